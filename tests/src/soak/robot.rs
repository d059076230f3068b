//! One robot at 10 Hz: its base, its localiser, its missions.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use curionav_planning::geometry::{Pose2, Twist};
use curionav_pool::context::PlanContext;
use curionav_runtime::convert;
use curionav_runtime::query::{Urgency, ask, fetch};
use curionav_runtime::topic::{Flow, Inbox, Topic};
use curionav_schemas::{
    self as wire, Belief, Clock, CycleReport, Decision, Mission, MissionCommand, MissionState, Odometry,
    People, Scan, keys,
};
use zenoh::Session;

use super::watch::Watch;
use crate::faults::base::{Base, TICK};
use crate::faults::corridor_map::{self, GOAL, START};
use crate::invariants::HEALED;
use crate::pace::Pace;

/// How long the driver is asked again for what it must take, whatever else fails and however busy the machine is.
const PATIENCE: Duration = Duration::from_secs(120);
/// Longest without driving, whatever fails in between, and again: preparing for a new goal included. At 10 Hz.
const STANDSTILL_MAX: Duration = Duration::from_secs(30);

/// How robots drive.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drive {
    pub(super) pace: Pace,
    /// In a long run, which is on a machine with the time for it.
    pub(super) is_long: bool,
}

pub(super) struct Robot {
    session: Session,
    mission_key: String,
    command_key: String,
    mission: Mission,
    watch: Mutex<Watch>,
    pace: Pace,
    /// Longest that a tick came late, and the sum, seconds.
    pub(super) lateness: Mutex<(f64, f64)>,
}

impl Robot {
    /// Robot `name`, driving to and fro in a corridor of its own.
    pub(super) fn new(name: &str, seed: u64, session: &Session, Drive { pace, is_long }: Drive) -> Self {
        let (fields, map) = corridor_map::fields();
        let mut mission = corridor_map::mission(map, seed, Clock::Realtime, 1);
        mission.order.robot = name.to_owned();
        (mission.order.tick_s, mission.order.time_scale, mission.order.plan_every) = (TICK, pace.speed(), 1);
        mission.order.require = vec!["arbiter".into()];
        // A goal of its own: every pool holds the fields of many.
        let aside = (seed % 7) as f64 * 0.5 - 1.5;
        let start = Pose2::new(START.x, START.y + aside, 0.0);
        mission.order.initial_pose = convert::pose_to_wire(start);
        (mission.order.goal_x, mission.order.goal_y) = (GOAL.x, GOAL.y + aside);
        let mut back = mission.clone();
        (back.order.goal_x, back.order.goal_y) = (start.x, start.y);
        let contexts = [mission.clone(), back].map(|m| Arc::new(PlanContext::new(m, &fields, true).unwrap()));
        let watch = Mutex::new(Watch::new(name, contexts.to_vec(), is_long));
        Self {
            session: session.clone(),
            mission_key: keys::robot(name, "mission").unwrap(),
            command_key: keys::mission_command(name).unwrap(),
            mission,
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

    /// Closes its link.
    pub(super) fn leave(&self) {
        curionav_runtime::session::close(&self.session);
    }

    fn topic<M: wire::Message>(&self, stream: &str) -> Topic<M> {
        let key = keys::robot(&self.mission.order.robot, stream).unwrap();
        Topic::new(&self.session, &key, Flow::Sensor).unwrap()
    }

    fn inbox<M: wire::Message>(&self, stream: &str) -> Inbox<M> {
        Inbox::new(&self.session, &keys::robot(&self.mission.order.robot, stream).unwrap()).unwrap()
    }

    fn violation(&self, invariant: &str, what: String) {
        self.watch().violations().check(false, invariant, || what);
    }

    /// Asks the driver until it takes it.
    async fn request(&self, request: &MissionCommand) {
        let timeout = Duration::from_secs(2);
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            let asked =
                ask::<_, Mission>(&self.session, &self.command_key, request, timeout, Urgency::Normal);
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
                fetch(&self.session, &self.mission_key, Duration::from_secs(1)).await.ok();
            if mission.is_some_and(|m| m.state == MissionState::Running) {
                return;
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
        self.violation("the mission begins", format!("not within {PATIENCE:?}"));
    }

    /// Sends it to the other end of the corridor.
    fn turn_round(self: &Arc<Self>) {
        let to_start = {
            let mut watch = self.watch();
            watch.preparing_since = Some(Instant::now());
            watch.counts.goals += 1;
            watch.counts.goals % 2 == 1
        };
        let there = (self.mission.order.goal_x, self.mission.order.goal_y);
        let here = (self.mission.order.initial_pose.x, self.mission.order.initial_pose.y);
        let (x, y) = if to_start { here } else { there };
        let robot = Arc::clone(self);
        tokio::spawn(async move { robot.request(&MissionCommand::Goal { x, y, heading: None }).await });
    }

    /// Tick after tick, the first after `phase`, until `end`.
    pub(super) async fn run(self: Arc<Self>, phase: Duration, end: Arc<AtomicBool>) {
        let mut base = Base::new(&self.mission);
        self.watch().followed_at = Instant::now();
        let decisions = self.inbox::<Decision>("decision");
        let commands = self.inbox::<wire::Twist>("cmd");
        let reports = self.inbox::<CycleReport>("report");
        let odometry = self.topic::<Odometry>("odom");
        let scans = self.topic::<Scan>("scan");
        let beliefs = self.topic::<Belief>("belief");
        let people = self.topic::<People>("people");
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
            people.publish(&base.people(), Clock::Realtime);
            scans.publish(&base.scan(), Clock::Realtime);
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
