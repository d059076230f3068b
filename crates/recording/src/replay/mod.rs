//! Planning every cycle of a recording again, to see where decisions differ.

mod difference;
mod offline;

pub use difference::{Difference, Side};

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;

use curionav_planning::profile::Profile;
use curionav_schemas::{Memory, ServiceStatus};
use serde::Serialize;

use crate::{Item, Reader};
use offline::Offline;

/// Of this program, which must be that of the recording.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// What replaying came to.
#[derive(Debug, Default, Serialize)]
pub struct Summary {
    /// File of the recording.
    pub recording: String,
    /// Planner of this replay.
    pub planner: String,
    /// Planner of the recording.
    pub recorded_planner: String,
    /// Version of this program.
    pub version: String,
    /// Cycles in the recording.
    pub cycles: u64,
    /// Cycles planned again.
    pub replayed: u64,
    /// Cycles decided otherwise.
    pub differing: u64,
    /// Cycles that were degraded when they were recorded.
    pub degraded: u64,
    /// Cycles that could not be planned again, by reason.
    pub skipped: BTreeMap<String, u64>,
    /// Whether the recording lacks its end.
    pub cut_short: bool,
    /// Every cycle decided otherwise, in the order of the recording.
    pub differences: Vec<Difference>,
}

/// Plans every cycle of the recording in the file `path` again, with the planner it was recorded with or with
/// `planner`. With `any_version` also a recording that another version of this program made.
///
/// # Errors
/// If the recording cannot be read, is of another version, or holds a mission that cannot be planned.
pub async fn replay(path: &Path, planner: Option<Profile>, any_version: bool) -> anyhow::Result<Summary> {
    let name = planner.as_ref().map(|planner| planner.name.clone());
    let mut summary =
        Summary { recording: path.display().to_string(), version: VERSION.to_owned(), ..Summary::default() };
    let mut reader = Reader::open(path)?;
    let mut offline = Offline::new(planner);
    let mut waiting = Waiting::default();
    while let Some(item) = reader.next_message()? {
        match item {
            Item::Mission(mission) => offline.learn_mission(*mission),
            Item::Map(map) => offline.learn_map(map)?,
            Item::Status(status) if !any_version => check_service(&summary.recording, &status)?,
            Item::Status(_) => {}
            Item::Memory(memory) => {
                if !any_version {
                    check_version(&summary.recording, "arbiter", &memory.version)?;
                }
                waiting.put(*memory);
            }
            Item::Scan(..) | Item::Odometry(..) | Item::Belief(..) | Item::Run(_) => {}
            Item::Report(report) => {
                summary.cycles += 1;
                summary.degraded += u64::from(!report.decision.degraded.is_empty());
                let replayed = match waiting.take(&report.robot, report.epoch, report.seq) {
                    Some(memory) => offline.plan(memory, &report).await?,
                    None => Err("what it was planned from is not in the recording"),
                };
                match replayed {
                    Ok(decision) => {
                        summary.replayed += 1;
                        let difference = Difference::between(&report.robot, &report.decision, &decision);
                        summary.differing += u64::from(difference.is_some());
                        summary.differences.extend(difference);
                    }
                    Err(why) => *summary.skipped.entry(why.to_owned()).or_default() += 1,
                }
            }
        }
    }
    summary.cut_short = reader.cut_short;
    summary.recorded_planner = offline.recorded_planner().unwrap_or_default();
    summary.planner = name.unwrap_or_else(|| summary.recorded_planner.clone());
    Ok(summary)
}

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
        "{recording} was recorded with {who} of version {version}; this is curionav {VERSION}, whose decisions may \
         differ. Replay it with curionav {version}, or add --any-version to see what has changed"
    );
    Ok(())
}

/// Memories of one robot that may wait: a report that was lost never comes.
const OF_ROBOT_MAX: usize = 64;

/// What each robot's cycles began with, oldest first, until their report comes.
#[derive(Debug, Default)]
struct Waiting(BTreeMap<String, VecDeque<Memory>>);

impl Waiting {
    fn put(&mut self, memory: Memory) {
        let of_robot = self.0.entry(memory.robot.clone()).or_default();
        if of_robot.len() == OF_ROBOT_MAX {
            of_robot.pop_front();
        }
        of_robot.push_back(memory);
    }

    fn take(&mut self, robot: &str, epoch: u64, seq: u64) -> Option<Memory> {
        let of_robot = self.0.get_mut(robot)?;
        let index = of_robot.iter().position(|memory| (memory.epoch, memory.seq) == (epoch, seq))?;
        of_robot.remove(index)
    }
}

#[cfg(test)]
mod tests {
    use curionav_testing::golden;

    use super::*;

    #[test]
    fn the_oldest_of_the_same_robot_goes_first() {
        let memory = |robot: &str, epoch, seq| Memory { robot: robot.into(), epoch, seq, ..golden::memory() };
        let mut waiting = Waiting::default();
        // One that is first in the alphabet, and then many of another, which begins anew with a lower epoch.
        waiting.put(memory("a", 1, 1));
        waiting.put(memory("b", 9, 1));
        for seq in 1..=OF_ROBOT_MAX as u64 {
            waiting.put(memory("b", 2, seq));
        }
        assert!(waiting.take("a", 1, 1).is_some() && waiting.take("a", 1, 1).is_none());
        assert!(waiting.take("b", 9, 1).is_none());
        assert!((1..=OF_ROBOT_MAX as u64).all(|seq| waiting.take("b", 2, seq).is_some()));
    }
}
