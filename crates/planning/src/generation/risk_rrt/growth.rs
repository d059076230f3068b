//! How the tree grows: towards a point, from the node that promises most, by the control that leads
//! nearest.

use super::control_lattice::{ControlLattice, RiskRrtParams};
use super::time_tree::TimeTree;
use super::update::follow;
use crate::collision::CollisionChecker;
use crate::collision_risk::{CollisionRisk, RiskParams};
use crate::generation::GenerationInput;
use crate::geometry::{Point2, Pose2};
use crate::motion::step;
use crate::occupancy::{Cell, OccupancyGrid};
use crate::random::{Rng, uniform};

/// What a cycle stands on.
pub struct Ground<'a> {
    /// What is known.
    pub input: &'a GenerationInput<'a>,
    /// What leads from node to node.
    pub lattice: ControlLattice<'a>,
    /// Walls.
    pub checker: CollisionChecker<'a>,
    /// A node of the tree in time that is this deep is not gone on from.
    pub max_depth: u32,
}

impl<'a> Ground<'a> {
    /// Of the cycle of `input`.
    pub fn new(input: &'a GenerationInput<'a>) -> Self {
        let tree = &input.params.generation.risk_rrt;
        let lattice = ControlLattice {
            robot: input.robot,
            dt: input.params.dt,
            v_count: tree.v_controls,
            omega_count: tree.omega_controls,
        };
        let room = (input.params.steps as u32).saturating_sub(lattice.braking_steps());
        Self { lattice, checker: input.checker(), input, max_depth: tree.max_depth.min(room) }
    }

    /// The tree in time: last cycle's as far as it is still ahead, or a new one, its risks read anew.
    pub fn growth(&'a self, old: Option<TimeTree>) -> Growth<'a> {
        let (scene, params) = (self.input.scene, self.input.params);
        let (pose, twist) = scene.belief.motion();
        let off_path = params.generation.risk_rrt.off_path;
        let tree = old
            .and_then(|tree| follow(&tree, scene.stamp, pose, self.input.previous, off_path))
            .unwrap_or_else(|| TimeTree::rooted(scene.stamp, params.dt, pose, twist));
        // At every depth, and while braking after the deepest.
        let moments = (0..=params.steps + 1).map(|depth| tree.stamp + depth as f64 * tree.dt - scene.stamp);
        let radius = self.input.robot.radius();
        let people = CollisionRisk::new(&scene.people, params.forecast, radius, &params.risk, moments);
        let mut growth = Growth { ground: self, tree, people: Some(people), max_depth: self.max_depth };
        growth.assess();
        growth
    }
}

/// A tree while it grows.
pub struct Growth<'a> {
    /// Where.
    pub ground: &'a Ground<'a>,
    /// The tree so far.
    pub tree: TimeTree,
    /// People by depth; none for a tree without meaning in time.
    pub people: Option<CollisionRisk>,
    /// A node this deep is not gone on from.
    pub max_depth: u32,
}

impl Growth<'_> {
    fn params(&self) -> &RiskRrtParams {
        &self.ground.input.params.generation.risk_rrt
    }

    /// How risk is weighed.
    pub fn weighing(&self) -> &RiskParams {
        &self.ground.input.params.risk
    }

    /// Probability that the robot is in collision at `pose`, having come from its parent at `from`:
    /// `P_s + (1 - P_s) P_d`.
    fn risk_at(&self, from: Pose2, pose: Pose2, depth: u32) -> f64 {
        if !self.ground.checker.segment_wall_clear(from, pose) {
            return 1.0;
        }
        self.people.as_ref().map_or(0.0, |people| people.at(depth as usize, pose.position()))
    }

    /// Reads every node's risk anew: walls and people are seen better than a cycle ago.
    fn assess(&mut self) {
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
        if self.tree.nodes.len() >= self.params().max_nodes as usize {
            return None;
        }
        let (parent, _) = self.best(target, |growth, node| growth.is_open(node))?;
        let from = self.tree.nodes[parent];
        let root_distance = self.root_distance(target);
        let open = (0..self.ground.lattice.count()).filter(|k| from.closed & (1 << k) == 0);
        let reached = open.map(|control| {
            let twist = self.ground.lattice.twist(from.twist, control);
            let pose = step(from.pose, twist, self.tree.dt);
            (self.weighing().node_cost(pose, 0.0, root_distance, target), control, twist, pose)
        });
        let (_, control, twist, pose) = reached.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let risk = from.risk.max(self.risk_at(from.pose, pose, from.depth + 1));
        Some(self.tree.push(parent, control, twist, pose, risk))
    }

    /// The node whose weight for `target` is greatest among those that `may` be, and the weight's
    /// reciprocal; the first of equals.
    pub fn best(&self, target: Point2, may: impl Fn(&Self, usize) -> bool) -> Option<(usize, f64)> {
        let root_distance = self.root_distance(target);
        let mut best: Option<(usize, f64)> = None;
        for (index, node) in self.tree.nodes.iter().enumerate() {
            let limit = best.map_or(f64::INFINITY, |b| b.1);
            let far = self.weighing().far_cost(node.pose.position(), node.risk, root_distance, target);
            // Most nodes are too far already: their bearing need not be known.
            if far >= limit || !may(self, index) {
                continue;
            }
            let cost = far + self.weighing().turn_cost(node.pose, target);
            if cost < limit {
                best = Some((index, cost));
            }
        }
        best
    }

    /// Whether a node's risk is bearable.
    pub fn is_free(&self, node: usize) -> bool {
        self.tree.nodes[node].risk <= self.params().threshold
    }

    fn is_open(&self, node: usize) -> bool {
        let n = &self.tree.nodes[node];
        self.is_free(node) && n.depth < self.max_depth && n.closed.count_ones() < self.ground.lattice.count()
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
    (0..20).map(|_| draw()).find(|p| grid.at(*p) == Cell::Free).unwrap_or(centre)
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
