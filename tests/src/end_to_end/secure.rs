//! Deployments over TLS with certificates and access rules: they do the same, and nothing else gets in.

use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::session;
use curionav_schemas::keys;
use curionav_security::folder::{Folder, days};
use curionav_security::name::Name;
use serde_json::Value;
use zenoh::Wait;

use super::program::{Deployment, Serving, comes_true, command, curionav, is_alive, run, turn};
use crate::certificates::issued;

const QUICK: &str = "scenarios/quickstart.toml";

fn json(arguments: &[&str]) -> Value {
    let output = curionav(arguments);
    let text = String::from_utf8(output.stdout).unwrap();
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)))
}

/// Questions to replicas, as the arbiter counts them.
fn questions_to_pools(at: &[&str]) -> f64 {
    let status = json(&[&["status", "--json"], at].concat());
    let of_arbiter = |service: &&Value| service["status"]["role"] == "arbiter";
    let arbiter = status["services"].as_array().unwrap().iter().find(of_arbiter).unwrap();
    let metrics = arbiter["status"]["metrics"].as_object().unwrap();
    let asked = metrics.iter().filter(|(name, _)| name.starts_with("curionav_pool_questions_total"));
    asked.map(|(_, count)| count.as_f64().unwrap()).sum()
}

/// A folder with certificates of these names.
fn folder(names: &[&str]) -> tempfile::TempDir {
    issued(names.iter().map(|name| name.parse().unwrap()), &[])
}

#[test]
fn over_tls_the_decisions_are_the_same_and_nothing_that_is_needed_is_denied() {
    let _turn = turn();
    let expected = run(QUICK, &[]).0;
    let place = tempfile::tempdir().unwrap();
    let (pki, recording) = (place.path().join("pki"), place.path().join("drive.mcap"));
    let secure = ["--secure", pki.to_str().unwrap()];
    let deployment = Deployment::start_with(2, &secure);
    assert!(deployment.endpoint().starts_with("tls/"));
    let at = [&["--connect", deployment.endpoint()], &secure[..]].concat();
    let record = ["--record", recording.to_str().unwrap()];
    let (result, status) = run(QUICK, &[&at[..], &record].concat());
    assert_eq!(result.decisions_sha256, expected.decisions_sha256, "{result:?}");
    assert_eq!((status, result.cycles.degraded), (0, 0), "{result:?}");
    assert!(questions_to_pools(&at) > result.cycles.count as f64, "{result:?}");
    assert!(
        curionav(&["replay", recording.to_str().unwrap()]).status.success(),
        "what was recorded is whole"
    );
    let doctor = json(&[&["doctor", "--json", "--listen", "0.1"], &at[..]].concat());
    assert_eq!(doctor["ok"], true, "{doctor:#}");
    let denied = || json(&[&["status", "--json"], &at[..]].concat())["denied"].clone();
    assert_eq!(denied(), Value::Array(Vec::new()), "everything was allowed");

    // A viewer that tries to drive is counted, and the doctor names the right that it lacks.
    let config = ServiceConfig {
        connect: vec![deployment.endpoint().to_owned()],
        secure: Some(pki.clone()),
        certificates: vec!["viewer".parse().unwrap()],
        ..ServiceConfig::default()
    };
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let session = runtime.block_on(session::client(&config)).unwrap();
    session.put(keys::robot("robot", "cmd").unwrap(), "drive").wait().unwrap();
    let counted =
        || denied() == serde_json::json!([{ "certificate": "viewer", "message": "put", "count": 1 }]);
    assert!(comes_true(counted), "{}", denied());
    let doctor = json(&[&["doctor", "--json", "--listen", "0.1"], &at[..]].concat());
    let findings = doctor["findings"].as_array().unwrap();
    let finding = findings.iter().find(|finding| finding["link"] == "denied").unwrap();
    assert!(finding["fix"].as_str().unwrap().starts_with("`viewer` may put nothing"), "{finding:#}");
    session::close(&session);

    // What would be denied is said before anything is sent.
    let pause = curionav(&[&["pause", "robot", "--as", "viewer"], &at[..]].concat());
    let error = String::from_utf8(pause.stderr).unwrap();
    assert!(pause.status.code() == Some(2) && error.contains("use --as operator"), "{error}");
    let doctor = json(&[&["doctor", "--json", "--listen", "0.1", "--as", "viewer"], &at[..]].concat());
    let own =
        doctor["findings"].as_array().unwrap().iter().find(|f| f["link"] == "certificate viewer").unwrap();
    assert!(own["verdict"] == "missing" && own["detail"].as_str().unwrap().contains("ask echo/a"), "{own:#}");
    assert_eq!(deployment.stop(), 0);
}

