//! How the tree grows: towards a point, from the node that promises most, by the control that leads
//! nearest.

use super::control_lattice::ControlLattice;
use super::time_tree::TimeTree;
use crate::collision::CollisionChecker;
use crate::collision_risk::{CollisionRisk, RiskParams};
use crate::geometry::{Point2, Pose2};
use crate::motion::step;
use crate::occupancy::{Cell, OccupancyGrid};
use crate::random::{Rng, uniform};

/// A tree while it grows.
pub struct Growth<'a> {
    /// The tree so far.
    pub tree: TimeTree,
    /// What leads from node to node.
    pub lattice: &'a ControlLattice<'a>,
    /// Walls.
    pub checker: &'a CollisionChecker<'a>,
    /// People by depth; none for a tree without meaning in time.
    pub people: Option<&'a CollisionRisk>,
    /// How risk is weighed.
    pub weighing: &'a RiskParams,
    /// A node with more risk is not gone on from.
    pub threshold: f64,
    /// A node this deep is not gone on from.
    pub max_depth: u32,
    /// Most nodes.
    pub max_nodes: usize,
}

impl Growth<'_> {
    /// Probability that the robot is in collision at `pose`, having come from its parent at `from`:
    /// `P_s + (1 - P_s) P_d`.
    fn risk_at(&self, from: Pose2, pose: Pose2, depth: u32) -> f64 {
        if !self.checker.segment_wall_clear(from, pose) {
            return 1.0;
        }
        self.people.map_or(0.0, |people| people.at(depth as usize, pose.position()))
    }

    /// Reads every node's risk anew: walls and people are seen better than a cycle ago.
    pub fn assess(&mut self) {
        for node in 0..self.tree.nodes.len() {
            let n = self.tree.nodes[node];
            self.tree.nodes[node].risk = match self.tree.parent(node) {
                None => 0.0,
                Some(parent) => {
                    let above = self.tree.nodes[parent];
                    above.risk.max(self.risk_at(above.pose, n.pose, n.depth))
                }
            };
        }
    }

    /// Adds the node that gets nearest to `target` from the node of greatest weight, and returns it;
    /// `None` when no node has a control left or the tree is full. A node in collision is added too, so
    /// that its control is not tried again, but never gone on from.
    pub fn extend(&mut self, target: Point2) -> Option<usize> {
        if self.tree.nodes.len() >= self.max_nodes {
            return None;
        }
        let (parent, _) = self.best(target, |growth, node| growth.is_open(node))?;
        let from = self.tree.nodes[parent];
        let root_distance = self.root_distance(target);
        let mut nearest: Option<(f64, u32, Pose2)> = None;
        for control in (0..self.lattice.len()).filter(|k| from.closed & (1 << k) == 0) {
            let pose = step(from.pose, self.lattice.twist(from.twist, control), self.tree.dt);
            let d = self.weighing.node_cost(pose, 0.0, root_distance, target);
            if nearest.is_none_or(|(least, ..)| d < least) {
                nearest = Some((d, control, pose));
            }
        }
        let (_, control, pose) = nearest?;
        let risk = from.risk.max(self.risk_at(from.pose, pose, from.depth + 1));
        let twist = self.lattice.twist(from.twist, control);
        Some(self.tree.push(parent, control, twist, pose, risk))
    }

    /// The node whose weight for `target` is greatest among those that `may` be, and the weight's
    /// reciprocal; the first of equals.
    pub fn best(&self, target: Point2, may: impl Fn(&Self, usize) -> bool) -> Option<(usize, f64)> {
        let root_distance = self.root_distance(target);
        let mut best: Option<(usize, f64)> = None;
        for (index, node) in self.tree.nodes.iter().enumerate() {
            let limit = best.map_or(f64::INFINITY, |b| b.1);
            let far = self.weighing.far_cost(node.pose.position(), node.risk, root_distance, target);
            // Most nodes are too far already: their bearing need not be known.
            if far >= limit || !may(self, index) {
                continue;
            }
            let cost = far + self.weighing.turn_cost(node.pose, target);
            if cost < limit {
                best = Some((index, cost));
            }
        }
        best
    }

    /// Whether a node's risk is bearable.
    pub fn is_free(&self, node: usize) -> bool {
        self.tree.nodes[node].risk <= self.threshold
    }

    /// Whether the tree can go on from a node.
    fn is_open(&self, node: usize) -> bool {
        let n = &self.tree.nodes[node];
        self.is_free(node) && n.depth < self.max_depth && n.closed.count_ones() < self.lattice.len()
    }

    /// Distance from the root, the unit of the distances in weights.
    pub fn root_distance(&self, target: Point2) -> f64 {
        self.tree.nodes[0].pose.position().distance(target)
    }
}

/// A free point of the square `window` metres around `centre` to every side, clipped to the map; any point
/// of it after twenty tries.
pub fn sample_window(grid: &OccupancyGrid, centre: Point2, window: f64, rng: &mut Rng) -> Point2 {
    let mut draw = || {
        let mut side = |middle: f64| middle + window * (2.0 * uniform(rng) - 1.0);
        let x = side(centre.x);
        Point2::new(x, side(centre.y))
    };
    let is_free = |p: &Point2| {
        grid.locate(*p).is_some_and(|(column, row)| grid.cell(grid.index(column, row)) == Cell::Free)
    };
    (0..20).map(|_| draw()).find(is_free).unwrap_or(centre)
}

/// A free point of the whole map; `otherwise` after a hundred tries.
pub fn sample_map(grid: &OccupancyGrid, otherwise: Point2, rng: &mut Rng) -> Point2 {
    (0..100)
        .find_map(|_| {
            let column = (uniform(rng) * grid.width() as f64) as usize;
            let row = (uniform(rng) * grid.height() as f64) as usize;
            (grid.cell(grid.index(column, row)) == Cell::Free).then(|| grid.centre(column, row))
        })
        .unwrap_or(otherwise)
}
