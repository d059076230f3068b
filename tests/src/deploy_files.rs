//! The files under `deploy/` are read by the code they are for, and their command lines by the program.
//!
//! What cannot be run here is parsed: Kubernetes' manifest and the alerts. Systemd's own checker judges the units
//! where it is installed; the compose file is started where Podman is (`deploy_containers`).

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use curionav_runtime::config::{ServiceConfig, read_toml};
use curionav_runtime::session;
use curionav_security::name::Name;
use curionav_testing::skip;
use serde_json::Value;

use crate::end_to_end::program::{curionav, program};
use crate::foreign_bytes::ceilings::ceilings;

/// A container's limit over the ceiling of its role (docs/tuning.md): beyond the limit the kernel kills it.
const TO_SPARE: f64 = 1.25;

fn deploy(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy").join(name)
}

fn text(name: &str) -> String {
    std::fs::read_to_string(deploy(name)).unwrap()
}

/// Every document of a YAML file.
pub(crate) fn yaml(name: &str) -> Vec<Value> {
    serde_saphyr::from_multiple(&text(name)).unwrap_or_else(|e| panic!("deploy/{name}: {e}"))
}

/// A list of texts.
pub(crate) fn texts(list: &Value) -> Vec<String> {
    list.as_array().unwrap().iter().map(|entry| entry.as_str().unwrap().to_owned()).collect()
}

/// The program reads all of a command line before it shows its help.
fn assert_understood(whose: &str, arguments: &[String]) {
    let line: Vec<&str> = arguments.iter().map(String::as_str).chain(["--help"]).collect();
    let output = curionav(&line);
    assert!(output.status.success(), "{whose}: {line:?}: {}", String::from_utf8_lossy(&output.stderr));
    let mut wrong = line.clone();
    wrong.insert(1, "--no-such-argument");
    assert_eq!(curionav(&wrong).status.code(), Some(2), "{whose}: help is shown before arguments are read");
}

#[test]
fn the_documented_service_configuration_says_the_defaults() {
    let read: ServiceConfig = read_toml(&deploy("service.toml")).unwrap();
    // The file shows how a router is named; without one the command line tries this machine.
    let expected = ServiceConfig { connect: read.connect.clone(), ..ServiceConfig::default() };
    assert_eq!(read, expected);
    assert_eq!(read.connect, ["tcp/127.0.0.1:7447"]);
}

#[test]
fn zenoh_takes_the_router_and_client_configurations_and_they_say_what_is_built_in() {
    let built_in = session::built_in().unwrap();
    for name in ["router.json5", "router-robot.json5", "client.json5"] {
        let read = zenoh::Config::from_file(deploy(name)).unwrap_or_else(|e| panic!("deploy/{name}: {e}"));
        for section in ["scouting", "queries_default_timeout", "adminspace", "transport"] {
            let of = |config: &zenoh::Config| config.get_json(section).unwrap();
            assert_eq!(of(&read), of(&built_in), "deploy/{name}: {section}");
        }
    }
}

#[test]
fn the_container_images_run_the_program_without_privileges() {
    let file = text("Dockerfile");
    let begins =
        |start: &str| file.lines().filter(|l| l.starts_with(start)).map(str::to_owned).collect::<Vec<_>>();
    let images = begins("ARG ").iter().filter(|line| line.contains("_IMAGE=")).count();
    assert_eq!(images, 2, "both base images can be replaced");
    assert_eq!(begins("FROM "), ["FROM ${BUILD_IMAGE} AS build", "FROM ${RUNTIME_IMAGE} AS runtime"]);
    assert_eq!(begins("ENTRYPOINT "), ["ENTRYPOINT [\"/usr/local/bin/curionav\"]"]);
    assert_eq!(begins("USER "), ["USER 65532:65532"]);
    // What the build reads must be among what it is sent.
    let sent = text("Dockerfile.dockerignore");
    let manifest: toml::Table = std::fs::read_to_string(deploy("../Cargo.toml")).unwrap().parse().unwrap();
    for member in texts(&serde_json::to_value(&manifest["workspace"]["members"]).unwrap()) {
        let folder = member.split('/').next().unwrap();
        assert!(sent.lines().any(|l| l == format!("!{folder}")), "the image is built without {folder}");
    }
}

