//! The robot: a simulated base and the real driver's judgement.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use curionav_planning::geometry::{Pose2, Twist};
use curionav_robot::driver::control::{Inputs, command};
use curionav_robot::driver::decision_fence::DecisionFence;
use curionav_robot::driver::guard::Guard;
use curionav_robot::driver::seen_way::SeenWay;
use curionav_runtime::guard_settings::GuardSettings;
use curionav_runtime::robot_limits::Ages;
use curionav_schemas::{
    self as wire, Action, Belief, Clock, CommandReason, Decision, Mission, Odometry, People,
};
use curionav_testing::golden;

use super::base::{Base, TICK};
use super::fault::{Epoch, Fault};
use super::invariants;
use super::world::World;

/// Ticks the driver remembers, as in production.
const REMEMBERED: usize = 64;

/// One tick as it was driven.
#[derive(Debug, Clone)]
pub(super) struct Driven {
    pub(super) now: f64,
    /// Metres.
    pub(super) distance: f64,
    pub(super) v: f64,
    /// What the driver said, if it was there.
    pub(super) command: Option<wire::Twist>,
    /// Metres between the robot and where its trajectory has it.
    pub(super) strayed: f64,
}

impl Driven {
    pub(super) fn reason(&self) -> Option<CommandReason> {
        self.command.as_ref().map(|command| command.reason)
    }
}

pub(super) struct Robot {
    pub(super) base: Base,
    command: Option<wire::Twist>,
    inbox: Vec<Decision>,
    fence: DecisionFence,
    guard: Guard,
    odometry_of: BTreeMap<u64, Odometry>,
    belief_of: BTreeMap<u64, Belief>,
    /// Every decision obeyed, with the time it was taken up and which life of the driver that was.
    pub(super) taken: Vec<(f64, u64, Decision)>,
    pub(super) lives: u64,
    pub(super) driven: Vec<Driven>,
}

impl Robot {
    pub(super) fn new(mission: &Mission) -> Self {
        Self {
            base: Base::new(mission),
            command: None,
            inbox: Vec::new(),
            fence: DecisionFence::default(),
            guard: guard(),
            odometry_of: BTreeMap::new(),
            belief_of: BTreeMap::new(),
            taken: Vec::new(),
            lives: 0,
            driven: Vec::new(),
        }
    }

    pub(super) fn receive(&mut self, decision: Decision) {
        self.inbox.push(decision);
    }

    /// A decision that no arbiter has made.
    pub(super) fn receive_foreign(&mut self, epoch: Epoch) {
        let obeyed = self.fence.newest().map(|d| d.epoch);
        let (epoch, seq) = match epoch {
            Epoch::Last => (u64::MAX, u64::MAX),
            Epoch::Same => (obeyed.unwrap_or(1), u64::MAX),
        };
        let (tick, stamp) = (self.base.tick, self.base.now());
        self.receive(Decision { epoch, seq, tick, stamp, action: Action::Stop, ..golden::decision() });
    }

    pub(super) fn waiting(&self) -> usize {
        self.inbox.len() + self.belief_of.len() + self.odometry_of.len()
    }

    /// All that the driver knew is gone.
    pub(super) fn crash_driver(&mut self) {
        self.fence = DecisionFence::default();
        self.guard = guard();
        self.belief_of.clear();
        self.odometry_of.clear();
        self.inbox.clear();
        self.lives += 1;
    }

    /// The driver's tick.
    fn drive(&mut self, belief: Option<Belief>, period: f64) -> wire::Twist {
        let odometry = self.base.odometry();
        remember(&mut self.odometry_of, self.base.tick, odometry.clone());
        if let Some(belief) = belief {
            remember(&mut self.belief_of, belief.tick, belief);
        }
        for decision in std::mem::take(&mut self.inbox) {
            if self.fence.admit(decision.clone(), self.base.now(), Clock::Realtime) {
                self.taken.push((self.base.now(), self.lives, decision));
            }
        }
        let scan = self.base.scan();
        let obeyed = self.fence.newest();
        let belief = self.belief_of.last_key_value().map(|(_, b)| b);
        let inputs = Inputs {
            odometry: &odometry,
            belief: belief.and_then(|b| Some((b, self.odometry_of.get(&b.tick)?))),
            scan: Some((&scan, &odometry)),
            blind: None,
            seen: &SeenWay::ALL,
            decision: obeyed,
            made_from: obeyed.and_then(|d| self.belief_of.get(&d.tick)),
            robot: &self.base.model,
            stopping: &self.base.model,
            ages: Ages::DEFAULT,
            period,
            on_its_way: &[],
        };
        let command = command(&inputs, &mut self.guard);
        let (epoch, seq) = obeyed.map_or((0, 0), |d| (d.epoch, d.seq));
        let (Twist { v, omega }, reason) = (command.twist, command.reason);
        let (tick, stamp) = (self.base.tick, self.base.now());
        let command = wire::Twist { epoch, seq, tick, stamp, v, omega, reason, ..golden::twist() };
        self.command.insert(command).clone()
    }

