//! What the arbiter carries from one cycle into the next.

use curionav_mission::convert;
use curionav_planning::arbitration::Observer;
use curionav_planning::planner::Carried;
use curionav_schemas::{self as wire, CommandReason, Reject};

/// (epoch, seq) of a decision: which arbiter made it, and its number among those of that arbiter.
pub type DecisionId = (u64, u64);

/// A command older than this says nothing of now, seconds of the robot's clock.
const BRAKING_AGE_MAX: f64 = 0.5;

/// What was closed counts as open again after so long, seconds. What is seen of a thing differs from scan to scan,
/// and a robot that has not looked for a while takes a way for open until it has looked again.
const OPEN_AGAIN: f64 = 5.0;

/// For how long something has kept the robot from its goal, seconds of the robot's clock.
#[derive(Debug, Clone, Copy, Default)]
struct Closed {
    since: Option<f64>,
    /// Since when it seems to be over.
    open_since: Option<f64>,
}

impl Closed {
    fn observe(&mut self, is_closed: bool, stamp: f64) {
        if is_closed {
            self.open_since = None;
            self.since.get_or_insert(stamp);
            return;
        }
        let open_since = *self.open_since.get_or_insert(stamp);
        if stamp - open_since >= OPEN_AGAIN {
            self.since = None;
        }
    }

    /// Since when it lasts, seconds of the robot's clock; nothing if it seems to be over.
    fn begun(&self) -> Option<f64> {
        self.since.filter(|_| self.open_since.is_none())
    }

    /// For how long it has lasted at `stamp`, seconds; 0 if it seems to be over.
    fn lasts(&self, stamp: f64) -> f64 {
        self.begun().map_or(0.0, |since| stamp - since)
    }
}

/// What the arbiter remembers from one cycle to the next.
#[derive(Debug, Default)]
pub struct Memory {
    /// Which arbiter this is: unlike any other of the robot.
    epoch: u64,
    /// Rises with every cycle.
    pub seq: u64,
    /// Tick of the last cycle that planned.
    planned: Option<u64>,
    /// What planning needs of the cycles before.
    pub carried: Carried,
    /// The driver's newest command: what became of the decisions before.
    pub driven: Option<wire::Twist>,
    /// Whether obstacles have closed every way, and for how long.
    ways: Closed,
    /// Whether people at the goal have made the robot wait, and for how long.
    goal: Closed,
    /// Whether the robot does not know where it is, and for how long.
    lost: Closed,
}

impl Memory {
    /// The memory of an arbiter that has just started. `epoch` must differ from that of any other arbiter of the robot.
    pub fn new(epoch: u64) -> Self {
        Self { epoch, ..Self::default() }
    }

    /// The memory that was carried into a recorded cycle: what is planned next is that cycle. Trees are only what
    /// they were if the generator is.
    pub fn recall(memory: wire::Memory) -> Result<Self, Reject> {
        let previous = memory.previous.map(convert::previous).transpose()?;
        let trees = memory.trees.into_iter().map(convert::tree);
        Ok(Self {
            epoch: memory.epoch,
            seq: memory.seq,
            planned: None,
            driven: memory.driven,
            ways: Closed::default(),
            goal: Closed::default(),
            lost: Closed::default(),
            carried: Carried {
                observer: Observer {
                    uncertain: memory.uncertain,
                    members: memory.members.0,
                    place: memory.place.map(convert::place),
                    region: memory.region.map(convert::place),
                    impatient_since: memory.impatient_since,
                    unseen: memory.unseen.map(convert::place),
                },
                trees: trees.map(|tree| Some(tree).filter(|t| !t.is_empty())).collect(),
                previous,
            },
        })
    }

    /// What is carried into the next cycle of `mission`, for a recorder.
    pub fn to_wire(&self, mission: &wire::Mission) -> wire::Memory {
        let Carried { observer, trees, previous } = &self.carried;
        let trees = trees.iter().cloned().map(Option::unwrap_or_default);
        wire::Memory {
            robot: mission.order.robot.clone(),
            epoch: self.epoch,
            seq: self.seq + 1,
            run: mission.run,
            revision: mission.revision,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            uncertain: observer.uncertain,
            members: observer.members.as_slice().into(),
            place: observer.place.map(convert::place_to_wire),
            region: observer.region.map(convert::place_to_wire),
            impatient_since: observer.impatient_since,
            unseen: observer.unseen.map(convert::place_to_wire),
            previous: previous.as_ref().map(convert::previous_to_wire),
            driven: self.driven.clone(),
            trees: trees.map(convert::tree_to_wire).collect(),
        }
    }

