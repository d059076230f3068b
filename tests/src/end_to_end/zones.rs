//! Zones of a map that only the planner knows, and maps that are not true.

use std::path::{Path, PathBuf};

use curionav_planning::profile::Profile;

use super::program::{Deployment, curionav, run, turn};

/// A hall of 16 m x 8 m in cells of 0.1 m, with three pillars for the laser.
const SCENARIO: &str = "name = \"hall\"\n[map]\nfile = \"hall.yaml\"\n[robot]\nstart = [1.5, 4.0, 0.0]\n\
                        goal = [14.5, 4.0]\ninitial_sigma = [0.05, 0.05, 0.03]\nstart_noise = 0.0\n\
                        [clock]\ntime_limit_s = 90.0\n";
/// A block from (5, 2.5) to (7, 7.5), in cells of 0.5 m.
const KEEPOUT: Area = Area { from: (5.0, 2.5), to: (7.0, 7.5) };
/// Across the hall from x = 9 to 12 m.
const SLOW: Area = Area { from: (9.0, 0.0), to: (12.0, 8.0) };
const WITH_ZONES: (&str, &str) =
    ("\"hall.yaml\"\n", "\"hall.yaml\"\nkeepout = \"keepout.yaml\"\nspeed = \"speed.yaml\"\n");
/// What is allowed in the slow area, m/s: the robot's greatest speed is 1 m/s.
const SLOW_MPS: f64 = 0.3;

#[derive(Clone, Copy)]
struct Area {
    from: (f64, f64),
    to: (f64, f64),
}

impl Area {
    fn holds(&self, (x, y): (f64, f64)) -> bool {
        (self.from.0..self.to.0).contains(&x) && (self.from.1..self.to.1).contains(&y)
    }

    /// Distance from a point to the area, metres; 0 inside.
    fn distance(&self, (x, y): (f64, f64)) -> f64 {
        let dx = (self.from.0 - x).max(x - self.to.0).max(0.0);
        let dy = (self.from.1 - y).max(y - self.to.1).max(0.0);
        dx.hypot(dy)
    }
}

fn is_wall((x, y): (f64, f64)) -> bool {
    let is_rim = !(0.1..15.9).contains(&x) || !(0.1..7.9).contains(&y);
    let pillars = [(3.0, 6.5), (8.0, 1.0), (13.0, 6.5)];
    is_rim || pillars.iter().any(|(px, py)| (x - px).abs() < 0.2 && (y - py).abs() < 0.2)
}

