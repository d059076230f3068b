//! The paper's generator (Alg. 1): a tree of Dubins edges that follows the robot, and its branches as candidates.

use crate::collision::CollisionChecker;
use crate::generation::generator::SAMPLES;
use crate::generation::{
    Generated, GenerationInput, GenerationParams, Generator, RrtStar, SampleSpace, Tree, find_candidates,
    update,
};
use crate::random::rng;

/// The paper's generator: RRT* with Dubins edges.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RrtStarGenerator {
    /// Its parameters.
    pub params: GenerationParams,
}

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
        let way = input.geodesic.descend_for(pose.position(), 0.2, radius);

        let old = tree.filter(|t| t.check().is_ok() && t.has_columns(&[])).unwrap_or_default();
        let room = params.tree.max_nodes.saturating_sub(params.tree.iterations) as usize;
        let tree = update::reroot(&old, pose, radius, &params.tree, &checker);
        let tree = update::thin(tree, room, |t, n| t.cost[n] + input.geodesic.at(t.position(n)));

        let warm_up = if old.is_empty() { params.tree.warm_up } else { 0 };
        let iterations = params.tree.iterations + warm_up;
        let mut search = RrtStar::new(&params.tree, &checker, tree);
        let space = SampleSpace { grid, centre: pose.position(), radius, way: &way };
        search.grow(&space, iterations, &mut rng(seed, SAMPLES + scene.tick), should_stop);
        let tree = search.into_tree();

        let candidates = find_candidates(input, &tree, &way, &checker, params, should_stop);
        Generated { candidates, tree }
    }
}
