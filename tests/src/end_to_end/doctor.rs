//! `curionav doctor` against deployments that are whole, and that are not.

use std::net::TcpListener;

use serde_json::Value;

use super::program::{
    Deployment, SLOW, Serving, comes_true, curionav, run, signal, turn, wait_until_running,
};

const QUICK: &str = "scenarios/quickstart.toml";

/// Exit status and report.
fn doctor(endpoint: &str, more: &[&str]) -> (i32, Value) {
    doctor_that_listens("0.5", endpoint, more)
}

/// The same, with seconds to listen to each stream.
fn doctor_that_listens(seconds: &str, endpoint: &str, more: &[&str]) -> (i32, Value) {
    let arguments = [&["doctor", "--json", "--connect", endpoint, "--listen", seconds], more].concat();
    let output = curionav(&arguments);
    let text = String::from_utf8(output.stdout).unwrap();
    let json = serde_json::from_str(&text)
        .unwrap_or_else(|e| panic!("{e}: `{text}` {}", String::from_utf8_lossy(&output.stderr)));
    (output.status.code().unwrap(), json)
}

/// The findings whose link begins so.
fn of<'a>(report: &'a Value, link: &str) -> Vec<&'a Value> {
    let findings = report["findings"].as_array().unwrap();
    findings.iter().filter(|f| f["link"].as_str().unwrap().starts_with(link)).collect()
}

#[test]
fn a_whole_deployment_is_proven_link_by_link() {
    let _turn = turn();
    let deployment = Deployment::start(2);
    let (status, report) = doctor(deployment.endpoint(), &[]);
    assert_eq!((status, &report["ok"]), (0, &Value::Bool(true)), "{report:#}");
    let names = ["generator generator-0", "generator generator-1", "cpc cpc-0", "cpc cpc-1", "cnc cnc-0"];
    let more = ["cnc cnc-1", "driver driver-0", "localizer localizer-0", "arbiter arbiter-0", "simulator"];
    for link in names.into_iter().chain(more).chain(["router tcp/"]) {
        let finding = of(&report, link)[0];
        assert_eq!(finding["verdict"], "proven", "{finding:#}");
        assert!(finding["round_trip_ms"].as_f64() > Some(0.0) && finding["bytes"].as_u64() > Some(100));
        // One machine has one clock, which is compared no better than a question takes.
        let off = finding["clock_offset_ms"].as_f64().unwrap_or(0.0).abs();
        assert!(off < 1000.0 + finding["round_trip_ms"].as_f64().unwrap(), "{finding:#}");
    }
    assert_eq!(of(&report, "arbiter arbiter-0: control session")[0]["verdict"], "proven");
    assert_eq!(of(&report, "driver driver-0: control session")[0]["verdict"], "proven");
    assert_eq!(of(&report, "mission of robot")[0]["verdict"], "note");

    // While a run is on: mission, map and every stream as well.
    let endpoint = deployment.endpoint().to_owned();
    let running =
        std::thread::spawn(move || curionav(&["run", QUICK, "--connect", &endpoint, "--speed", SLOW]));
    wait_until_running(deployment.endpoint());
    // At this speed 1.5 s pass between two decisions.
    let (status, report) = doctor_that_listens("4", deployment.endpoint(), &[]);
    assert_eq!(status, 0, "{report:#}");
    for stream in ["scan", "odom", "people", "belief", "decision", "cmd", "mission", "map"] {
        let finding = of(&report, &format!("{stream} of robot"))[0];
        assert_eq!(finding["verdict"], "proven", "{finding:#}");
    }
    assert!(of(&report, "cpc cpc-0")[0]["detail"].as_str().unwrap().contains("ready for the mission"));
    assert!(curionav(&["cancel", "robot", "--connect", deployment.endpoint()]).status.success());
    running.join().unwrap();

    // Cancelled, and its map gone with the simulator, which has served it: nothing is missing.
    deployment.kill("simulator-0");
    let is_noted = || {
        let (status, report) = doctor(deployment.endpoint(), &[]);
        status == 0 && of(&report, "map of robot").iter().any(|finding| finding["verdict"] == "note")
    };
    assert!(comes_true(is_noted), "{:#}", doctor(deployment.endpoint(), &[]).1);
}

