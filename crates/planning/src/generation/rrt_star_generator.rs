//! The paper's generator (Alg. 1): a tree of Dubins edges that follows the robot, and its branches as candidates.

use crate::generation::pose_tree::Nodes;
use crate::generation::{
    Generated, GenerationInput, Landmarks, Pace, RrtStar, SampleSpace, Tree, find_candidates, update,
};

/// The candidates of one cycle.
pub fn generate(input: &GenerationInput<'_>, tree: Option<Tree>, pace: &Pace<'_>) -> Generated {
    let params = &input.params.generation.tree;
    let checker = input.checker();
    let pose = input.scene.belief.pose;
    let horizon = input.params.dt * input.params.steps as f64;
    let radius = input.robot.v_max * horizon + params.disc_margin;
    let way = input.geodesic.descend_for(pose.position(), 0.2, radius);

    let old = tree.as_ref().and_then(Nodes::of).unwrap_or_default();
    let room = params.max_nodes.saturating_sub(params.iterations) as usize;
    let tree = update::reroot(old, pose, radius, params, &checker);
    let tree = update::thin(tree, room, |t, n| t.cost[n] + input.geodesic.at(t.position(n)));

    let warm_up = if old.is_empty() { params.warm_up } else { 0 };
    let seen = input.information.filter(|_| params.informative > 0.0);
    let landmarks = seen.map(|field| Landmarks::new(field.worth_around(pose.position(), radius)));
    let landmarks = &landmarks.unwrap_or_default();
    let space = SampleSpace { grid: &input.map.grid, centre: pose.position(), radius, way: &way, landmarks };
    let mut search = RrtStar::new(params, &checker, &space, tree);
    search.grow(params.iterations + warm_up, &mut input.samples(), pace);
    let tree = search.into_tree();

    let candidates = find_candidates(input, &tree, &way, &checker, pace);
    Generated { candidates, tree: tree.into_value() }
}
