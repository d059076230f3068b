//! `curionav track` on logs as a user has them.

use super::localize::{MAP, standing};
use super::program::{curionav, turn};

#[test]
fn the_people_of_a_recording_are_found_where_its_table_says() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let recording = path("run.mcap");
    let output = curionav(&["run", "scenarios/quickstart.toml", "--record", &recording, "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let table = path("people.csv");
    let picture = path("track.svg");
    let track = |more: &[&str]| {
        let output = curionav(&[&["track", &recording, "--json", "--out", &picture], more].concat());
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{text}");
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()
    };
    let said = track(&["--people", &table]);
    assert!(said["score"].is_null() && said["placed_scans"] == said["scans"], "{said}");
    assert!(said["tracks"].as_array().is_some_and(|tracks| !tracks.is_empty()), "{said}");
    // The people in its table are the ones that it finds there; only hidden people do not count.
    let again = track(&["--annotations", &table, "--annotations-frame", "map"]);
    assert!(again["score"]["precision"].as_f64().unwrap() > 0.99, "{again}");
    assert!(again["score"]["recall"].as_f64().unwrap() > 0.6, "{again}");
    assert!(std::fs::read_to_string(&picture).unwrap().contains("annotated, found"));
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
    let log = path("log", &standing());
    let people = path("people.csv", "stamp_s,x,y\n100.1,1,2\n100.2,1,left\n");
    let params = path("params.toml", "gate = -1.0\n");
    let start = ["--map", MAP, &log, "--start", "2.0,4.5,0"];
    for (more, said) in [
        (vec!["--annotations", &people], "people.csv: line 3: y is `left`: write metres"),
        (vec!["--annotations", "nowhere.csv"], "nowhere.csv"),
        (vec!["--by-reference"], "give --reference"),
        (vec!["--tracker", &params], "gate"),
        (vec!["--annotations-frame", "robot"], "--annotations"),
        (vec!["--raw-odometry", "--by-reference"], "cannot be used with"),
    ] {
        let output = curionav(&[&["track"], &start[..], &more].concat());
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{more:?}: {text}");
        assert!(text.contains(said), "{more:?}: {text}");
    }
}
