//! Which branches of the tree are worth timing.

use std::collections::BTreeSet;
use std::ops::Range;

use crate::generation::dubins::Dubins;
use crate::generation::path::Path;
use crate::generation::pose_tree::PoseTree;
use crate::geometry::{Point2, bearing};

/// Branches shorter than this lead nowhere, metres.
const SHORTEST: f64 = 0.8;
/// Where branches that end alike may still differ: the cell of their node after this way, metres.
const FORK: f64 = 1.0;
/// Side of that cell, metres.
const FORK_CELL: f64 = 0.4;
/// Directions among which branches are spread.
const SECTORS: usize = 12;

/// One branch, before its edges are rebuilt.
struct Branch {
    end: usize,
    sector: usize,
    length_through: f64,
}

/// Paths from the root to where each branch ends or passes `reach` metres, at most `most` of them: one
/// for every pair of cells (an early one and the end's, of side `end_cell`), the directions taking turns,
/// in each the one first whose way on to the goal is shortest by `to_go`.
pub fn branches(
    tree: &PoseTree,
    most: usize,
    reach: f64,
    end_cell: f64,
    turning_radius: f64,
    to_go: impl Fn(Point2) -> f64,
) -> Vec<Path> {
    if tree.is_empty() {
        return Vec::new();
    }
    let root = tree.position(0);
    let mut is_leaf = vec![true; tree.len()];
    for n in 1..tree.len() {
        if let Some(p) = tree.parent(n) {
            is_leaf[p] = false;
        }
    }
    let ends = (1..tree.len()).filter(|&n| {
        let parent_cost = tree.parent(n).map_or(0.0, |p| tree.cost[p]);
        let cut = tree.cost[n] >= reach && parent_cost < reach;
        cut || (is_leaf[n] && tree.cost[n] < reach && tree.cost[n] >= SHORTEST)
    });
    let mut all: Vec<Branch> = ends
        .map(|end| {
            let p = tree.position(end);
            Branch { end, sector: sector(root, p), length_through: tree.cost[end] + to_go(p) }
        })
        .collect();
    all.sort_by(|a, b| a.length_through.total_cmp(&b.length_through).then(a.end.cmp(&b.end)));
    let mut seen = BTreeSet::new();
    all.retain(|b| {
        let fork = tree.position(fork(tree, b.end));
        seen.insert((cell(fork, FORK_CELL), cell(tree.position(b.end), end_cell)))
    });
    let mut edges = Edges::new(tree, turning_radius);
    let turns = in_turns(all.iter().map(|b| b.sector));
    turns.into_iter().take(most).map(|k| edges.path_to(all[k].end, reach)).collect()
}

/// Which of the [`SECTORS`] around `from` a point lies in.
pub(super) fn sector(from: Point2, p: Point2) -> usize {
    let turn = 0.5 + bearing(from, p) / std::f64::consts::TAU;
    ((turn * SECTORS as f64) as usize).min(SECTORS - 1)
}

/// The indices of `sectors` in another order: the first of every sector, then the second of every sector, and so on.
pub(super) fn in_turns(sectors: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut seen = [0_usize; SECTORS];
    let rank = |sector: usize| {
        seen[sector] += 1;
        seen[sector]
    };
    let mut turns: Vec<(usize, usize)> = sectors.map(rank).zip(0..).collect();
    turns.sort_unstable();
    turns.into_iter().map(|(_, index)| index).collect()
}

/// Column and row of a square of the plane.
pub(super) type Cell = (i64, i64);

/// The square of that side, metres, in which a point lies.
pub(super) fn cell(p: Point2, side: f64) -> Cell {
    ((p.x / side).floor() as i64, (p.y / side).floor() as i64)
}

/// The first node of the branch to `end` at or beyond [`FORK`].
fn fork(tree: &PoseTree, end: usize) -> usize {
    let mut node = end;
    while let Some(p) = tree.parent(node).filter(|&p| tree.cost[p] >= FORK) {
        node = p;
    }
    node
}

/// The edges of a tree as points, each rebuilt once however many branches share it.
struct Edges<'a> {
    tree: &'a PoseTree,
    turning_radius: f64,
    points: Vec<Point2>,
    /// Where in `points` the edge to each node is; empty until it has been rebuilt.
    ranges: Vec<Range<usize>>,
}

impl<'a> Edges<'a> {
    fn new(tree: &'a PoseTree, turning_radius: f64) -> Self {
        Self { tree, turning_radius, points: Vec::new(), ranges: vec![0..0; tree.len()] }
    }

    /// The branch from the root to a node, cut at `reach` metres.
    fn path_to(&mut self, end: usize, reach: f64) -> Path {
        let mut chain = vec![end];
        while let Some(p) = self.tree.parent(chain[chain.len() - 1]) {
            chain.push(p);
        }
        chain.reverse();
        chain.windows(2).for_each(|pair| self.rebuild(pair[0], pair[1]));
        let points = chain.iter().flat_map(|&node| &self.points[self.ranges[node].clone()]);
        Path::new(self.tree.position(chain[0]), points.copied(), reach)
    }

    fn rebuild(&mut self, from: usize, to: usize) {
        if !self.ranges[to].is_empty() {
            return;
        }
        let [start, end] = [from, to].map(|node| self.tree.pose(node).into());
        let first = self.points.len();
        Dubins::shortest(start, end, self.turning_radius).walk(Path::SPACING, |pose| {
            self.points.push(pose.position());
            Some(Path::SPACING)
        });
        self.ranges[to] = first..self.points.len();
    }
}
