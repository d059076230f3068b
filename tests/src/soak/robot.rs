//! One robot at 10 Hz: its base, its localiser, its missions. Of a robot with a tracker, the base has a laser that
//! measures walls and people; any other is told of all people.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::occupancy::StaticMap;
use curionav_planning::sensor::LaserModel;
use curionav_pool::context::PlanContext;
use curionav_runtime::command::Commander;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::convert;
use curionav_runtime::lease::{BaseLease, LeaseServers};
use curionav_runtime::query::fetch;
use curionav_runtime::serve::refusals;
use curionav_runtime::topic::{Flow, Inbox, Topic};
use curionav_schemas::{
    self as wire, Belief, Clock, CycleReport, Decision, Mission, MissionCommand, MissionState, Odometry,
    People, Scan, keys,
};
use zenoh::Session;

use super::watch::{Drive, Watch};
use crate::faults::base::{Base, TICK};
use crate::faults::corridor_map::{self, START};
use crate::invariants::HEALED;
use crate::pace::Pace;

/// How long the driver is asked again for what it must take, whatever else fails and however busy the machine is.
const PATIENCE: Duration = Duration::from_secs(120);
/// Longest without driving, whatever fails in between, and again: preparing for a new goal included. At 10 Hz.
const STANDSTILL_MAX: Duration = Duration::from_secs(30);

/// A robot's links to the router.
#[derive(Debug, Clone)]
pub(super) struct Links {
    /// As its base.
    pub(super) base: Session,
    /// As its localiser.
    pub(super) localizer: Session,
    /// As the one who sends it about and looks on.
    pub(super) operator: Session,
}

pub(super) struct Robot {
    links: Links,
    /// Its laser, and the walls that it measures.
    eyes: (LaserModel, Arc<StaticMap>),
    /// Whether people are what its tracker finds.
    is_tracked: bool,
    mission_key: String,
    /// Which driver it obeys.
    lease: Arc<BaseLease>,
    _lease: LeaseServers,
    mission: Mission,
    /// Where it goes, one after the other.
    goals: Vec<Point2>,
    watch: Mutex<Watch>,
    pace: Pace,
    /// Longest that a tick came late, and the sum, seconds.
    pub(super) lateness: Mutex<(f64, f64)>,
}

impl Robot {
    /// Robot `name`, driving to and fro in a corridor of its own to the goals of its own, with a tracker or without.
    pub(super) fn new(
        name: &str,
        seed: u64,
        links: Links,
        goals: Vec<Point2>,
        is_tracked: bool,
        drive: Drive,
    ) -> Self {
        let pace = drive.pace;
        let (fields, map) = corridor_map::fields();
        let eyes = (LaserModel::default(), fields.map(map).unwrap());
        let mut mission = corridor_map::mission(map, seed, Clock::Realtime, 1);
        mission.order.robot = name.to_owned();
        (mission.order.tick_s, mission.order.time_scale, mission.order.plan_every) = (TICK, pace.speed(), 1);
        mission.order.require = vec!["arbiter".into()];
        if is_tracked {
            mission.order.require.push("tracker".into());
        }
        let start = Pose2::new(START.x, goals[0].y, 0.0);
        mission.order.initial_pose = convert::pose_to_wire(start);
        let missions = goals.iter().map(|goal| {
            let mut mission = mission.clone();
            (mission.order.goal_x, mission.order.goal_y) = (goal.x, goal.y);
            mission
        });
        let missions: Vec<Mission> = missions.collect();
        let mission = missions[0].clone();
        let prepare = |mission| Arc::new(PlanContext::new(mission, &fields, true).unwrap());
        let watch = Mutex::new(Watch::new(name, missions.into_iter().map(prepare).collect(), drive));
        let config = ServiceConfig { robot: name.to_owned(), ..ServiceConfig::default() };
        let (lease, _lease) = BaseLease::serve(&links.base, &config, "base", &refusals()).unwrap();
        Self {
            links,
            eyes,
            is_tracked,
            mission_key: keys::robot(name, "mission").unwrap(),
            lease,
            _lease,
            mission,
            goals,
            watch,
            pace,
            lateness: Mutex::default(),
        }
    }

    pub(super) fn name(&self) -> &str {
        &self.mission.order.robot
    }

