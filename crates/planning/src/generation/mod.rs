//! How candidates come to be (Alg. 1): a tree lives across cycles as a value (D15), and each cycle its
//! branches, timed and checked, become the candidates (D14).
//!
//! Read in this order: [`rrt_star`] (how the tree grows), [`update`] (how it follows the robot),
//! [`candidates`] (what is offered), [`rollout`] (how a path becomes a trajectory). The baselines are
//! [`risk_rrt`] and [`bi_risk_rrt`].

pub mod bi_risk_rrt;
pub mod branches;
pub mod candidates;
pub mod dubins;
mod neighbours;
pub mod path;
pub mod risk_rrt;
pub mod rollout;
pub mod rrt_star;
pub mod tree;
pub mod update;

use serde::{Deserialize, Serialize};

use crate::candidates::CandidateSet;
use crate::collision::{CollisionChecker, CollisionParams};
use crate::collision_risk::RiskParams;
use crate::forecast::ForecastParams;
use crate::geometry::{Point2, Pose2};
use crate::motion::RobotModel;
use crate::occupancy::{GeodesicField, StaticMap};
use crate::random::rng;
use crate::scene::Scene;

pub use bi_risk_rrt::{BiRiskRrtGenerator, BiRiskRrtParams};
pub use candidates::{CandidateParams, find_candidates};
pub use risk_rrt::{RiskRrtGenerator, RiskRrtParams};
pub use rollout::RolloutParams;
pub use rrt_star::{RrtStar, RrtStarParams, SampleSpace};
pub use tree::{Tree, TreeError};

/// Parameters of the generators.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GenerationParams {
    /// How the tree grows.
    pub tree: RrtStarParams,
    /// How its branches are driven.
    pub rollout: RolloutParams,
    /// What is offered.
    pub candidates: CandidateParams,
    /// The tree of the Risk-RRT baselines.
    pub risk_rrt: RiskRrtParams,
    /// What Bi-Risk-RRT does besides.
    pub bi_risk_rrt: BiRiskRrtParams,
    /// How much room is kept. Skipped: a profile says it once for everybody.
    #[serde(skip)]
    pub collision: CollisionParams,
    /// How the baselines weigh risk. Skipped likewise.
    #[serde(skip)]
    pub risk: RiskParams,
}

/// What a generator knows.
#[derive(Debug, Clone, Copy)]
pub struct GenerationInput<'a> {
    /// The static world.
    pub map: &'a StaticMap,
    /// Where to go.
    pub goal: Point2,
    /// Distance to the goal. Best made for a radius a little above the robot's, so that the shortest way keeps the
    /// margins of [`CollisionParams`].
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

/// Names of the generators there are.
pub const NAMES: [&str; 3] = ["rrt-star", "risk-rrt", "bi-risk-rrt"];

/// The generator of that name.
pub fn by_name(name: &str, params: GenerationParams) -> Option<Box<dyn Generator>> {
    match name {
        "rrt-star" => Some(Box::new(RrtStarGenerator { params })),
        "risk-rrt" => Some(Box::new(RiskRrtGenerator { params })),
        "bi-risk-rrt" => Some(Box::new(BiRiskRrtGenerator { params })),
        _ => None,
    }
}

/// The paper's generator: RRT* with Dubins edges.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RrtStarGenerator {
    /// Its parameters.
    pub params: GenerationParams,
}

/// Stream of [`crate::random::rng`] on which samples are drawn, one a tick.
const SAMPLES: u64 = 0x5e_ed00_0000;

impl Generator for RrtStarGenerator {
    fn name(&self) -> &'static str {
        "rrt-star"
    }

    fn generate(
        &self,
        input: &GenerationInput<'_>,
        tree: Option<Tree>,
        seed: u64,
        should_stop: &dyn Fn() -> bool,
    ) -> Generated {
        let params = &self.params;
        let (scene, grid) = (input.scene, &input.map.grid);
        let pose = scene.belief.pose;
        let checker = CollisionChecker::new(input.map, input.robot, scene, input.forecast, &params.collision);
        let horizon = params.candidates.dt * f64::from(params.candidates.steps);
        let radius = input.robot.v_max * horizon + params.tree.disc_margin;
        let way = input.geodesic.descend_for(grid, pose.position(), 0.2, radius);

        let old = tree.filter(|t| t.check().is_ok() && t.has_columns(&[])).unwrap_or_default();
        let room = params.tree.max_nodes.saturating_sub(params.tree.iterations) as usize;
        let tree = update::reroot(&old, pose, radius, &params.tree, &checker);
        let tree = update::thin(tree, room, |t, n| t.cost[n] + input.geodesic.at(grid, t.position(n)));

        let warm_up = if old.is_empty() { params.tree.warm_up } else { 0 };
        let iterations = params.tree.iterations + warm_up;
        let mut search = RrtStar::new(&params.tree, &checker, tree);
        let space = SampleSpace { grid, centre: pose.position(), radius, way: &way };
        search.grow(&space, iterations, &mut rng(seed, SAMPLES + scene.tick), should_stop);
        let tree = search.into_tree();

        let candidates = find_candidates(
            input,
            &tree,
            &way,
            &checker,
            &params.candidates,
            &params.rollout,
            params.tree.turning_radius,
        );
        Generated { candidates, tree }
    }
}

#[cfg(test)]
mod tests;
