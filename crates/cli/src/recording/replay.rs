//! `curionav replay`: a recording planned again.

use std::path::PathBuf;

use clap::Args;
use comfy_table::Table;
use curionav_recording::replay::{Difference, Side, Summary, replay};
use curionav_schemas::Action;
use curionav_schemas::words::{say, say_all};

use curionav_deployment::package;
use curionav_runtime::exit::{Exit, FAILED, SUCCESS};
use curionav_runtime::print::print;

/// Differences shown to people; --json has all.
const SHOWN: usize = 20;

/// Plan every cycle of a recording again, in this process, and report where decisions differ.
///
/// Each cycle starts from what was recorded: scene, search trees and the trajectory being driven. With the planner
/// and version of the recording no decision differs. Only degraded cycles may: a replay has the replicas and the time
/// that they lacked. --planner shows what another planner would have done at each of these moments. One with another
/// generator grows its own trees along the recording.
///
///   curionav replay drive.mcap                         must say: 0 differ
///   curionav replay drive.mcap --planner distance-only
///
/// Exit status: 0 no decision differs; 1 some do; 2 the recording cannot be read, is of another version, or holds
/// nothing to plan.
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ReplayOptions {
    /// A recording.
    #[arg(value_name = "IN.mcap")]
    path: PathBuf,
    /// Another planner: a built-in profile, or a profile file (.toml). Default: the recording's.
    #[arg(long, value_name = "PROFILE")]
    planner: Option<String>,
    /// Replay a recording of another version anyway.
    #[arg(long)]
    any_version: bool,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

pub(crate) async fn run(options: ReplayOptions) -> Result<u8, Exit> {
    let planner = options.planner.as_deref().map(package::read_profile).transpose();
    let planner = planner.map_err(Exit::bad_input)?;
    let summary = replay(&options.path, planner, options.any_version).await.map_err(Exit::bad_input)?;
    if summary.replayed == 0 {
        let why: Vec<&str> = summary.skipped.keys().map(String::as_str).collect();
        let why = if why.is_empty() { "it holds no planning cycle".to_owned() } else { why.join("; ") };
        return Err(Exit::bad_input(anyhow::anyhow!("{}: nothing to plan: {why}", summary.recording)));
    }
    let json = serde_json::to_string(&summary).map_err(Exit::failed);
    print(if options.json { json? } else { words(&summary) })?;
    Ok(if summary.differing == 0 { SUCCESS } else { FAILED })
}

fn words(summary: &Summary) -> String {
    let Summary { replayed, differing, degraded, planner, recorded_planner, differences, .. } = summary;
    let mut lines = vec![format!(
        "{differing} of {replayed} replayed cycles are decided otherwise by {planner} (recorded: {recorded_planner})"
    )];
    if !differences.is_empty() {
        lines.push(table(differences).to_string());
    }
    if differences.len() > SHOWN {
        lines.push(format!("and {} more; --json has them all", differences.len() - SHOWN));
    }
    for (why, cycles) in &summary.skipped {
        lines.push(format!("{cycles} cycles could not be planned again: {why}"));
    }
    if *degraded > 0 && *differing > 0 {
        lines.push(format!(
            "{degraded} cycles were degraded when they were recorded: what they lacked is there in a replay"
        ));
    }
    if summary.cut_short {
        lines.push("the recording lacks its end: it was killed, or is still being written".into());
    }
    lines.join("\n")
}

fn table(differences: &[Difference]) -> Table {
    let mut table = Table::new();
    table
        .load_style(comfy_table::presets::UTF8_BORDERS_ONLY)
        .set_header(["robot", "cycle", "time s", "recorded", "replayed", "apart m", "degraded"]);
    for d in differences.iter().take(SHOWN) {
        table.add_row([
            d.robot.clone(),
            d.seq.to_string(),
            format!("{:.1}", d.time_s),
            brief(&d.recorded),
            brief(&d.replayed),
            d.apart_m.map_or(String::new(), |apart| format!("{apart:.2}")),
            say_all("degradation", &d.degraded),
        ]);
    }
    let is_one_robot = differences.iter().all(|d| d.robot == differences[0].robot);
    if is_one_robot && let Some(column) = table.column_mut(0) {
        column.set_constraint(comfy_table::ColumnConstraint::Hidden);
    }
    table
}

fn brief(side: &Side) -> String {
    let action = say("action", &side.action);
    match side.candidate {
        Some(id) if side.action == Action::Follow => format!("{action} {id}"),
        _ => action,
    }
}
