//! What a run leaves for people and for scripts: a table, one JSON object, a directory of files, an exit status.

mod csv;
mod summary;
mod table;

pub(crate) use summary::json;
pub(crate) use table::table;

use anyhow::Context;
use curionav_picture::{Run, run_svg};
use curionav_runtime::exit;
use curionav_schemas::{Outcome, RunResult};
use std::fs;
use std::path::Path;

/// Writes `metrics.json`, `trajectory.csv`, `cycles.csv` and `run.svg` into `dir`, which is created if need be.
pub(crate) fn write(dir: &Path, run: &Run<'_>) -> anyhow::Result<()> {
    fs::create_dir_all(dir).with_context(|| format!("cannot create the directory {}", dir.display()))?;
    let files = [
        ("metrics.json", summary::for_file(run.result)? + "\n"),
        ("trajectory.csv", csv::trajectory(run.result)),
        ("cycles.csv", csv::cycles(run.reports)),
        ("run.svg", run_svg(run)),
    ];
    for (name, content) in files {
        let path = dir.join(name);
        fs::write(&path, content).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

/// The exit status of a run that came to an end: success only at the goal and without a collision.
pub(crate) fn exit_code(result: &RunResult) -> u8 {
    let success = result.outcome == Outcome::Reached && result.measures.collisions == 0;
    if success { exit::SUCCESS } else { exit::FAILED }
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    fn written(dir: &Path) -> anyhow::Result<()> {
        let (result, reports) = (&golden::run_result(), &[golden::cycle_report()]);
        let map = &golden::occupancy_grid();
        let run = Run { result, reports, map, goal: (8.0, 6.5), robot_radius: 0.3, goal_tolerance: 0.3 };
        write(dir, &run)
    }

    #[test]
    fn only_a_goal_reached_without_collision_succeeds() {
        let reached = golden::run_result();
        assert_eq!(exit_code(&reached), exit::SUCCESS);
        for outcome in [Outcome::Timeout, Outcome::Lost] {
            assert_eq!(exit_code(&RunResult { outcome, ..reached.clone() }), exit::FAILED);
        }
        let mut bumped = reached;
        bumped.measures.collisions = 1;
        assert_eq!(exit_code(&bumped), exit::FAILED);
    }

    #[test]
    fn a_run_is_written_as_four_files_and_again_over_them() {
        let dir = std::env::temp_dir().join(format!("curionav-output-{}", std::process::id()));
        let nested = dir.join("a/b");
        for _ in 0..2 {
            written(&nested).unwrap();
        }
        let mut names: Vec<_> =
            fs::read_dir(&nested).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        let metrics = fs::read_to_string(nested.join("metrics.json")).unwrap();
        fs::remove_dir_all(&dir).unwrap();
        assert_eq!(names, ["cycles.csv", "metrics.json", "run.svg", "trajectory.csv"]);
        let read: serde_json::Value = serde_json::from_str(&metrics).unwrap();
        let mut expected: serde_json::Value =
            serde_json::from_str(&json(&golden::run_result()).unwrap()).unwrap();
        expected["social"] = serde_json::json!({ "personal_share": 0.25, "spl": 0.93 });
        assert_eq!(read, expected);
    }

    #[test]
    fn an_error_names_the_file() {
        let blocked = std::env::temp_dir().join(format!("curionav-blocked-{}", std::process::id()));
        fs::write(&blocked, "a file where a directory should be").unwrap();
        let written = written(&blocked);
        fs::remove_file(&blocked).unwrap();
        assert!(format!("{:#}", written.unwrap_err()).contains("curionav-blocked"));
    }
}
