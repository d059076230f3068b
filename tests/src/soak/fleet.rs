//! Every process of the soak, by name: one router, the pool, and an arbiter and a driver a robot.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard};

use super::process::{Process, port_for_a_restart};

/// Roles of the pool.
pub(super) const POOL: [&str; 3] = ["generator", "cpc", "cnc"];
/// Replicas of each.
pub(super) const REPLICAS: usize = 3;

/// Processes started at once.
const AT_ONCE: usize = 10;

/// The processes there are; one that is killed is not.
pub(super) struct Fleet {
    endpoint: String,
    running: Mutex<BTreeMap<String, Process>>,
}

/// The name of a robot.
pub(super) fn robot(index: usize) -> String {
    format!("r{index:02}")
}

impl Fleet {
    /// Everything for so many robots.
    pub(super) fn start(robots: usize) -> Self {
        let listen = format!("tcp/127.0.0.1:{}", port_for_a_restart());
        let router = Process::start(&["router".into(), "--listen".into(), listen]);
        let ready: serde_json::Value = serde_json::from_str(&router.line).unwrap();
        let endpoint = ready["endpoints"][0].as_str().unwrap().to_owned();
        let fleet = Self { endpoint, running: Mutex::new(BTreeMap::from([("router".into(), router)])) };
        let replicas = POOL.into_iter().flat_map(|role| (0..REPLICAS).map(move |i| format!("{role}-{i}")));
        let of_robots = (0..robots).flat_map(|i| ["driver", "arbiter"].map(|r| format!("{r}-{}", robot(i))));
        let names: Vec<String> = replicas.chain(of_robots).collect();
        names.chunks(AT_ONCE).for_each(|names| fleet.revive_all(names));
        fleet
    }

    /// Where the router listens.
    pub(super) fn endpoint(&self) -> &str {
        &self.endpoint
    }

    fn running(&self) -> MutexGuard<'_, BTreeMap<String, Process>> {
        self.running.lock().unwrap()
    }

    fn arguments(&self, name: &str) -> Vec<String> {
        let endpoint = self.endpoint.clone();
        let Some((role, of)) = name.split_once('-') else {
            return vec!["router".into(), "--listen".into(), endpoint];
        };
        let mut arguments = vec![role.into(), "--connect".into(), endpoint, "--instance".into(), name.into()];
        if matches!(role, "arbiter" | "driver") {
            arguments.extend(["--robot".into(), of.into()]);
        }
        if role == "driver" {
            arguments.push("--simulated-base".into());
        }
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
