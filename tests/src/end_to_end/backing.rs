//! A robot in a dead end in which it cannot turn.

use std::path::Path;

use super::program::{RunJson, run, turn};

/// A square of 0.8 m whose nose is 0.25 m from the end of a dead end 1.3 m wide. It keeps 0.15 m from walls, which
/// leaves its corners no room to turn: they are 0.57 m from its centre.
const SCENARIO: &str = r#"
name = "dead-end"
[map]
file = "dead-end.yaml"
[robot]
start = [8.2, 4.0, 0.0]
goal = [3.0, 4.0]
initial_sigma = [0.05, 0.05, 0.03]
start_noise = 0.0
[robot.model]
v_reverse = 0.2
[robot.model.footprint]
shape = "polygon"
vertices = [{ x = -0.4, y = -0.4 }, { x = 0.4, y = -0.4 }, { x = 0.4, y = 0.4 }, { x = -0.4, y = 0.4 }]
[laser]
fov = 6.283185307179586
beams = 360
[profile.collision]
wall_margin = 0.15
tight_after = 0.0
[clock]
time_limit_s = 60.0
"#;
/// Metres.
const CELL: f64 = 0.05;

/// A hall of 7.9 m by 7.9 m with two pillars, and the dead end east of it, 0.95 m deep.
fn is_wall(x: f64, y: f64) -> bool {
    let is_hall = (0.1..7.9).contains(&x) && (0.1..7.9).contains(&y);
    let is_dead_end = (7.9..8.85).contains(&x) && (3.35..4.65).contains(&y);
    let is_pillar =
        [(2.0, 6.5), (5.0, 1.5)].iter().any(|at| (x - at.0).abs() < 0.2 && (y - at.1).abs() < 0.2);
    is_pillar || !(is_hall || is_dead_end)
}

fn write_map(folder: &Path) {
    let columns = 180;
    let rows = 160;
    let grey = |i: usize| {
        let x = CELL * ((i % columns) as f64 + 0.5);
        let y = CELL * ((rows - 1 - i / columns) as f64 + 0.5);
        if is_wall(x, y) { 0 } else { 255 }
    };
    let pixels: Vec<u8> = (0..columns * rows).map(grey).collect();
    let image = [format!("P5\n{columns} {rows}\n255\n").into_bytes(), pixels].concat();
    std::fs::write(folder.join("dead-end.pgm"), image).unwrap();
    let yaml = "image: dead-end.pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n\
                occupied_thresh: 0.65\nfree_thresh: 0.196\n";
    std::fs::write(folder.join("dead-end.yaml"), yaml).unwrap();
}

/// The scenario with `from` replaced by `to`.
fn driven(from: &str, to: &str, seed: &str) -> (RunJson, i32) {
    let folder = tempfile::tempdir().unwrap();
    write_map(folder.path());
    assert!(SCENARIO.contains(from), "{from}");
    let path = folder.path().join("dead-end.toml");
    std::fs::write(&path, SCENARIO.replace(from, to)).unwrap();
    run(path.to_str().unwrap(), &["--seed", seed])
}

#[test]
fn a_robot_that_cannot_turn_backs_out_where_its_laser_sees_behind_it() {
    let _turn = turn();
    for seed in ["1", "2"] {
        let (json, status) = driven("", "", seed);
        assert_eq!((json.outcome.as_str(), status), ("reached", 0), "seed {seed}: {json:?}");
        assert_eq!(json.metrics.collisions, 0, "seed {seed}: {json:?}");
    }
    for (from, to) in [("v_reverse = 0.2", "v_reverse = 0.0"), ("fov = 6.283185307179586", "fov = 3.14")] {
        let (json, status) = driven(from, to, "1");
        assert!(json.outcome != "reached" && status == 1, "{to}: {json:?}");
        assert!(json.metrics.length_m < 0.1, "{to}: {json:?}");
    }
}