/// A map_server map of the hall's floor in cells of `side` metres: each has the occupancy, per cent, of its centre.
fn write_map(folder: &Path, name: &str, side: f64, mode: &str, occupancy: impl Fn((f64, f64)) -> u8) {
    let columns = (16.0 / side) as usize;
    let rows = (8.0 / side) as usize;
    let pixel = |i: usize| {
        let x = (i % columns) as f64 + 0.5;
        let y = (rows - 1 - i / columns) as f64 + 0.5;
        // `raw` takes the grey as it is; otherwise black is occupied.
        let percent = occupancy((side * x, side * y));
        if mode == "raw" { percent } else { 255 - (2.55 * f64::from(percent)).round() as u8 }
    };
    let pixels: Vec<u8> = (0..columns * rows).map(pixel).collect();
    let image = [format!("P5\n{columns} {rows}\n255\n").into_bytes(), pixels].concat();
    std::fs::write(folder.join(format!("{name}.pgm")), image).unwrap();
    let yaml = format!(
        "image: {name}.pgm\nmode: {mode}\nresolution: {side}\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n\
         occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    );
    std::fs::write(folder.join(format!("{name}.yaml")), yaml).unwrap();
}

/// The hall's files in `folder`, and its scenario with `from` replaced by `to`.
fn hall(folder: &Path, (from, to): (&str, &str)) -> PathBuf {
    write_map(folder, "hall", 0.1, "trinary", |p| if is_wall(p) { 100 } else { 0 });
    write_map(folder, "keepout", 0.5, "trinary", |p| if KEEPOUT.holds(p) { 100 } else { 0 });
    write_map(folder, "speed", 0.25, "raw", |p| if SLOW.holds(p) { 70 } else { 0 });
    assert!(SCENARIO.contains(from), "{from}");
    let path = folder.join("hall.toml");
    std::fs::write(&path, SCENARIO.replacen(from, to, 1)).unwrap();
    path
}

/// A row of `trajectory.csv`.
struct Row {
    truth: (f64, f64),
    belief: (f64, f64),
    speed: f64,
}

fn rows(folder: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(folder.join("trajectory.csv")).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let columns = ["true_x", "true_y", "belief_x", "belief_y", "v"].map(|name| {
        names.iter().position(|it| *it == name).unwrap_or_else(|| panic!("no {name} in {names:?}"))
    });
    lines
        .map(|line| {
            let values: Vec<&str> = line.split(',').collect();
            let [x, y, belief_x, belief_y, speed] = columns.map(|at| values[at].parse().unwrap());
            Row { truth: (x, y), belief: (belief_x, belief_y), speed }
        })
        .collect()
}

#[test]
fn every_planner_goes_round_keepout_and_is_slow_where_it_has_to_be() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let scenario = hall(folder.path(), WITH_ZONES);
    for planner in Profile::names() {
        let out = folder.path().join(planner);
        let (json, _) =
            run(scenario.to_str().unwrap(), &["--planner", planner, "--out", out.to_str().unwrap()]);
        if ["curionav", "dwa", "mppi"].contains(&planner) {
            assert_eq!(json.outcome, "reached", "{planner}: {json:?}");
        }
        let rows = rows(&out);
        assert!(rows.iter().any(|row| row.speed > 0.8), "{planner} is never fast");
        for Row { truth, belief, speed } in rows {
            let room = KEEPOUT.distance(truth) - 0.3;
            assert!(room > -0.1, "{planner}: {room:.3} m from keepout at {truth:?}, believed {belief:?}");
            // The driver catches up with what was decided.
            assert!(
                !SLOW.holds(belief) || speed < SLOW_MPS + 0.08,
                "{planner}: {speed:.3} m/s at {truth:?}, believed {belief:?}"
            );
        }
        let picture = std::fs::read_to_string(out.join("run.svg")).unwrap();
        assert!(
            picture.contains("href=\"#zones\"") && picture.contains("keepout, and slow floor"),
            "{planner}"
        );
    }
}

#[test]
fn services_and_replays_know_of_the_same_zones() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let scenario = hall(folder.path(), WITH_ZONES);
    let scenario = scenario.to_str().unwrap();
    let recorded = folder.path().join("run.mcap");
    let recorded = recorded.to_str().unwrap();
    let deployment = Deployment::start(2);
    for planner in ["curionav", "risk-rrt"] {
        let expected = run(scenario, &["--planner", planner, "--record", recorded]).0;
        let (json, _) = run(scenario, &["--planner", planner, "--connect", deployment.endpoint()]);
        assert_eq!(json.decisions_sha256, expected.decisions_sha256, "{planner}: {json:?}");
        assert_eq!(json.cycles.degraded, 0, "{planner}");
        let replayed = curionav(&["replay", recorded, "--json"]);
        assert!(replayed.status.success(), "{replayed:?}");
        let said: serde_json::Value = serde_json::from_slice(&replayed.stdout).unwrap();
        assert_eq!(
            (&said["differing"], &said["replayed"]),
            (&0.into(), &said["cycles"]),
            "{planner}: {said}"
        );
        std::fs::remove_file(recorded).unwrap();
    }
    assert_eq!(deployment.stop(), 0);
}

