//! What `check` calls fine can be run; what cannot is refused at every door, with what is wrong and what to write.

use std::path::Path;

use tempfile::TempDir;

use super::program::{Deployment, curionav, run, turn};

const YAML: &str = "image: room.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n\
                    occupied_thresh: 0.65\nfree_thresh: 0.196\n";
const SCENARIO: &str = "name = \"room\"\nmap = { file = \"room.yaml\" }\n[robot]\nstart = [1.0, 2.0, 0.0]\n\
                        goal = [5.0, 2.0]\nstart_noise = 0.0\n[clock]\ntime_limit_s = 30\n";
/// A person who walks 0.1 m in each of 40 frames, 10 in a second.
const FILM: &str = "format = \"text\"\nfps = 10.0\n";

/// A room of 6 m x 4 m with walls, a corner that was never seen, and what a test puts into it.
struct Room(TempDir);

impl Room {
    fn new() -> Self {
        let room = Self(tempfile::tempdir().unwrap());
        room.put("room.pgm", image());
        room.put("room.yaml", YAML);
        room.put("room.toml", SCENARIO);
        room
    }

    fn put(&self, file: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.0.path().join(file), content).unwrap();
    }

    fn path(&self, file: &str) -> String {
        self.0.path().join(file).to_str().unwrap().to_owned()
    }

    /// What `check` says of the scenario, whether it is fine or not.
    fn check(&self) -> (bool, String) {
        let output = curionav(&["scenario", "check", &self.path("room.toml")]);
        let said = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        assert!(!said.contains("panicked"), "{said}");
        (output.status.success(), said)
    }

    /// It is fine or not, and each of `words` is said. What is refused here is refused by `run` in the same words.
    #[track_caller]
    fn assert_checked(&self, is_fine: bool, words: &[&str]) {
        let (fine, said) = self.check();
        assert_eq!(fine, is_fine, "{said}");
        words.iter().for_each(|word| assert!(said.contains(word), "no `{word}` in: {said}"));
        if !is_fine {
            let ran = curionav(&["run", &self.path("room.toml")]);
            let error = String::from_utf8(ran.stderr).unwrap();
            assert_eq!(ran.status.code(), Some(2), "{error}");
            assert!(error.lines().count() == 1 && said.contains(error.trim_end()), "{said}\nbut: {error}");
        }
    }
}

fn image() -> Vec<u8> {
    let (width, height) = (60, 40);
    let grey = |i: usize| {
        let (x, y) = (i % width, i / width);
        let is_wall = x == 0 || y == 0 || x == width - 1 || y == height - 1;
        if is_wall {
            0
        } else if x > 50 && y < 8 {
            205
        } else {
            254
        }
    };
    let pixels: Vec<u8> = (0..width * height).map(grey).collect();
    [format!("P5\n{width} {height}\n255\n").into_bytes(), pixels].concat()
}

fn film(step: f64, frames: u32) -> String {
    (0..frames).map(|frame| format!("{frame} 1 {:.3} 3.000\n", 1.0 + step * f64::from(frame))).collect()
}

#[test]
fn maps_of_any_name_can_be_run() {
    for name in ["büro_地図.pgm", "hall (2) [new].pgm", "l'étage & 1,5.pgm"] {
        let room = Room::new();
        room.put(name, image());
        room.put("room.yaml", YAML.replace("room.pgm", &format!("\"{name}\"")));
        room.assert_checked(true, &["fine", "% free"]);
        assert_eq!(run(&room.path("room.toml"), &[]).1, 0, "{name}");
    }
    let room = Room::new();
    room.put("a:b.pgm", image());
    room.put("room.yaml", YAML.replace("room.pgm", "\"a:b.pgm\""));
    room.assert_checked(false, &["files", "a:b.pgm"]);
}

#[test]
fn marks_and_modes_are_read_as_they_are_meant() {
    let room = Room::new();
    room.put("room.toml", format!("\u{feff}{SCENARIO}[[recorded]]\nfile = \"f.txt\"\n{FILM}"));
    room.put("room.yaml", format!("\u{feff}{YAML}mode: Scale\n"));
    room.put("f.txt", format!("\u{feff}{}", film(0.1, 40)));
    room.assert_checked(true, &["1 people", "walking at 1.00 m/s"]);
}

