//! Real maps and real people.

use std::io::Write;

use curionav_testing::reference_data;

use super::program::{curionav, run, turn};

/// A robot that comes no faster towards a person does not drive into it, m/s.
const DRIVES_INTO: f64 = 0.1;

#[track_caller]
fn assert_reached(scenario: &str, data: &str) {
    if reference_data(data).is_none() {
        return;
    }
    let _turn = turn();
    let (json, status) = run(&format!("scenarios/real/{scenario}.toml"), &[]);
    assert_eq!(
        (json.outcome.as_str(), json.metrics.collisions, status),
        ("reached", 0, 0),
        "{scenario}: {json:?}"
    );
    println!(
        "{scenario}: {:.1} m in {:.1} s, RMSE {:.2} m",
        json.metrics.length_m, json.metrics.time_s, json.metrics.rmse_m
    );
}

#[test]
fn the_third_floor_in_osnabrueck_is_crossed() {
    assert_reached("osnabrueck-floor3", "maps_real_slam/avz3floor_complete.yaml");
}

#[test]
fn the_warehouse_is_crossed() {
    assert_reached("warehouse", "maps_nav2_turtlebot/warehouse.yaml");
}

/// Filmed people do not see the robot, and may walk into it while it stands or makes way.
#[test]
fn recorded_people_are_crossed_and_the_robot_drives_into_none_of_them() {
    if reference_data("peds_eth_ucy/zara01/obsmat.txt").is_none() {
        return;
    }
    let _turn = turn();
    let out = tempfile::tempdir().unwrap();
    let (json, _) = run("scenarios/real/zara01.toml", &["--out", out.path().to_str().unwrap()]);
    assert_eq!(json.outcome, "reached", "{json:?}");
    let metrics: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(out.path().join("metrics.json")).unwrap()).unwrap();
    let contacts = metrics["contacts"].as_array().unwrap();
    assert_eq!(contacts.len(), json.metrics.collisions as usize, "{metrics}");
    for contact in contacts {
        let robot = contact["robot_mps"].as_f64().unwrap();
        let person = contact["person_mps"].as_f64().unwrap();
        assert!(robot < DRIVES_INTO && robot < person, "{contact}");
    }
}

#[test]
fn a_missing_dataset_is_told_with_file_line_field_and_the_command_that_downloads_it() {
    let mut file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
    file.write_all(
        b"name = \"s\"\nmap = { file = \"dataset:no-such/map.yaml\" }\nrobot = { start = [0, 0, 0], goal = [1, 0] }\n",
    )
    .unwrap();
    let path = file.path().to_str().unwrap();
    let output = curionav(&["scenario", "check", path]);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(error.contains(&format!("{path}: line 2: map.file: there is no file ")), "{error}");
    assert!(error.contains("`python -m curionav.datasets no-such` downloads it"), "{error}");
}
