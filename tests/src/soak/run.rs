//! The run itself.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use curionav_planning::geometry::Point2;
use curionav_planning::random::rng;
use curionav_runtime::map_store;
use curionav_runtime::query::fetch;
use curionav_runtime::serve::{Server, refusals};
use curionav_runtime::{convert, session};
use curionav_schemas::{ServiceStatus, keys};
use tokio::task::JoinHandle;
use zenoh::Session;

use super::fault::{KINDS, Outage, which};
use super::fleet::{Fleet, POOL, REPLICAS, is_tracked, robot};
use super::memory::Memory;
use super::robot::{Links, Robot};
use super::watch::{Counts, Drive};
use crate::end_to_end::program::{soak_time, turn, two_workers};
use crate::faults::base::TICK;
use crate::faults::corridor_map::{self, GOAL, START};
use crate::invariants::{BOUNDED, HEALED, Violations};
use crate::pace::Pace;

/// Robots of a long run, and of a short one, which shares its machine with other tests.
const ROBOTS: [usize; 2] = [20, 8];
/// Goals at either end of the corridor, of all robots together, at least: more than a pool of three generators for five
/// robots each.
const GOALS_PER_END: usize = 20;
/// A run that takes this long is a long one.
pub(super) const LONG: Duration = Duration::from_secs(900);
const SEED: u64 = 1000;
/// Between two faults, by the robots' clocks.
const FAULT_EVERY: Duration = Duration::from_secs(5);
/// A replica may have one question a slot at work and 16 waiting, and one in the hands of each.
const IN_FLIGHT_MAX: f64 = 18.0;
/// A replica that stands still must not hold up the others' status for long.
const STATUS_TIMEOUT: Duration = Duration::from_millis(100);

/// How long it may take, once nothing fails any more, until every robot drives on a decision made since and every
/// replica has answered, however busy the machine is.
const SETTLE_MAX: Duration = Duration::from_secs(120);
/// How long a pace is tried out, by the robots' clocks.
const TRIAL: Duration = Duration::from_secs(4);
/// A machine keeps a pace at which there are more than this share of the ticks that are due, and of decisions. What
/// must hold also holds on a machine that is busy all the time, as in a long run.
const KEPT: f64 = 0.8;

/// What came of the faults of one kind.
#[derive(Debug, Default)]
pub(super) struct Healing {
    pub(super) faults: u32,
    /// Seconds to the first nominal decision, and to the first one driven, of every robot.
    pub(super) nominal_after: Vec<f64>,
    pub(super) driven_after: Vec<f64>,
    /// Robots that had not both when the next thing failed.
    pub(super) unfinished: u32,
    /// Decisions made when all should be well, and how many of them were not nominal.
    pub(super) settled: (u64, u64),
}

impl Healing {
    /// Adds how these robots came back from one more fault.
    fn add(&mut self, robots: &[Arc<Robot>]) {
        self.faults += 1;
        for recovery in robots.iter().filter_map(|r| r.watch().recovery.take()) {
            self.settled.0 += recovery.settled.0;
            self.settled.1 += recovery.settled.1;
            self.nominal_after.extend(recovery.nominal_after.map(|t| t.as_secs_f64()));
            self.driven_after.extend(recovery.driven_after.map(|t| t.as_secs_f64()));
            self.unfinished += u32::from(!recovery.is_over());
        }
    }
}

pub(super) struct Soak {
    fleet: Arc<Fleet>,
    /// How long it lasts by the robots' clocks.
    pub(super) lasts: Duration,
    pub(super) pace: Pace,
    pub(super) robots: Vec<Arc<Robot>>,
    pub(super) violations: Violations,
    pub(super) healing: BTreeMap<&'static str, Healing>,
}

#[test]
fn robots_keep_driving_while_something_fails_every_five_seconds() {
    keep_driving(false);
}

#[test]
fn robots_keep_driving_over_tls_while_something_fails_every_five_seconds() {
    keep_driving(true);
}

fn keep_driving(is_secure: bool) {
    let _turn = turn();
    let runtime = two_workers();
    runtime.block_on(soak(soak_time(40), is_secure));
    runtime.shutdown_timeout(Duration::from_secs(2));
}

/// Where a robot goes: to and fro, each time to another place if there are fewer robots than goals.
fn goals(robot: usize, robots: usize) -> Vec<Point2> {
    let per_end = GOALS_PER_END.div_ceil(robots);
    (0..per_end)
        .flat_map(|i| {
            let place = robot * per_end + i;
            let (aside, along) = (0.7 * (place % 5) as f64 - 1.4, 0.4 * (place / 5) as f64);
            let end = |x: f64| Point2::new(x, START.y + aside);
            [end(GOAL.x - along), end(START.x + along)]
        })
        .collect()
}

