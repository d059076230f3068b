//! Taking last cycle's tree over: the robot has moved, so the root moves with it (Alg. 2, line 4; D15).

use crate::collision::CollisionChecker;
use crate::generation::dubins::Dubins;
use crate::generation::neighbours::Neighbours;
use crate::generation::pose_tree::{Nodes, PoseTree};
use crate::generation::rrt_star::{RrtStarParams, clear};
use crate::generation::tree::Tree;
use crate::geometry::{Facing, Pose2};

/// An edge to a node may be this much longer than the straight line: about a quarter turn. Longer ones lead to what the
/// robot has passed.
const DETOUR: f64 = 1.3;
/// Nodes tried as parents of one whose own is gone and that the new root does not reach.
const FOSTERS: usize = 4;

/// The tree seen from `root`: its nodes stay where they are, and each has the heading with which the shortest way from
/// its parent arrives. Nodes outside `radius` are dropped, and so are those the robot has passed. A node whose parent
/// is gone hangs on the new root, or on a near node, if a sensible edge leads there, and is dropped otherwise. Costs
/// are those from the new root.
pub fn reroot(
    old: Nodes<'_>,
    root: Pose2,
    radius: f64,
    params: &RrtStarParams,
    checker: &CollisionChecker<'_>,
) -> PoseTree {
    let room = old.len() + 1;
    let mut neighbours = Neighbours::new(root.position(), radius, params.eta);
    neighbours.reserve(room);
    let tree = PoseTree::with_room_for(room);
    let index = vec![None; old.len()];
    let nodes = Vec::with_capacity(room);
    let mut moved = Rerooting { old, params, checker, index, tree, nodes, neighbours };
    moved.put(root.into(), 0.0, Tree::NO_PARENT);
    let is_inside = |n: &usize| old.position(*n).distance_squared(root.position()) <= radius * radius;
    // Parents come before their children in the old tree, whose root is gone.
    let mut unreached: Vec<usize> = (1..old.len()).filter(is_inside).collect();
    unreached.retain(|&node| !moved.hang(node, moved.own_parent(node).unwrap_or(0)));
    let mut near = Vec::new();
    for node in unreached {
        if moved.own_parent(node).is_some_and(|parent| moved.hang(node, parent)) {
            continue;
        }
        moved.neighbours.within(old.position(node), params.eta, &mut near);
        near.retain(|&(_, n)| n > 0);
        near.iter_mut().for_each(|(way, n)| *way += moved.tree.cost[*n]);
        let shorter = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if near.len() > FOSTERS {
            near.select_nth_unstable_by(FOSTERS, shorter);
            near.truncate(FOSTERS);
        }
        near.sort_unstable_by(shorter);
        let _is_hung = near.iter().any(|&(_, n)| moved.hang(node, n));
    }
    moved.tree
}

struct Rerooting<'a> {
    old: Nodes<'a>,
    params: &'a RrtStarParams,
    checker: &'a CollisionChecker<'a>,
    /// Where each old node is in the new tree.
    index: Vec<Option<usize>>,
    tree: PoseTree,
    /// The new tree's nodes, with their directions and the radius of a disc around each that is known to be free.
    nodes: Vec<(Facing, f64)>,
    neighbours: Neighbours,
}

impl Rerooting<'_> {
    /// The parent that an old node had, in the new tree.
    fn own_parent(&self, node: usize) -> Option<usize> {
        self.index[self.old.parent(node)?]
    }

    /// Hangs an old node on one of the new tree, if the edge is no detour and is clear of walls.
    fn hang(&mut self, node: usize, parent: usize) -> bool {
        let (from, free) = self.nodes[parent];
        let to = self.old.position(node);
        let bound = (DETOUR * from.pose.position().distance(to)).min(self.params.max_edge);
        let path = Dubins::to_point(from, to, self.params.turning_radius);
        let sensible = path.filter(|(path, _)| path.length() <= bound && clear(path, free, self.checker));
        let Some((path, end)) = sensible else { return false };
        self.index[node] = Some(self.tree.len());
        self.put(end, self.tree.cost[parent] + path.length(), parent as u32);
        true
    }

    fn put(&mut self, at: Facing, cost: f64, parent: u32) {
        self.tree.push(at.pose, cost, parent);
        self.nodes.push((at, self.checker.wall_free(at.pose.position())));
        self.neighbours.push(at.pose.position());
    }
}

/// The tree without its least promising leaves: those with the greatest `length through the node`, until
/// at most `target` nodes are left.
pub fn thin(tree: PoseTree, target: usize, length_through: impl Fn(&PoseTree, usize) -> f64) -> PoseTree {
    if tree.len() <= target {
        return tree;
    }
    let mut alive = vec![true; tree.len()];
    let mut child_count: Vec<usize> = {
        let children = tree.children();
        (0..tree.len()).map(|node| children.of(node).len()).collect()
    };
    let mut count = tree.len();
    while count > target.max(1) {
        let mut leaves: Vec<(f64, usize)> = (1..tree.len())
            .filter(|&n| alive[n] && child_count[n] == 0)
            .map(|n| (length_through(&tree, n), n))
            .collect();
        leaves.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        // Half of the leaves at most before looking again: their parents become leaves.
        let batch = (count - target.max(1)).min(leaves.len().div_ceil(2));
        for &(_, leaf) in &leaves[..batch] {
            alive[leaf] = false;
            count -= 1;
            if let Some(p) = tree.parent(leaf) {
                child_count[p] -= 1;
            }
        }
    }
    tree.compact(|n| alive[n])
}
