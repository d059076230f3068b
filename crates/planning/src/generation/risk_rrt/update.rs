//! Taking last cycle's tree over: while time passes, the root moves along the path that is driven.

use super::time_tree::TimeTree;
use crate::geometry::{Pose2, wrap_angle};
use crate::motion::step_facing;

/// A node is on the path that is driven when it differs from it by less than this, metres and radians
/// together: between two states a decision is straight where the tree is an arc.
const SAME: f64 = 0.05;

/// The part of `tree` that is still ahead `now` (seconds of the robot's clock), seen from the last node
/// already passed on the way to `driven`, the poses decided on one step, two steps, ... from now.
///
/// `None` when the tree has nothing on that way, or when the robot, at `pose`, is more than `off_path`
/// metres from where it would have to be: then the search starts anew.
pub fn follow(
    tree: &TimeTree,
    now: f64,
    pose: Pose2,
    driven: Option<&[Pose2]>,
    off_path: f64,
) -> Option<TimeTree> {
    let next = driven?.first()?;
    let elapsed = (now - tree.stamp) / tree.dt;
    // No branch has more steps than there are nodes.
    if !(elapsed > -1e-6 && elapsed < tree.nodes.len() as f64) {
        return None;
    }
    let passed = (elapsed + 1e-6).floor();
    let part = ((elapsed - passed) * tree.dt).max(0.0);
    let passed = passed as u32;
    // Between two nodes, the next decided pose lies on the edge after the next.
    let part = if part < 1e-6 * tree.dt { 0.0 } else { part };
    let depth = passed + if part > 0.0 { 2 } else { 1 };
    let (nearest, _) = tree
        .nodes
        .iter()
        .enumerate()
        .filter(|(_, node)| node.depth == depth)
        .map(|(index, _)| {
            let there = along(tree, index, part);
            let turn = wrap_angle(there.heading - next.heading).abs();
            (index, there.position().distance(next.position()) + turn)
        })
        .filter(|(_, apart)| *apart < SAME)
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let branch = tree.branch(nearest);
    let root = if passed == 0 { 0 } else { branch[passed as usize - 1] };
    let expected =
        if part > 0.0 { along(tree, branch[passed as usize], part) } else { tree.nodes[root].pose };
    let strayed = expected.position().distance(pose.position());
    (strayed <= off_path).then(|| tree.subtree(root))
}

/// The pose `part` seconds into the edge that leads to `node`; at the node itself if `part` is 0.
fn along(tree: &TimeTree, node: usize, part: f64) -> Pose2 {
    let n = &tree.nodes[node];
    match tree.parent(node) {
        Some(parent) if part > 0.0 => step_facing(tree.nodes[parent].facing(), n.twist, part).pose,
        _ => n.pose,
    }
}
