//! Viewers that stop reading what they have subscribed to, or read it slowly, while a robot drives.
//!
//! `CURIONAV_SOAK_S` makes it longer than in a usual run of the tests: each kind of viewer stays for so many seconds.

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::session;
use curionav_schemas::keys;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::program::{
    Deployment, LIMIT, RunJson, in_real_time, lines, quickstart_with, run, signal, soak_time, turn,
    two_workers,
};

const VIEWERS: usize = 20;
/// Between two commands, in the robot's time: two ticks, and what a machine adds at times that others use as well. A
/// gap of 0.32 s was seen without any viewer. One viewer that is waited for makes one of 0.6 s.
const GAP_MAX: f64 = 0.2 + 0.3;
/// The share of its mean speed that the robot may lose. No two runs in real time are alike, and one viewer that is
/// waited for costs three tenths.
const SLOWER_MAX: f64 = 0.1;
/// How long a slow viewer takes for a message: of the thirty that come per second it reads three.
const DAWDLED: Duration = Duration::from_millis(300);
/// From the start of a run until the process of the viewers is stopped, by which time the robot drives.
const STOPPED_AFTER: Duration = Duration::from_secs(4);
/// What a robot sends out.
const STREAMS: [&str; 10] =
    ["scan", "odom", "people", "belief", "particles", "mission", "decision", "cmd", "report", "memory"];
/// Tell [`viewers`] to which endpoint they connect, and with which folder of certificates.
const ENDPOINT: &str = "CURIONAV_TEST_VIEWERS";
const FOLDER: &str = "CURIONAV_TEST_FOLDER";
/// Tells them to be slow.
const IS_SLOW: &str = "CURIONAV_TEST_SLOW";
/// What they say when all listen.
const LISTENING: &str = "all listen";

/// In which way viewers do not read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Deafness {
    /// They are there and say so, but read nothing.
    Alive,
    /// They read far less than there is.
    Slow,
    /// Their process is stopped.
    Stopped,
}

fn config(endpoint: &str, folder: Option<PathBuf>) -> ServiceConfig {
    ServiceConfig {
        connect: vec![endpoint.to_owned()],
        secure: folder,
        certificates: vec!["viewer".parse().unwrap()],
        ..ServiceConfig::default()
    }
}

/// Takes a message and never comes back, so that nothing more is read. The link stays alive.
fn never_come_back(_: Sample) {
    loop {
        std::thread::park();
    }
}

fn dawdle(_: Sample) {
    std::thread::sleep(DAWDLED);
}

fn subscribe_to_all(session: &Session, reading: fn(Sample)) -> Vec<Subscriber<()>> {
    let keys = STREAMS.map(|stream| format!("{}/robot/*/{stream}", keys::ROOT));
    keys.iter().map(|key| session.declare_subscriber(key).callback(reading).wait().unwrap()).collect()
}

/// A process of its own, which its parent starts and ends. Without a parent it does nothing.
#[test]
fn viewers() {
    let Ok(endpoint) = std::env::var(ENDPOINT) else { return };
    let config = config(&endpoint, std::env::var_os(FOLDER).map(PathBuf::from));
    let runtime = two_workers();
    // All are there before one stops reading: they share the threads that read.
    let sessions: Vec<Session> =
        (0..VIEWERS).map(|_| runtime.block_on(session::client(&config)).unwrap()).collect();
    let reading = if std::env::var_os(IS_SLOW).is_some() { dawdle } else { never_come_back };
    let _subscribers: Vec<_> = sessions.iter().map(|session| subscribe_to_all(session, reading)).collect();
    println!("{LISTENING}");
    loop {
        std::thread::park();
    }
}

/// The process of all viewers; gone once this is dropped.
struct Viewers(Child);

impl Viewers {
    fn start(endpoint: &str, pki: Option<&PathBuf>, deafness: Deafness) -> Self {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["end_to_end::deaf_viewers::viewers", "--exact", "--nocapture"]).env(ENDPOINT, endpoint);
        if let Some(pki) = pki {
            command.env(FOLDER, pki);
        }
        if deafness == Deafness::Slow {
            // A thread for each: none waits for another.
            command.env(IS_SLOW, "1").env("ZENOH_RUNTIME", format!("(rx:(worker_threads:{VIEWERS}))"));
        }
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().unwrap();
        let said = lines(child.stdout.take().unwrap());
        while !said.recv_timeout(LIMIT).expect("viewers listen").contains(LISTENING) {}
        Self(child)
    }

    fn stop_later(&self) -> std::thread::JoinHandle<()> {
        let pid = self.0.id();
        std::thread::spawn(move || {
            std::thread::sleep(STOPPED_AFTER);
            signal("STOP", pid);
        })
    }
}