    pub(super) fn watch(&self) -> MutexGuard<'_, Watch> {
        self.watch.lock().unwrap()
    }

    /// Closes its links.
    pub(super) fn leave(&self) {
        let Links { base, localizer, operator } = &self.links;
        [base, localizer, operator].into_iter().for_each(curionav_runtime::session::close);
    }

    fn topic<M: wire::Message>(&self, link: &Session, stream: &str) -> Topic<M> {
        let key = keys::robot(&self.mission.order.robot, stream).unwrap();
        Topic::new(link, &key, Flow::Sensor).unwrap()
    }

    fn inbox<M: wire::Message>(&self, stream: &str) -> Inbox<M> {
        Inbox::new(&self.links.operator, &keys::robot(&self.mission.order.robot, stream).unwrap()).unwrap()
    }

    fn violation(&self, invariant: &str, what: String) {
        self.watch().violations().check(false, invariant, || what);
    }

    /// Asks the driver until it takes it.
    async fn request(&self, request: &MissionCommand) {
        let timeout = Duration::from_secs(2);
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            let operator = Commander::new(&self.links.operator, self.name(), "operator");
            let asked = operator.command_driver(request, self.lease.number(), timeout);
            if asked.await.is_ok() {
                return;
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
        self.violation("the driver takes missions", format!("not within {PATIENCE:?}"));
    }

    /// Sets its mission and waits until it runs.
    pub(super) async fn begin(&self) {
        self.request(&MissionCommand::Set { order: Box::new(self.mission.order.clone()) }).await;
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            let mission: Option<Mission> =
                fetch(&self.links.operator, &self.mission_key, Duration::from_secs(1)).await.ok();
            if mission.is_some_and(|m| m.state == MissionState::Running) {
                return;
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
        self.violation("the mission begins", format!("not within {PATIENCE:?}"));
    }

    /// Sends it to its next goal.
    fn turn_round(self: &Arc<Self>) {
        let arrived = {
            let mut watch = self.watch();
            watch.preparing_since = Some(Instant::now());
            watch.counts.goals += 1;
            watch.counts.goals as usize
        };
        let Point2 { x, y } = self.goals[arrived % self.goals.len()];
        let robot = Arc::clone(self);
        tokio::spawn(
            async move { robot.request(&MissionCommand::Goal { x, y, heading: None, way: None }).await },
        );
    }

    /// Tick after tick, the first after `phase`, until `end`.
    pub(super) async fn run(self: Arc<Self>, phase: Duration, end: Arc<AtomicBool>) {
        let mut base = Base::new(&self.mission);
        self.watch().followed_at = Instant::now();
        let decisions = self.inbox::<Decision>("decision");
        let commands = self.lease.commands(self.inbox::<wire::Twist>("cmd"));
        let reports = self.inbox::<CycleReport>("report");
        let odometry = self.topic::<Odometry>(&self.links.base, "odom");
        let scans = self.topic::<Scan>(&self.links.base, "scan");
        let beliefs = self.topic::<Belief>(&self.links.localizer, "belief");
        let people = self.topic::<People>(&self.links.base, "people");
        let (mut command, mut complained) = (None, false);
        let first = tokio::time::Instant::now() + phase;
        let mut pace = tokio::time::interval_at(first, self.pace.tick());
        pace.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        while !end.load(Ordering::Relaxed) {
            let due = pace.tick().await;
            self.note_lateness(due.elapsed().as_secs_f64());
            let arrived = self.hear(&decisions, &reports, &commands, &mut command);
            let driven = command.as_ref().map(|c: &wire::Twist| (c.stamp, Twist { v: c.v, omega: c.omega }));
            let metres = base.roll(driven);
            self.watch().rolled(base.now(), metres, base.twist.v, command.as_ref());
            let here = base.people();
            if !self.is_tracked {
                people.publish(&here, Clock::Realtime);
            }
            let (laser, walls) = &self.eyes;
            scans.publish(&base.measured(laser, walls), Clock::Realtime);
            beliefs.publish(&base.belief(), Clock::Realtime);
            odometry.publish(&base.odometry(), Clock::Realtime);
            let (preparing, stands) = {
                let watch = self.watch();
                (watch.preparing_since.is_some(), watch.followed_at.elapsed())
            };
            // Said once each time it stands.
            if stands < self.pace.scaled(STANDSTILL_MAX) {
                complained = false;
            } else if !complained {
                complained = true;
                let (at, words) = (base.pose, self.watch().last_words());
                self.violation(
                    HEALED,
                    format!("it has not driven for {stands:.1?}, preparing: {preparing}, at {at:?}: {words}"),
                );
            }
            if arrived && !preparing {
                self.turn_round();
            }
        }
    }

    /// Takes what has arrived; whether the robot has, too.
    fn hear(
        &self,
        decisions: &Inbox<Decision>,
        reports: &Inbox<CycleReport>,
        commands: &Inbox<wire::Twist>,
        newest: &mut Option<wire::Twist>,
    ) -> bool {
        let mut watch = self.watch();
        let mut arrived = false;
        while let Some(decision) = decisions.try_next() {
            arrived = decision.arrived;
            watch.decided(decision);
        }
        while let Some(report) = reports.try_next() {
            watch.reported(&report);
        }
        while let Some(command) = commands.try_next() {
            watch.commanded(&command);
            *newest = Some(command);
        }
        arrived
    }

    fn note_lateness(&self, late: f64) {
        let mut lateness = self.lateness.lock().unwrap();
        *lateness = (lateness.0.max(late), lateness.1 + late);
    }
}
