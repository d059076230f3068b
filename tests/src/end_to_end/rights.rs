//! One who may command some robots alone: every command works for these and no other, and logs say who it was.

use std::fs::File;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use curionav_security::name::Name;
use serde_json::Value;

use super::program::{
    Serving, comes_true, command, curionav, ready_line, signal, turn, wait, wait_until_running_at,
};
use crate::certificates::issued;

const QUICK: &str = "scenarios/quickstart.toml";
/// Within it a recorder ends that is asked to.
const ENDS: Duration = Duration::from_secs(20);

/// A process whose log is kept.
struct Logged {
    child: Child,
}

impl Logged {
    fn start(arguments: &[&str], log: &Path) -> Self {
        let log = File::create(log).unwrap();
        let mut child = command(arguments).stdout(Stdio::piped()).stderr(log).spawn().unwrap();
        ready_line(child.stdout.take().unwrap()).unwrap();
        Self { child }
    }
}

impl Drop for Logged {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn listing(name: &str, robots: &[&str]) -> Name {
    let robots: Vec<String> = robots.iter().map(|&robot| robot.to_owned()).collect();
    name.parse::<Name>().unwrap().for_robots(&robots).unwrap()
}

/// What the machine of one person has of the deployment's folder.
fn copied(from: &Path, name: &str) -> tempfile::TempDir {
    let place = tempfile::tempdir().unwrap();
    for file in ["ca.pem".to_owned(), format!("{name}.pem"), format!("{name}.key")] {
        std::fs::copy(from.join(&file), place.path().join(&file)).unwrap();
    }
    place
}

/// The robot `robot` with everything that it needs, over TLS.
struct Ward {
    pki: tempfile::TempDir,
    logs: tempfile::TempDir,
    router: Serving,
    _logged: Vec<Logged>,
    _others: Vec<Serving>,
}

impl Ward {
    fn start() -> Self {
        let services =
            ["router", "driver.robot", "localizer.robot", "arbiter.robot", "simulator.world.robot"];
        let pools = ["generator.a", "cpc.a", "cnc.a", "experimenter", "operator.elsewhere"];
        let names = services.iter().chain(&pools).map(|name| name.parse().unwrap());
        let ward = [listing("operator.ward", &["robot", "r2"]), listing("viewer.ward", &["robot", "r2"])];
        let pki = issued(names.chain(ward), &[]);
        let logs = tempfile::tempdir().unwrap();
        let secure = ["--secure", pki.path().to_str().unwrap()];
        let router = Serving::start(&[&["router", "--listen", "tls/127.0.0.1:0"], &secure[..]].concat());
        let at = ["--connect", router.endpoint(), secure[0], secure[1]];
        let service = |role: &str, instance: &str, more: &[&str]| {
            Serving::start(&[&[role, "--instance", instance], &at[..], more].concat())
        };
        let logged = |role: &str, more: &[&str]| {
            let arguments = [&[role, "--instance", "robot"], &at[..], more].concat();
            Logged::start(&arguments, &logs.path().join(role))
        };
        let _logged = vec![logged("simulator", &[]), logged("driver", &["--simulated-base"])];
        let of_robot = ["localizer", "arbiter"].map(|role| service(role, "robot", &[]));
        let pools = ["generator", "cpc", "cnc"].map(|role| service(role, "a", &[]));
        let _others = of_robot.into_iter().chain(pools).collect();
        Self { pki, logs, router, _logged, _others }
    }

    /// The arguments of one who has the certificate `name` alone.
    fn at<'a>(&'a self, folder: &'a tempfile::TempDir) -> [&'a str; 4] {
        ["--connect", self.router.endpoint(), "--secure", folder.path().to_str().unwrap()]
    }

    fn log_of(&self, role: &str) -> String {
        std::fs::read_to_string(self.logs.path().join(role)).unwrap()
    }
}

fn denied(at: &[&str]) -> Value {
    let output = curionav(&[&["status", "--json"], at].concat());
    serde_json::from_slice::<Value>(&output.stdout).unwrap()["denied"].clone()
}

#[test]
fn who_may_command_some_robots_commands_these_with_every_command_and_the_logs_say_who_it_was() {
    let _turn = turn();
    let ward = Ward::start();
    let operator = copied(ward.pki.path(), "operator.ward");
    let viewer = copied(ward.pki.path(), "viewer.ward");
    let elsewhere = copied(ward.pki.path(), "operator.elsewhere");
    let at = ward.at(&operator);
    let say = |what: &[&str]| {
        let output = curionav(&[what, &at[..]].concat());
        (
            output.status.code(),
            String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr),
        )
    };
    let well = || say(&["doctor", "--listen", "0.1", "--robot", "robot"]).0 == Some(0);
    assert!(comes_true(well), "{:?}", say(&["doctor", "--listen", "0.1", "--robot", "robot"]));
    assert_eq!(say(&["goal", "robot", "3", "3"]).0, Some(1), "there is no mission yet");
    let experimenter = ["--connect", ward.router.endpoint(), "--secure", ward.pki.path().to_str().unwrap()];
    let run = [&["run", QUICK, "--speed", "0.5"], &experimenter[..]].concat();
    let mut run = command(&run).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    wait_until_running_at(&at);
    assert_eq!(say(&["pause", "robot"]).0, Some(0));
    assert_eq!(say(&["resume", "robot"]).0, Some(0));
    assert_eq!(say(&["stop", "robot"]).0, Some(0));
    let status = say(&["status"]);
    assert!(status.0 == Some(0) && status.1.contains("driver"), "{status:?}");
    let seen = curionav(&[&["status"], &ward.at(&viewer)[..]].concat());
    assert!(String::from_utf8_lossy(&seen.stdout).contains("driver"), "{seen:?}");
    let explained = say(&["resume", "robot"]);
    assert_eq!(explained.0, Some(0), "{explained:?}");
    assert_eq!(say(&["explain", "--robot", "robot"]).0, Some(0));
    let file = viewer.path().join("drive.mcap");
    let arguments = [&["record", file.to_str().unwrap()], &ward.at(&viewer)[..]].concat();
    let mut recorder = command(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    assert!(comes_true(|| std::fs::metadata(&file).is_ok_and(|file| file.len() > 100_000)));
    signal("INT", recorder.id());
    assert!(wait(&mut recorder, ENDS).is_some_and(|status| status.success()));
    assert_eq!(say(&["cancel", "robot"]).0, Some(0));
    let _ = run.wait();
    assert_eq!(denied(&experimenter), Value::Array(Vec::new()), "nothing that is needed is denied");

    // Not another robot, and not with another's certificate.
    let refused = say(&["pause", "r3"]);
    assert!(refused.0 == Some(2) && refused.1.contains("`operator.ward` may not ask"), "{refused:?}");
    let foreign = curionav(&[&["pause", "robot"], &ward.at(&elsewhere)[..]].concat());
    assert_eq!(foreign.status.code(), Some(2), "{foreign:?}");

    let driver = ward.log_of("driver");
    for line in [
        "operator.ward: a goal at (3.00, 3.00): refused: the robot has no mission yet",
        "simulator.world.robot: a mission to (",
        "operator.ward: pause: the driver obeys",
        "operator.ward: go on: the driver obeys",
        "operator.ward: cancel: revision",
    ] {
        assert!(driver.contains(line), "{line} is not in {driver}");
    }
    assert!(!driver.contains("says it is"), "{driver}");
    let base = ward.log_of("simulator");
    assert!(base.contains("driver.robot: driver `robot` wishes to drive: lease"), "{base}");
    assert!(base.contains("operator.ward: pause: the base obeys"), "{base}");
}