impl Drop for Viewers {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// When the newest message of a stream came, and the longest that none came.
#[derive(Debug, Clone, Copy, Default)]
struct Gaps {
    newest: Option<Instant>,
    longest: Duration,
}

impl Gaps {
    fn message_came(&mut self) {
        let now = Instant::now();
        let since = self.newest.map_or(Duration::ZERO, |before| now - before);
        *self = Self { newest: Some(now), longest: self.longest.max(since) };
    }
}

/// Someone who reads, and sees how regularly messages of a stream come.
struct Watch {
    gaps: Arc<Mutex<Gaps>>,
    _subscriber: Subscriber<()>,
}

impl Watch {
    fn start(session: &Session, stream: &str) -> Self {
        let gaps: Arc<Mutex<Gaps>> = Arc::default();
        let heard = Arc::clone(&gaps);
        let key = keys::robot("robot", stream).unwrap();
        let subscriber =
            session.declare_subscriber(key).callback(move |_| heard.lock().unwrap().message_came());
        Self { gaps, _subscriber: subscriber.wait().unwrap() }
    }

    /// The longest gap since the last call, s.
    fn longest(&self) -> f64 {
        std::mem::take(&mut *self.gaps.lock().unwrap()).longest.as_secs_f64()
    }
}

/// A deployment, and someone who reads.
struct Site {
    deployment: Deployment,
    pki: Option<PathBuf>,
    /// How programs connect.
    at: Vec<String>,
    /// What is driven.
    scenario: String,
    commands: Watch,
    odometry: Watch,
}

/// What runs were like, in the robot's time.
#[derive(Debug, Clone, Default)]
struct Seen {
    runs: f64,
    /// Mean of the runs, m/s.
    speed: f64,
    /// The longest of all runs, s.
    gap_of_cmd: f64,
    gap_of_odom: f64,
    last: Option<RunJson>,
}

impl Site {
    /// The robot drives for `lasts`, at so much of the wall clock's pace.
    fn drive(&self, pace: f64, lasts: Duration) -> Seen {
        let begun = Instant::now();
        let pace_in_words = pace.to_string();
        let at: Vec<&str> = self.at.iter().map(String::as_str).collect();
        let mut seen = Seen::default();
        loop {
            self.commands.longest();
            self.odometry.longest();
            let (json, _) = run(&self.scenario, &[&at[..], &["--speed", &pace_in_words]].concat());
            seen.gap_of_cmd = seen.gap_of_cmd.max(pace * self.commands.longest());
            seen.gap_of_odom = seen.gap_of_odom.max(pace * self.odometry.longest());
            seen.runs += 1.0;
            seen.speed += (json.metrics.vel_mps - seen.speed) / seen.runs;
            let is_over = json.outcome != "reached" || begun.elapsed() > lasts;
            seen.last = Some(json);
            if is_over {
                return seen;
            }
        }
    }

    /// The same with viewers that do not read.
    fn drive_among(&self, deafness: Deafness, pace: f64, lasts: Duration) -> Seen {
        let viewers = Viewers::start(self.deployment.endpoint(), self.pki.as_ref(), deafness);
        let stopping = (deafness == Deafness::Stopped).then(|| viewers.stop_later());
        let seen = self.drive(pace, lasts);
        stopping.into_iter().for_each(|thread| thread.join().unwrap());
        seen
    }
}

fn deaf_viewers_slow_no_robot(is_over_tls: bool) {
    let _turn = turn();
    let lasts = soak_time(5);
    let place = tempfile::tempdir().unwrap();
    let pki = is_over_tls.then(|| place.path().join("pki"));
    let secure: Vec<&str> = pki.iter().flat_map(|pki| ["--secure", pki.to_str().unwrap()]).collect();
    let deployment = Deployment::start_with(1, &secure);
    let at = [&["--connect", deployment.endpoint()], &secure[..]].concat();
    let at: Vec<String> = at.into_iter().map(str::to_owned).collect();
    let runtime = two_workers();
    let scenario = place.path().join("empty.toml");
    // Those that a robot meets decide how fast it gets on.
    std::fs::write(&scenario, quickstart_with("", "curionav")).unwrap();
    let scenario = scenario.to_str().unwrap().to_owned();
    let session = runtime.block_on(session::client(&config(deployment.endpoint(), pki.clone()))).unwrap();
    let commands = Watch::start(&session, "cmd");
    let odometry = Watch::start(&session, "odom");
    let site = Site { deployment, pki, at, scenario, commands, odometry };
    in_real_time(|pace| {
        let alone = site.drive(pace, lasts);
        println!("alone: {alone:.3?}");
        let worse = [Deafness::Alive, Deafness::Slow, Deafness::Stopped].into_iter().find_map(|deafness| {
            let seen = site.drive_among(deafness, pace, lasts);
            println!("{VIEWERS} viewers, {deafness:?}: {seen:.3?}");
            let holds = seen.gap_of_cmd < GAP_MAX
                && seen.gap_of_odom < GAP_MAX
                && seen.speed > (1.0 - SLOWER_MAX) * alone.speed
                && seen.last.as_ref().is_some_and(|json| json.outcome == "reached");
            (!holds).then_some(seen)
        });
        let holds = worse.is_none();
        (worse.unwrap_or(alone).last.unwrap(), holds)
    });
    session::close(&session);
    runtime.shutdown_timeout(Duration::from_secs(2));
    assert_eq!(site.deployment.stop(), 0);
}

#[test]
fn viewers_that_do_not_read_slow_no_robot_over_tcp() {
    deaf_viewers_slow_no_robot(false);
}

#[test]
fn viewers_that_do_not_read_slow_no_robot_over_tls() {
    deaf_viewers_slow_no_robot(true);
}