#[test]
fn compose_starts_two_of_each_pool_and_one_of_everything_else() {
    let compose = yaml("compose.yaml").remove(0);
    let mut roles = Vec::new();
    for (name, service) in compose["services"].as_object().unwrap() {
        let command = texts(&service["command"]);
        assert_understood(name, &command);
        roles.push(command[0].clone());
        assert_eq!(command[command.len() - 2..], ["--secure", "/pki"], "{name}");
        if command[0] != "router" {
            // It has the certificate that it will show, and no other.
            let value = |argument: &str| {
                let at = command.iter().position(|word| word == argument);
                at.map_or("", |at| command[at + 1].as_str())
            };
            let of = |argument| value(argument);
            let shown =
                Name::of_service(&command[0], of("--robot"), of("--world"), of("--instance")).unwrap();
            let files = texts(&service["volumes"]).concat();
            assert!(files.contains(&format!("/pki/{shown}.key:ro")) && files.matches(".key:ro").count() == 1);
            assert!(
                command.contains(&"tls/router:7447".to_owned()),
                "{name} connects elsewhere: {command:?}"
            );
        }
    }
    roles.sort();
    let expected = [
        "arbiter",
        "cnc",
        "cnc",
        "cpc",
        "cpc",
        "driver",
        "generator",
        "generator",
        "localizer",
        "router",
        "simulator",
        "tracker",
    ];
    assert_eq!(roles, expected);
}

#[test]
fn kubernetes_runs_every_pool_and_probes_it_where_it_answers() {
    let documents = yaml("kubernetes.yaml");
    let of_kind = |kind: &str| documents.iter().filter(|d| d["kind"] == kind).collect::<Vec<_>>();
    let service = of_kind("Service")[0]["metadata"]["name"].as_str().unwrap().to_owned();
    let ceilings = ceilings();
    let mut roles = Vec::new();
    for deployment in [of_kind("Deployment"), of_kind("StatefulSet")].concat() {
        let pod = &deployment["spec"]["template"];
        assert_eq!(deployment["spec"]["selector"]["matchLabels"], pod["metadata"]["labels"]);
        let container = &pod["spec"]["containers"][0];
        let pod_name = format!("{}-0", deployment["metadata"]["name"].as_str().unwrap());
        let command: Vec<String> =
            texts(&container["args"]).iter().map(|a| a.replace("$(POD_NAME)", &pod_name)).collect();
        assert!(command.contains(&"--secure".to_owned()), "{command:?}");
        assert_understood(&command[0], &command);
        if command[0] != "router" {
            assert!(command.contains(&format!("tls/{service}:7447")), "{command:?}");
            let port = container["ports"][0]["containerPort"].as_u64().unwrap();
            assert!(command.contains(&format!("0.0.0.0:{port}")), "{command:?} is probed on port {port}");
            assert_eq!(container["livenessProbe"]["httpGet"]["path"], "/livez");
            assert_eq!(container["readinessProbe"]["httpGet"]["path"], "/readyz");
            assert_eq!(deployment["spec"]["replicas"], 2);
        }
        let memory = container["resources"]["limits"]["memory"].as_str().unwrap();
        let limit: f64 = memory.strip_suffix("Mi").unwrap().parse().unwrap();
        assert!(limit >= TO_SPARE * ceilings[&command[0]], "{}: {memory}", command[0]);
        roles.push(command[0].clone());
    }
    assert_eq!(roles, ["router", "generator", "cpc", "cnc"]);
}

