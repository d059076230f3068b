//! Certificates that expire while a robot drives, with files as systemd hands them to its units.

use std::path::Path;
use std::time::{Duration, SystemTime};

use curionav_security::folder::{Folder, days};
use curionav_security::name::Name;

use super::program::{SLOW, Serving, command, is_alive, run, turn, wait_until_running_at};
use crate::certificates::issued;

const QUICK: &str = "scenarios/quickstart.toml";
/// How long the first certificates are valid. The run takes longer: fourteen seconds of the robot's time, at
/// [`SLOW`].
const SHORT: Duration = Duration::from_secs(40);
const OF_ROBOT: [&str; 4] = ["driver", "localizer", "arbiter", "simulator"];
const OF_POOL: [(&str, &str); 3] = [("generator", "g"), ("cpc", "a"), ("cnc", "a")];

/// Copies what ends in `extension`.
fn copy(from: &Path, to: &Path, extension: &str) {
    for entry in std::fs::read_dir(from).unwrap() {
        let file = entry.unwrap().path();
        if file.extension().is_some_and(|found| found == extension) {
            // As a whole: a program may read it at any moment.
            let new = to.join("new");
            std::fs::copy(&file, &new).unwrap();
            std::fs::rename(&new, to.join(file.file_name().unwrap())).unwrap();
        }
    }
}

#[test]
fn a_mission_goes_on_while_the_certificates_of_all_services_expire() {
    let _turn = turn();
    let services = ["driver.robot", "localizer.robot", "arbiter.robot", "simulator.world.robot"];
    let services: Vec<Name> =
        services.iter().chain(&["generator.g", "cpc.a", "cnc.a"]).map(|name| name.parse().unwrap()).collect();
    let others = ["router", "experimenter"].map(|name| name.parse().unwrap());
    let authority = issued(services.iter().cloned().chain(others), &[]);
    // What a machine has: certificates for all to read, and keys that systemd hands out when a unit starts.
    let machine = tempfile::tempdir().unwrap();
    let handed = tempfile::tempdir().unwrap();
    copy(authority.path(), machine.path(), "pem");
    copy(authority.path(), machine.path(), "json");
    copy(authority.path(), handed.path(), "key");
    std::fs::remove_file(handed.path().join("ca.key")).unwrap();
    let here = Folder::new(authority.path());
    let at_authority = ["--secure", authority.path().to_str().unwrap()];
    let router = Serving::start(&[&["router", "--listen", "tls/127.0.0.1:0"], &at_authority[..]].concat());
    services.iter().for_each(|name| here.renew(name, SHORT).unwrap());
    let ends = SystemTime::now() + SHORT;
    copy(authority.path(), machine.path(), "pem");

    let secure = ["--secure", machine.path().to_str().unwrap()];
    let start = |(role, instance): (&str, &str)| {
        let base: &[&str] = if role == "driver" { &["--simulated-base"] } else { &[] };
        let named = [role, "--connect", router.endpoint(), "--instance", instance];
        let mut command = command(&[&named, &secure[..], base].concat());
        command.env("CREDENTIALS_DIRECTORY", handed.path());
        Serving::start_by(command)
    };
    let started: Vec<Serving> =
        OF_ROBOT.map(|role| (role, "robot")).into_iter().chain(OF_POOL).map(start).collect();
    let at: Vec<String> =
        ["--connect", router.endpoint()].iter().chain(&at_authority).map(|&text| text.to_owned()).collect();
    let driving = std::thread::spawn({
        let at = at.clone();
        move || {
            let at: Vec<&str> = at.iter().map(String::as_str).collect();
            run(QUICK, &[&at[..], &["--speed", SLOW]].concat())
        }
    });
    wait_until_running_at(&at.iter().map(String::as_str).collect::<Vec<_>>());
    services.iter().for_each(|name| here.renew(name, days(1)).unwrap());
    copy(authority.path(), machine.path(), "pem");
    assert!(SystemTime::now() < ends, "too slow to renew in time");

    let (result, status) = driving.join().unwrap();
    println!(
        "{} after {:?} with the new certificates",
        result.outcome,
        SystemTime::now().duration_since(ends)
    );
    assert_eq!((status, result.outcome.as_str()), (0, "reached"), "{result:?}");
    assert!(SystemTime::now() > ends, "over before the certificates expired");
    assert!(started.iter().all(|service| is_alive(service.pid())), "a service was restarted");
}