#[test]
fn robots_have_forty_goals_or_more_between_them() {
    for robots in ROBOTS {
        let all: Vec<Point2> = (0..robots).flat_map(|robot| goals(robot, robots)).collect();
        let apart = |a: &Point2, b: &Point2| a.distance_squared(*b).sqrt() > 0.3;
        assert!(all.len() >= 40, "{}", all.len());
        let is_new = |(i, goal): (usize, &Point2)| all[..i].iter().all(|other| apart(goal, other));
        assert!(all.iter().enumerate().all(is_new), "{all:?}");
    }
}

/// A fleet, its map, and the links of an operator and of the one who has the map.
pub(super) struct Site {
    pub(super) fleet: Arc<Fleet>,
    pub(super) operator: Session,
    host: Session,
    hosted: Server,
}

impl Site {
    pub(super) async fn start(robots: usize, is_secure: bool) -> Self {
        let fleet = Arc::new(Fleet::start(robots, is_secure));
        let operator = session::client(&fleet.config("operator")).await.unwrap();
        let host = session::client(&fleet.config(&format!("base.{}", robot(0)))).await.unwrap();
        let known = corridor_map::fields();
        let map = known.0.map(known.1).unwrap();
        let hosted = map_store::host(&host, convert::occupancy_grid_to_wire(&map.grid), &refusals()).unwrap();
        Self { fleet, operator, host, hosted }
    }

    pub(super) fn end(self) {
        drop(self.hosted);
        session::close(&self.host);
        session::close(&self.operator);
    }
}

async fn soak(lasts: Duration, is_secure: bool) {
    let count = ROBOTS[usize::from(lasts < LONG)];
    let site = Site::start(count, is_secure).await;
    let (pace, driving) = at_a_pace_that_is_kept(&site.fleet, lasts, count).await;
    let over = if is_secure { ", over TLS" } else { "" };
    println!("seed {SEED}, {} s, {count} robots, pace {}{over}", lasts.as_secs(), pace.speed());

    let wall = pace.scaled(lasts);
    let (window, mark) = if lasts >= LONG { (30, 300) } else { (5, wall.as_secs() / 3) };
    let mut memory = Memory::new(Duration::from_secs(window), Duration::from_secs(mark), wall);
    let (robots, violations) = (driving.robots.clone(), Violations::of("fleet"));
    let fleet = Arc::clone(&site.fleet);
    let mut soak = Soak { fleet, lasts, pace, robots, violations, healing: BTreeMap::new() };
    soak.suffer(&site.operator, &mut memory, wall).await;
    soak.settle(&site.operator).await;

    driving.end().await;
    site.end();
    soak.tell(&memory);
    soak.judge(&memory);
}

/// Robots that drive, each in a task of its own.
pub(super) struct Driving {
    pub(super) robots: Vec<Arc<Robot>>,
    tasks: Vec<JoinHandle<()>>,
    end: Arc<AtomicBool>,
}

impl Driving {
    pub(super) async fn start(fleet: &Fleet, count: usize, drive: Drive) -> Self {
        let mut robots = Vec::with_capacity(count);
        for i in 0..count {
            let (name, links) = (robot(i), links(fleet, &robot(i)).await);
            let seed = SEED + i as u64;
            robots.push(Arc::new(Robot::new(&name, seed, links, goals(i, count), is_tracked(i), drive)));
        }
        let begun: Vec<_> =
            robots.iter().cloned().map(|r| tokio::spawn(async move { r.begin().await })).collect();
        for task in begun {
            task.await.unwrap();
        }
        let end = Arc::new(AtomicBool::new(false));
        // Robots do not keep step with each other.
        let phase = |i: usize| drive.pace.tick() / count as u32 * i as u32;
        let tasks = (robots.iter().enumerate())
            .map(|(i, r)| tokio::spawn(Arc::clone(r).run(phase(i), Arc::clone(&end))))
            .collect();
        Self { robots, tasks, end }
    }

    pub(super) async fn end(self) {
        self.end.store(true, Ordering::Relaxed);
        for task in self.tasks {
            task.await.unwrap();
        }
        self.robots.iter().for_each(|robot| robot.leave());
    }
}

/// A robot's own links to the router, as on a machine of its own. Over TLS each shows the certificate of its part.
async fn links(fleet: &Fleet, robot: &str) -> Links {
    let operator = session::client(&fleet.config("operator")).await.unwrap();
    if !fleet.is_secure() {
        return Links { base: operator.clone(), localizer: operator.clone(), operator };
    }
    let as_part =
        async |part: &str| session::client(&fleet.config(&format!("{part}.{robot}"))).await.unwrap();
    Links { base: as_part("base").await, localizer: as_part("localizer").await, operator }
}