#[test]
fn what_is_odd_about_a_map_is_told() {
    for (from, to, is_fine, words) in [
        ("", "", true, &["map: 89.5 % free, 8.2 % occupied, 2.3 % unknown"][..]),
        ("negate: 0", "negate: 1", false, &["robot.start", "with `negate: 0` 90 % would be free"]),
        ("negate: 0", "negate: 0\nmode: raw", false, &["robot.start", "leave `mode` out"]),
        ("0.196", "0.25", true, &["map is odd", "grey 205", "`free_thresh: 0.196`"]),
        ("0.65", "1.0", true, &["map is odd", "no cell is occupied"]),
    ] {
        let room = Room::new();
        room.put("room.yaml", YAML.replacen(from, to, 1));
        let (fine, said) = room.check();
        assert_eq!(fine, is_fine, "{said}");
        words.iter().for_each(|word| assert!(said.contains(word), "no `{word}` in: {said}"));
    }
}

#[test]
fn files_that_are_cut_off_or_compressed_are_told() {
    let gzip = [0x1f, 0x8b, 8, 0, 0, 0, 0, 0];
    let film = format!("{SCENARIO}[[recorded]]\nfile = \"f.txt\"\n{FILM}");
    for (file, content, scenario, words) in [
        (
            "room.pgm",
            image()[..1500].to_vec(),
            SCENARIO,
            &["should have 60 x 40 pixels but is only 1500 bytes"][..],
        ),
        ("room.pgm", b"P5\n60 40\n255\n".to_vec(), SCENARIO, &["cut off"]),
        ("room.pgm", gzip.to_vec(), SCENARIO, &["map.file: the map's image is compressed", "gunzip"]),
        ("room.yaml", gzip.to_vec(), SCENARIO, &["room.yaml", "gunzip"]),
        ("room.toml", gzip.to_vec(), SCENARIO, &["room.toml", "gunzip"]),
        ("f.txt", gzip.to_vec(), &film, &["recorded[0].file", "gunzip"]),
        ("room.toml", b"\xff\xfen\0a\0".to_vec(), SCENARIO, &["room.toml", "UTF-8"]),
    ] {
        let room = Room::new();
        room.put("room.toml", scenario);
        room.put(file, content);
        room.assert_checked(false, words);
    }
}

#[test]
fn films_that_cannot_be_are_told() {
    for (film, more, is_fine, words) in [
        (
            film(0.1, 40),
            "ids = []\n",
            false,
            &["line 13: recorded[0].ids: has 0 entries", "leave it out"][..],
        ),
        (film(0.1, 40), "ids = [2]\n", false, &["recorded[0].ids", "id 2"]),
        (film(0.1, 40), "", true, &["walking at 1.00 m/s (median), at most 1.00 m/s"]),
        (film(0.005, 300), "", true, &["1 people"]),
        (film(0.02, 150), "", true, &["is odd: people move at 0.20 m/s as a rule", "fps"]),
        (
            "0 1 1 3\n1 1 5 3\n2 1 1 3\n3 1 5 3\n".to_owned(),
            "",
            true,
            &["is odd: person 1 moves at 40.0 m/s at "],
        ),
        (film(1.3, 4), "", true, &["is odd: person 1 moves at 13.0 m/s", "as a rule"]),
    ] {
        let room = Room::new();
        room.put("f.txt", film);
        room.put("room.toml", format!("{SCENARIO}[[recorded]]\nfile = \"f.txt\"\n{FILM}{more}"));
        let (fine, said) = room.check();
        assert_eq!(fine, is_fine, "{said}");
        words.iter().for_each(|word| assert!(said.contains(word), "no `{word}` in: {said}"));
    }
}

/// So many people who stand in a corner, and so many on film.
fn many(walkers: usize, recorded: u32) -> Room {
    let room = Room::new();
    let standing = "[[walkers]]\nroute = [[1.0, 1.0]]\nmode = \"stand\"\n".repeat(walkers);
    let filmed: String = (0..recorded).map(|id| format!("0 {id} 3 3\n10 {id} 3.5 3\n")).collect();
    room.put("f.txt", filmed);
    let film = if recorded > 0 { format!("[[recorded]]\nfile = \"f.txt\"\n{FILM}") } else { String::new() };
    room.put("room.toml", format!("{SCENARIO}{standing}{film}"));
    room
}

