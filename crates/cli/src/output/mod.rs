//! What a run leaves for people and for scripts: a table, one JSON object, a directory of files, an exit status.

mod csv;
mod summary;
mod table;

pub(crate) use summary::json;
pub(crate) use table::table;

use curionav_deployment::files;
use curionav_runtime::exit::{self, Exit};
use curionav_schemas::{CycleReport, Outcome, RunResult};
use std::path::Path;

/// Writes `metrics.json`, `trajectory.csv`, `cycles.csv` and `run.svg` into `dir`, which is created if need be. Why
/// there is no picture is said once the others are written.
pub(crate) fn write(
    dir: &Path,
    result: &RunResult,
    reports: &[CycleReport],
    picture: Result<String, Exit>,
) -> Result<(), Exit> {
    let data = [
        ("metrics.json", summary::for_file(result).map_err(Exit::failed)? + "\n"),
        ("trajectory.csv", csv::trajectory(result)),
        ("cycles.csv", csv::cycles(reports)),
    ];
    for (name, content) in data {
        files::write(&dir.join(name), content).map_err(Exit::failed)?;
    }
    files::write(&dir.join("run.svg"), picture?).map_err(Exit::failed)
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
    use std::fs;

    fn written(dir: &Path, picture: Result<String, Exit>) -> Result<(), Exit> {
        write(dir, &golden::run_result(), &[golden::cycle_report()], picture)
    }

    #[test]
    fn only_a_goal_reached_without_collision_succeeds() {
        let reached = golden::run_result();
        assert_eq!(exit_code(&reached), exit::SUCCESS);
        for outcome in [Outcome::Timeout, Outcome::Lost, Outcome::NoWay] {
            assert_eq!(exit_code(&RunResult { outcome, ..reached.clone() }), exit::FAILED);
        }
        let mut bumped = reached;
        bumped.measures.collisions = 1;
        assert_eq!(exit_code(&bumped), exit::FAILED);
    }

    #[test]
    fn a_run_is_written_as_four_files_again_over_them_and_without_a_picture_as_three() {
        let dir = std::env::temp_dir().join(format!("curionav-output-{}", std::process::id()));
        let nested = dir.join("a/b");
        let names = || {
            let mut names: Vec<_> =
                fs::read_dir(&nested).unwrap().map(|entry| entry.unwrap().file_name()).collect();
            names.sort();
            names
        };
        let reason = written(&nested, Err(Exit::network(anyhow::anyhow!("no map")))).unwrap_err();
        assert_eq!((reason.code, reason.line().as_str()), (exit::NO_NETWORK, "no map"));
        assert_eq!(names(), ["cycles.csv", "metrics.json", "trajectory.csv"]);
        for _ in 0..2 {
            written(&nested, Ok("<svg/>".into())).unwrap();
        }
        assert_eq!(names(), ["cycles.csv", "metrics.json", "run.svg", "trajectory.csv"]);
        let metrics = fs::read_to_string(nested.join("metrics.json")).unwrap();
        fs::remove_dir_all(&dir).unwrap();
        let read: serde_json::Value = serde_json::from_str(&metrics).unwrap();
        let mut expected: serde_json::Value =
            serde_json::from_str(&json(&golden::run_result()).unwrap()).unwrap();
        let [person, wall] = golden::run_result().contacts.try_into().unwrap();
        expected["contacts"] = serde_json::json!([person, wall]);
        expected["social"] = serde_json::json!({ "personal_share": 0.25, "spl": 0.93 });
        assert_eq!(read, expected);
    }

    #[test]
    fn an_error_names_the_file() {
        let blocked = std::env::temp_dir().join(format!("curionav-blocked-{}", std::process::id()));
        fs::write(&blocked, "a file where a directory should be").unwrap();
        let written = written(&blocked, Ok(String::new()));
        fs::remove_file(&blocked).unwrap();
        assert!(written.unwrap_err().line().contains("curionav-blocked"));
    }
}