    /// The memory at the start of a mission: sequence numbers go on, nothing else does.
    pub fn fresh(&self) -> Self {
        Self { epoch: self.epoch, seq: self.seq, ..Self::default() }
    }

    /// Takes note of a command of the driver.
    pub fn observe_command(&mut self, command: &wire::Twist) {
        self.driven = Some(command.clone());
    }

    /// Seconds for which the driver has braked, at `stamp`, because something is too close; `None` if it does not.
    pub fn braked_for(&self, stamp: f64) -> Option<f64> {
        let command = self.driven.as_ref().filter(|c| c.reason == CommandReason::TooClose)?;
        let age = stamp - command.stamp;
        let seconds = command.stamp - command.since;
        ((0.0..=BRAKING_AGE_MAX).contains(&age) && seconds >= 0.0).then_some(seconds)
    }

    /// Takes note at `stamp` of whether obstacles close every way; gives back for how long they have, seconds.
    pub fn observe_ways(&mut self, are_closed: bool, stamp: f64) -> f64 {
        self.ways.observe(are_closed, stamp);
        self.ways.lasts(stamp)
    }

    /// Whether obstacles closed every way in the cycle before.
    pub fn are_ways_closed(&self) -> bool {
        self.ways.begun().is_some()
    }

    /// Takes note at `stamp` of whether people at the goal make the robot wait.
    pub fn observe_goal(&mut self, is_occupied: bool, stamp: f64) {
        self.goal.observe(is_occupied, stamp);
    }

    /// For how long people at the goal have made the robot wait at `stamp`, seconds.
    pub fn has_waited_for_goal(&self, stamp: f64) -> f64 {
        self.goal.lasts(stamp)
    }

    /// Takes note at `stamp` of whether the robot does not know where it is; gives back for how long it has not,
    /// seconds.
    pub fn observe_place(&mut self, is_lost: bool, stamp: f64) -> f64 {
        self.lost.observe(is_lost, stamp);
        self.lost.lasts(stamp)
    }

    /// Ways and the goal count as open again.
    pub fn forget_closed(&mut self) {
        self.ways = Closed::default();
        self.goal = Closed::default();
    }

    /// (epoch, seq) of the newest decision.
    pub fn id(&self) -> DecisionId {
        (self.epoch, self.seq)
    }

    /// Planning ticks of `period` ticks each between the last cycle and that of `tick`, which had no cycle.
    pub fn gap(&mut self, tick: u64, period: u64) -> u64 {
        let last = self.planned.replace(tick);
        last.map_or(0, |last| (tick.saturating_sub(last) / period.max(1)).saturating_sub(1))
    }
}

#[cfg(test)]
mod tests {
    use curionav_testing::golden;

    use super::*;

    #[test]
    fn what_was_carried_into_a_recorded_cycle_is_carried_on() {
        let recorded = golden::memory();
        let mission = golden::mission();
        let carried = Memory::recall(recorded.clone()).unwrap().to_wire(&mission);
        let run = mission.run;
        let revision = mission.revision;
        let seq = recorded.seq + 1;
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let robot = mission.order.robot;
        assert_eq!(carried, wire::Memory { robot, run, revision, seq, version, ..recorded });
    }

    #[test]
    fn ways_are_closed_until_one_was_open_for_a_while() {
        let mut memory = Memory::new(0);
        let seen = [(1.0, false), (2.0, true), (5.0, true), (6.0, false), (9.0, true), (10.0, false)];
        let closed_for = seen.map(|(stamp, are_closed)| memory.observe_ways(are_closed, stamp));
        assert_eq!(closed_for, [0.0, 0.0, 3.0, 0.0, 7.0, 0.0]);
        let closed_for =
            [(15.0, false), (16.0, true), (18.0, true)].map(|(t, closed)| memory.observe_ways(closed, t));
        assert_eq!(closed_for, [0.0, 0.0, 2.0]);
    }

    #[test]
    fn a_gap_is_what_has_no_cycle() {
        let mut memory = Memory::new(0);
        let gaps: Vec<u64> = [0, 3, 6, 15, 18].into_iter().map(|tick| memory.gap(tick, 3)).collect();
        assert_eq!(gaps, [0, 0, 0, 2, 0]);
    }
}
