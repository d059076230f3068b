//! Where two decisions about the same scene differ.

use curionav_schemas::{Action, Decision, Degradation, Reason};
use serde::Serialize;

/// One side of a difference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Side {
    /// What kind of decision.
    pub action: Action,
    /// Identifier of the candidate; comparable between planners with the same generator only.
    pub candidate: Option<u32>,
    /// Why.
    pub reason: Reason,
}

/// A cycle that was decided otherwise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// Whose decision.
    pub robot: String,
    /// Epoch of the arbiter that decided.
    pub epoch: u64,
    /// Number of the cycle within the epoch.
    pub seq: u64,
    /// Stamp of the scene, robot clock, s.
    pub time_s: f64,
    /// As it was recorded.
    pub recorded: Side,
    /// As it is decided now.
    pub replayed: Side,
    /// Greatest distance between states due at the same time, m; absent if one of the two stops.
    pub apart_m: Option<f64>,
    /// What was not as it should be when it was recorded: it may explain the difference.
    pub degraded: Vec<Degradation>,
}

impl Difference {
    /// What differs in what the robot is to do, bit for bit; nothing if it is the same.
    pub(super) fn between(robot: &str, recorded: &Decision, replayed: &Decision) -> Option<Self> {
        if recorded.action == replayed.action && bits(recorded) == bits(replayed) {
            return None;
        }
        Some(Self {
            robot: robot.to_owned(),
            epoch: recorded.epoch,
            seq: recorded.seq,
            time_s: recorded.stamp,
            recorded: side(recorded),
            replayed: side(replayed),
            apart_m: apart(recorded, replayed),
            degraded: recorded.degraded.clone(),
        })
    }
}

fn bits(d: &Decision) -> [Vec<u64>; 5] {
    [&d.x, &d.y, &d.heading, &d.v, &d.omega].map(|a| a.iter().map(|n| n.to_bits()).collect())
}

fn side(decision: &Decision) -> Side {
    Side { action: decision.action, candidate: decision.candidate, reason: decision.reason.clone() }
}

fn apart(a: &Decision, b: &Decision) -> Option<f64> {
    let states = a.x.iter().zip(b.x.iter()).zip(a.y.iter().zip(b.y.iter()));
    let distances = states.map(|((ax, bx), (ay, by))| ((ax - bx).powi(2) + (ay - by).powi(2)).sqrt());
    distances.reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use curionav_testing::golden;

    use super::*;

    #[test]
    fn what_the_robot_is_to_do_makes_the_difference() {
        let recorded = golden::decision();
        // Who decided, and how long it took, does not.
        let same = Decision { epoch: 9, seq: 1, elapsed_us: 1, degraded: Vec::new(), ..recorded.clone() };
        assert_eq!(Difference::between("r1", &recorded, &same), None);

        let mut bent = recorded.clone();
        bent.y = vec![-0.4, -0.3, 0.05].into();
        let difference = Difference::between("r1", &recorded, &bent).unwrap();
        assert!((difference.apart_m.unwrap() - 0.3).abs() < 1e-12);

        let stopped = Difference::between("r1", &recorded, &golden::stop()).unwrap();
        assert_eq!((stopped.replayed.action, stopped.apart_m), (Action::Stop, None));
    }
}