#[test]
fn the_last_part_of_a_benchmark_on_kubernetes_is_the_last_of_all() {
    let job = yaml("bench-job.yaml").remove(0);
    assert_eq!((&job["kind"], &job["spec"]["completionMode"]), (&"Job".into(), &"Indexed".into()));
    let count = job["spec"]["completions"].as_u64().unwrap();
    let command = texts(&job["spec"]["template"]["spec"]["containers"][0]["command"]);
    // What a shell makes of it for the last index.
    let printing = command[2].replace("exec curionav", "printf '%s\\n'");
    let mut shell = Command::new(&command[0]);
    let output =
        shell.args([&command[1], &printing]).env("JOB_COMPLETION_INDEX", (count - 1).to_string()).output();
    let words: Vec<String> =
        String::from_utf8(output.unwrap().stdout).unwrap().lines().map(str::to_owned).collect();
    assert!(words.contains(&format!("{count}/{count}")), "{words:?}");
    assert_understood("bench-job.yaml", &words);
}

/// What `docs/running.md` lists in its table of metrics.
pub(crate) fn documented_metrics() -> BTreeSet<String> {
    let text = std::fs::read_to_string(deploy("../docs/running.md")).unwrap();
    let names = text
        .lines()
        .filter_map(|l| Some(format!("curionav_{}", l.strip_prefix("| `curionav_")?.split('`').next()?)));
    names.collect()
}

#[test]
fn alerts_are_about_metrics_that_there_are() {
    let documented = documented_metrics();
    let mut rules = 0;
    for group in yaml("alerts.yaml")[0]["groups"].as_array().unwrap() {
        for rule in group["rules"].as_array().unwrap() {
            let expression = rule["expr"].as_str().unwrap();
            assert!(rule["annotations"]["summary"].is_string() && rule["labels"]["severity"].is_string());
            let words = expression.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
            let metrics: Vec<&str> = words.filter(|w| w.starts_with("curionav_")).collect();
            assert!(!metrics.is_empty(), "{expression}");
            for metric in metrics {
                let known = documented.contains(metric.trim_end_matches("_bucket"));
                assert!(known, "{}: {metric} is not documented", rule["alert"]);
            }
            rules += 1;
        }
    }
    assert!(rules >= 10);
}

/// (file name, the command line of its service) of every systemd unit; `%i` is a name.
fn units() -> Vec<(String, Vec<String>)> {
    let mut units = Vec::new();
    for entry in std::fs::read_dir(deploy("systemd")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let text = text(&format!("systemd/{name}"));
        let line = text.lines().find_map(|l| l.strip_prefix("ExecStart=")).unwrap();
        let line = line.replace("$CURIONAV_ARGUMENTS", "--metrics 0.0.0.0:9101").replace("%i", "a");
        units.push((name, line.split_whitespace().map(str::to_owned).collect()));
    }
    units.sort();
    units
}

#[test]
fn every_role_has_a_unit_whose_command_line_is_understood() {
    let mut roles = BTreeSet::new();
    for (name, command) in units() {
        assert_eq!(command[0], "/usr/local/bin/curionav", "{name}");
        assert_understood(&name, &command[1..]);
        assert_eq!(
            name.trim_end_matches(".service").trim_end_matches('@'),
            format!("curionav-{}", command[1])
        );
        roles.insert(command[1].clone());
    }
    let all = [
        "arbiter",
        "cnc",
        "cpc",
        "cpc-occluded",
        "driver",
        "generator",
        "localizer",
        "ros2-gateway",
        "router",
        "simulator",
        "tracker",
    ];
    assert!(roles.iter().eq(&all), "{roles:?}");
}

#[test]
fn systemd_finds_nothing_wrong_with_the_units() {
    if !Command::new("systemd-analyze").arg("--version").output().is_ok_and(|o| o.status.success()) {
        skip("systemd-analyze is not installed, so the units are only read");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (name, _) in units() {
        let unit =
            text(&format!("systemd/{name}")).replace("/usr/local/bin/curionav", program().to_str().unwrap());
        std::fs::write(folder.path().join(&name), &unit).unwrap();
        let instance = folder.path().join(name.replace("@.", "@a."));
        std::fs::write(&instance, &unit).unwrap();
        let output =
            Command::new("systemd-analyze").args(["verify", "--man=no"]).arg(&instance).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !said.contains(&name.replace("@.", "@a.")), "{name}: {said}");
    }
}
