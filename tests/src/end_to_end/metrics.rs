//! What operators read: the same numbers over HTTP and over Zenoh, and every one of them documented.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::unix::net::UnixDatagram;
use std::process::Stdio;
use std::time::Duration;

use super::program::{Deployment, LIMIT, Serving, comes_true, command, curionav, run, signal, turn};
use crate::deploy_files::documented_metrics;

const QUICK: &str = "scenarios/quickstart.toml";

/// Status line and body of what is said at `path`.
fn get(address: SocketAddr, path: &str) -> (String, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    let (head, body) = text.split_once("\r\n\r\n").unwrap();
    (head.lines().next().unwrap().to_owned(), body.to_owned())
}

/// Samples by name and labels.
fn samples(text: &str) -> BTreeMap<String, f64> {
    let sample = |line: &str| {
        let (name, value) = line.rsplit_once(' ').unwrap();
        (name.to_owned(), value.parse().unwrap())
    };
    text.lines().filter(|l| !l.starts_with('#')).map(sample).collect()
}

/// The number of a metric of which there is one.
fn number(samples: &BTreeMap<String, f64>, metric: &str) -> f64 {
    let prefix = format!("{metric}{{");
    samples.iter().filter(|(name, _)| name.starts_with(&prefix)).map(|s| s.1).sum()
}

#[test]
fn over_http_and_over_zenoh_the_numbers_are_the_same_and_all_are_documented() {
    let _turn = turn();
    let deployment = Deployment::start(1);
    let cycles = run(QUICK, &["--connect", deployment.endpoint()]).0.cycles.count as f64;
    let mut families = BTreeSet::new();
    let mut asked = 0;
    for (name, address) in deployment.metrics() {
        let before = samples(&get(address, "/metrics").1);
        let status = curionav(&["status", "--json", "--connect", deployment.endpoint()]);
        let (line, text) = get(address, "/metrics");
        let after = samples(&text);
        assert_eq!(line, "HTTP/1.1 200 OK");
        assert!(text.ends_with("# EOF\n"));
        let status: serde_json::Value = serde_json::from_slice(&status.stdout).unwrap();
        let service = status["services"].as_array().unwrap().iter().find(|s| s["instance"] == name).unwrap();
        let key: BTreeMap<String, f64> =
            serde_json::from_value(service["status"]["metrics"].clone()).unwrap();
        assert!(key.keys().eq(after.keys()), "{name}: {key:?}\n{after:?}");
        for (sample, number) in &key {
            // Uptime and ages go on between two questions.
            let (low, high) = (before[sample].min(after[sample]), before[sample].max(after[sample]));
            // JSON rounds the last digit.
            let (low, high) = (low - 1e-12 * low.abs(), high + 1e-12 * high.abs());
            assert!((low..=high).contains(number), "{name}: {sample} is {number}, not in {low}..{high}");
        }
        let requests = number(&key, "curionav_requests_total");
        assert_eq!(Some(requests), service["status"]["requests"].as_f64(), "{name}");
        // A tracker has nothing to do where the truth about people is published.
        assert_eq!(requests > 0.0, !name.starts_with("tracker"), "{name}: {requests} answered");
        match name.split('-').next().unwrap() {
            "arbiter" => {
                // Every cycle of the run ended in a decision.
                assert!(number(&key, "curionav_decisions_total") >= cycles, "{key:?}");
                assert_eq!(number(&key, "curionav_pool_ready"), 3.0);
                assert!(number(&key, "curionav_pool_questions_total") > cycles, "{key:?}");
                assert_eq!(number(&key, "curionav_router_links"), 2.0);
            }
            "driver" => assert!(number(&key, "curionav_commands_total") > cycles),
            "cpc" | "cnc" | "generator" => assert!(number(&key, "curionav_candidates_total") > 0.0),
            _ => {}
        }
        families.extend(
            text.lines().filter_map(|l| Some(l.strip_prefix("# TYPE ")?.split(' ').next()?.to_owned())),
        );
        asked += 1;
    }
    assert_eq!(asked, 8);
    // A counter's samples end in `_total`, the counter does not.
    let documented: BTreeSet<String> = documented_metrics()
        .into_iter()
        .map(|name| name.strip_suffix("_total").unwrap_or(&name).to_owned())
        .collect();
    // These have no sample until something has gone wrong.
    families.extend(["curionav_degraded", "curionav_pool_failures"].map(String::from));
    // The gateway's own: there is none in this deployment.
    families.extend(documented.iter().filter(|name| name.starts_with("curionav_ros2_")).cloned());
    assert_eq!(families, documented, "docs/running.md and the services disagree");
}

