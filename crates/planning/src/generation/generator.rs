//! What every generator takes and answers.

use std::cell::Cell;

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

/// How much of the time for an answer is over, for emergencies only: an answer that is cut short is usable but depends on
/// the machine.
pub struct Pace<'a> {
    spent: &'a dyn Fn() -> f64,
    cut: Cell<bool>,
}

impl<'a> Pace<'a> {
    /// Share of the time after which nothing grows any more: the rest is for making candidates of what has grown.
    pub const GROWTH: f64 = 0.6;

    /// `spent` gives the share of the time that is over, 1 or more when all of it is.
    pub fn new(spent: &'a dyn Fn() -> f64) -> Self {
        Self { spent, cut: Cell::new(false) }
    }

    /// Whether so much of the time is over that what takes until `share` of it has to end. The answer is then cut short.
    pub fn is_over(&self, share: f64) -> bool {
        let is_over = (self.spent)() >= share;
        self.cut.set(self.cut.get() || is_over);
        is_over
    }

    /// Whether anything had to end.
    pub fn has_cut(&self) -> bool {
        self.cut.get()
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
