//! What several search trees per cycle bring: whole drives in real time, with generators as processes of their own.

use std::time::{Duration, Instant};

use anyhow::Context;
use curionav_deployment::embedded::Embedded;
use curionav_deployment::follow::{Finished, follow};
use curionav_deployment::package::{self, Choice};
use curionav_deployment::service_kind::Kind;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::exit::Exit;
use curionav_runtime::latency::percentile_ms;
use curionav_runtime::print::note;
use curionav_runtime::session;
use curionav_schemas::{Clock, Degradation, Outcome, RunResult};
use serde_json::json;

use super::figures::{self, Row, count, number, share};
use super::options::{Options, Service};
use super::processes::Processes;
use super::setup::Measured;
use crate::statistics::mean;

/// Drives `--drives` times for each number of trees.
pub(super) async fn measure(options: &Options, processes: &mut Processes) -> anyhow::Result<Measured> {
    let mut rows = Vec::new();
    for &trees in &options.trees {
        let trees = usize::from(trees);
        let generators = options.replicas_or(&[trees as u16])[0];
        processes.add(Service::Generator.name(), generators).await?;
        let config = ServiceConfig { connect: processes.endpoints_from(0), ..ServiceConfig::default() };
        let session = session::client(&config).await.map_err(Exit::network)?;
        let here: Vec<Kind> = Kind::simulated().into_iter().filter(|kind| *kind != Kind::Generator).collect();
        let robot = Embedded::of(&here, session, &config).await.map_err(Exit::network)?;
        let driven = drive_all(options, processes, &robot, &config, trees).await;
        robot.stop().await;
        processes.dismiss().await;
        rows.push(driven?.row(trees, generators)?);
    }
    let scenario = read(options, None, None)?.scenario;
    Ok(Measured {
        json: json!({
            "service": Service::Generator.name(),
            "rows": rows.iter().map(figures::json).collect::<Vec<_>>(),
            "scenario": options.scenario.display().to_string(),
            "planner": options.planner.as_ref().unwrap_or(&scenario.planner.profile),
            "drives": options.drives,
            "cpu_quota": options.cpu_quota,
        }),
        text: figures::table(&rows),
    })
}

fn read(options: &Options, seed: Option<u64>, trees: Option<u32>) -> Result<package::Package, Exit> {
    let choice = Choice { planner: options.planner.clone(), seed, trees, ..Choice::default() };
    package::read(&options.scenario, &choice, Clock::Realtime, 1.0).map_err(Exit::bad_input)
}

/// What several drives were like.
#[derive(Default)]
struct Driven {
    results: Vec<RunResult>,
    /// Candidates of each cycle.
    candidates: Vec<f64>,
    times: Vec<Duration>,
    /// Processors that the generators used.
    cores: f64,
}

async fn drive_all(
    options: &Options,
    processes: &mut Processes,
    robot: &Embedded,
    config: &ServiceConfig,
    trees: usize,
) -> anyhow::Result<Driven> {
    let mut driven = Driven::default();
    processes.limit()?;
    let begin = Instant::now();
    let before = processes.used();
    for seed in 1..=options.drives {
        note(format_args!("{trees} trees, drive {seed} of {}", options.drives));
        let package = read(options, Some(seed.into()), Some(trees as u32))?;
        let finished = follow(&robot.session, config, &package, true).await?;
        driven.add(finished);
    }
    (driven.cores, _) = processes.used().cores_since(&before, begin.elapsed().as_secs_f64());
    Ok(driven)
}

impl Driven {
    fn add(&mut self, Finished { result, reports, .. }: Finished) {
        for report in reports {
            self.candidates.push(f64::from(report.candidates.count));
            self.times.push(Duration::from_micros(report.timings.total_us));
        }
        self.results.push(result);
    }

    fn row(mut self, trees: usize, generators: usize) -> anyhow::Result<Row> {
        let candidates = mean(&self.candidates).context("no cycle was reported")?;
        let cycles: u64 = self.results.iter().map(|r| r.cycles.count).sum();
        let degraded = |by: Degradation| {
            let counts = self.results.iter().filter_map(|r| r.cycles.degraded_by.get(by.code()));
            counts.sum::<u64>() as f64 / cycles.max(1) as f64
        };
        let reached: Vec<&RunResult> =
            self.results.iter().filter(|r| r.outcome == Outcome::Reached).collect();
        let of_all = |of: fn(&RunResult) -> f64| mean(&self.results.iter().map(of).collect::<Vec<_>>());
        let times_s: Vec<f64> = reached.iter().map(|r| r.measures.time_s).collect();
        let clean = reached.iter().filter(|r| r.measures.collisions == 0).count();
        Ok(vec![
            count("trees", trees),
            count("generators", generators),
            number("candidates", "candidates", candidates, 1),
            number("p50_ms", "p50 ms", percentile_ms(&mut self.times, 0.50), 1),
            number("p99_ms", "p99 ms", percentile_ms(&mut self.times, 0.99), 1),
            share("cut_short", degraded(Degradation::CutShort)),
            share("grown_locally", degraded(Degradation::GeneratedLocally)),
            number("cores", "cores", self.cores, 2),
            count("drives", self.results.len()),
            count("reached", clean),
            share("td", of_all(|r| r.measures.td).unwrap_or_default()),
            number("time_s", "time s", mean(&times_s).unwrap_or_default(), 1),
        ])
    }
}
