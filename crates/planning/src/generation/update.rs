//! Taking last cycle's tree over: the robot has moved, so the root moves with it (Alg. 2, line 4; D15).

use std::collections::VecDeque;

use crate::collision::CollisionChecker;
use crate::generation::neighbours::Neighbours;
use crate::generation::rrt_star::{RrtStarParams, edge};
use crate::generation::tree::{Children, Tree};
use crate::geometry::{Facing, Pose2};

/// An edge to a node whose parent is gone may be this much longer than the straight line: about a
/// quarter turn. Longer ones lead to what the robot has passed.
const DETOUR: f64 = 1.3;
/// Survivors tried for a node that the new root does not reach.
const FOSTERS: usize = 4;

/// The tree seen from `root`: nodes outside `radius` are dropped, nodes the robot has passed too; what
/// hung on them is hung on the new root or on surviving neighbours where a sensible edge leads there,
/// and dropped otherwise. Costs are those from the new root.
pub fn reroot(
    old: &Tree,
    root: Pose2,
    radius: f64,
    params: &RrtStarParams,
    checker: &CollisionChecker<'_>,
) -> Tree {
    let mut moved = Rerooting {
        inside: (0..old.len())
            .map(|n| old.position(n).distance_squared(root.position()) <= radius * radius)
            .collect(),
        children: old.children(),
        index: vec![None; old.len()],
        tree: Tree::rooted(root),
        neighbours: Neighbours::new(root.position(), radius, params.eta),
        old,
        params,
        checker,
    };
    moved.neighbours.push(root.position());
    if !old.is_empty() {
        let passed = moved.adopt_by_root();
        moved.adopt_by_survivors(&passed);
    }
    moved.tree.compact(|_| true)
}

struct Rerooting<'a> {
    old: &'a Tree,
    params: &'a RrtStarParams,
    checker: &'a CollisionChecker<'a>,
    inside: Vec<bool>,
    children: Children,
    /// Where each old node is in the new tree.
    index: Vec<Option<u32>>,
    tree: Tree,
    /// Of the new tree.
    neighbours: Neighbours,
}

impl Rerooting<'_> {
    /// Hangs on the root what it reaches, from the old root downwards, each with all that is below it;
    /// returns the nodes that were not reached, parents first.
    fn adopt_by_root(&mut self) -> Vec<usize> {
        let root = self.tree.pose(0).into();
        let mut open: VecDeque<u32> = self.children.of(0).iter().copied().collect();
        let mut unreached = Vec::new();
        while let Some(node) = open.pop_front() {
            let node = node as usize;
            match self.sensible(root, node) {
                Some(length) => self.adopt(node, 0, length),
                None => {
                    open.extend(self.children.of(node));
                    unreached.push(node);
                }
            }
        }
        unreached
    }

    /// Hangs what is left on nodes of the new tree, each with what is left below it.
    fn adopt_by_survivors(&mut self, unreached: &[usize]) {
        let mut near = Vec::new();
        for &node in unreached {
            if self.index[node].is_some() || !self.inside[node] {
                continue;
            }
            self.neighbours.within(self.old.position(node), self.params.eta, &mut near);
            near.retain(|&(_, n)| n > 0);
            near.iter_mut().for_each(|(way, n)| *way += self.tree.cost[*n]);
            near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            for &(_, parent) in near.iter().take(FOSTERS) {
                if let Some(length) = self.sensible(self.tree.pose(parent).into(), node) {
                    self.adopt(node, parent as u32, length);
                    break;
                }
            }
        }
    }

    /// Length of the edge from a pose to an old node, if the node still counts and the edge is no detour.
    fn sensible(&self, from: Facing, node: usize) -> Option<f64> {
        if !self.inside[node] {
            return None;
        }
        let to = self.old.pose(node);
        let bound = (DETOUR * from.pose.position().distance(to.position())).min(self.params.max_edge);
        let path = edge(from, to.into(), bound, self.params.turning_radius, self.checker)?;
        Some(path.length())
    }

    /// Puts an old node and its not yet placed descendants into the new tree.
    fn adopt(&mut self, node: usize, parent: u32, length: f64) {
        let cost = self.tree.cost[parent as usize] + length;
        let shift = cost - self.old.cost[node];
        let mut open = VecDeque::from([(node, parent)]);
        while let Some((node, parent)) = open.pop_front() {
            let index = self.tree.push(self.old.pose(node), self.old.cost[node] + shift, parent) as u32;
            self.neighbours.push(self.old.position(node));
            self.index[node] = Some(index);
            for &child in self.children.of(node) {
                let child = child as usize;
                if self.inside[child] && self.index[child].is_none() {
                    open.push_back((child, index));
                }
            }
        }
    }
}

/// The tree without its least promising leaves: those with the greatest `length through the node`, until
/// at most `target` nodes are left.
pub fn thin(tree: Tree, target: usize, length_through: impl Fn(&Tree, usize) -> f64) -> Tree {
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
