//! What every generator takes and answers.

use crate::candidates::CandidateSet;
use crate::collision::CollisionChecker;
use crate::evaluation::cpc::InformationField;
use crate::generation::params::GeneratorPart;
use crate::generation::rollout::RolloutParams;
use crate::generation::tree::Tree;
use crate::geometry::{Point2, Pose2};
use crate::motion::RobotModel;
use crate::occupancy::{Detour, GeodesicField, StaticMap};
use crate::random::{Rng, rng};
use crate::scene::Scene;
use crate::speed_zones;

/// What a generator knows besides last cycle's tree.
#[derive(Debug, Clone, Copy)]
pub struct GenerationInput<'a> {
    /// How to generate.
    pub params: &'a GeneratorPart,
    /// The static world.
    pub map: &'a StaticMap,
    /// Where to go.
    pub goal: Point2,
    /// Distance to the goal. Best made for a radius a little above the robot's, so that the shortest way keeps the
    /// margins of [`crate::collision::CollisionParams`].
    pub geodesic: &'a GeodesicField,
    /// What an observation is worth where; needed by profiles whose samples look for landmarks
    /// ([`GeneratorPart::looks_for_landmarks`]).
    pub information: Option<&'a InformationField>,
    /// What the base can do.
    pub robot: &'a RobotModel,
    /// Belief and people.
    pub scene: &'a Scene,
    /// What is left of the trajectory decided before, to be offered again.
    pub previous: Option<&'a [Pose2]>,
    /// The run's. The same input, seed and tree give the same answer.
    pub seed: u64,
}

/// With less room than this on either side the way is narrow, metres.
const NARROW_M: f64 = 0.15;
/// Distance of the pursued point there at standstill, metres: from a farther one corners are cut by more than there is.
const CLOSE_LOOKAHEAD_M: f64 = 0.15;

impl<'a> GenerationInput<'a> {
    /// What says whether a candidate is free.
    pub fn checker(&self) -> CollisionChecker<'a> {
        CollisionChecker::new(self.map, self.robot, self.scene, self.params.forecast, &self.params.collision)
    }

    /// How paths are followed: closely where the way ahead is narrow.
    pub(super) fn rollout_params(&self) -> RolloutParams {
        let rollout = self.params.generation.rollout;
        let is_narrow = self.scene.passage.is_some_and(|room| room < NARROW_M);
        let lookahead = if is_narrow { rollout.lookahead.min(CLOSE_LOOKAHEAD_M) } else { rollout.lookahead };
        RolloutParams { lookahead, ..rollout }
    }

    /// The share of its greatest speed that the robot may plan with, because of speed zones.
    pub(super) fn allowed_share(&self) -> f64 {
        let here = self.scene.belief.pose.position();
        speed_zones::allowed_share(self.robot, &self.map.grid, here, self.params.held)
    }

    /// The shortest ways, past people who are slower than `speed`, m/s.
    pub(super) fn ways_past(&self, speed: f64) -> Detour<'a> {
        let people = &self.scene.people;
        let is_slow = |&i: &usize| people.speed(i) < speed;
        let bodies = (0..people.len()).filter(is_slow).map(|i| (people.position(i), people.radius));
        Detour::new(self.geodesic, self.map, self.scene.belief.pose.position(), bodies)
    }

    /// The candidates from which the robot can be stopped short of people who stop walking, numbered from 0; all of
    /// them if there is none such.
    pub(super) fn stoppable(&self, set: CandidateSet) -> CandidateSet {
        let checker = self.checker();
        let dt = set.dt();
        let reach = self.robot.v_max * dt + self.robot.stopping_distance(self.robot.v_max);
        let people = checker.over(1, dt, reach);
        let stops = |&i: &usize| {
            let states = set.range(i);
            let braking = self.robot.stopping_distance(set.all_states().v[states.start]);
            people.stops_short(set.all_states().poses(states), braking)
        };
        let stopping: Vec<usize> = (0..set.len()).filter(stops).collect();
        if stopping.is_empty() || stopping.len() == set.len() {
            return set;
        }
        CandidateSet::concat(set.steps(), dt, vec![set.pick(stopping)])
    }

    /// What samples of this tick are drawn from.
    pub(super) fn samples(&self) -> Rng {
        rng(self.seed, 0x5e_ed00_0000 + self.scene.tick)
    }
}

/// What a generator answers.
#[derive(Debug, Clone, PartialEq)]
pub struct Generated {
    /// Free candidates, all of the same number of states; ids count from 0.
    pub candidates: CandidateSet,
    /// The tree, to be handed back in the next cycle.
    pub tree: Tree,
}
