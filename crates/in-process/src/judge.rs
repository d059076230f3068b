//! How a run is judged: whether a tick ends it, how it ended, and what is measured of it.

use curionav_crowdsim::World;
use curionav_crowdsim::outcome::Outcome;
use curionav_mission::convert;
use curionav_mission::fields::Fields;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_robot::driver::drive::given_up;
use curionav_schemas::{Belief, Decision, Mission, MissionEnd, Reject, RunResult};

use crate::record::Record;

/// Watches one run.
pub struct Judge {
    record: Record,
    believed: Option<Belief>,
}

/// How a run stands after a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// From where the robot truly is to its goal, metres.
    pub to_go: f64,
    /// How the run ended, if this tick has ended it.
    pub outcome: Option<Outcome>,
}

impl Judge {
    /// Of a run that is planned every `plan_every` ticks.
    pub fn new(plan_every: u32) -> Self {
        Self { record: Record::new(plan_every), believed: None }
    }

    /// Takes note of a tick: the newest belief, if one has come, and the decisions that have come.
    pub fn tick(
        &mut self,
        world: &World,
        mission: &Mission,
        belief: Option<Belief>,
        decisions: &[Decision],
    ) -> Standing {
        let truth = world.truth();
        self.believed = belief.or(self.believed.take());
        // Before the first belief, in real time, the robot knows what it was told.
        let belief = self.believed.clone().unwrap_or_else(|| convert::initial_belief(mission));
        self.record.tick(truth.clone(), &belief, world);
        let goal = goal_of(mission);
        let standing = |outcome| Standing { to_go: truth.pose.position().distance(goal), outcome };
        for decision in decisions {
            self.record.decision(decision, truth.tick);
            if decision.arrived {
                let arrival = Outcome::of_arrival(truth.pose, goal, mission.order.goal_tolerance);
                return standing(Some(arrival));
            }
        }
        let is_late = truth.time >= world.scenario().clock.time_limit_s;
        let estimate = Pose2::new(belief.x, belief.y, belief.heading);
        standing(is_late.then(|| Outcome::of_timeout(truth.pose, estimate)))
    }

    /// The result of the run, in which the robot planned with the profile `planner`.
    ///
    /// # Errors
    /// The way to the goal cannot be derived.
    pub fn finish(
        self,
        world: &World,
        mission: &Mission,
        planner: &str,
        outcome: Outcome,
        fields: &Fields,
    ) -> Result<RunResult, Reject> {
        self.record.finish(world, planner, mission.order.seed, outcome, goal_of(mission), fields)
    }
}

/// The scenario's goal, unless the robot was sent elsewhere on the way.
fn goal_of(mission: &Mission) -> Point2 {
    Point2::new(mission.order.goal_x, mission.order.goal_y)
}

/// Whether one of these decisions gives the mission up: its driver then ends it.
pub fn is_given_up(decisions: &[Decision]) -> bool {
    decisions.iter().any(|decision| given_up(decision).is_some())
}

/// What the end of its mission means for a run.
///
/// # Errors
/// The end itself, if the run has no outcome.
pub fn outcome_of(mission: &Mission) -> Result<Option<Outcome>, Box<MissionEnd>> {
    if !mission.is_over() {
        return Ok(None);
    }
    match mission.end.clone().unwrap_or(MissionEnd::Cancelled) {
        MissionEnd::NoWayToGoal | MissionEnd::GoalOccupied => Ok(Some(Outcome::NoWay)),
        MissionEnd::Lost => Ok(Some(Outcome::Lost)),
        end => Err(Box::new(end)),
    }
}
