//! What every generator takes and answers.

use crate::candidates::CandidateSet;
use crate::forecast::ForecastParams;
use crate::generation::tree::Tree;
use crate::geometry::{Point2, Pose2};
use crate::motion::RobotModel;
use crate::occupancy::{GeodesicField, StaticMap};
use crate::scene::Scene;

/// Stream of [`crate::random::rng`] on which samples are drawn, one per tick.
pub(super) const SAMPLES: u64 = 0x5e_ed00_0000;

/// What a generator knows.
#[derive(Debug, Clone, Copy)]
pub struct GenerationInput<'a> {
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
    /// How people's uncertainty grows.
    pub forecast: ForecastParams,
    /// What is left of the trajectory decided before, to be offered again.
    pub previous: Option<&'a [Pose2]>,
}

/// What a generator answers.
#[derive(Debug, Clone, PartialEq)]
pub struct Generated {
    /// Free candidates, all of the same number of states; ids count from 0.
    pub candidates: CandidateSet,
    /// The tree, to be handed back in the next cycle.
    pub tree: Tree,
}

/// Makes candidates. Stateless: all that lasts is in the tree.
pub trait Generator: Send + Sync {
    /// Name, as in profiles.
    fn name(&self) -> &'static str;

    /// The candidates of one cycle. `tree` is what the last cycle answered, `seed` the run's; the same
    /// input, tree and seed give the same answer. `should_stop` is for emergencies: an answer cut short
    /// is usable but depends on the machine.
    fn generate(
        &self,
        input: &GenerationInput<'_>,
        tree: Option<Tree>,
        seed: u64,
        should_stop: &dyn Fn() -> bool,
    ) -> Generated;
}
