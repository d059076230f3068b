//! A robot, its routers and a pool on three machines, as processes on hosts of their own.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::MutexGuard;
use std::time::{Duration, Instant};

use curionav_security::name::Name;
use tempfile::TempDir;

use super::delayed_link::DelayedLink;
use super::namespaces::Network;
use super::pace::{Kept, Pace};
use super::recorder::Recorder;
use crate::certificates::{issued, secure};
use crate::end_to_end::program::{program, ready_line, root, signal, spawn, turn};

/// A hall with 27 people; the way takes the robot 45 s.
const SCENARIO: &str = "scenarios/paper/env4-s2.toml";
const SEED: &str = "1004";
/// Machines of the pool; each has one replica of every role.
pub(super) const POOL: [&str; 3] = ["pool-0", "pool-1", "pool-2"];
/// The port of the deployment's routers.
const PORT: u16 = 7447;
/// Until the robot's first decision.
const START_LIMIT: Duration = Duration::from_secs(60);
/// Until every cycle is as it should be, once there are some or what was wrong is mended.
pub(super) const NOMINAL_LIMIT: Duration = Duration::from_secs(20);
/// A planner that takes little time, so that these tests measure the network. It is never so certain of the position
/// that CPC evaluators could rest.
const LIGHT: &str = "
[profile.uncertainty]
threshold = 1e-6
[profile.generation.tree]
iterations = 12
warm_up = 40
max_nodes = 80
[profile.generation.candidates]
max_candidates = 24
min_candidates = 8
max_branches = 12
";

/// What differs between sites.
pub(super) struct Layout {
    /// Hosts with a router. The robot prefers the first, the pool and the recorder the last.
    pub(super) routers: &'static [&'static str],
    /// Whether the arbiter computes what the pool does not answer.
    pub(super) in_process: bool,
    /// Whether the pool reaches its router through a [`DelayedLink`].
    pub(super) delayed: bool,
}

impl Default for Layout {
    fn default() -> Self {
        Self { routers: &["router"], in_process: true, delayed: false }
    }
}

struct Process {
    child: Child,
    host: String,
    arguments: Vec<String>,
}

/// A deployment at work. Everything of it is gone once this is dropped.
pub(super) struct Site {
    pub(super) pace: Pace,
    processes: BTreeMap<String, Process>,
    run: Option<Child>,
    pub(super) recorder: Option<Recorder>,
    pub(super) delayed_link: Option<DelayedLink>,
    pub(super) network: Network,
    directory: TempDir,
    /// Certificates, if links are over TLS.
    pki: Option<TempDir>,
    _turn: MutexGuard<'static, ()>,
}

impl Site {
    /// The hosts of a deployment, without any process.
    pub(super) fn new(layout: &Layout, pace: Pace) -> Self {
        let turn = turn();
        let mut network = Network::new().unwrap();
        let hosts = layout.routers.iter().chain(["robot"].iter().filter(|h| !layout.routers.contains(h)));
        hosts.chain(&POOL).for_each(|host| network.add(host));
        let addresses = layout.routers.iter().map(|host| network.address(host)).chain([network.ours()]);
        let pki = is_over_tls().then(|| certificates(&addresses.collect::<Vec<_>>()));
        Self {
            pace,
            processes: BTreeMap::new(),
            run: None,
            recorder: None,
            delayed_link: None,
            network,
            directory: tempfile::tempdir().unwrap(),
            pki,
            _turn: turn,
        }
    }

