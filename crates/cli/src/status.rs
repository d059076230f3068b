//! `curionav status`: which services are alive, how loaded and how fast, and which are missing.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use clap::Args;
use comfy_table::Table;
use curionav_ros2_gateway::problem::Problem;
use curionav_runtime::membership::members;
use curionav_runtime::print::print;
use curionav_runtime::query::fetch;
use curionav_runtime::session;
use curionav_schemas::{ServiceStatus, keys};
use serde::Serialize;

use crate::blind::blindness;
use crate::connect::{ConnectOptions, LOOKS, is_of, robots_of};
use crate::denied::{denied, label, routers};
use crate::doubt::doubt;
use crate::required_roles::{self, Alive, Missing, default_pools};
use curionav_runtime::exit::{Exit, SUCCESS};

const TIMEOUT: Duration = Duration::from_secs(1);

/// Show which services run, their load and speed, and which are missing.
#[derive(Debug, Args)]
pub(crate) struct StatusOptions {
    #[command(flatten)]
    at: ConnectOptions,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Line {
    role: String,
    instance: String,
    /// Absent for services that answer no questions of this kind.
    status: Option<ServiceStatus>,
    /// From asking to the answer, ms; absent without one.
    round_trip_ms: Option<f64>,
}

pub(crate) async fn run(options: StatusOptions) -> Result<u8, Exit> {
    let config = options.at.config(&LOOKS, None)?;
    let denied = denied(&routers(&config).await?);
    let session = session::client(&config).await?;
    let mut lines = Vec::new();
    for (role, instances) in members(&session).await.map_err(Exit::network)? {
        for instance in instances {
            let key = keys::status(&role, &instance).map_err(Exit::network)?;
            let asked = Instant::now();
            let status = fetch::<ServiceStatus>(&session, &key, TIMEOUT).await.ok();
            let round_trip_ms = status.as_ref().map(|_| asked.elapsed().as_secs_f64() * 1e3);
            lines.push(Line { role: role.clone(), instance, status, round_trip_ms });
        }
    }
    session::close(&session);
    let listed = robots_of(&config);
    lines.retain(|line| is_of(line.status.as_ref(), &listed));
    let alive: Vec<Alive<'_>> = lines
        .iter()
        .map(|line| Alive { role: &line.role, instance: &line.instance, status: line.status.as_ref() })
        .collect();
    let robots = required_roles::robots(&alive, &listed);
    let missing = required_roles::missing(&robots, &BTreeSet::new(), &default_pools(), &alive, &options.at);
    if options.json {
        print(serde_json::json!({ "services": lines, "missing": missing, "denied": denied }))?;
        return Ok(SUCCESS);
    }
    match lines.as_slice() {
        [] => print(format_args!("no service is alive behind {}", options.at.place()))?,
        lines => print(table(lines))?,
    }
    for status in lines.iter().filter_map(|line| line.status.as_ref()) {
        shares(status).map_or(Ok(()), print)?;
        let problems = status.metrics.keys().filter_map(|sample| Problem::of_sample(sample));
        for problem in problems {
            print(format_args!("{} {}: {}", status.role, status.instance, problem.sentence()))?;
        }
        for why in [blindness(status), doubt(status)].into_iter().flatten() {
            print(format_args!("{} {}: {why}", status.role, status.instance))?;
        }
    }
    for one in &denied {
        print(format_args!("denied: {}", one.words()))?;
    }
    for Missing { what, fix } in &missing {
        print(format_args!("missing: {what}; {fix}"))?;
    }
    Ok(SUCCESS)
}

fn table(lines: &[Line]) -> Table {
    let mut table = Table::new();
    table.set_header([
        "role", "instance", "robot", "up", "load", "answered", "refused", "p50 ms", "p99 ms", "asked ms",
    ]);
    for line in lines {
        let mut row = vec![line.role.clone(), line.instance.clone()];
        match &line.status {
            Some(s) => row.extend([
                s.robot.clone().unwrap_or_default(),
                format!("{:.0} s", s.uptime_s),
                format!("{:.2}", s.load),
                s.requests.to_string(),
                s.rejected.to_string(),
                format!("{:.2}", s.p50_ms),
                format!("{:.2}", s.p99_ms),
                format!("{:.2}", line.round_trip_ms.unwrap_or_default()),
            ]),
            None => row.extend([String::new(), "alive, says nothing".into()]),
        }
        table.add_row(row);
    }
    table
}

/// Of an arbiter's cycles since its start: how many planning ticks had none, and what share was degraded, by code.
fn shares(status: &ServiceStatus) -> Option<String> {
    let decisions = total(status, "curionav_decisions_total");
    if decisions == 0.0 {
        return None;
    }
    let degraded = status.metrics.iter().filter_map(|(sample, value)| {
        let code = label(sample, "reason").filter(|_| sample.starts_with("curionav_degraded_total{"))?;
        Some(format!("{} {:.1} %", code.replace('_', " "), 100.0 * value / decisions))
    });
    let degraded: Vec<String> = degraded.collect();
    let degraded = if degraded.is_empty() { "none degraded".to_owned() } else { degraded.join(", ") };
    let instance = &status.instance;
    let unplanned = total(status, "curionav_unplanned_ticks_total");
    Some(format!(
        "arbiter {instance}: {decisions} decisions, {unplanned} planning ticks without a cycle; {degraded}"
    ))
}

/// The sum of all samples of a metric.
fn total(status: &ServiceStatus, metric: &str) -> f64 {
    let samples = status.metrics.iter().filter(|(sample, _)| sample.split('{').next() == Some(metric));
    samples.fold(0.0, |sum, (_, value)| sum + value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    #[test]
    fn an_arbiter_says_what_share_of_its_cycles_was_degraded_and_by_what() {
        let evaluator = golden::service_status();
        assert_eq!(shares(&evaluator), None);
        let sample = |name: &str, label: &str, value: f64| {
            (format!("curionav_{name}_total{{role=\"arbiter\",name=\"a\",{label}}}"), value)
        };
        let decisions =
            [sample("decisions", "action=\"follow\"", 190.0), sample("decisions", "action=\"hold\"", 10.0)];
        let mut arbiter = ServiceStatus { instance: "a".into(), metrics: decisions.into(), ..evaluator };
        assert_eq!(
            shares(&arbiter).unwrap(),
            "arbiter a: 200 decisions, 0 planning ticks without a cycle; none degraded"
        );
        arbiter.metrics.extend([
            sample("degraded", "reason=\"cut_short\"", 25.0),
            sample("degraded", "reason=\"evaluated_locally\"", 4.0),
            ("curionav_unplanned_ticks_total{role=\"arbiter\"}".into(), 3.0),
        ]);
        assert_eq!(
            shares(&arbiter).unwrap(),
            "arbiter a: 200 decisions, 3 planning ticks without a cycle; cut short 12.5 %, evaluated locally 2.0 %"
        );
    }
}
