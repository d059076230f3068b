//! Real maps and real people.

use std::io::Write;

use curionav_testing::reference_data;

use super::program::{curionav, run, turn};

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

#[test]
fn recorded_people_are_crossed() {
    assert_reached("zara01", "peds_eth_ucy/zara01/obsmat.txt");
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