#[test]
fn pools_behind_another_router_work_over_tls_and_nothing_of_the_robot_passes() {
    let _turn = turn();
    let names = ["router", "router.robot", "driver.robot", "localizer.robot", "arbiter.robot", "generator.g"];
    let more = ["cpc.a", "cnc.a", "simulator.world.robot", "operator", "experimenter"];
    let pki = folder(&[&names[..], &more].concat());
    let secure = ["--secure", pki.path().to_str().unwrap()];
    let start = |arguments: &[&str]| Serving::start(&[arguments, &secure].concat());
    let pools = start(&["router", "--listen", "tls/127.0.0.1:0"]);
    let linked = ["--connect", pools.endpoint(), "--as", "router.robot"];
    let robot = start(&[&["router", "--listen", "tls/127.0.0.1:0"], &linked[..]].concat());
    let of_robot = ["driver", "localizer", "arbiter", "simulator"].map(|role| (role, "robot"));
    let of_pools = [("generator", "g"), ("cpc", "a"), ("cnc", "a")];
    let service = |at: &str, (role, instance): (&str, &str)| {
        let base: &[&str] = if role == "driver" { &["--simulated-base"] } else { &[] };
        start(&[&[role, "--connect", at, "--instance", instance], base].concat())
    };
    let _robot_services = of_robot.map(|one| service(robot.endpoint(), one));
    let _pool_services = of_pools.map(|one| service(pools.endpoint(), one));
    let at = [&["--connect", robot.endpoint()], &secure[..]].concat();
    let well = || curionav(&[&["doctor", "--listen", "0.1"], &at[..]].concat()).status.success();
    assert!(comes_true(well), "the pools behind the other router are not proven");
    let (result, status) = run(QUICK, &at);
    assert_eq!((status, result.cycles.degraded), (0, 0), "{result:?}");
    assert!(questions_to_pools(&at) > result.cycles.count as f64, "{result:?}");
    assert_eq!(result.decisions_sha256, run(QUICK, &[]).0.decisions_sha256);
    // An operator at the other router does not reach the robot.
    let there = [&["pause", "robot", "--connect", pools.endpoint()], &secure[..]].concat();
    assert_eq!(curionav(&there).status.code(), Some(3));
}

#[test]
fn through_a_socket_on_its_host_the_robots_own_programs_do_what_they_may_and_nothing_else() {
    use std::os::unix::fs::PermissionsExt;

    let _turn = turn();
    let of_robot =
        ["router.robot", "driver.robot", "localizer.robot", "arbiter.robot", "simulator.world.robot"];
    let others = ["generator.g", "cpc.a", "cnc.a", "operator", "experimenter"];
    let pki = folder(&[&of_robot[..], &others].concat());
    let secure = ["--secure", pki.path().to_str().unwrap()];
    let socket = pki.path().join("robot.sock");
    let through = format!("unixsock-stream/{}", socket.display());
    let start = |arguments: &[&str]| Serving::start(&[arguments, &secure].concat());
    let listens = ["--listen", "tls/127.0.0.1:0", "--listen", &through, "--as", "router.robot"];
    let router = start(&[&["router"], &listens[..]].concat());
    assert_eq!(std::fs::metadata(&socket).unwrap().permissions().mode() & 0o777, 0o600);
    let service = |role: &str, instance: &str, at: &str| {
        let base: &[&str] = if role == "driver" { &["--simulated-base"] } else { &[] };
        start(&[&[role, "--connect", at, "--instance", instance], base].concat())
    };
    let _robot = ["driver", "localizer", "arbiter", "simulator"].map(|role| service(role, "robot", &through));
    let tls = router.endpoint_over("tls");
    let _pool = [("generator", "g"), ("cpc", "a"), ("cnc", "a")].map(|(role, name)| service(role, name, tls));
    let at = [&["--connect", tls], &secure[..]].concat();
    let well = || curionav(&[&["doctor", "--listen", "0.1"], &at[..]].concat()).status.success();
    assert!(comes_true(well), "the pool is not proven");
    let (result, status) = run(QUICK, &at);
    assert_eq!((status, result.cycles.degraded), (0, 0), "{result:?}");
    assert_eq!(result.decisions_sha256, run(QUICK, &[]).0.decisions_sha256);

    // A program behind the socket cannot command another robot.
    let config = |endpoint: &str| ServiceConfig {
        connect: vec![endpoint.to_owned()],
        secure: Some(pki.path().to_owned()),
        certificates: vec!["operator".parse().unwrap()],
        ..ServiceConfig::default()
    };
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let behind = runtime.block_on(session::client(&config(&through))).unwrap();
    let looking = runtime.block_on(session::client(&config(tls))).unwrap();
    let heard = looking.declare_subscriber(format!("{}/robot/*/cmd", keys::ROOT)).wait().unwrap();
    let own = keys::robot("robot", "cmd").unwrap();
    let came = std::cell::RefCell::new(Vec::new());
    let has_come = || {
        behind.put(keys::robot("other", "cmd").unwrap(), "drive").wait().unwrap();
        behind.put(&own, "not a command").wait().unwrap();
        let next = heard.recv_timeout(Duration::from_millis(200)).unwrap();
        came.borrow_mut().extend(next.map(|sample| sample.key_expr().to_string()));
        came.borrow().contains(&own)
    };
    assert!(comes_true(has_come), "{came:?}");
    assert!(!came.borrow().iter().any(|key| key.contains("other")), "{came:?}");
    session::close(&behind);
    session::close(&looking);
    // The router of the pools has none.
    let pools = folder(&["router"]);
    let path = pools.path().to_str().unwrap();
    fails(
        &["router", "--listen", &through, "--secure", path],
        2,
        "this configuration allows links over tls alone",
    );
}

