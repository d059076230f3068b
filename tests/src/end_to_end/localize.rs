//! `curionav localize` on logs as a user has them.

use super::program::{curionav, turn};

pub(super) const MAP: &str = "scenarios/maps/quickstart.yaml";

/// A robot that stands for three seconds with something 2 m off all around.
pub(super) fn standing() -> String {
    let scan = |k: u32| {
        let stamp = 100.0 + 0.1 * f64::from(k);
        format!("FLASER 5 2 2 2 2 2 0 0 0 0 0 0 {stamp} nohost {stamp}\n")
    };
    (0..30).map(scan).collect()
}

#[test]
fn figures_and_picture_of_a_log_that_says_nothing_of_the_start_need_one() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let (log, picture) = (folder.path().join("log"), folder.path().join("tracks.svg"));
    std::fs::write(&log, standing() + "FLASER 5 cut").unwrap();
    let run = |more: &[&str]| {
        let what = ["localize", "--map", MAP, log.to_str().unwrap(), "--range-max", "5", "--json"];
        curionav(&[&what[..], &["--out", picture.to_str().unwrap()], more].concat())
    };
    let output = run(&[]);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("--start") && text.contains(log.to_str().unwrap()), "{text}");
    let output = run(&["--start", "2.0,4.5,0"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((said["scans"].as_u64(), said["broken_lines"].as_u64()), (Some(30), Some(1)));
    assert!(said["localizer"].is_null() && said["updates"].as_u64() > Some(2), "{said}");
    assert!(std::fs::read_to_string(&picture).unwrap().contains("localiser"));
}

#[test]
fn what_cannot_be_used_is_named() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str, content: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        path.display().to_string()
    };
    let (log, other) = (path("log", &standing()), path("other", "not a log"));
    let params = path("params.toml", "beams = 0\n");
    for (arguments, said) in [
        (vec!["--map", MAP, &other, "--global"], "has no scan that can be read"),
        (vec!["--map", "nowhere.yaml", &log, "--global"], "nowhere.yaml"),
        (vec!["--map", MAP, &log, "--start", "1,2"], "three numbers"),
        (vec!["--map", MAP, &log, "--global", "--localizer", &params], "beams"),
        (vec!["--map", MAP, &log, "--global", "--reference", &other], "other"),
    ] {
        let output = curionav(&[&["localize"], &arguments[..]].concat());
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
        assert!(text.contains(said), "{arguments:?}: {text}");
    }
}

#[test]
fn a_recording_brings_its_map_and_where_the_robot_truly_was() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (recording, picture, scans) = (path("run.mcap"), path("tracks.svg"), path("scans"));
    let output = curionav(&["run", "scenarios/quickstart.toml", "--record", &recording, "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let driven: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let localize = |more: &[&str]| {
        let output = curionav(&[&["localize", &recording, "--json", "--out", &picture], more].concat());
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{text}");
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()
    };
    let said = localize(&[]);
    let seconds = driven["metrics"]["time_s"].as_f64().unwrap();
    assert!((said["duration_s"].as_f64().unwrap() - seconds).abs() < 1.0, "{said} {driven}");
    assert!(said["scans"].as_u64() == said["references"].as_u64() && said["later_runs"] == 0, "{said}");
    assert_eq!(said["references_are"], "where the robot truly was");
    let error = |who: &str| said[who]["median_m"].as_f64().unwrap();
    assert!(error("localizer") < 0.15, "{said}");
    // The map of the recording is the one of the scenario.
    assert_eq!(localize(&["--map", MAP])["localizer"], said["localizer"]);
    // Another robot, and a file that only begins as a recording does.
    std::fs::write(&scans, b"\x89MCAP0\r\n and no more").unwrap();
    for (arguments, part) in
        [([recording.as_str(), "--robot", "nemo"], "no scan of robot nemo"), ([&scans, "--map", MAP], &scans)]
    {
        let output = curionav(&[&["localize"], &arguments[..]].concat());
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && text.contains(part), "{arguments:?}: {text}");
    }
}

#[test]
fn a_map_of_a_log_localises_the_log_with_several_seeds() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let log = path("run.log");
    let map = path("map.yaml");
    // A log with its own poses: a robot on a circle in a square room.
    let range = |heading: f64, x: f64, y: f64| {
        let (sin, cos) = heading.sin_cos();
        let to_x = if cos > 0.0 { (4.0 - x) / cos } else { (-4.0 - x) / cos };
        let to_y = if sin > 0.0 { (3.0 - y) / sin } else { (-3.0 - y) / sin };
        to_x.abs().min(to_y.abs())
    };
    let scan = |k: u32| {
        let angle = 0.1 * f64::from(k);
        let (x, y, heading) = (angle.cos(), angle.sin(), angle + std::f64::consts::FRAC_PI_2);
        let ranges: Vec<String> = (0..181)
            .map(|i| format!("{:.2}", range(heading + f64::from(i - 90).to_radians(), x, y)))
            .collect();
        format!(
            "FLASER 181 {} {x} {y} {heading} {} {y} {heading} {k} host {k}\n",
            ranges.join(" "),
            x + 0.01 * f64::from(k)
        )
    };
    std::fs::write(&log, (0..100).map(scan).collect::<String>()).unwrap();
    let output = curionav(&["map", "build", &log, "--every", "2", "--out", &map]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8_lossy(&output.stdout).contains("from 50 scans"));
    let picture = path("tracks.svg");
    let what = ["localize", "--map", &map, &log, "--seeds", "3", "--out", &picture];
    let output = curionav(&what);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("right at the end: 3 of 3"), "{text}");
    let output = curionav(&[&what[..], &["--global", "--json"]].concat());
    let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let seeds: Vec<u64> = said.as_array().unwrap().iter().map(|one| one["seed"].as_u64().unwrap()).collect();
    assert_eq!(seeds, [1, 2, 3]);
}
