//! What a driver remembers from tick to tick, and the command that it makes of it.

use std::collections::BTreeMap;

use curionav_mission::convert;
use curionav_mission::robot_limits::Base;
use curionav_mission::scanner_limits::ScannerLimits;
use curionav_mission::ticks::has_started_over;
use curionav_planning::geometry::Twist;
use curionav_planning::occupancy::StaticMap;
use curionav_schemas::{
    self as wire, Belief, CommandReason, Decision, Mission, MissionEnd, Odometry, Reason, Reject, Scan,
};

use super::control::{Command, Inputs, braking, command, on_arrival, pose_of};
use super::guard::Guard;
use super::lookout::{Lookout, Sensed};
use super::sight::Blind;
use super::told::{OnItsWay, Told};

/// Ticks for which odometry and beliefs are remembered: longer than any decision is valid.
const REMEMBERED_TICKS: usize = 64;

/// Drives one robot by the decisions and messages of each tick.
#[derive(Debug)]
pub struct Drive {
    /// Bounds whatever a mission or a decision asks for.
    base: Base,
    odometry_of: BTreeMap<u64, Odometry>,
    belief_of: BTreeMap<u64, Belief>,
    told: Told,
    lookout: Lookout,
    /// Judges what the base is told.
    guard: Guard,
    /// Why the last command was given, and since which stamp every command has been given for this reason.
    reason: Option<(CommandReason, f64)>,
}

/// What a command is made from, beside what is remembered.
pub struct Now<'a> {
    /// What to do.
    pub mission: &'a Mission,
    /// Measured motion of this tick.
    pub odometry: &'a Odometry,
    /// The newest scan.
    pub scan: Option<&'a Scan>,
    /// Why the newest scan was refused, if it was.
    pub refused: Option<Reject>,
    /// The mission's map, if it is here.
    pub map: Option<&'a StaticMap>,
    /// The decision in force.
    pub decision: Option<&'a Decision>,
}

/// Under whose grant and on whose decision a command is given.
#[derive(Debug, Clone, Copy)]
pub struct Grounds {
    /// The grant of the base.
    pub lease: u64,
    /// Epoch and number of the newest decision; zeros without one.
    pub decision: (u64, u64),
}

impl Drive {
    /// Has heard nothing yet.
    pub fn new(base: Base, scanner: Option<ScannerLimits>, guard: Guard) -> Self {
        Self {
            lookout: Lookout::new(&base, scanner),
            base,
            odometry_of: BTreeMap::new(),
            belief_of: BTreeMap::new(),
            told: Told::default(),
            guard,
            reason: None,
        }
    }

    /// A mission has begun, or goes on to another goal.
    pub fn begin(&mut self, mission: &Mission) {
        self.lookout.begin(mission);
    }

    /// Forgets what belongs to a clock that is over.
    pub fn forget(&mut self) {
        self.odometry_of.clear();
        self.belief_of.clear();
        self.told.clear();
        self.guard.forget();
        self.reason = None;
        self.lookout.forget();
    }

    /// Takes note of odometry.
    pub fn measured(&mut self, odometry: Odometry) {
        remember(&mut self.odometry_of, odometry.tick, odometry);
    }

    /// Takes note of a belief.
    pub fn believed(&mut self, belief: Belief) {
        remember(&mut self.belief_of, belief.tick, belief);
    }

    /// Shows the guard what further sensors have seen last.
    pub fn see_further(&mut self, scans: &BTreeMap<String, Scan>) {
        for (sensor, scan) in scans {
            if let Some(at_scan) = self.odometry_of.get(&scan.tick) {
                self.guard.see_further(sensor, scan, pose_of(at_scan));
            }
        }
    }

    /// The newest odometry.
    pub fn newest_odometry(&self) -> Option<&Odometry> {
        self.odometry_of.last_key_value().map(|(_, odometry)| odometry)
    }

    /// The newest odometry of a tick before this one.
    pub fn odometry_before(&self, tick: u64) -> Option<&Odometry> {
        self.odometry_of.range(..tick).next_back().map(|(_, odometry)| odometry)
    }

    /// The newest belief.
    pub fn newest_belief(&self) -> Option<&Belief> {
        self.belief_of.last_key_value().map(|(_, belief)| belief)
    }

