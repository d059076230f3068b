//! The world that the claims about arbitration are made in.

use nalgebra::Matrix3;

use super::*;
use crate::geometry::Twist;
use crate::occupancy::OccupancyGrid;
use crate::scene::{Belief, People};
use crate::states::States;

pub(super) const STEPS: usize = 13;
pub(super) const DT: f64 = 0.3;

/// A hall of 40 m x 40 m without walls, the robot in its middle, the goal 15 m to the right.
pub(super) struct Hall {
    pub(super) profile: Profile,
    pub(super) scene: Scene,
    pub(super) map: StaticMap,
    pub(super) robot: RobotModel,
    pub(super) goal: Point2,
    pub(super) goal_heading: Option<f64>,
}

impl Hall {
    pub(super) fn new() -> Self {
        // Weights of 1: totals can be read off the costs.
        let mut profile = Profile::default();
        profile.terms.values_mut().for_each(|term| term.weight = 1.0);
        let grid = OccupancyGrid::new(80, 80, 0.5, Pose2::default(), vec![0; 80 * 80]).unwrap();
        let belief = Belief {
            pose: Pose2::new(20.0, 20.0, 0.0),
            covariance: Matrix3::identity() * 0.001,
            twist: Twist { v: 0.8, omega: 0.0 },
        };
        let people = People { radius: 0.3, ..People::default() };
        Self {
            profile,
            scene: Scene { tick: 3, stamp: 0.3, ..Scene::new(belief, people) },
            map: StaticMap::new(grid),
            robot: RobotModel::default(),
            goal: Point2::new(35.0, 20.0),
            goal_heading: None,
        }
    }

    pub(super) fn uncertain() -> Self {
        let mut hall = Self::new();
        hall.scene.uncertain = true;
        hall
    }

    pub(super) fn add_person(&mut self, x: f64, y: f64) {
        let people = &mut self.scene.people;
        people.id.push(people.id.len() as u32);
        people.x.push(x);
        people.y.push(y);
        people.vx.push(0.0);
        people.vy.push(0.0);
    }

    pub(super) fn context<'a>(
        &'a self,
        candidates: &'a CandidateSet,
        previous: Option<&'a Previous>,
    ) -> Context<'a> {
        let Self { profile, scene, map, robot, goal, goal_heading } = self;
        Context { profile, scene, map, robot, goal: *goal, goal_heading: *goal_heading, candidates, previous }
    }

    pub(super) fn arbitrate(
        &self,
        candidates: &CandidateSet,
        scores: &Scores,
        previous: Option<&Previous>,
    ) -> Verdict {
        arbitrate(&self.context(candidates, previous), scores)
    }
}

/// Straight ways from the hall's middle: id, direction (rad), speed (m/s).
pub(super) fn fan(ways: &[(u32, f64, f64)]) -> CandidateSet {
    let mut states = States::default();
    for &(_, direction, speed) in ways {
        let (s, c) = sin_cos(direction);
        for k in 1..=STEPS {
            let travel = speed * DT * k as f64;
            let pose = Pose2::new(20.0 + c * travel, 20.0 + s * travel, direction);
            states.push(pose, Twist { v: speed, omega: 0.0 });
        }
    }
    CandidateSet::new(STEPS, DT, ways.iter().map(|w| w.0).collect(), states).unwrap()
}

pub(super) fn scores(columns: &[(&str, &[f64])]) -> Scores {
    let mut scores = Scores::new(columns[0].1.len());
    for (term, costs) in columns {
        scores.insert(term, 0, costs).unwrap();
    }
    scores
}

/// Ids 5, 3 and 8: ahead, left, right at 0.8 m/s.
pub(super) fn three() -> CandidateSet {
    fan(&[(5, 0.0, 0.8), (3, 1.5, 0.8), (8, -1.5, 0.8)])
}

pub(super) fn previous(direction: f64, stamp: f64) -> Previous {
    let trajectory = Trajectory::of(&fan(&[(77, direction, 0.8)]), 0, Hall::new().scene.belief.motion());
    Previous { trajectory, candidate: Some(77), stamp, valid_for: 1.2 }
}