#[test]
fn what_is_true_is_seen_and_met_and_the_map_stays_what_the_planner_knows() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let scenario = hall(folder.path(), ("[clock]", "[world]\nfile = \"truth.yaml\"\n[clock]"));
    let scenario = scenario.to_str().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let boxed = Area { from: (6.0, 2.8), to: (6.6, 5.2) };
    // Of another resolution than the map: a box stands in the way.
    write_map(
        folder.path(),
        "truth",
        0.05,
        "trinary",
        |p| if is_wall(p) || boxed.holds(p) { 100 } else { 0 },
    );
    let (json, status) = run(scenario, &["--out", out]);
    assert_eq!((json.outcome.as_str(), status, json.metrics.collisions), ("reached", 0, 0), "{json:?}");
    // The way on the map is straight.
    assert!(rows(Path::new(out)).iter().any(|row| (row.truth.1 - 4.0).abs() > 1.2), "{json:?}");
    // A wall across the hall of the truth.
    write_map(folder.path(), "truth", 0.1, "trinary", |p| {
        if is_wall(p) || (8.0..8.3).contains(&p.0) { 100 } else { 0 }
    });
    let (json, _) = run(scenario, &["--out", out]);
    assert!(json.outcome != "reached" && json.metrics.collisions == 0, "{json:?}");
    assert!(rows(Path::new(out)).iter().all(|row| row.truth.0 < 7.8), "{json:?}");
    // A wall of the map that is not there any more: the planner knows no way through it.
    write_map(folder.path(), "truth", 0.1, "trinary", |p| if is_wall(p) { 100 } else { 0 });
    write_map(folder.path(), "hall", 0.1, "trinary", |p| {
        if is_wall(p) || (8.0..8.3).contains(&p.0) && p.1 < 6.0 { 100 } else { 0 }
    });
    let (json, _) = run(scenario, &["--out", out]);
    assert_eq!((json.outcome.as_str(), json.metrics.collisions), ("reached", 0), "{json:?}");
    assert!(rows(Path::new(out)).iter().any(|row| row.truth.1 > 6.0), "{json:?}");
}

#[test]
fn what_does_not_fit_is_refused_with_file_field_and_mend() {
    let folder = tempfile::tempdir().unwrap();
    let beside = "image: keepout.pgm\nresolution: 0.5\norigin: [90.0, 0.0, 0.0]\nnegate: 0\n\
                  occupied_thresh: 0.65\nfree_thresh: 0.196\n";
    std::fs::write(folder.path().join("beside.yaml"), beside).unwrap();
    write_map(folder.path(), "black", 0.5, "trinary", |p| if SLOW.holds(p) { 100 } else { 0 });
    write_map(folder.path(), "start", 0.5, "trinary", |p| if p.0 < 2.0 { 100 } else { 0 });
    let map = "\"hall.yaml\"\n";
    for (from, to, words) in [
        (map, "\"hall.yaml\"\nkeepout = \"none.yaml\"\n", &["line 4", "map.keepout", "none.yaml"][..]),
        (
            map,
            "\"hall.yaml\"\nkeepout = \"beside.yaml\"\n",
            &["line 4: map.keepout", "beside the map", "`origin`"],
        ),
        (map, "\"hall.yaml\"\nkeepout = \"start.yaml\"\n", &["robot.start", "a keepout zone"]),
        (
            map,
            "\"hall.yaml\"\nspeed = \"black.yaml\"\n",
            &["line 4: map.speed", "value 100", "1 to 100 %", "`mode`"],
        ),
        (map, "\"hall.yaml\"\nspeed_base = 3.0\n", &["line 4", "map.speed_base", "`speed`"]),
        ("[clock]", "[world]\nfile = \"start.yaml\"\n[clock]", &["robot.start", "`world.file`, start.yaml"]),
        ("[clock]", "[world]\nfile = \"none.yaml\"\n[clock]", &["line 10: world.file", "none.yaml"]),
    ] {
        let scenario = hall(folder.path(), (from, to));
        let refused = curionav(&["scenario", "check", scenario.to_str().unwrap()]);
        let said = String::from_utf8(refused.stderr).unwrap();
        assert_eq!((refused.status.code(), said.trim_end().lines().count()), (Some(2), 1), "{to}: {said}");
        for word in [&["hall.toml"][..], words].concat() {
            assert!(said.contains(word), "{to}: no `{word}` in: {said}");
        }
    }
    let fits = curionav(&["scenario", "check", hall(folder.path(), WITH_ZONES).to_str().unwrap()]);
    let said = String::from_utf8(fits.stdout).unwrap();
    assert!(said.contains("is slow, down to 30 % of the greatest speed"), "{said}");
}