    /// Starts everything, with the files of `deploy/`, and the scenario in real time; waits until the robot drives at
    /// its pace.
    pub(super) fn start(&mut self, layout: &Layout) -> Kept {
        self.start_routers(layout);
        let mut endpoints: Vec<String> = layout.routers.iter().map(|host| self.endpoint(host)).collect();
        self.spawn_robot(&endpoints, layout);
        let of_robot = endpoints.clone();
        endpoints.reverse();
        // Access rules let nothing of a robot through to another router.
        let listened_to = if self.pki.is_some() { of_robot } else { endpoints.clone() };
        let recorded = listened_to[0].clone();
        if layout.delayed {
            let link = DelayedLink::new(&self.network.ours(), &recorded);
            endpoints = vec![self.endpoint_at(&link.address)];
            self.delayed_link = Some(link);
        }
        self.spawn_pool(&endpoints);
        let names: Vec<String> = self.processes.keys().cloned().collect();
        names.iter().filter(|name| !name.starts_with("router")).for_each(|name| self.await_ready(name));
        self.recorder = Some(Recorder::start(&listened_to, self.pace, self.pki.as_ref()));
        let (scenario, speed) = (self.scenario(), self.pace.speed().to_string());
        let run = ["run", &scenario, "--connect", &recorded, "--speed", &speed, "--seed", SEED, "--json"];
        let secure = secure(self.pki.as_ref());
        let secure: Vec<&str> = secure.iter().map(String::as_str).collect();
        self.run = Some(spawn(&[&run[..], &secure].concat()));
        let decides = |r: &Recorder| !r.record().decisions.is_empty();
        self.recorder().await_until("it decides", Instant::now(), START_LIMIT, decides)?;
        self.recorder().await_nominal("the robot drives", NOMINAL_LIMIT)
    }

    /// What has been heard since the start.
    pub(super) fn recorder(&self) -> &Recorder {
        self.recorder.as_ref().unwrap()
    }

    /// Sends a signal to a process by its name.
    pub(super) fn signal(&self, signal_name: &str, process: &str) {
        signal(signal_name, self.processes[process].child.id());
    }

    /// Kills a process at once.
    pub(super) fn kill(&mut self, process: &str) {
        let child = &mut self.processes.get_mut(process).unwrap().child;
        child.kill().unwrap();
        child.wait().unwrap();
    }

    /// Starts a process again that has ended.
    pub(super) fn restart(&mut self, process: &str) {
        let Process { host, arguments, .. } = self.processes.remove(process).unwrap();
        self.spawn(process, &host, arguments);
    }

    /// Waits until a process serves.
    pub(super) fn await_ready(&mut self, name: &str) {
        let stdout = self.processes.get_mut(name).unwrap().child.stdout.take().unwrap();
        let line = ready_line(stdout).unwrap_or_else(|reason| panic!("{name}: {reason}\n{}", self.log(name)));
        assert!(line.contains("\"ready\""), "{name} is not ready: `{line}`\n{}", self.log(name));
    }

    fn endpoint(&self, host: &str) -> String {
        self.endpoint_at(&format!("{}:{PORT}", self.network.address(host)))
    }

    fn endpoint_at(&self, address: &str) -> String {
        format!("{}/{address}", self.protocol())
    }