/// The fastest pace that this machine keeps while nothing fails, tried out, and robots that drive at it. A long run is
/// always at 10 Hz.
async fn at_a_pace_that_is_kept(fleet: &Fleet, lasts: Duration, count: usize) -> (Pace, Driving) {
    for halvings in 0.. {
        let drive = Drive { pace: Pace::halved(halvings), is_long: lasts >= LONG };
        let driving = Driving::start(fleet, count, drive).await;
        if drive.is_long || drive.pace.is_slowest() {
            return (drive.pace, driving);
        }
        tokio::time::sleep(drive.pace.scaled(TRIAL)).await;
        let Counts { ticks, decisions, .. } = driving.robots.iter().map(|r| r.watch().counts).sum();
        let due = TRIAL.as_secs_f64() / TICK * count as f64;
        println!("at {} of the pace: {ticks} ticks of {due}, {decisions} decisions", drive.pace.speed());
        if ticks as f64 > KEPT * due && decisions as f64 > KEPT * due {
            return (drive.pace, driving);
        }
        driving.end().await;
    }
    unreachable!("there is a slowest pace")
}

impl Soak {
    /// Lets things fail, one after the other, until the time is over.
    async fn suffer(&mut self, session: &Session, memory: &mut Memory, lasts: Duration) {
        let begun = Instant::now();
        let Self { fleet, pace, robots, violations, healing, .. } = self;
        let fault_every = pace.scaled(FAULT_EVERY);
        let faults = async {
            let mut rng = rng(SEED, 79);
            let count = (lasts.as_secs() / fault_every.as_secs()) as u32;
            // Each kind once before one comes again, so that a short run has them all.
            let mut kinds = Vec::new();
            for round in 1..count {
                tokio::time::sleep((fault_every * round).saturating_sub(begun.elapsed())).await;
                if kinds.is_empty() {
                    kinds.extend(0..KINDS);
                }
                let kind = kinds.swap_remove(which(&mut rng, kinds.len()));
                let outage = Outage::of_kind(kind, &mut rng, robots.len(), *pace);
                let (fleet, happening) = (Arc::clone(fleet), outage.clone());
                tokio::task::spawn_blocking(move || happening.happen(&fleet)).await.unwrap();
                robots.iter().for_each(|robot| robot.watch().heal());
                tokio::time::sleep((fault_every * (round + 1)).saturating_sub(begun.elapsed())).await;
                healing.entry(outage.kind()).or_default().add(robots);
            }
        };
        let watching = async {
            let mut told = Duration::ZERO;
            while begun.elapsed() < lasts {
                tokio::time::sleep(Duration::from_secs(1)).await;
                let size = memory.sample(begun.elapsed(), &fleet.pids());
                if begun.elapsed() > told + Duration::from_secs(60) {
                    told += Duration::from_secs(60);
                    println!("{:5} s: {size:.1} MiB", told.as_secs());
                }
                queues_are_bounded(session, violations).await;
                nothing_has_ended(fleet, violations);
            }
        };
        tokio::join!(faults, watching);
    }

    /// Nothing fails any more: waits until all is well.
    async fn settle(&mut self, session: &Session) {
        self.robots.iter().for_each(|robot| robot.watch().heal());
        let begun = Instant::now();
        let mut answered_before: BTreeMap<String, u64> = BTreeMap::new();
        let unwell = loop {
            let stands = |r: &&Arc<Robot>| r.watch().recovery.is_none_or(|r| r.driven_after.is_none());
            let mut unwell: Vec<String> =
                self.robots.iter().filter(stands).map(|r| r.name().to_owned()).collect();
            for (name, status) in statuses(session).await {
                let before = *answered_before.entry(name.clone()).or_insert(status.requests);
                unwell.extend((status.requests <= before).then_some(name));
            }
            if (unwell.is_empty() && answered_before.len() == POOL.len() * REPLICAS)
                || begun.elapsed() > SETTLE_MAX
            {
                break unwell;
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        };
        println!("all is well {:.1} s after the last fault", begun.elapsed().as_secs_f64());
        self.violations.check(begun.elapsed() <= SETTLE_MAX, HEALED, || {
            format!("not with {unwell:?}; replicas that answer: {answered_before:?}")
        });
        nothing_has_ended(&self.fleet, &mut self.violations);
    }
}

fn nothing_has_ended(fleet: &Fleet, violations: &mut Violations) {
    let ended = fleet.ended();
    violations.check(ended.is_empty(), "no process ends by itself", || format!("{ended:?}"));
}

/// What each replica says of itself; one that is gone or stands still says nothing.
async fn statuses(session: &Session) -> Vec<(String, ServiceStatus)> {
    let mut statuses = Vec::new();
    for role in POOL {
        for index in 0..REPLICAS {
            let name = format!("{role}-{index}");
            let key = keys::status(role, &name).unwrap();
            let status = fetch(session, &key, STATUS_TIMEOUT).await;
            statuses.extend(status.ok().map(|status| (name, status)));
        }
    }
    statuses
}

/// Invariant 8, as far as replicas tell.
async fn queues_are_bounded(session: &Session, violations: &mut Violations) {
    for (name, status) in statuses(session).await {
        // In units of its only slot.
        violations
            .check(status.load <= IN_FLIGHT_MAX, BOUNDED, || format!("{} in flight at {name}", status.load));
    }
}
