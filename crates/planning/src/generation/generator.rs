//! What every generator takes and answers.

use crate::candidates::CandidateSet;
use crate::collision::CollisionChecker;
use crate::generation::params::GeneratorPart;
use crate::generation::tree::Tree;
use crate::geometry::{Point2, Pose2};
use crate::motion::RobotModel;
use crate::occupancy::{GeodesicField, StaticMap};
use crate::random::{Rng, rng};
use crate::scene::Scene;

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
    /// What the base can do.
    pub robot: &'a RobotModel,
    /// Belief and people.
    pub scene: &'a Scene,
    /// What is left of the trajectory decided before, to be offered again.
    pub previous: Option<&'a [Pose2]>,
    /// The run's. The same input, seed and tree give the same answer.
    pub seed: u64,
}

impl<'a> GenerationInput<'a> {
    /// What says whether a candidate is free.
    pub fn checker(&self) -> CollisionChecker<'a> {
        CollisionChecker::new(self.map, self.robot, self.scene, self.params.forecast, &self.params.collision)
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
