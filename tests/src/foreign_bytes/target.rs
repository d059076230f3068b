//! The key table of `schemas/README.md`, and who must count what is sent to each key.

use curionav_schemas::keys::Commanded;
use curionav_schemas::{MapId, keys};

/// Role and instance of one of every service, as `curionav up` names them.
pub(super) static SERVICES: [(&str, &str); 8] = [
    ("driver", "driver-0"),
    ("localizer", "localizer-0"),
    ("tracker", "tracker-0"),
    ("generator", "generator-0"),
    ("cpc", "cpc-0"),
    ("cnc", "cnc-0"),
    ("arbiter", "arbiter-0"),
    ("simulator", "simulator-0"),
];

/// A key and what belongs on it.
#[derive(Debug, Clone)]
pub(super) struct Target {
    pub(super) key: String,
    /// What is put there or asked; nothing where no question belongs.
    pub(super) message: Option<&'static str>,
    /// Whether it is asked; else it is put to.
    pub(super) asked: bool,
    /// Roles that hear it.
    pub(super) heard_by: &'static [&'static str],
}

/// Every key of robot `robot` and world `world`.
pub(super) fn all(map: &MapId) -> Vec<Target> {
    let put = |key: String, message, heard_by| Target { key, message: Some(message), asked: false, heard_by };
    let ask = |key: String, message, heard_by| Target { key, message, asked: true, heard_by };
    let robot = |stream| keys::robot("robot", stream).unwrap();
    let world = |channel| keys::world("world", channel).unwrap();
    let mut all = vec![
        put(robot("scan"), "scan", &["localizer", "driver"][..]),
        put(robot("odom"), "odometry", &["localizer", "driver"]),
        put(robot("people"), "people", &["arbiter"]),
        put(robot("belief"), "belief", &["arbiter", "driver", "simulator", "tracker"]),
        put(robot("mission"), "mission", &["arbiter", "localizer", "simulator", "tracker"]),
        put(robot("decision"), "decision", &["driver", "simulator"]),
        put(robot("cmd"), "twist", &["arbiter", "simulator"]),
        // Recorders, viewers and `curionav run` listen to these.
        put(robot("report"), "cycle_report", &[]),
        put(world("people"), "people", &[]),
        put(world("run"), "run_status", &[]),
        ask(robot("mission"), None, &["driver"]),
        ask(Commanded::Mission.by("robot", "operator").unwrap(), Some("mission_command"), &["driver"]),
        ask(keys::mission_ready("robot").unwrap(), Some("readiness"), &["driver"]),
        ask(robot("decision"), None, &["driver"]),
        ask(
            keys::question("generator", "generator-0", "robot").unwrap(),
            Some("generate_request"),
            &["generator"],
        ),
        ask(keys::question("cpc", "cpc-0", "robot").unwrap(), Some("evaluate_request"), &["cpc"]),
        ask(keys::question("cnc", "cnc-0", "robot").unwrap(), Some("evaluate_request"), &["cnc"]),
        ask(keys::map(map), None, &["simulator"]),
        ask(world("scenario"), Some("inject_request"), &["simulator"]),
        ask(world("run"), None, &["simulator"]),
    ];
    for (index, (role, instance)) in SERVICES.iter().enumerate() {
        all.push(ask(keys::status(role, instance).unwrap(), None, std::slice::from_ref(&SERVICES[index].0)));
    }
    all
}