#[test]
fn robots_with_different_planners_need_not_ask_the_same_of_a_pool() {
    let _turn = turn();
    let deployment = Deployment::start(1);
    let at = ["--connect", deployment.endpoint()];
    let _other = ["driver", "localizer", "arbiter", "simulator"].map(|role| {
        let simulated = if role == "driver" { &["--simulated-base"][..] } else { &[] };
        let named = [role, "--robot", "a", "--world", "a", "--instance", "a"];
        Serving::start(&[&named[..], simulated, &at[..]].concat())
    });
    // The first in the alphabet has no use for CPC, the other one has.
    let seed = ["--seed", "1000"];
    let with_cnc_alone = ["--robot", "a", "--world", "a", "--planner", "cnc-only"];
    for planner in [&with_cnc_alone[..], &[]] {
        assert_eq!(run(QUICK, &[planner, &seed, &at].concat()).1, 0);
    }
    let (status, report) = doctor(deployment.endpoint(), &[]);
    assert_eq!(status, 0, "{report:#}");
    for pool in ["cpc cpc-0", "cnc cnc-0", "generator generator-0"] {
        assert!(of(&report, pool)[0]["detail"].as_str().unwrap().contains("ready for the mission"));
    }
}

#[test]
fn what_is_missing_is_named_with_the_command_that_mends_it() {
    let _turn = turn();
    let router = Serving::start(&["router", "--listen", "tcp/127.0.0.1:0"]);
    let (status, report) = doctor(router.endpoint(), &["--robot", "r7"]);
    assert_eq!((status, &report["ok"]), (1, &Value::Bool(false)));
    for (link, command) in [
        ("driver of robot r7", "curionav driver"),
        ("localizer of robot r7", "curionav localizer"),
        ("arbiter of robot r7", "curionav arbiter"),
        ("trajectory generator", "curionav generator"),
        ("evaluator of the term cpc", "curionav cpc"),
        ("evaluator of the term cnc", "curionav cnc"),
    ] {
        let finding = of(&report, link)[0];
        let fix = finding["fix"].as_str().unwrap();
        assert_eq!(finding["verdict"], "missing", "{finding:#}");
        assert!(fix.contains(command) && fix.contains(router.endpoint()), "{fix}");
        // What it says can be typed: everything after the first word, as it stands.
        let line: Vec<&str> = fix.split("curionav ").nth(1).unwrap().split(' ').collect();
        assert!(curionav(&[&line[..], &["--help"]].concat()).status.success(), "{fix}");
    }
    let words = curionav(&["doctor", "--connect", router.endpoint(), "--listen", "0.1"]);
    let words = String::from_utf8(words.stdout).unwrap();
    assert!(words.lines().last().unwrap().starts_with("6 things are missing: driver"), "{words}");
    let status = String::from_utf8(curionav(&["status", "--connect", router.endpoint()]).stdout).unwrap();
    assert!(status.contains("missing: evaluator of the term cnc; start it: curionav cnc"), "{status}");
}

#[test]
fn a_service_that_hangs_is_found_and_one_that_is_back_is_well() {
    let _turn = turn();
    let deployment = Deployment::start(1);
    signal("STOP", deployment.pid("cpc-0"));
    let (status, report) = doctor(deployment.endpoint(), &[]);
    signal("CONT", deployment.pid("cpc-0"));
    // Its token lasts for a second: then there is no such service; until then, it is one that does not answer.
    let found = [of(&report, "cpc cpc-0"), of(&report, "evaluator of the term cpc")].concat();
    assert!(status == 1 && found.iter().any(|f| f["verdict"] == "missing"), "{report:#}");
    assert!(comes_true(|| doctor(deployment.endpoint(), &[]).0 == 0));
}

#[test]
fn two_of_one_name_are_told_apart_from_one() {
    let _turn = turn();
    let router = Serving::start(&["router", "--listen", "tcp/127.0.0.1:0"]);
    let arguments = ["cpc", "--connect", router.endpoint(), "--instance", "twin"];
    let _both = [Serving::start(&arguments), Serving::start(&arguments)];
    let (_, report) = doctor(router.endpoint(), &[]);
    let finding = of(&report, "cpc twin: name")[0];
    assert!(finding["fix"].as_str().unwrap().contains("--instance"), "{finding:#}");
}

#[test]
fn without_a_router_it_says_so_with_status_3_and_a_wrong_name_is_bad_input() {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let (status, report) = doctor(&format!("tcp/127.0.0.1:{port}"), &[]);
    assert_eq!((status, &report["ok"]), (3, &Value::Bool(false)));
    assert!(of(&report, "router")[0]["fix"].as_str().unwrap().contains("curionav router"));
    let output = curionav(&["doctor", "--robot", "R/1"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(output.stdout.is_empty());
}