#[test]
fn probes_hear_whether_a_service_lives_and_is_ready() {
    let _turn = turn();
    let router = Serving::start(&["router", "--listen", "tcp/127.0.0.1:0"]);
    let cpc = Serving::start(&[
        "cpc",
        "--connect",
        router.endpoint(),
        "--instance",
        "probed",
        "--metrics",
        "127.0.0.1:0",
    ]);
    let status = |path| get(cpc.metrics(), path).0;
    assert_eq!(status("/livez"), "HTTP/1.1 200 OK");
    assert_eq!(status("/readyz"), "HTTP/1.1 200 OK");
    assert_eq!(status("/elsewhere"), "HTTP/1.1 404 Not Found");
    drop(router);
    let unready = || get(cpc.metrics(), "/readyz").0 == "HTTP/1.1 503 Service Unavailable";
    assert!(comes_true(unready));
    assert_eq!(status("/livez"), "HTTP/1.1 200 OK");
}

#[test]
fn a_bad_address_is_refused_before_any_router_is_looked_for() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let said = |arguments: &[&str]| {
        let output = curionav(arguments);
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (status, error) = said(&["cpc", "--connect", "tcp/127.0.0.1:9", "--metrics", &address]);
    assert!(status == Some(2) && error.contains(&address) && error.contains("choose another"), "{error}");
    let (status, error) = said(&["cpc", "--metrics", "9100"]);
    assert!(status == Some(2) && error.contains("--metrics <ADDR:PORT>"), "{error}");
    let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
    std::fs::write(file.path(), "slots = 1\nmetrics = \"everywhere\"\n").unwrap();
    let (status, error) = said(&["cpc", "--config", file.path().to_str().unwrap()]);
    assert!(status == Some(2) && error.contains("line 2") && error.contains("metrics"), "{error}");
}

#[test]
fn a_service_manager_is_told_that_a_process_is_ready_and_then_that_it_works() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("notify");
    let manager = UnixDatagram::bind(&path).unwrap();
    manager.set_read_timeout(Some(LIMIT)).unwrap();
    let mut router = command(&["router", "--listen", "tcp/127.0.0.1:0"])
        .env("NOTIFY_SOCKET", &path)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut told = [0; 64];
    for expected in ["READY=1", "WATCHDOG=1", "WATCHDOG=1"] {
        let length = manager.recv(&mut told).unwrap();
        assert_eq!(std::str::from_utf8(&told[..length]), Ok(expected));
    }
    signal("STOP", router.id());
    while manager.set_read_timeout(Some(Duration::from_secs(3))).is_ok() && manager.recv(&mut told).is_ok() {}
    signal("CONT", router.id());
    manager.set_read_timeout(Some(LIMIT)).unwrap();
    assert!(manager.recv(&mut told).is_ok(), "it works again, and says so");
    router.kill().unwrap();
    router.wait().unwrap();
}

#[test]
fn strangers_that_say_nothing_keep_no_probe_out() {
    let _turn = turn();
    let router = Serving::start(&["router", "--listen", "tcp/127.0.0.1:0"]);
    let metrics = ["--metrics", "127.0.0.1:0"];
    let service = Serving::start(&[&["cnc", "--connect", router.endpoint()], &metrics[..]].concat());
    let idle: Vec<TcpStream> = (0..100).map(|_| TcpStream::connect(service.metrics()).unwrap()).collect();
    assert_eq!(get(service.metrics(), "/livez").1, "alive\n");
    drop(idle);
}
