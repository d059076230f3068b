//! Every process of the soak, by name: one router, the pool, an arbiter and a driver per robot, and a tracker for every
//! fourth one.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard};

use curionav_runtime::config::ServiceConfig;
use curionav_security::name::Name;
use tempfile::TempDir;

use super::process::{Process, port_for_a_restart};
use crate::certificates::{issued, secure};

/// Roles of the pool.
pub(super) const POOL: [&str; 3] = ["generator", "cpc", "cnc"];
/// Replicas of each.
pub(super) const REPLICAS: usize = 3;

/// Processes started at once.
const AT_ONCE: usize = 10;

/// The processes there are; one that is killed is not.
pub(super) struct Fleet {
    endpoint: String,
    /// Certificates, if links are over TLS.
    pki: Option<TempDir>,
    running: Mutex<BTreeMap<String, Process>>,
}

/// The name of a robot.
pub(super) fn robot(index: usize) -> String {
    format!("r{index:02}")
}

/// Whether a robot knows people by a tracker of its own alone.
pub(super) fn is_tracked(robot: usize) -> bool {
    robot.is_multiple_of(4)
}

/// The services of one robot, by role.
fn services(robot: usize) -> impl Iterator<Item = &'static str> {
    ["driver", "arbiter"].into_iter().chain(is_tracked(robot).then_some("tracker"))
}

/// Those of every process that there will ever be, and of what this test does as a robot's base and localiser and as
/// an operator.
fn certificates(robots: usize) -> TempDir {
    // One more of each role joins late.
    let of_pool =
        POOL.into_iter().flat_map(|role| (0..=REPLICAS).map(move |i| (role, format!("{role}-{i}"))));
    let of_robot = |i: usize| {
        let robot = robot(i);
        let own = ["base", "localizer"].map(|role| Name::new(role, &[&robot]).unwrap());
        let names = services(i)
            .map(move |role| Name::of_service(role, &robot, "world", &format!("{role}-{robot}")).unwrap());
        names.chain(own)
    };
    let names = of_pool.map(|(role, instance)| Name::new(role, &[&instance]).unwrap());
    let names = names.chain((0..robots).flat_map(of_robot));
    let others = ["router", "operator", "viewer"].map(|name| Name::new(name, &[]).unwrap());
    issued(names.chain(others), &[])
}

impl Fleet {
    /// Everything for so many robots.
    pub(super) fn start(robots: usize, is_secure: bool) -> Self {
        let pki = is_secure.then(|| certificates(robots));
        let protocol = if is_secure { "tls" } else { "tcp" };
        let listen = format!("{protocol}/127.0.0.1:{}", port_for_a_restart());
        let router = ["router".into(), "--listen".into(), listen];
        let router = Process::start(&[&router, &secure(pki.as_ref())[..]].concat());
        let ready: serde_json::Value = serde_json::from_str(&router.line).unwrap();
        let endpoint = ready["endpoints"][0].as_str().unwrap().to_owned();
        let fleet = Self { endpoint, pki, running: Mutex::new(BTreeMap::from([("router".into(), router)])) };
        let replicas = POOL.into_iter().flat_map(|role| (0..REPLICAS).map(move |i| format!("{role}-{i}")));
        let of_robots = (0..robots).flat_map(|i| services(i).map(move |role| format!("{role}-{}", robot(i))));
        let names: Vec<String> = replicas.chain(of_robots).collect();
        names.chunks(AT_ONCE).for_each(|names| fleet.revive_all(names));
        fleet
    }

    /// How a program connects that shows this certificate where links are over TLS.
    pub(super) fn config(&self, certificate: &str) -> ServiceConfig {
        ServiceConfig {
            connect: vec![self.endpoint.clone()],
            secure: self.pki.as_ref().map(|folder| folder.path().to_owned()),
            certificates: vec![certificate.parse().unwrap()],
            connect_timeout_s: 60.0,
            ..ServiceConfig::default()
        }
    }

    /// Whether links are over TLS.
    pub(super) fn is_secure(&self) -> bool {
        self.pki.is_some()
    }

    fn running(&self) -> MutexGuard<'_, BTreeMap<String, Process>> {
        self.running.lock().unwrap()
    }

    fn arguments(&self, name: &str) -> Vec<String> {
        let endpoint = self.endpoint.clone();
        let secure = secure(self.pki.as_ref());
        let Some((role, of)) = name.split_once('-') else {
            return ["router".into(), "--listen".into(), endpoint].into_iter().chain(secure).collect();
        };
        let mut arguments = vec![role.into(), "--connect".into(), endpoint, "--instance".into(), name.into()];
        if matches!(role, "arbiter" | "driver" | "tracker") {
            arguments.extend(["--robot".into(), of.into()]);
        }
        if role == "driver" {
            arguments.push("--simulated-base".into());
        }
        arguments.extend(secure);
        arguments
    }

    /// Kills it with SIGKILL.
    pub(super) fn kill(&self, name: &str) {
        let gone = self.running().remove(name);
        drop(gone);
    }

    /// Starts it, and waits until it is ready.
    pub(super) fn revive(&self, name: &str) {
        let process = Process::start(&self.arguments(name));
        self.running().insert(name.into(), process);
    }

    /// Starts all of them.
    pub(super) fn revive_all(&self, names: &[String]) {
        let begun: Vec<_> = names.iter().map(|name| Process::begin(&self.arguments(name))).collect();
        for (name, mut process) in names.iter().zip(begun) {
            process.await_ready();
            self.running().insert(name.clone(), process);
        }
    }

    /// Sends a signal by name.
    pub(super) fn signal(&self, name: &str, signal: &str) {
        self.running()[name].signal(signal);
    }

    /// The processes that should be there and have ended.
    pub(super) fn ended(&self) -> Vec<String> {
        let mut running = self.running();
        let ended = running.iter_mut().filter_map(|(name, process)| Some((name, process.ended()?)));
        ended.map(|(name, how)| format!("{name}: {how}")).collect()
    }

    /// Name and id of every process.
    pub(super) fn pids(&self) -> Vec<(String, u32)> {
        self.running().iter().map(|(name, process)| (name.clone(), process.pid())).collect()
    }
}
