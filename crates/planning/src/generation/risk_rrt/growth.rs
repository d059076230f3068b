//! How the tree grows: towards a point, from the node that promises most, by the control that leads
//! nearest.

use super::control_lattice::{ControlLattice, RiskRrtParams};
use super::free_nodes::{Found, FreeNodes};
use super::reach::nearest_control;
use super::time_tree::TimeTree;
use super::update::follow;
use crate::collision::CollisionChecker;
use crate::collision_risk::{CollisionRisk, RiskParams};
use crate::generation::GenerationInput;
use crate::geometry::{Point2, Pose2};
use crate::lanes::{Level, dispatch};
use crate::occupancy::OccupancyGrid;
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
        let speeds = tree.v_controls;
        let rates = tree.omega_controls;
        let lattice = ControlLattice::new(input.robot, input.params.dt, speeds, rates);
        let room = (input.params.steps as u32).saturating_sub(lattice.braking_steps());
        Self { lattice, checker: input.checker(), input, max_depth: tree.max_depth.min(room) }
    }

    /// The tree in time: last cycle's as far as it is still ahead, or a new one, its risks read anew.
    pub fn growth(&'a self, old: Option<TimeTree>) -> Growth<'a> {
        let scene = self.input.scene;
        let params = self.input.params;
        let (pose, twist) = scene.belief.motion();
        let off_path = params.generation.risk_rrt.off_path;
        let tree = old
            .and_then(|tree| follow(&tree, scene.stamp, pose, self.input.previous, off_path))
            .unwrap_or_else(|| TimeTree::rooted(scene.stamp, params.dt, pose, twist));
        self.growth_of(tree)
    }

    /// A tree in time that is gone on with, its risks read anew.
    pub(in crate::generation) fn growth_of(&self, tree: TimeTree) -> Growth<'_> {
        let scene = self.input.scene;
        let params = self.input.params;
        // At every depth, and while braking after the deepest.
        let moments = (0..=params.steps + 1).map(|depth| tree.stamp + depth as f64 * tree.dt - scene.stamp);
        let radius = self.input.robot.radius();
        let people = CollisionRisk::new(&scene.people, params.forecast, radius, &params.risk, moments);
        Growth::new(self, tree, Some(people), self.max_depth)
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
    /// What to compute with.
    pub(super) level: Level,
    /// A node this deep is not gone on from.
    max_depth: u32,
    /// The nodes whose risk is bearable.
    free: FreeNodes,
}

impl<'a> Growth<'a> {
    /// Goes on with `tree`. If it has people, it reads every node's risk anew: walls and people are seen better than a
    /// cycle ago.
    pub fn new(
        ground: &'a Ground<'a>,
        tree: TimeTree,
        people: Option<CollisionRisk>,
        max_depth: u32,
    ) -> Self {
        let level = Level::new();
        let mut growth = Self { ground, tree, people, level, max_depth, free: FreeNodes::new(level) };
        growth.tree.nodes.reserve(growth.params().nodes as usize);
        for node in 0..growth.tree.nodes.len() {
            if growth.people.is_some() {
                growth.tree.nodes[node].risk = growth.assessed(node);
            }
            growth.notice(node);
        }
        growth
    }

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

    /// A node's risk as it is seen now; its parent's is.
    fn assessed(&self, node: usize) -> f64 {
        let n = &self.tree.nodes[node];
        let above = self.tree.parent(node).map(|parent| &self.tree.nodes[parent]);
        above.map_or(0.0, |above| above.risk.max(self.risk_at(above.pose, n.pose, n.depth)))
    }

    /// Files a new node.
    fn notice(&mut self, node: usize) {
        if self.is_free(node) {
            self.free.push(node, &self.tree.nodes[node], self.is_open(node));
        }
    }

    /// Adds the node that gets nearest to `target` from the node of greatest weight, and returns it;
    /// `None` when no node has a control left or the tree is full. A node in collision is added too, so
    /// that its control is not tried again, but never gone on from.
    pub fn extend(&mut self, target: Point2) -> Option<usize> {
        if self.tree.nodes.len() >= self.params().max_nodes as usize {
            return None;
        }
        let best = self.best(target, true)?;
        let from = &self.tree.nodes[best.node];
        let lattice = &self.ground.lattice;
        let weighing = self.weighing();
        let towards = (target, self.root_distance(target));
        let (control, pose) =
            dispatch!(self.level, simd => nearest_control(simd, lattice, weighing, from, towards))?;
        let risk = from.risk.max(self.risk_at(from.pose, pose, from.depth + 1));
        let new = self.tree.push(best.node, control, lattice.twist(from.twist, control), pose, risk);
        if !self.is_open(best.node) {
            self.free.close(best);
        }
        self.notice(new);
        Some(new)
    }

    /// The free node whose weight for `target` is greatest, and the weight's reciprocal; the first of equals. If
    /// `is_open`, only one that can be gone on from.
    pub(super) fn best(&self, target: Point2, is_open: bool) -> Option<Found> {
        self.free.best(self.weighing(), target, self.root_distance(target), is_open)
    }

    /// The free node that is nearest to `p` among those within `reach` metres, the first of equals.
    pub fn nearest(&self, p: Point2, reach: f64) -> Option<usize> {
        self.free.nearest(p, reach)
    }

    /// Whether a node's risk is bearable.
    pub fn is_free(&self, node: usize) -> bool {
        self.tree.nodes[node].risk <= self.params().threshold
    }

    /// Whether a free node can be gone on from.
    fn is_open(&self, node: usize) -> bool {
        let n = &self.tree.nodes[node];
        n.depth < self.max_depth && n.closed.count_ones() < self.ground.lattice.count()
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
    (0..20).map(|_| draw()).find(|p| grid.is_drivable_at(*p)).unwrap_or(centre)
}

/// A free point of the whole map; `otherwise` after a hundred tries.
pub fn sample_map(grid: &OccupancyGrid, otherwise: Point2, rng: &mut Rng) -> Point2 {
    (0..100)
        .find_map(|_| {
            let column = (uniform(rng) * grid.width() as f64) as usize;
            let row = (uniform(rng) * grid.height() as f64) as usize;
            grid.is_drivable(grid.index(column, row)).then(|| grid.centre(column, row))
        })
        .unwrap_or(otherwise)
}
