//! `curionav explain`: why a cycle was decided as it was.

mod table;
mod words;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::anyhow;
use clap::Args;
use curionav_runtime::print::print;
use curionav_runtime::session;
use curionav_runtime::topic::Inbox;
use curionav_schemas::{CycleReport, keys};

use crate::connect::{ConnectOptions, LOOKS};
use crate::recording::robots::only_one;
use curionav_recording::{Item, Reader};
use curionav_runtime::exit::{Exit, SUCCESS};

/// A robot that drives reports several times a second.
const REPORT_TIMEOUT: Duration = Duration::from_secs(5);

/// Explain the decision of a cycle: every candidate's costs, and what other weights would have led to.
///
///   curionav explain drive.mcap --cycle 40             a cycle of a recording; without --cycle the last one
///   curionav explain --robot r1                        the next cycle of a robot that is driving
///
/// The cost of a candidate of K states is the sum of weight x raw cost / (scale x K) over the terms whose condition
/// holds (of the paper: w1 weighs cpc, w2 cnc, w3 distance). What another weight would have led to is computed by
/// the arbiter in the cycle itself, collisions included.
///
/// Exit status: 0 explained; 1 no such cycle; 2 bad input; 3 no router, or no report came.
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ExplainOptions {
    /// A recording. Without it, the command listens to a robot that is driving.
    #[arg(value_name = "IN.mcap", required_unless_present = "robot")]
    recording: Option<PathBuf>,
    /// Robot; needed only if the recording has several.
    #[arg(long, value_name = "NAME")]
    robot: Option<String>,
    /// Cycle, by its number (`seq`). Default: the last of the recording, the next of a robot that is driving.
    #[arg(long, value_name = "N")]
    cycle: Option<u64>,
    /// Candidates in the table, cheapest first; 0 shows all.
    #[arg(long, value_name = "N", default_value_t = 10)]
    top: usize,
    #[command(flatten)]
    at: ConnectOptions,
}

pub(crate) async fn run(options: ExplainOptions) -> Result<u8, Exit> {
    let report = match &options.recording {
        Some(recording) => recorded(recording, options.robot.as_deref(), options.cycle)?,
        None => live(&options).await?,
    };
    print(format_args!("{}\n{}", words::words(&report), table::table(&report, options.top)))?;
    Ok(SUCCESS)
}

/// The report of a cycle of a recording; of the last one with that number, should it be there for several missions.
fn recorded(path: &Path, robot: Option<&str>, cycle: Option<u64>) -> Result<CycleReport, Exit> {
    let mut reader = Reader::open(path).map_err(Exit::bad_input)?;
    let mut found: Option<CycleReport> = None;
    let mut robots = BTreeSet::new();
    let mut first = u64::MAX;
    let mut last = 0;
    while let Some(item) = reader.next_message().map_err(Exit::bad_input)? {
        let Item::Report(report) = item else { continue };
        if robot.is_some_and(|robot| robot != report.robot) {
            continue;
        }
        robots.insert(report.robot.clone());
        first = first.min(report.seq);
        last = last.max(report.seq);
        if cycle.is_none_or(|cycle| cycle == report.seq) {
            found = Some(*report);
        }
    }
    only_one(path, &robots).map_err(Exit::bad_input)?;
    let path = path.display();
    found.ok_or_else(|| {
        let whose = robot.map_or(String::new(), |robot| format!(" of robot {robot}"));
        let there = if last == 0 { "none".to_owned() } else { format!("cycles {first} to {last}") };
        Exit::failed(anyhow!("{path} has no such cycle{whose}; it has {there}"))
    })
}

/// The next report of a robot, or the one of the cycle asked for.
async fn live(options: &ExplainOptions) -> Result<CycleReport, Exit> {
    let robot = options.robot.as_deref().unwrap_or_default();
    let key = keys::robot(robot, "report").map_err(Exit::bad_input)?;
    let cycle = options.cycle;
    let session = options.at.session(&LOOKS, Some(robot)).await?;
    let listening = async {
        let reports = Inbox::<CycleReport>::new(&session, &key).map_err(Exit::network)?;
        loop {
            let Ok(Some(report)) = tokio::time::timeout(REPORT_TIMEOUT, reports.next()).await else {
                return Err(Exit::network(anyhow!(
                    "robot {robot} has reported no cycle for {} s: it stands or is absent; see `curionav status`",
                    REPORT_TIMEOUT.as_secs()
                )));
            };
            if cycle.is_some_and(|cycle| cycle < report.seq) {
                return Err(Exit::failed(anyhow!(
                    "robot {robot} is at cycle {} already; record it to look back (`curionav record`)",
                    report.seq
                )));
            }
            if cycle.is_none_or(|cycle| cycle == report.seq) {
                return Ok(report);
            }
        }
    };
    let found = listening.await;
    session::close(&session);
    found
}
