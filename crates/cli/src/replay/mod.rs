//! `curionav replay`: a recording planned again.

mod difference;
mod offline;
mod waiting;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use clap::Args;
use comfy_table::Table;
use curionav_planning::profile::Profile;
use curionav_schemas::{Action, ServiceStatus};
use serde::Serialize;

use crate::exit::{Exit, FAILED, SUCCESS};
use crate::package;
use crate::recording::{Item, Reader};
use difference::{Difference, Side};
use offline::{Offline, Replayed};
use waiting::Waiting;

/// Differences shown to people; --json has all.
const SHOWN: usize = 20;
/// Of this program, which must be that of the recording.
const VERSION: &str = env!("CARGO_PKG_VERSION");

#[derive(Debug, Args)]
pub(crate) struct ReplayOptions {
    /// A recording.
    #[arg(value_name = "IN.mcap")]
    path: PathBuf,
    /// Another planner: a built-in profile, or a profile file (.toml). Default: the recording's.
    #[arg(long, value_name = "PROFILE")]
    planner: Option<String>,
    /// Replay a recording of another version all the same.
    #[arg(long)]
    any_version: bool,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

/// What replaying came to.
#[derive(Debug, Default, Serialize)]
struct Summary {
    recording: String,
    /// Planner of this replay, and of the recording.
    planner: String,
    recorded_planner: String,
    version: String,
    /// Cycles in the recording.
    cycles: u64,
    /// Cycles planned again.
    replayed: u64,
    /// Cycles decided otherwise.
    differing: u64,
    /// Cycles that were degraded when they were recorded.
    degraded: u64,
    /// Cycles that could not be planned again, by reason.
    skipped: BTreeMap<String, u64>,
    /// Whether the recording lacks its end.
    cut_short: bool,
    differences: Vec<Difference>,
}

pub(crate) async fn replay(options: ReplayOptions) -> Result<u8, Exit> {
    let planner = options.planner.as_deref().map(package::read_profile).transpose();
    let planner = planner.map_err(Exit::bad_input)?;
    let mut summary = Summary {
        recording: options.path.display().to_string(),
        version: VERSION.to_owned(),
        ..Summary::default()
    };
    replay_all(&options, planner, &mut summary).await.map_err(Exit::bad_input)?;
    if summary.replayed == 0 {
        let why: Vec<&str> = summary.skipped.keys().map(String::as_str).collect();
        let why = if why.is_empty() { "it holds no planning cycle".to_owned() } else { why.join("; ") };
        return Err(Exit::bad_input(anyhow::anyhow!("{}: nothing to plan: {why}", summary.recording)));
    }
    #[expect(clippy::print_stdout, reason = "what the command is for")]
    if options.json {
        println!("{}", serde_json::to_string(&summary).map_err(|e| Exit::failed(e.into()))?);
    } else {
        println!("{}", words(&summary));
    }
    Ok(if summary.differing == 0 { SUCCESS } else { FAILED })
}

async fn replay_all(
    options: &ReplayOptions,
    planner: Option<Profile>,
    summary: &mut Summary,
) -> anyhow::Result<()> {
    let name = planner.as_ref().map(|planner| planner.name.clone());
    let mut reader = Reader::open(&options.path)?;
    let mut offline = Offline::new(planner);
    let mut waiting = Waiting::default();
    while let Some(item) = reader.next()? {
        match item {
            Item::Mission(mission) => offline.learn_mission(*mission),
            Item::Map(map) => offline.learn_map(map)?,
            Item::Status(status) if !options.any_version => check_service(&summary.recording, &status)?,
            Item::Status(_) => {}
            Item::Memory(memory) => {
                if !options.any_version {
                    check_version(&summary.recording, "arbiter", &memory.version)?;
                }
                waiting.put(*memory);
            }
            Item::Report(report) => {
                summary.cycles += 1;
                summary.degraded += u64::from(!report.decision.degraded.is_empty());
                let replayed = match waiting.take(&report.robot, report.epoch, report.seq) {
                    Some(memory) => offline.plan(memory, &report).await?,
                    None => Replayed::Skipped("what it was planned from is not in the recording".into()),
                };
                match replayed {
                    Replayed::Planned(decision) => {
                        summary.replayed += 1;
                        let difference = Difference::between(&report.robot, &report.decision, &decision);
                        summary.differing += u64::from(difference.is_some());
                        summary.differences.extend(difference);
                    }
                    Replayed::Skipped(why) => *summary.skipped.entry(why).or_default() += 1,
                }
            }
        }
    }
    summary.cut_short = reader.is_cut_short();
    summary.recorded_planner = offline.recorded_planner().unwrap_or_default();
    summary.planner = name.unwrap_or_else(|| summary.recorded_planner.clone());
    Ok(())
}

/// Whoever had a part in the decisions must be of this version.
fn check_service(recording: &str, status: &ServiceStatus) -> anyhow::Result<()> {
    const DECIDE: [&str; 4] = ["arbiter", "generator", "cpc", "cnc"];
    if DECIDE.contains(&status.role.as_str()) {
        check_version(recording, &format!("{} {}", status.role, status.instance), &status.version)?;
    }
    Ok(())
}

fn check_version(recording: &str, who: &str, version: &str) -> anyhow::Result<()> {
    anyhow::ensure!(
        version == VERSION,
        "{recording} was recorded with {who} of version {version}, this is curionav {VERSION}, which may decide \
         otherwise: replay it with curionav {version}, or give --any-version to see what has changed"
    );
    Ok(())
}

/// The summary for people.
fn words(summary: &Summary) -> String {
    let mut lines = vec![format!(
        "{} of {} replayed cycles are decided otherwise by {} (recorded: {})",
        summary.differing, summary.replayed, summary.planner, summary.recorded_planner
    )];
    if !summary.differences.is_empty() {
        lines.push(table(&summary.differences).to_string());
        if summary.differences.len() > SHOWN {
            lines.push(format!("and {} more; --json has them all", summary.differences.len() - SHOWN));
        }
    }
    for (why, cycles) in &summary.skipped {
        lines.push(format!("{cycles} cycles could not be planned again: {why}"));
    }
    if summary.degraded > 0 && summary.differing > 0 {
        let line = "{} cycles were degraded when they were recorded: what they lacked is there in a replay";
        lines.push(line.replacen("{}", &summary.degraded.to_string(), 1));
    }
    if summary.cut_short {
        lines.push("the recording lacks its end: it was killed, or is still being written".into());
    }
    lines.join("\n")
}

fn table(differences: &[Difference]) -> Table {
    let robots: BTreeSet<&str> = differences.iter().map(|d| d.robot.as_str()).collect();
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
            d.degraded.join("; "),
        ]);
    }
    if robots.len() == 1
        && let Some(column) = table.column_mut(0)
    {
        column.set_constraint(comfy_table::ColumnConstraint::Hidden);
    }
    table
}

fn brief(side: &Side) -> String {
    match (side.action, side.candidate) {
        (Action::Follow, Some(id)) => format!("follow {id}"),
        (Action::Follow, None) => "follow".into(),
        (Action::Hold, _) => "hold".into(),
        (Action::Stop, _) => "stop".into(),
    }
}