    /// Full braking on the present curve.
    pub fn braking(&self, mission: &Mission, odometry: &Odometry) -> Twist {
        let robot = convert::robot_model(&mission.order.robot_model);
        let moving = on_arrival(odometry, &self.on_its_way(mission, odometry.tick), &robot).twist;
        braking(moving, &self.base.stopping(&robot), mission.order.tick_s)
    }

    /// The command of a tick of a mission that runs; and why the robot counts as blind, if it does.
    pub fn command(&mut self, now: &Now<'_>) -> (Command, Option<Blind>) {
        let Now { mission, odometry, decision, .. } = *now;
        let robot = convert::robot_model(&mission.order.robot_model);
        let stopping = self.base.stopping(&robot);
        let on_its_way = self.on_its_way(mission, odometry.tick);
        let ages = self.base.ages();
        let belief = self.belief_of.last_key_value();
        let belief = belief.and_then(|(tick, b)| Some((b, self.odometry_of.get(tick)?)));
        let sensed = Sensed {
            scan: now.scan.and_then(|s| Some((s, self.odometry_of.get(&s.tick)?))),
            belief,
            refused: now.refused.clone(),
            map: now.map,
            now: odometry.stamp,
            age_max: ages.scan,
        };
        let blind = self.lookout.look(&sensed, mission, robot.radius());
        let inputs = Inputs {
            odometry,
            belief: sensed.belief,
            scan: sensed.scan,
            blind: blind.as_ref().map(|blind| blind.reason),
            seen: self.lookout.seen(),
            decision,
            made_from: decision.and_then(|d| self.belief_of.get(&d.tick)),
            robot: &robot,
            stopping: &stopping,
            ages,
            period: mission.order.tick_s,
            on_its_way: &on_its_way,
        };
        (command(&inputs, &mut self.guard), blind)
    }

    /// The message of a command, within the limits of base and mission: whatever was computed before, nothing else
    /// reaches the base.
    pub fn tell(
        &mut self,
        mission: &Mission,
        odometry: &Odometry,
        command: &Command,
        grounds: Grounds,
    ) -> wire::Twist {
        let Odometry { tick, stamp, .. } = *odometry;
        let Command { twist, reason } = *command;
        let Twist { v, omega } = self.base.clamp(twist, &convert::robot_model(&mission.order.robot_model));
        // A clock that has begun anew makes every reason a new one.
        let lasting = self.reason.filter(|(last, since)| *last == reason && *since <= stamp);
        if lasting.is_none() {
            tracing::debug!(reason = reason.code(), stamp, "commands are given for another reason");
        }
        let (_, since) = *self.reason.insert(lasting.unwrap_or((reason, stamp)));
        self.told.tell(tick, Twist { v, omega });
        let Grounds { lease, decision: (epoch, seq) } = grounds;
        wire::Twist { lease, epoch, seq, tick, stamp, v, omega, reason, since }
    }

    fn on_its_way(&self, mission: &Mission, tick: u64) -> Vec<OnItsWay> {
        let period = mission.order.tick_s;
        self.told.on_its_way(tick, self.base.latency(mission.order.clock, period), period)
    }
}

/// How a mission ends that the arbiter has given up. The robot stands by then.
pub fn given_up(decision: &Decision) -> Option<MissionEnd> {
    match decision.reason {
        Reason::NoWayToGoal => Some(MissionEnd::NoWayToGoal),
        Reason::GoalOccupied => Some(MissionEnd::GoalOccupied),
        Reason::PlaceUnknown => Some(MissionEnd::Lost),
        _ => None,
    }
}

/// Keeps the newest few. What is left of a clock that is over would count as newer for ever.
fn remember<T>(of: &mut BTreeMap<u64, T>, tick: u64, value: T) {
    if of.last_key_value().is_some_and(|(newest, _)| has_started_over(*newest, tick)) {
        of.clear();
    }
    of.insert(tick, value);
    while of.len() > REMEMBERED_TICKS {
        of.pop_first();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_remembered_is_the_newest_also_of_a_base_that_has_started_over() {
        let mut of = BTreeMap::new();
        (0..200).chain([197, 195]).for_each(|tick| remember(&mut of, tick, tick));
        assert_eq!((of.len(), of.last_key_value()), (REMEMBERED_TICKS, Some((&199, &199))));
        (0..3).for_each(|tick| remember(&mut of, tick, tick));
        assert_eq!(of.keys().copied().collect::<Vec<_>>(), [0, 1, 2]);
    }
}