#[test]
fn a_world_has_at_most_1024_people() {
    many(1000, 24).assert_checked(true, &["1000 walkers"]);
    many(1000, 25).assert_checked(false, &["recorded: are 1025 people in all", "at most 1024"]);
    many(0, 1100).assert_checked(false, &["recorded: are 1100 people in all"]);
    many(1001, 0).assert_checked(false, &["1000"]);
}

#[test]
fn nobody_stands_in_the_robot_at_its_start() {
    let standing = |x: f64| format!("[[walkers]]\nroute = [[{x}, 2.0]]\nmode = \"stand\"\n");
    let walking = "[[walkers]]\nroute = [[1.0, 2.0], [3.0, 2.0]]\n".to_owned();
    let noisy = SCENARIO.replace("start_noise = 0.0", "start_noise = 0.5");
    for (scenario, people, is_fine) in [
        (SCENARIO, standing(1.0), false),
        (SCENARIO, standing(1.5), false),
        (SCENARIO, standing(1.6), true),
        (SCENARIO, walking.clone(), false),
        // The robot does not know that it stands elsewhere.
        (&noisy, standing(1.0), false),
        // Its true start is drawn where no person is.
        (&noisy, walking, true),
    ] {
        let room = Room::new();
        room.put("room.toml", format!("{scenario}{people}"));
        let words: &[&str] = if is_fine { &[] } else { &["walkers[0]: stands in the robot at its start"] };
        room.assert_checked(is_fine, words);
    }
}

#[test]
fn numbers_that_a_message_names_are_taken() {
    for (from, to, more) in [
        ("", "", "[laser]\nfov = 6.2832\nbeams = 360\n"),
        ("[1.0, 2.0, 0.0]", "[1.0, 2.0, -6.2832]", ""),
        ("goal = [5.0, 2.0]", "goal = [5.0, 2.0]\ngoal_heading = 6.2832", ""),
    ] {
        let room = Room::new();
        room.put("room.toml", format!("{}{more}", SCENARIO.replacen(from, to, 1)));
        room.assert_checked(true, &["fine"]);
        assert_eq!(run(&room.path("room.toml"), &[]).1, 0, "{to}{more}");
    }
    let room = Room::new();
    room.put("room.toml", format!("{SCENARIO}[laser]\nfov = 6.29\n"));
    room.assert_checked(false, &["laser.fov: is 6.29; give 0.01 to 6.2832 rad"]);
}

/// A wall with a door across the room, in cells of 0.05 m.
fn door(cells: usize) -> Vec<u8> {
    let (width, height) = (120, 80);
    let first = (height - cells) / 2;
    let grey = |i: usize| {
        let (x, y) = (i % width, i / width);
        let is_wall = x == 0 || y == 0 || x == width - 1 || y == height - 1;
        let is_door = (first..first + cells).contains(&y);
        if is_wall || ((60..62).contains(&x) && !is_door) { 0 } else { 254 }
    };
    let pixels: Vec<u8> = (0..width * height).map(grey).collect();
    [format!("P5\n{width} {height}\n255\n").into_bytes(), pixels].concat()
}

#[test]
fn a_door_is_passed_or_said_to_be_too_narrow() {
    let room = Room::new();
    room.put("room.yaml", YAML.replace("resolution: 0.1", "resolution: 0.05"));
    // The robot has 0.6 m, and 0.03 m are kept on both sides.
    for (cells, is_narrow) in [(13, true), (14, false), (16, false), (20, false)] {
        room.put("room.pgm", door(cells));
        let (fine, said) = room.check();
        assert!(fine && said.contains("the way is too narrow for this robot") == is_narrow, "{said}");
        if is_narrow {
            assert!(said.contains(", and planners need 0.66 m"), "{said}");
        } else {
            assert_eq!(run(&room.path("room.toml"), &[]).1, 0, "{said}");
        }
    }
    room.put("room.pgm", door(13));
    room.assert_checked(true, &["the way is too narrow", "about 0.65 m at"]);
    room.put("room.pgm", door(11));
    room.assert_checked(false, &["robot.goal: cannot be reached"]);
}

