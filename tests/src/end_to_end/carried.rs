//! A robot that is carried off notices it, and drives slowly until it knows where it is.

use std::path::Path;

use super::program::{RunJson, root, run, turn};

/// When it is carried, seconds.
const AT_S: f64 = 8.0;
/// What it may drive while it does not know its place, m/s: 0.2, and what the base errs by.
const SLOW: f64 = 0.21;

/// A training floor, the seed of the run, and where the robot is put down: drawn at random, with 0.6 m of room.
const TRIALS: [(&str, u64, &str); 12] = [
    ("offices-1", 1002, "[1.65, 4.05, 1.35]"),
    ("offices-1", 1003, "[28.35, 2.75, -0.99]"),
    ("offices-2", 1002, "[1.65, 4.05, 1.35]"),
    ("offices-2", 1003, "[16.25, 2.75, 1.04]"),
    ("shops-1", 1002, "[18.05, 5.15, 2.27]"),
    ("shops-1", 1003, "[7.65, 4.95, -0.76]"),
    ("shops-2", 1002, "[18.05, 3.95, 2.27]"),
    ("shops-2", 1003, "[11.95, 11.25, 2.99]"),
    ("corridors-1", 1002, "[17.25, 21.85, -2.99]"),
    ("corridors-1", 1003, "[12.65, 21.25, -0.72]"),
    ("corridors-2", 1002, "[17.25, 22.35, -2.99]"),
    ("corridors-2", 1003, "[25.45, 12.45, -1.94]"),
];

/// One row of `trajectory.csv`.
struct Row {
    time_s: f64,
    /// Metres between truth and belief.
    error: f64,
    /// Greatest standard deviation of the belief's position, metres.
    sigma: f64,
    v: f64,
}

fn rows(folder: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(folder.join("trajectory.csv")).unwrap();
    let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let row = |line: &str| {
        let numbers: Vec<&str> = line.split(',').collect();
        let at = |name: &str| -> f64 {
            let column = names.iter().position(|other| *other == name).unwrap();
            numbers[column].parse().unwrap()
        };
        let half = 0.5 * (at("cov_xx") - at("cov_yy"));
        let worst = 0.5 * (at("cov_xx") + at("cov_yy")) + half.hypot(at("cov_xy"));
        Row {
            time_s: at("time_s"),
            error: (at("true_x") - at("belief_x")).hypot(at("true_y") - at("belief_y")),
            sigma: worst.sqrt(),
            v: at("v"),
        }
    };
    text.lines().skip(1).map(row).collect()
}

fn carried(floor: &str, seed: u64, to: &str) -> (RunJson, Vec<Row>) {
    let folder = tempfile::tempdir().unwrap();
    let training = root().join("scenarios/training");
    let text = std::fs::read_to_string(training.join(format!("{floor}.toml"))).unwrap();
    let text = text.replace("\"maps/", &format!("\"{}/", training.join("maps").display()));
    let event = format!("\n[[world.events]]\nat_s = {AT_S}\ncarried_to = {to}\n");
    let file = folder.path().join("carried.toml");
    std::fs::write(&file, text + &event).unwrap();
    let out = folder.path().join("out");
    let seed = seed.to_string();
    let arguments = ["--planner", "curionav", "--seed", &seed, "--out", out.to_str().unwrap()];
    let (json, _) = run(file.to_str().unwrap(), &arguments);
    (json, rows(&out))
}

#[test]
fn a_robot_that_is_carried_off_mostly_says_so_drives_slowly_and_finds_itself() {
    let _turn = turn();
    let mut found_soon = 0;
    let mut honest = 0;
    let mut unknown = 0;
    let mut fast = 0;
    for (floor, seed, to) in TRIALS {
        let (json, rows) = carried(floor, seed, to);
        let lost = rows.iter().filter(|row| row.time_s > AT_S + 0.05 && row.error > 0.5);
        let found = lost.clone().next_back().map_or(0.0, |row| row.time_s - AT_S);
        // After 2 s it has noticed, and from 1 m/s it brakes to 0.2 m/s within 2 s.
        let fastest =
            lost.clone().filter(|row| row.time_s > AT_S + 4.0).map(|row| row.v.abs()).fold(0.0, f64::max);
        println!("{floor}, {seed}: {}, found after {found:.1} s, {fastest:.2} m/s until then", json.outcome);
        fast += usize::from(fastest > SLOW);
        // In doubt it may also take a way for closed, and once found it may lack the time.
        assert!(
            ["reached", "timeout", "lost", "no_way"].contains(&json.outcome.as_str()),
            "{floor}, {seed}: {json:?}"
        );
        found_soon += usize::from(json.outcome == "reached" && found <= 20.0);
        let late = lost.filter(|row| row.time_s > AT_S + 2.0);
        unknown += late.clone().count();
        honest += late.filter(|row| row.sigma >= row.error / 3.0).count();
    }
    println!("{found_soon} of {} found within 20 s; {honest} of {unknown} ticks honest", TRIALS.len());
    // Of 34 such trials the robot was found within 20 s in 26, and was sure of a wrong place for a while in 3. Which
    // ones depends on every turn of the way.
    assert!(fast <= 2, "{fast} were faster than {SLOW} m/s while they did not know where they were");
    assert!(found_soon >= 8, "{found_soon}");
    assert!(honest as f64 >= 0.8 * unknown as f64, "{honest} of {unknown}");
}