/// Runs a command that must fail at once with one line.
fn fails(arguments: &[&str], status: i32, says: &str) {
    let began = Instant::now();
    let output = curionav(arguments);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {error}");
    assert!(error.contains(says) && error.lines().count() == 1, "{arguments:?}: {error}");
    assert!(began.elapsed() < Duration::from_secs(60), "{arguments:?}");
}

#[test]
fn expired_foreign_and_missing_certificates_are_one_clear_line_each() {
    let _turn = turn();
    let pki = folder(&["router", "viewer", "operator"]);
    let other = folder(&["router", "viewer", "operator"]);
    let path = |folder: &tempfile::TempDir| folder.path().to_str().unwrap().to_owned();
    let router = Serving::start(&["router", "--listen", "tls/127.0.0.1:0", "--secure", &path(&pki)]);
    let at = router.endpoint();
    let status = |secure: &str| ["status", "--connect", at, "--secure", secure].map(str::to_owned);
    let fails = |arguments: &[String], status: i32, says: &str| {
        fails(&arguments.iter().map(String::as_str).collect::<Vec<_>>(), status, says);
    };
    assert!(curionav(&status(&path(&pki)).each_ref().map(String::as_str)).status.success());
    fails(&status(&path(&other)), 3, "the router's certificate is not signed by the authority");

    // Its own authority is known, but the certificate is of another.
    let mixed = tempfile::tempdir().unwrap();
    let copy = |from: &tempfile::TempDir, file: &str| {
        std::fs::copy(from.path().join(file), mixed.path().join(file)).unwrap();
    };
    copy(&pki, "ca.pem");
    fails(
        &status(&path(&mixed)),
        2,
        "viewer.pem: is missing; where the authority's key is: curionav secure issue",
    );
    ["viewer.pem", "viewer.key"].iter().for_each(|file| copy(&other, file));
    fails(&status(&path(&mixed)), 2, "`viewer` is not signed by the authority in");
    std::fs::remove_file(mixed.path().join("viewer.key")).unwrap();
    copy(&pki, "viewer.pem");
    fails(&status(&path(&mixed)), 2, "viewer.key: is missing; copy it from where it was issued");

    let cpc = ["cpc", "--connect", at, "--secure", &path(&pki), "--instance", "a"].map(str::to_owned);
    fails(&cpc, 2, "cpc.a.pem: is missing");
    let plain =
        ["doctor", "--connect", &at.replace("tls/", "tcp/"), "--secure", &path(&pki)].map(str::to_owned);
    fails(&plain, 2, "this configuration allows links over tls, unixsock-stream alone");
    let listen = ["router", "--listen", "tcp/127.0.0.1:0", "--secure", &path(&pki)].map(str::to_owned);
    fails(&listen, 2, "this configuration allows links over tls alone");
    let named = curionav(&["status", "--connect", at, "--secure", &path(&pki), "--as", "opertor"]);
    assert!(
        String::from_utf8_lossy(&named.stderr).contains("`opertor` is not the name of a certificate"),
        "{named:?}"
    );
    let without_rules = folder(&["router"]);
    std::fs::remove_file(without_rules.path().join("rules.json")).unwrap();
    let listen =
        ["router", "--listen", "tls/127.0.0.1:0", "--secure", &path(&without_rules)].map(str::to_owned);
    fails(&listen, 2, "rules.json: is missing");

    Folder::new(pki.path()).renew(&"viewer".parse().unwrap(), Duration::ZERO).unwrap();
    fails(&status(&path(&pki)), 2, "the certificate `viewer` has expired on");
}

#[test]
fn a_configuration_over_tls_is_not_overridden_by_a_plain_endpoint() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("client.json5");
    std::fs::write(&file, r#"{ mode: "client", connect: { endpoints: ["tls/127.0.0.1:1"] } }"#).unwrap();
    let output =
        command(&["status", "--connect", "tcp/127.0.0.1:1"]).env("ZENOH_CONFIG", &file).output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && error.contains("connects over tls alone"), "{error}");
}

