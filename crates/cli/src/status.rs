//! `curionav status`: which services are alive, how loaded and how fast, and which are missing.

use std::time::{Duration, Instant};

use clap::Args;
use comfy_table::Table;
use curionav_runtime::membership::members;
use curionav_runtime::print::print;
use curionav_runtime::query::fetch;
use curionav_runtime::session;
use curionav_schemas::{ServiceStatus, keys};
use serde::Serialize;

use crate::connect::ConnectOptions;
use crate::required_roles::{self, Alive, Missing, default_pools};
use curionav_runtime::exit::{Exit, SUCCESS};

const TIMEOUT: Duration = Duration::from_secs(1);

/// Say which services are alive, how loaded and how fast, and which are missing.
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
    let session = options.at.session().await?;
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
    let alive: Vec<Alive<'_>> = lines
        .iter()
        .map(|line| Alive { role: &line.role, instance: &line.instance, status: line.status.as_ref() })
        .collect();
    let robots = required_roles::robots(&alive);
    let missing = required_roles::missing(&robots, &default_pools(), &alive, &options.at);
    if options.json {
        print(serde_json::json!({ "services": lines, "missing": missing }))?;
        return Ok(SUCCESS);
    }
    match lines.as_slice() {
        [] => print(format_args!("no service is alive behind {}", options.at.connect))?,
        lines => print(table(lines))?,
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
