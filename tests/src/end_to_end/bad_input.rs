//! What is wrong is said in one clear line, with the right exit status, and leaves nothing behind.

use std::net::TcpListener;
use std::path::Path;

use super::program::{curionav, root};

/// Exit status and standard error, which must be one line that holds each of `words`.
fn assert_refused(arguments: &[&str], status: i32, words: &[&str]) {
    let output = curionav(arguments);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {error}");
    assert_eq!(error.trim_end().lines().count(), 1, "{arguments:?}: {error}");
    for word in words {
        assert!(error.contains(word), "{arguments:?}: no `{word}` in: {error}");
    }
    assert!(output.stdout.is_empty() && !error.contains("panicked"), "{arguments:?}");
}

/// A scenario on a small walled map, with `from` replaced by `to`, in a directory of its own.
fn scenario(directory: &Path, from: &str, to: &str) -> String {
    const SCENARIO: &str = "name = \"room\"\n[map]\nfile = \"room.yaml\"\n[robot]\nstart = [1.0, 1.0, 0.0]\ngoal = [3.0, 1.0]\n[[walkers]]\nroute = [[2.0, 2.0], [2.0, 3.0]]\nspeed = 0.5\n";
    const YAML: &str = "image: room.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
    // 5 m x 4 m, walls around, and one from (4, 0) to (4, 4): what is beyond it is out of reach.
    let (width, height) = (50, 40);
    let wall = |x: usize, y: usize| x == 0 || y == 0 || x == width - 1 || y == height - 1 || x == 40;
    let pixels = (0..width * height).map(|i| if wall(i % width, i / width) { 0 } else { 254 });
    let pgm = [format!("P5\n{width} {height}\n255\n").into_bytes(), pixels.collect::<Vec<u8>>()].concat();
    std::fs::write(directory.join("room.pgm"), pgm).unwrap();
    std::fs::write(directory.join("room.yaml"), YAML.replacen(from, to, 1)).unwrap();
    let text = SCENARIO.replacen(from, to, 1);
    assert!(text != SCENARIO || YAML.contains(from) || from.is_empty(), "`{from}` is in neither file");
    let path = directory.join("room.toml");
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn a_wrong_scenario_is_refused_by_file_line_and_field() {
    let directory = tempfile::tempdir().unwrap();
    for (from, to, words) in [
        ("goal = [3.0, 1.0]", "goal = [4.5, 1.0]", &["room.toml", "line 6", "robot.goal"][..]),
        ("goal = [3.0, 1.0]", "goal = [nan, 1.0]", &["line 6", "robot.goal[0]", "-1e7 to 1e7 m"]),
        ("start = [1.0, 1.0, 0.0]", "start = [0.1, 1.0, 0.0]", &["line 5", "robot.start", "wall"]),
        ("speed = 0.5", "sped = 0.5", &["line 9", "walkers[0].sped"]),
        ("speed = 0.5", "speed = -1.0", &["line 9", "walkers[0].speed"]),
        (
            "[[walkers]]",
            "[robot.model]\nfootprint = { shape = \"disc\", radius = -0.3 }\n[[walkers]]",
            &["radius"],
        ),
        ("[[walkers]]", "[planner]\nprofile = \"wandering\"\n[[walkers]]", &["wandering", "curiosity"]),
        ("[[walkers]]", "[profile]\nsteps = 0\n[[walkers]]", &["line 8", "profile.steps", "1 to 200"]),
        ("[[walkers]]", "[profile]\nstep = 9\n[[walkers]]", &["room.toml", "step"]),
        ("[[walkers]]", "[localizer]\nparticles = 9\n[[walkers]]", &["line 8", "localizer.particles"]),
        (
            "file = \"room.yaml\"",
            "file = \"cellar.yaml\"",
            &["room.toml", "line 3", "map.file", "cellar.yaml"],
        ),
        (
            "[[walkers]]",
            "[[recorded]]\nfile = \"film.txt\"\nformat = \"text\"\nfps = 10\n[[walkers]]",
            &["line 8", "recorded[0].file", "film.txt"],
        ),
        ("image: room.pgm", "image: attic.pgm", &["attic.pgm"]),
        ("resolution: 0.1", "resolution: -0.1", &["room.yaml", "resolution"]),
        ("resolution: 0.1", "resolution: [", &["room.yaml"]),
        ("name = \"room\"", "name = ", &["room.toml", "line 1"]),
    ] {
        let path = scenario(directory.path(), from, to);
        assert_refused(&["run", &path], 2, words);
        assert_refused(&["scenario", "check", &path], 2, words);
    }
}

#[test]
fn the_room_itself_is_fine() {
    let directory = tempfile::tempdir().unwrap();
    let path = scenario(directory.path(), "", "");
    assert!(curionav(&["scenario", "check", &path]).status.success());
}

#[test]
fn wrong_arguments_are_bad_input() {
    assert_refused(&["run", "nowhere.toml"], 2, &["nowhere.toml"]);
    assert_refused(
        &["run", "scenarios/quickstart.toml", "--planner", "wandering"],
        2,
        &["wandering", "curiosity"],
    );
    assert_refused(&["up", "nowhere.toml"], 2, &["nowhere.toml"]);
    assert_refused(&["cpc", "--instance", "A B"], 2, &["instance"]);
    assert_eq!(curionav(&["run", "scenarios/quickstart.toml", "--speed", "0"]).status.code(), Some(2));
    let nothing = root().join("README.md");
    assert_refused(&["run", nothing.to_str().unwrap()], 2, &["README.md"]);
}

#[test]
fn a_port_already_taken_is_named() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let endpoint = format!("tcp/{}", taken.local_addr().unwrap());
    assert_refused(&["router", "--listen", &endpoint], 3, &[&endpoint, "in use"]);
}

#[test]
fn a_router_that_is_not_there_is_named() {
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let endpoint = format!("tcp/{free}");
    assert_refused(&["run", "scenarios/quickstart.toml", "--connect", &endpoint], 3, &[&endpoint, "router"]);
    assert_refused(&["pause", "robot", "--connect", &endpoint], 3, &[&endpoint, "router"]);
}
