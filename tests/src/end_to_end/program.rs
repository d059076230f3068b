//! Starting `curionav` and reading what it says.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::Deserialize;
use serde::de::DeserializeOwned;

/// Longest that is waited for what is sure to come, however slow the machine is: it only keeps a test from waiting for
/// ever, and claims nothing.
pub(crate) const LIMIT: Duration = Duration::from_secs(240);
/// The same for a program that runs to its end, at any speed.
const RUN_LIMIT: Duration = Duration::from_secs(900);

/// One at a time: a test that keeps the pace of the wall clock must not share a small machine with others.
pub(crate) fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The root of the project.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// The program that was built last, beside this test's own binary.
pub(crate) fn program() -> PathBuf {
    let mut directory = std::env::current_exe().unwrap();
    directory.pop();
    if directory.ends_with("deps") {
        directory.pop();
    }
    let program = directory.join("curionav");
    assert!(program.is_file(), "{} is missing: run `cargo full` first, as tests/run does", program.display());
    program
}

/// `curionav ARGUMENTS` in the project's root, without input.
pub(crate) fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(program());
    command.args(arguments).current_dir(root()).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// How long a test goes on that may be made longer: the seconds of `CURIONAV_SOAK_S`, or else so many.
pub(crate) fn soak_time(usual: u64) -> Duration {
    let seconds = std::env::var("CURIONAV_SOAK_S");
    Duration::from_secs(seconds.map_or(usual, |s| s.parse().expect("CURIONAV_SOAK_S: seconds")))
}

/// A runtime for a test that talks to processes, which need the machine more.
pub(crate) fn two_workers() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap()
}

/// The first scenario with absolute paths of its maps, so that it can stand anywhere.
pub(crate) fn quickstart() -> String {
    let scenario = std::fs::read_to_string(root().join("scenarios/quickstart.toml")).unwrap();
    scenario.replace("\"maps/", &format!("\"{}/", root().join("scenarios/maps").display()))
}

/// The same with these people instead of its own, none or `[[walkers]]`, and with this planner.
pub(crate) fn quickstart_with(people: &str, planner: &str) -> String {
    let quickstart = quickstart();
    let (before, _) = quickstart.split_once("[[walkers]]").unwrap();
    format!("{before}{people}\n[planner]\nprofile = \"{planner}\"\n")
}

