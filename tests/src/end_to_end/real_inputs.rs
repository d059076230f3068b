//! Real maps and real people.

use super::program::{reference_data, run, turn};

fn assert_reached(scenario: &str) {
    if reference_data(scenario).is_none() {
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
    assert_reached("osnabrueck-floor3");
}

#[test]
fn the_warehouse_is_crossed() {
    assert_reached("warehouse");
}

#[test]
fn recorded_people_are_crossed() {
    assert_reached("zara01");
}
