//! What more replicas bring, from when on, for how many robots, and what the split costs.
//!
//! Scenes, candidates and missions come from a drive through a scenario (`workload`); replicas and router are
//! processes of this program (`processes`); what asks them is the arbiter's own pool and dispatch (`robots`).

mod batch;
mod break_even;
mod cgroup;
mod figures;
mod fleet;
mod fleet_robot;
mod many_robots;
mod options;
mod overhead;
mod processes;
mod robots;
mod setup;
mod throughput;
mod trees;
mod workload;

use anyhow::anyhow;
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::print::{note, print};
use curionav_runtime::shutdown::on_signals;

use processes::Processes;
use setup::{Measured, Setup};
use workload::Workload;

pub use options::Options;

/// Measures, prints what came out, and gives the exit status. `log` is what the processes log, a filter.
///
/// # Errors
/// Bad input if the scenario or the planner cannot be used, the network if a process does not start or answer.
pub async fn scale(options: Options, log: &str) -> Result<u8, Exit> {
    options.check()?;
    let mut signals = on_signals().map_err(Exit::network)?;
    let mut processes =
        Processes::start(log, options.cpu_quota, options.secure.as_deref(), options.counts()).await?;
    let measured = tokio::select! {
        measured = measure(&options, &mut processes) => measured,
        () = signals.requested() => Err(anyhow!("interrupted")),
    };
    // Whatever happened: no process and no control group is left.
    processes.stop().await;
    let measured = measured.map_err(|error| error.downcast::<Exit>().unwrap_or_else(Exit::failed))?;
    let printed = if options.json { print(measured.json) } else { print(measured.text) };
    printed.map(|()| SUCCESS)
}

async fn measure(options: &Options, processes: &mut Processes) -> anyhow::Result<Measured> {
    if options.drives_through() {
        return trees::measure(options, processes).await;
    }
    note(format_args!("driving through {}", options.scenario.display()));
    let workload = Workload::of(&options.scenario, options.planner.as_deref()).await?;
    let measured = match options.service.map(|service| Setup { options, workload: &workload, service }) {
        Some(setup) if options.break_even => break_even::measure(&setup, processes).await,
        Some(setup) if !options.robots.is_empty() => many_robots::measure(&setup, processes).await,
        Some(setup) => throughput::measure(&setup, processes).await,
        None if !options.fleet.is_empty() => fleet::measure(options, processes, &workload).await,
        // The arguments name a service, or else `--fleet` or `--overhead`.
        None => overhead::measure(options, processes, &workload).await,
    };
    workload.services.stop().await;
    measured
}
