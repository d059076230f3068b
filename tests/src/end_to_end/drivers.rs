//! Two drivers of one robot, in any order: one of them drives, and a pause that was confirmed holds.

use std::process::{Child, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use curionav_planning::random::{Rng, rng, uniform};
use curionav_runtime::command::lease_of;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::lockstep::LOCKSTEP_PATIENCE;
use curionav_runtime::query::fetch;
use curionav_runtime::session;
use curionav_schemas::{Lease, Message, Mission, MissionState, Twist, keys};
use zenoh::{Session, Wait};

use super::program::{Serving, comes_true, command, curionav, signal, soak_time, turn, two_workers, wait};

const QUICK: &str = "scenarios/quickstart.toml";
const ROBOT: &str = "robot";
/// The speed of runs: a machine that is busy keeps it.
const SPEED: f64 = 0.5;
/// The scenario's robot brakes from 1 m/s at 0.5 m/s2, seconds of its time; and two ticks.
const BRAKING: f64 = 2.0 + 0.2;
/// A driver that must not start says so within it.
const REFUSED: Duration = Duration::from_secs(20);

/// A robot without a driver: its router, its base and the other services.
struct Site {
    router: Serving,
    _services: Vec<Serving>,
    session: Session,
    runtime: tokio::runtime::Runtime,
    /// When commands above zero came.
    moving: Arc<Mutex<Vec<Instant>>>,
}

impl Site {
    fn start() -> Self {
        let router = Serving::start(&["router", "--listen", "tcp/127.0.0.1:0"]);
        let at = router.endpoint().to_owned();
        let service = |role: &str| Serving::start(&[role, "--connect", &at, "--instance", role]);
        let _services = ["simulator", "localizer", "generator", "cnc", "cpc", "arbiter"].map(service).into();
        let runtime = two_workers();
        let config = ServiceConfig { connect: vec![at.clone()], ..ServiceConfig::default() };
        let session = runtime.block_on(session::client(&config)).unwrap();
        let moving: Arc<Mutex<Vec<Instant>>> = Arc::default();
        let heard = Arc::clone(&moving);
        let listen = session.declare_subscriber(keys::robot(ROBOT, "cmd").unwrap()).callback(move |sample| {
            let command = Twist::decode(&sample.payload().to_bytes(), None).unwrap();
            if command.v > 1e-6 {
                heard.lock().unwrap().push(Instant::now());
            }
        });
        listen.background().wait().unwrap();
        Self { router, _services, session, runtime, moving }
    }

    fn at(&self) -> &str {
        self.router.endpoint()
    }

    fn driver(&self, name: &str, more: &[&str]) -> Driver {
        let of = ["driver", "--connect", self.at(), "--instance", name, "--simulated-base"];
        let child = command(&[&of, more].concat()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
        Driver { child: child.unwrap(), stopped: false }
    }

    fn lease(&self) -> Option<Lease> {
        self.runtime.block_on(lease_of(&self.session, ROBOT, Duration::from_secs(2))).ok()
    }

    fn mission_is(&self, state: MissionState) -> bool {
        let key = keys::robot(ROBOT, "mission").unwrap();
        let mission = self.runtime.block_on(fetch::<Mission>(&self.session, &key, Duration::from_secs(2)));
        mission.is_ok_and(|mission| mission.state == state)
    }

    fn is_held_by(&self, driver: &str) -> bool {
        self.lease().is_some_and(|lease| lease.holder.as_deref() == Some(driver))
    }

    fn say(&self, what: &str) -> Option<i32> {
        curionav(&[what, ROBOT, "--connect", self.at()]).status.code()
    }

    /// Begins a run and waits until it drives.
    fn run(&self) -> Child {
        let speed = SPEED.to_string();
        let of = ["run", QUICK, "--json", "--connect", self.at(), "--speed", &speed];
        let child = command(&of).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let begun = Instant::now();
        let drives = || self.moving.lock().unwrap().iter().any(|at| *at > begun);
        assert!(comes_true(drives), "the run does not begin to drive");
        child
    }

    /// The longest time after `since`, beyond the braking, at which something was told to move.
    fn moved_after(&self, since: Instant) -> Option<Duration> {
        let braking = Duration::from_secs_f64(BRAKING / SPEED);
        let moving = self.moving.lock().unwrap();
        moving.iter().map(|at| at.saturating_duration_since(since + braking)).max().filter(|d| !d.is_zero())
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        session::close(&self.session);
    }
}

struct Driver {
    child: Child,
    stopped: bool,
}

impl Driver {
    fn signal(&mut self, name: &str) {
        if self.child.try_wait().unwrap().is_none() {
            signal(name, self.child.id());
            self.stopped = name == "STOP";
        }
    }

    /// Its exit status and what it said, once it has ended by itself.
    fn ended(mut self) -> (Option<i32>, String) {
        let mut said = String::new();
        let status = wait(&mut self.child, REFUSED);
        let mut pipe = self.child.stderr.take().unwrap();
        std::io::Read::read_to_string(&mut pipe, &mut said).unwrap();
        (status.and_then(|status| status.code()), said)
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn a_second_driver_refuses_to_start_and_says_who_drives_and_takes_over_if_it_is_asked_to() {
    let _turn = turn();
    let site = Site::start();
    let first = site.driver("a", &[]);
    assert!(comes_true(|| site.is_held_by("a")));
    let (status, said) = site.driver("b", &[]).ended();
    assert!(status == Some(3) && said.contains("driver `a` drives this robot"), "{status:?}: {said}");
    // Nor does one of the same name share the lease.
    let (status, said) = site.driver("a", &[]).ended();
    assert!(status == Some(3) && said.contains("--take-over"), "{status:?}: {said}");
    let mut run = site.run();
    let second = site.driver("b", &["--take-over"]);
    let (status, said) = first.ended();
    assert!(status == Some(3) && said.contains("driver `b`"), "{status:?}: {said}");
    assert!(comes_true(|| site.is_held_by("b")));
    drop(second);
    let _ = run.kill();
    let _ = run.wait();
}

#[test]
fn a_pause_is_taken_without_a_mission_and_outlives_orders_and_drivers() {
    let _turn = turn();
    let site = Site::start();
    assert_eq!(site.say("pause"), Some(0), "the base alone is enough: nothing else could move the robot");
    let first = site.driver("a", &[]);
    assert!(comes_true(|| site.is_held_by("a")));
    assert!(site.lease().unwrap().paused);
    let speed = SPEED.to_string();
    let of = ["run", QUICK, "--connect", site.at(), "--speed", &speed];
    let mut run = command(&of).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    assert!(comes_true(|| site.mission_is(MissionState::Paused)));
    let ordered = Instant::now();
    assert_eq!(site.say("stop"), Some(0));
    drop(first);
    let _second = site.driver("a", &[]);
    assert!(comes_true(|| site.is_held_by("a")), "a driver that died is replaced");
    std::thread::sleep(Duration::from_secs(2));
    assert!(site.moving.lock().unwrap().iter().all(|at| *at < ordered), "it moved while it was paused");
    let _ = run.kill();
    let _ = run.wait();
    assert_eq!(site.say("resume"), Some(0));
    let mut run = site.run();
    let _ = run.kill();
    let _ = run.wait();
}

#[test]
fn a_lockstep_run_whose_driver_died_ends_once_another_drives_and_the_world_takes_the_next() {
    let _turn = turn();
    let site = Site::start();
    let first = site.driver("a", &[]);
    assert!(comes_true(|| site.is_held_by("a")));
    let of = ["run", "scenarios/paper/env4-s2.toml", "--connect", site.at()];
    let mut run = command(&of).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    assert!(comes_true(|| !site.moving.lock().unwrap().is_empty()), "the run does not begin to drive");
    drop(first);
    let _second = site.driver("b", &[]);
    assert!(comes_true(|| site.is_held_by("b")));
    let taken = Instant::now();
    let status = wait(&mut run, REFUSED).expect("the run goes on without its driver");
    println!(
        "the run was over {:.1} s after another driver had taken the robot",
        taken.elapsed().as_secs_f64()
    );
    assert!(taken.elapsed() < LOCKSTEP_PATIENCE / 2, "{:?}", taken.elapsed());
    let mut said = String::new();
    std::io::Read::read_to_string(&mut run.stderr.take().unwrap(), &mut said).unwrap();
    assert!(!status.success() && said.contains("drives the robot no more"), "{status:?}: {said}");
    assert_eq!(curionav(&["run", QUICK, "--connect", site.at()]).status.code(), Some(0));
}

/// One of so many.
fn below(random: &mut Rng, count: usize) -> usize {
    (uniform(random) * count as f64) as usize
}

/// What is done to two drivers of a robot.
fn disturb(site: &Site, random: &mut Rng, drivers: &mut Vec<Driver>) {
    let which = below(random, drivers.len());
    match below(random, 5) {
        0 => drivers[which].signal("STOP"),
        1 => drivers[which].signal("CONT"),
        2 => drivers[which].signal("KILL"),
        3 => drivers.push(site.driver("c", &[])),
        _ => drivers.push(site.driver("d", &["--take-over"])),
    }
    std::thread::sleep(Duration::from_secs_f64(1.5 * uniform(random)));
}

#[test]
fn a_pause_that_was_confirmed_holds_whatever_becomes_of_two_drivers() {
    let _turn = turn();
    let ends = Instant::now() + soak_time(25);
    let mut confirmed = 0;
    for seed in 1000_u64.. {
        let site = Site::start();
        let mut random = rng(seed, 0);
        let mut drivers = vec![site.driver("a", &[])];
        assert!(comes_true(|| site.is_held_by("a")));
        let mut run = site.run();
        for _ in 0..below(&mut random, 3) {
            disturb(&site, &mut random, &mut drivers);
        }
        let status = site.say("pause");
        let paused = Instant::now();
        for _ in 0..1 + below(&mut random, 3) {
            disturb(&site, &mut random, &mut drivers);
        }
        drivers.iter_mut().filter(|driver| driver.stopped).for_each(|driver| driver.signal("CONT"));
        std::thread::sleep(Duration::from_secs_f64(BRAKING / SPEED + 1.0));
        if status == Some(0) {
            confirmed += 1;
            assert_eq!(site.moved_after(paused), None, "seed {seed}: it moved after it was paused");
        }
        let _ = run.kill();
        let _ = run.wait();
        if Instant::now() > ends {
            break;
        }
    }
    println!("{confirmed} pauses were confirmed");
    assert!(confirmed > 0, "no pause was confirmed");
}