#[test]
fn a_link_ends_with_its_certificate_and_a_renewed_one_is_taken_without_a_restart() {
    let _turn = turn();
    let pki = folder(&["router", "viewer"]);
    let (here, short) = (Folder::new(pki.path()), Duration::from_secs(8));
    let names: [Name; 2] = ["cpc.a", "cnc.b"].map(|name| name.parse().unwrap());
    // The router's rules are made with them; only now do they become short.
    names.iter().for_each(|name| here.issue(name, &[], days(1)).unwrap());
    let secure = ["--secure", pki.path().to_str().unwrap()];
    let router = Serving::start(&[&["router", "--listen", "tls/127.0.0.1:0"], &secure[..]].concat());
    let at = [&["--connect", router.endpoint()], &secure[..]].concat();
    names.iter().for_each(|name| here.renew(name, short).unwrap());
    let ends = SystemTime::now() + short;
    let _cpc = Serving::start(&[&["cpc", "--instance", "a"], &at[..]].concat());
    let _cnc = Serving::start(&[&["cnc", "--instance", "b"], &at[..]].concat());
    here.renew(&names[0], days(1)).unwrap();
    let alive = || json(&[&["status", "--json"], &at[..]].concat())["services"].to_string();
    let both = alive();
    assert!(SystemTime::now() > ends || (both.contains("cpc") && both.contains("cnc")), "{both}");
    let one = || {
        let left = alive();
        SystemTime::now() > ends && left.contains("cpc") && !left.contains("cnc")
    };
    assert!(comes_true(one), "{}", alive());
}

#[test]
fn certificates_are_renewed_while_it_runs_and_no_service_is_restarted_for_them() {
    let _turn = turn();
    let place = tempfile::tempdir().unwrap();
    let pki = place.path().join("pki");
    let secure = ["--secure", pki.to_str().unwrap()];
    // Makes them all; from here on they are short.
    assert_eq!(Deployment::start_with(1, &secure).stop(), 0);
    let (here, short) = (Folder::new(&pki), Duration::from_secs(60));
    let names: Vec<Name> = here.certificates().unwrap().into_iter().map(|(name, _)| name).collect();
    names.iter().for_each(|name| here.renew(name, short).unwrap());
    // One whose key was lost: deleted while the deployment runs, it is not made again.
    let ends = SystemTime::now() + short;
    let deployment = Deployment::start_with(1, &secure);
    std::fs::remove_file(pki.join("crowd.world.pem")).unwrap();
    let tomorrow =
        SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_secs() as i64 + 86_400;
    let are_renewed = || here.certificates().unwrap().iter().all(|(_, of)| of.not_after > tomorrow);
    assert!(comes_true(are_renewed), "{:?}", here.certificates());
    assert!(
        comes_true(|| !is_alive(deployment.pid("router"))),
        "the router goes on with its old certificate"
    );
    assert!(comes_true(|| SystemTime::now() > ends));
    let at = [&["--connect", deployment.endpoint()], &secure[..]].concat();
    let services = || json(&[&["status", "--json"], &at[..]].concat())["services"].to_string();
    let all = ["arbiter-0", "cnc-0", "cpc-0", "driver-0", "generator-0", "localizer-0", "simulator-0"];
    assert!(comes_true(|| all.iter().all(|name| services().contains(name))), "{}", services());
    assert!(all.iter().all(|name| is_alive(deployment.pid(name))), "a service was restarted");
    assert_eq!(run(QUICK, &at).1, 0);
    assert!(!pki.join("crowd.world.pem").exists(), "a certificate that was deleted was made again");
    assert_eq!(deployment.stop(), 0);
}

#[test]
fn keys_are_for_their_owner_alone() {
    use std::os::unix::fs::PermissionsExt;
    let pki = folder(&["router", "viewer"]);
    let mode = |file: &Path| std::fs::metadata(file).unwrap().permissions().mode() & 0o777;
    for key in ["ca.key", "router.key", "viewer.key"] {
        assert_eq!(mode(&pki.path().join(key)), 0o600, "{key}");
    }
    let show = curionav(&["secure", "show", pki.path().to_str().unwrap(), "viewer"]);
    let text = String::from_utf8(show.stdout).unwrap();
    assert!(text.contains("valid") && text.contains("viewer may watch: live/*/*"), "{text}");
    let again = curionav(&["secure", "issue", pki.path().to_str().unwrap(), "viewer"]);
    let error = String::from_utf8(again.stderr).unwrap();
    assert!(again.status.code() == Some(2) && error.contains("curionav secure renew"), "{error}");
}
