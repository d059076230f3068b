//! How a run ended (D13).

use curionav_planning::geometry::{Point2, Pose2};

/// At the time limit, a robot whose estimate is off by more than this was lost rather than slow, metres.
const LOST_ERROR_M: f64 = 2.0;

/// How a run ended. Collisions are counted beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The planner reported arrival, and the robot truly was at the goal.
    Reached,
    /// The time limit passed.
    Timeout,
    /// The planner reported arrival somewhere else, or the time limit passed while the estimate was wrong
    /// by more than 2 m.
    Lost,
    /// The planner gave up: obstacles that are on no map close every way, or people stand at the goal.
    NoWay,
}

impl Outcome {
    /// When the planner reports arrival: judged by the robot's true position.
    pub fn of_arrival(truth: Pose2, goal: Point2, tolerance: f64) -> Self {
        if truth.position().distance(goal) <= tolerance { Self::Reached } else { Self::Lost }
    }

    /// When the time limit has passed.
    pub fn of_timeout(truth: Pose2, estimate: Pose2) -> Self {
        let error = truth.position().distance(estimate.position());
        if error > LOST_ERROR_M { Self::Lost } else { Self::Timeout }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_truth_decides_about_an_arrival() {
        let goal = Point2::new(3.0, 0.0);
        assert_eq!(Outcome::of_arrival(Pose2::new(2.6, 0.3, 1.0), goal, 0.5), Outcome::Reached); // 0.5 m: 3-4-5
        assert_eq!(Outcome::of_arrival(Pose2::new(2.6, 0.4, 1.0), goal, 0.5), Outcome::Lost);
    }

    #[test]
    fn a_timeout_far_from_the_estimate_is_lost() {
        let truth = Pose2::new(1.0, 1.0, 0.0);
        assert_eq!(Outcome::of_timeout(truth, Pose2::new(1.0, 2.9, 0.0)), Outcome::Timeout);
        assert_eq!(Outcome::of_timeout(truth, Pose2::new(1.0, 3.1, 0.0)), Outcome::Lost);
    }
}
