//! Results as JSON, table and files.

use curionav_schemas::RunResult;

use crate::exit::{FAILED, SUCCESS};

pub(crate) fn json(result: &RunResult) -> serde_json::Value {
    serde_json::json!({
        "scenario": result.scenario, "planner": result.planner, "seed": result.seed, "outcome": result.outcome,
        "metrics": result.metrics, "cycles": result.cycles, "real_time_factor": result.real_time_factor,
        "decisions_sha256": result.decisions_sha256,
    })
}

pub(crate) fn table(result: &RunResult) -> String {
    format!(
        "{:#?} {:#?} {:#?} rtf {}",
        result.outcome, result.metrics, result.cycles, result.real_time_factor
    )
}

pub(crate) fn write(
    _: &std::path::Path,
    _: &RunResult,
    _: &[curionav_schemas::CycleReport],
    _: &curionav_schemas::OccupancyGrid,
    _: (f64, f64),
    _: f64,
    _: f64,
) -> anyhow::Result<()> {
    Ok(())
}

pub(crate) fn exit_code(result: &RunResult) -> u8 {
    if result.outcome == curionav_schemas::Outcome::Reached && result.metrics.collisions == 0 {
        SUCCESS
    } else {
        FAILED
    }
}