    fn protocol(&self) -> &'static str {
        if self.pki.is_some() { "tls" } else { "tcp" }
    }

    /// `deploy/router.json5` as it is; a router that is not alone knows the others, as that file says.
    fn start_routers(&mut self, layout: &Layout) {
        let shipped = std::fs::read_to_string(root().join("deploy/router.json5")).unwrap();
        for host in layout.routers {
            let others: Vec<String> =
                layout.routers.iter().filter(|r| *r != host).map(|r| self.endpoint(r)).collect();
            let alone = "connect: { endpoints: [] }";
            assert!(shipped.contains(alone), "deploy/router.json5 has no `{alone}`");
            let text = shipped.replace(alone, &format!("connect: {{ endpoints: {others:?} }}"));
            let text = text.replace("tcp/0.0.0.0", &format!("{}/0.0.0.0", self.protocol()));
            let file = self.directory.path().join(format!("{host}.json5"));
            std::fs::write(&file, text).unwrap();
            let config = file.to_str().unwrap().to_owned();
            let name = router_on(host);
            self.spawn(&name, host, vec!["router".into(), "--config".into(), config]);
            self.await_ready(&name);
        }
    }

    fn spawn_robot(&mut self, endpoints: &[String], layout: &Layout) {
        let mut config = std::fs::read_to_string(root().join("deploy/service.toml")).unwrap();
        if !layout.in_process {
            config = config.replace("in_process = true", "in_process = false");
            assert!(config.contains("in_process = false"));
        }
        std::fs::write(self.directory.path().join("robot.toml"), config).unwrap();
        let file = self.directory.path().join("robot.toml");
        for kind in ["simulator", "driver", "localizer", "arbiter"] {
            let mut arguments = service(kind, "a", file.to_str().unwrap(), endpoints);
            if kind == "driver" {
                arguments.push("--simulated-base".into());
            }
            self.spawn(kind, "robot", arguments);
        }
    }

    fn spawn_pool(&mut self, endpoints: &[String]) {
        let file = root().join("deploy/service.toml");
        for (index, host) in POOL.iter().enumerate() {
            for kind in ["generator", "cpc", "cnc"] {
                let name = format!("{kind}-{index}");
                self.spawn(&name, host, service(kind, &name, file.to_str().unwrap(), endpoints));
            }
        }
    }

    fn spawn(&mut self, name: &str, host: &str, arguments: Vec<String>) {
        let log = std::fs::OpenOptions::new().create(true).append(true).open(self.log_file(name)).unwrap();
        // What else this machine does is not part of the figures.
        let mut command: Command = self.network.on(host, Path::new("nice"));
        let child = command
            .args(["-n", "-10"])
            .arg(program())
            .args(&arguments)
            .args(secure(self.pki.as_ref()))
            .args(["--supervised", "--log", "info"])
            .env("ZENOH_CONFIG", root().join("deploy/client.json5"))
            .env_remove("RUST_LOG")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(log)
            .spawn()
            .unwrap();
        self.processes.insert(name.into(), Process { child, host: host.into(), arguments });
    }

    /// The scenario planned in every tick.
    fn scenario(&self) -> String {
        let shipped = root().join(SCENARIO);
        let maps = shipped.parent().unwrap().join("maps");
        let text = std::fs::read_to_string(&shipped).unwrap();
        let text = text
            .replace("plan_every = 3", "plan_every = 1")
            .replace("\"maps/", &format!("\"{}/", maps.display()))
            + LIGHT;
        assert!(text.contains("plan_every = 1"));
        let file = self.directory.path().join("scenario.toml");
        std::fs::write(&file, text).unwrap();
        file.to_str().unwrap().to_owned()
    }

    fn log_file(&self, name: &str) -> PathBuf {
        self.directory.path().join(format!("{name}.log"))
    }

    /// The end of what a process has logged.
    fn log(&self, name: &str) -> String {
        let text = std::fs::read_to_string(self.log_file(name)).unwrap_or_default();
        let lines: Vec<&str> = text.lines().collect();
        lines[lines.len().saturating_sub(30)..].join("\n")
    }
}

/// Whether links are over TLS: `CURIONAV_NETWORK_SECURE=1`.
pub(super) fn is_over_tls() -> bool {
    std::env::var_os("CURIONAV_NETWORK_SECURE").is_some()
}

/// Those of every process of a site; routers have these addresses.
fn certificates(addresses: &[String]) -> TempDir {
    let of_robot = ["simulator", "driver", "localizer", "arbiter"]
        .map(|role| Name::of_service(role, "robot", "world", "a").unwrap());
    let of_pool = ["generator", "cpc", "cnc"].into_iter().flat_map(|role| {
        (0..POOL.len()).map(move |index| Name::new(role, &[&format!("{role}-{index}")]).unwrap())
    });
    let others = ["router", "experimenter", "viewer"].map(|name| Name::new(name, &[]).unwrap());
    issued(of_robot.into_iter().chain(of_pool).chain(others), addresses)
}

/// The name of the router's process on a host.
pub(super) fn router_on(host: &str) -> String {
    format!("router on {host}")
}

fn service(kind: &str, instance: &str, config: &str, endpoints: &[String]) -> Vec<String> {
    let connect = endpoints.iter().flat_map(|e| ["--connect", e]);
    let named = [kind, "--config", config, "--instance", instance];
    named.into_iter().chain(connect).map(str::to_owned).collect()
}

impl Drop for Site {
    fn drop(&mut self) {
        if std::thread::panicking() {
            for name in ["arbiter", "driver"] {
                eprintln!("the end of what the {name} logged:\n{}", self.log(name));
            }
        }
        // All at once, so that no process notices that another is gone.
        let processes = self.processes.values_mut().map(|p| &mut p.child).chain(self.run.as_mut());
        for child in processes {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
