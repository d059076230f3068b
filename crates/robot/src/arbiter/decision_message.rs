//! Decisions as messages.

use std::collections::BTreeMap;

use curionav_planning::arbitration::{self, Lack};
use curionav_planning::collision::{Collision, Obstacle};
use curionav_planning::scene::Scene;
use curionav_planning::trajectory::Trajectory;
use curionav_schemas::{
    self as wire, Action, Decision, Degradation, Evaluated, F64Array, PreviousState, Reason,
};

use super::memory::DecisionId;

/// The decision as it goes to the driver.
///
/// `evaluated` says what has evaluated each active term, `degraded` what the cycle had to do without, and `elapsed_us`
/// how long it took.
pub fn decision(
    id: DecisionId,
    scene: &Scene,
    decision: &arbitration::Decision,
    evaluated: BTreeMap<String, Evaluated>,
    degraded: Vec<Degradation>,
    elapsed_us: u64,
) -> Decision {
    let trajectory = &decision.trajectory;
    let states = decision.trajectory.states();
    Decision {
        valid_for_s: decision.valid_for,
        action: match decision.action {
            arbitration::Action::Follow => Action::Follow,
            arbitration::Action::Hold => Action::Hold,
            arbitration::Action::Stop => Action::Stop,
        },
        arrived: decision.arrived,
        candidate: decision.candidate,
        x: states.x.as_slice().into(),
        y: states.y.as_slice().into(),
        heading: states.heading.as_slice().into(),
        v: states.v.as_slice().into(),
        omega: states.omega.as_slice().into(),
        uncertainty: scene.belief.uncertainty(),
        uncertain: scene.uncertain,
        evaluated,
        degraded,
        elapsed_us,
        ..standstill(id, (scene.tick, scene.stamp), trajectory.dt(), reason_to_wire(&decision.reason))
    }
}

/// A stop that no cycle led to: the mission is not running, or an input is missing.
pub fn stop(
    id: DecisionId,
    belief: &wire::Belief,
    dt: f64,
    reason: Reason,
    degraded: Option<Degradation>,
) -> Decision {
    Decision {
        uncertainty: belief.covariance.iter().step_by(4).sum(),
        degraded: degraded.into_iter().collect(),
        ..standstill(id, (belief.tick, belief.stamp), dt, reason)
    }
}

/// Gives a decision that stands this motion to drive instead.
pub fn drive(decision: Decision, motion: &Trajectory, valid_for_s: f64) -> Decision {
    let states = motion.states();
    Decision {
        action: Action::Follow,
        valid_for_s,
        dt: motion.dt(),
        x: states.x.as_slice().into(),
        y: states.y.as_slice().into(),
        heading: states.heading.as_slice().into(),
        v: states.v.as_slice().into(),
        omega: states.omega.as_slice().into(),
        ..decision
    }
}

fn standstill((epoch, seq): DecisionId, (tick, stamp): (u64, f64), dt: f64, reason: Reason) -> Decision {
    let none = F64Array::default;
    Decision {
        epoch,
        seq,
        tick,
        stamp,
        valid_for_s: 0.0,
        action: Action::Stop,
        reason,
        arrived: false,
        candidate: None,
        dt,
        x: none(),
        y: none(),
        heading: none(),
        v: none(),
        omega: none(),
        uncertainty: 0.0,
        uncertain: false,
        evaluated: BTreeMap::new(),
        degraded: Vec::new(),
        elapsed_us: 0,
    }
}

fn reason_to_wire(reason: &arbitration::Reason) -> Reason {
    match reason {
        arbitration::Reason::Arrived => Reason::Arrived,
        arbitration::Reason::TurnsToHeading => Reason::TurnsToHeading,
        arbitration::Reason::WaitsForGoal => Reason::WaitsForGoal,
        arbitration::Reason::LeastCost => Reason::LeastCost,
        arbitration::Reason::LeastCostFree => Reason::LeastCostFree,
        arbitration::Reason::OnlySlowFree => Reason::OnlySlowFree,
        arbitration::Reason::Degraded { lack, previous } => {
            let previous = previous_to_wire(previous);
            match lack {
                Lack::NoCandidates => Reason::NoCandidates { previous },
                Lack::NotScored { term } => Reason::NotScored { term: term.clone(), previous },
                Lack::NoneFree => Reason::NoneFree { previous },
            }
        }
    }
}

fn previous_to_wire(previous: &arbitration::PreviousState) -> PreviousState {
    match *previous {
        arbitration::PreviousState::Held => PreviousState::Held,
        arbitration::PreviousState::Absent => PreviousState::Absent,
        arbitration::PreviousState::Expired => PreviousState::Expired,
        arbitration::PreviousState::Strayed { metres } => PreviousState::Strayed { distance_m: metres },
        arbitration::PreviousState::Collides(Collision { with, time: after_s, .. }) => match with {
            Obstacle::Wall => PreviousState::HitsWall { after_s },
            Obstacle::Person(person) => PreviousState::HitsPerson { person, after_s },
        },
    }
}