/// Starts `curionav` without reading what it says.
pub(crate) fn spawn(arguments: &[&str]) -> Child {
    command(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// Starts `curionav` with pipes for what it says: the caller reads them, or the program waits when they are full.
pub(crate) fn spawn_piped(arguments: &[&str]) -> Child {
    command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Runs `curionav` to its end.
pub(crate) fn curionav(arguments: &[&str]) -> Output {
    let mut child = spawn_piped(arguments);
    // Both pipes must be read while it runs, or a long answer would block it.
    let read = |mut pipe: Box<dyn Read + Send>| {
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            pipe.read_to_end(&mut bytes).unwrap();
            bytes
        })
    };
    let out = read(Box::new(child.stdout.take().unwrap()));
    let err = read(Box::new(child.stderr.take().unwrap()));
    let status = wait(&mut child, RUN_LIMIT).unwrap_or_else(|| panic!("{arguments:?} did not end in time"));
    Output { status, stdout: out.join().unwrap(), stderr: err.join().unwrap() }
}

/// Waits for a process at most `limit`; kills it and gives nothing beyond that.
pub(crate) fn wait(child: &mut Child, limit: Duration) -> Option<std::process::ExitStatus> {
    let deadline = Instant::now() + limit;
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return Some(status);
        }
        if Instant::now() > deadline {
            child.kill().unwrap();
            child.wait().unwrap();
            return None;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// The JSON of `curionav run --json`, as people script against it.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RunJson {
    pub(super) scenario: String,
    pub(super) planner: String,
    pub(super) seed: u64,
    pub(crate) outcome: String,
    pub(crate) metrics: MetricsJson,
    pub(crate) cycles: CyclesJson,
    pub(super) real_time_factor: f64,
    pub(super) decisions_sha256: String,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MetricsJson {
    pub(super) rmse_m: f64,
    pub(super) tcm: f64,
    pub(super) nm: Option<u32>,
    pub(super) tce_s: Option<f64>,
    pub(super) td: f64,
    pub(super) md_m: Option<f64>,
    pub(super) td_in_view: f64,
    pub(super) md_in_view_m: Option<f64>,
    pub(super) nt: u32,
    pub(super) vel_mps: f64,
    pub(super) length_m: f64,
    pub(super) time_s: f64,
    pub(super) collisions: u32,
    pub(super) clearance_min_m: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CyclesJson {
    pub(crate) count: u64,
    pub(crate) skipped: u64,
    pub(crate) late: u64,
    pub(crate) first_choice: u64,
    pub(crate) other_choice: BTreeMap<String, u64>,
    pub(crate) degraded: u64,
    pub(crate) degraded_by: BTreeMap<String, u64>,
    pub(super) p50_ms: f64,
    pub(super) p99_ms: f64,
    pub(super) max_ms: f64,
}

/// `curionav run SCENARIO --json ...`: its JSON and exit status.
pub(crate) fn run(scenario: &str, more: &[&str]) -> (RunJson, i32) {
    let arguments = [&["run", scenario, "--json"], more].concat();
    let output = curionav(&arguments);
    let text = String::from_utf8(output.stdout).unwrap();
    let json = serde_json::from_str(&text).unwrap_or_else(|e| {
        panic!("{arguments:?}: {e}\nstdout: {text}\nstderr: {}", String::from_utf8_lossy(&output.stderr))
    });
    (json, output.status.code().unwrap())
}

/// An embedded run at full speed is faster than the robot's time by this factor over the number of processors where a
/// deployment of processes can keep the robot's time: each process needs its share of a processor, and some to spare.
const TO_SPARE: f64 = 40.0;
/// A run that reaches less than this share of its speed shows that the machine has not kept it: in real time the
/// simulator waits for no other service.
const KEPT: f64 = 0.98;
/// How often a claim about time is tried on a machine that does not keep the speed.
const ATTEMPTS: u32 = 4;

/// The speed of a run in real time (`--speed`) that this machine can keep now: 1, or less where it is slow or busy.
pub(crate) fn real_time() -> f64 {
    let factor = run("scenarios/quickstart.toml", &[]).0.real_time_factor;
    let processors = std::thread::available_parallelism().unwrap().get();
    println!("an embedded run is {factor:.1} times as fast as the robot's time; {processors} processors");
    (factor * processors as f64 / TO_SPARE).min(1.0)
}

/// Tries a claim about a run in real time, at the speed that this machine keeps: `claim` gives the run, and whether it
/// was as it must be. If it was not, and the run shows that the machine has not kept the speed, the claim is tried
/// again at half of it.
pub(crate) fn in_real_time(claim: impl Fn(f64) -> (RunJson, bool)) {
    let mut speed = real_time();
    for attempt in 1.. {
        let (json, holds) = claim(speed);
        if holds {
            return;
        }
        let excused = json.real_time_factor < KEPT * speed && attempt < ATTEMPTS;
        assert!(excused, "at speed {speed:.2}: {json:?}");
        println!("the machine has not kept the speed {speed:.2}: {json:?}");
        speed /= 2.0;
    }
}

/// The speed of a run that has to be under way while something else is done, however slow that is.
pub(super) const SLOW: &str = "0.2";

#[derive(Debug, Deserialize)]
struct ReadyJson {
    endpoints: Vec<String>,
    processes: Vec<ProcessJson>,
}

#[derive(Debug, Deserialize)]
struct ProcessJson {
    name: String,
    pid: u32,
    metrics: Option<SocketAddr>,
}

/// What comes through a pipe, line by line, so that it can be waited for with a limit. It is read to its end.
pub(super) fn lines(pipe: impl Read + Send + 'static) -> Receiver<String> {
    let (sender, lines) = mpsc::channel();
    std::thread::spawn(move || {
        for line in BufReader::new(pipe).lines().map_while(Result::ok) {
            // A test that has heard enough no longer listens.
            let _ = sender.send(line);
        }
    });
    lines
}

/// The line in which a program says that it is ready, or why there is none: it has ended, or is still not ready.
pub(crate) fn ready_line(output: ChildStdout) -> Result<String, String> {
    lines(output).recv_timeout(LIMIT).map_err(|error| match error {
        RecvTimeoutError::Timeout => format!("not ready within {LIMIT:?}"),
        RecvTimeoutError::Disconnected => "it has ended".into(),
    })
}

/// Starts the program and waits for the line in which it says that it is ready.
fn serving<R: DeserializeOwned>(arguments: &[&str]) -> (Child, R) {
    serving_by(command(arguments))
}

fn serving_by<R: DeserializeOwned>(mut command: Command) -> (Child, R) {
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let line = ready_line(child.stdout.take().unwrap());
    match line.and_then(|line| serde_json::from_str(&line).map_err(|e| format!("{e}: `{line}`"))) {
        Ok(ready) => (child, ready),
        Err(reason) => {
            let _ = child.kill();
            let _ = child.wait();
            panic!("{command:?}: {reason}");
        }
    }
}

/// A running `curionav up`, ended when dropped.
pub(crate) struct Deployment {
    child: Child,
    ready: ReadyJson,
    _file: tempfile::NamedTempFile,
}

impl Deployment {
    /// Starts one with `replicas` of generator and of each evaluator, on a free port.
    pub(crate) fn start(replicas: usize) -> Self {
        Self::start_with(replicas, &[])
    }

    /// The same with more arguments.
    pub(crate) fn start_with(replicas: usize, more: &[&str]) -> Self {
        let text = format!(
            "metrics_port = 0\n[replicas]\ngenerator = {replicas}\ncpc = {replicas}\ncnc = {replicas}\n"
        );
        Self::of(&text, more)
    }

    /// Of a deployment file with this text, with more arguments.
    pub(crate) fn of(text: &str, more: &[&str]) -> Self {
        let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let (child, ready) = serving(&[&["up", file.path().to_str().unwrap(), "--port", "0"], more].concat());
        Self { child, ready, _file: file }
    }

    pub(crate) fn endpoint(&self) -> &str {
        &self.ready.endpoints[0]
    }

    pub(crate) fn pid(&self, name: &str) -> u32 {
        self.ready
            .processes
            .iter()
            .find(|p| p.name == name)
            .unwrap_or_else(|| panic!("no process {name}"))
            .pid
    }

    /// Where the metrics of each service are, by the service's name.
    pub(super) fn metrics(&self) -> impl Iterator<Item = (&str, SocketAddr)> {
        self.ready.processes.iter().filter_map(|p| Some((p.name.as_str(), p.metrics?)))
    }

    pub(super) fn supervisor(&self) -> u32 {
        self.child.id()
    }

    pub(super) fn kill(&self, name: &str) {
        signal("KILL", self.pid(name));
    }

    pub(crate) fn pids(&self) -> Vec<u32> {
        self.processes().map(|(_, pid)| pid).collect()
    }

    /// Name and id of every process.
    pub(crate) fn processes(&self) -> impl Iterator<Item = (&str, u32)> {
        self.ready.processes.iter().map(|p| (p.name.as_str(), p.pid))
    }

    /// Asks it to end as a user would and gives its exit status.
    pub(crate) fn stop(mut self) -> i32 {
        signal("INT", self.child.id());
        wait(&mut self.child, LIMIT).expect("ended in time").code().unwrap()
    }
}

impl Drop for Deployment {
    fn drop(&mut self) {
        if self.child.try_wait().unwrap().is_none() {
            signal("INT", self.child.id());
            wait(&mut self.child, LIMIT);
        }
    }
}

/// One service, or a router, as a process; killed when dropped.
pub(super) struct Serving {
    child: Child,
    ready: OneJson,
}

#[derive(Debug, Deserialize)]
struct OneJson {
    #[serde(default)]
    endpoints: Vec<String>,
    metrics: Option<SocketAddr>,
}

impl Serving {
    /// Starts it and waits until it serves.
    pub(super) fn start(arguments: &[&str]) -> Self {
        Self::start_by(command(arguments))
    }

    /// The same by a command that was made with [`command`].
    pub(super) fn start_by(command: Command) -> Self {
        let (child, ready) = serving_by(command);
        Self { child, ready }
    }

    pub(super) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Where a router listens.
    pub(super) fn endpoint(&self) -> &str {
        &self.ready.endpoints[0]
    }

    /// Where it listens over this protocol.
    pub(super) fn endpoint_over(&self, protocol: &str) -> &str {
        let is_over = |endpoint: &&String| endpoint.split('/').next() == Some(protocol);
        let found = self.ready.endpoints.iter().find(is_over);
        found.unwrap_or_else(|| panic!("not over {protocol}: {:?}", self.ready.endpoints))
    }

    pub(super) fn metrics(&self) -> SocketAddr {
        self.ready.metrics.unwrap()
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

/// Whether `condition` comes true sooner or later.
pub(crate) fn comes_true(condition: impl Fn() -> bool) -> bool {
    let deadline = Instant::now() + LIMIT;
    while Instant::now() < deadline {
        if condition() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    false
}

/// Until evaluators have answered: the run has begun.
pub(super) fn wait_until_running(endpoint: &str) {
    wait_until_running_at(&["--connect", endpoint]);
}

/// The same, for a deployment that is reached with these arguments.
pub(super) fn wait_until_running_at(arguments: &[&str]) {
    let begun = || {
        let output = curionav(&[&["status", "--json"], arguments].concat());
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let services = json["services"].as_array().unwrap();
        services.iter().any(|s| s["role"] == "cnc" && s["status"]["requests"].as_u64() > Some(3))
    };
    assert!(comes_true(begun), "the run did not begin");
}

/// Sends a signal by name.
pub(crate) fn signal(name: &str, pid: u32) {
    let sent = Command::new("kill").args([format!("-{name}"), pid.to_string()]).status().unwrap();
    assert!(sent.success(), "kill -{name} {pid}");
}

/// Whether a process is there (a zombie is not).
pub(crate) fn is_alive(pid: u32) -> bool {
    std::fs::read_to_string(format!("/proc/{pid}/stat"))
        .is_ok_and(|stat| stat.rsplit(')').next().is_some_and(|rest| !rest.trim_start().starts_with('Z')))
}