    /// A tick of driver and base.
    pub(super) fn turn(&mut self, belief: Belief) {
        let command = self.drive(Some(belief), TICK);
        self.roll(Some(command));
    }

    /// The base's tick.
    fn roll(&mut self, command: Option<wire::Twist>) {
        let newest = self.command.as_ref().map(|c| (c.stamp, Twist { v: c.v, omega: c.omega }));
        let distance = self.base.roll(newest);
        let decision = self.fence.newest().filter(|d| d.action != Action::Stop);
        let strayed = decision.map_or(0.0, |d| strayed(d, self.base.now(), self.base.pose));
        self.driven.push(Driven { now: self.base.now(), distance, v: self.base.twist.v, command, strayed });
    }
}

fn guard() -> Guard {
    Guard::new(GuardSettings::default(), Vec::new())
}

/// Metres between `pose` and the state of the trajectory that is due next.
fn strayed(decision: &Decision, now: f64, pose: Pose2) -> f64 {
    let next = (((now - decision.stamp) / decision.dt).ceil() as usize).clamp(1, decision.x.len()) - 1;
    let (dx, dy) = (decision.x[next] - pose.x, decision.y[next] - pose.y);
    (dx * dx + dy * dy).sqrt()
}

fn remember<T>(of: &mut BTreeMap<u64, T>, tick: u64, value: T) {
    of.insert(tick, value);
    while of.len() > REMEMBERED {
        of.pop_first();
    }
}

/// The robot, tick by tick.
pub(super) async fn run(world: Arc<World>) {
    let mut last_belief = None;
    loop {
        let belief = {
            let fresh = world.state().robot.base.belief();
            if world.has(|f| *f == Fault::NoLocalizer) {
                None
            } else if world.has(|f| *f == Fault::OldBelief) {
                last_belief.clone()
            } else {
                last_belief = Some(fresh.clone());
                Some(fresh)
            }
        };
        let people = world.state().robot.base.people();
        let people = (!world.has(|f| *f == Fault::NoPeople)).then_some(people);
        tell_arbiters(&world, belief.clone(), people);
        let drives = !world.has(|f| *f == Fault::DriverCrash);
        let command = drives.then(|| world.state().robot.drive(belief, TICK));
        if let Some(command) = command.as_ref().filter(|_| !world.has(|f| *f == Fault::NoDriver)) {
            tell_of_command(&world, command);
        }
        world.state().robot.roll(command);
        invariants::after_a_tick(&world);
        world.executor.sleep(Duration::from_secs_f64(TICK)).await;
    }
}

/// What is commanded reaches the arbiters, too.
fn tell_of_command(world: &Arc<World>, command: &wire::Twist) {
    let seats = world.state().arbiters.clone();
    for seat in seats {
        let command = command.clone();
        world.send(move |_| seat.latest.lock().unwrap().command = Some(command.clone()));
    }
}

/// What the arbiters hear, each in its own time: an older belief never replaces a newer one.
fn tell_arbiters(world: &Arc<World>, belief: Option<Belief>, people: Option<People>) {
    let seats = world.state().arbiters.clone();
    for seat in seats {
        let (belief, people, to) = (belief.clone(), people.clone(), Arc::clone(&seat));
        world.send(move |_| {
            let mut latest = to.latest.lock().unwrap();
            if people.as_ref().is_some_and(|new| latest.people.as_ref().is_none_or(|old| new.tick > old.tick))
            {
                latest.people.clone_from(&people);
            }
            if belief.as_ref().is_some_and(|new| latest.belief.as_ref().is_none_or(|old| new.tick > old.tick))
            {
                latest.belief.clone_from(&belief);
            }
            drop(latest);
            to.arrived.notify_one();
        });
    }
}