/// The command fails at once with this status and one line with each of `words`, without a place in any source.
#[track_caller]
fn assert_refused(arguments: &[&str], words: &[&str]) {
    let output = curionav(arguments);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
    assert!(error.lines().count() == 1 && !error.contains(".rs:"), "{arguments:?}: {error}");
    words.iter().for_each(|word| assert!(error.contains(word), "{arguments:?}: no `{word}` in: {error}"));
}

#[test]
fn endpoints_and_namespaces_are_refused_with_the_right_form() {
    let right = "give tcp/127.0.0.1:7447";
    for endpoint in ["127.0.0.1:7447", "tcp/127.0.0.1", "tcp://127.0.0.1:7447", "tcp/127.0.0.1:99999"] {
        for command in
            [&["status"][..], &["cpc"], &["goal", "r1", "1", "1"], &["run", "quickstart"], &["doctor"]]
        {
            assert_refused(&[command, &["--connect", endpoint]].concat(), &[endpoint, right]);
        }
        assert_refused(&["router", "--listen", endpoint], &[endpoint, right]);
    }
    for (namespace, mend) in [("/hall", "give hall"), ("hall/*", "give hall"), ("a//b", "give a/b")] {
        assert_refused(&["status", "--namespace", namespace], &[namespace, mend]);
        assert_refused(&["driver", "--simulated-base", "--namespace", namespace], &[namespace, mend]);
        let deployment = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
        std::fs::write(deployment.path(), format!("namespace = \"{namespace}\"\n")).unwrap();
        assert_refused(&["up", deployment.path().to_str().unwrap()], &[namespace, mend]);
    }
}

#[test]
fn what_cannot_be_written_is_told_before_the_run() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let below_a_file = file.path().join("out");
    let below_a_file = below_a_file.to_str().unwrap();
    for (option, path) in
        [("--out", "/proc/nothing"), ("--out", below_a_file), ("--record", "/proc/nothing.mcap")]
    {
        assert_refused(&["run", "scenarios/quickstart.toml", option, path], &[path]);
    }
    assert_refused(&["bench", "dense", "--out", below_a_file], &["--out", below_a_file]);
}

#[test]
fn certificates_are_for_hosts() {
    let folder = tempfile::tempdir().unwrap();
    let pki = folder.path().join("pki");
    let pki = pki.to_str().unwrap();
    assert!(curionav(&["secure", "init", pki]).status.success());
    for (address, mend) in [
        ("10.0.0.1:7447", "give 10.0.0.1"),
        ("*", "give such as"),
        ("tls/hall.example:7447", "give hall.example"),
        ("[::1]:7447", "give ::1"),
    ] {
        assert_refused(&["secure", "issue", pki, "router", "--address", address], &[address, mend]);
        assert!(!Path::new(pki).join("router.pem").exists());
    }
    assert!(curionav(&["secure", "issue", pki, "router", "--address", "::1"]).status.success());
}

#[test]
fn a_goal_that_cannot_be_is_refused_with_the_reason() {
    let _turn = turn();
    for (arguments, words) in [
        (["goal", "robot", "1", "1", "90"], ["yaw: is 90", "-6.2832 to 6.2832 rad"]),
        (["goal", "robot", "1", "1", "-6.3"], ["yaw: is -6.3", "degrees"]),
        (["goal", "robot", "1e9", "1", "0"], ["x: is 1000000000", "-1e7 to 1e7 m"]),
        (["goal", "robot", "nan", "1", "0"], ["x: is NaN", "-1e7 to 1e7 m"]),
    ] {
        assert_refused(&arguments, &words);
    }
    let deployment = Deployment::start(1);
    let at = ["--connect", deployment.endpoint()];
    let ran = curionav(&[&["run", "scenarios/quickstart.toml"][..], &at].concat());
    assert!(ran.status.success(), "{ran:?}");
    for (x, y) in [("100", "100"), ("-3.5", "2"), ("5", "1e6")] {
        let refused = curionav(&[&["goal", "robot", x, y][..], &at].concat());
        let error = String::from_utf8(refused.stderr).unwrap();
        assert_eq!(refused.status.code(), Some(1), "{x}, {y}: {error}");
        assert!(
            error.contains("the goal is refused: arbiter") && error.contains("cannot be reached"),
            "{error}"
        );
    }
    let taken = curionav(&[&["goal", "robot", "4", "4", "6.2832"][..], &at].concat());
    assert!(taken.status.success(), "{taken:?}");
}
