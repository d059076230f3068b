//! The baseline Risk-RRT (Fulgenzi, Spalanzani, Laugier and Tay, 2010): a tree in time whose nodes know how
//! likely a collision on the way to them is.
//!
//! Structure and parameters follow the authors' ROS package (`docs/methods.md`, Baselines), risk the paper: a
//! person's Gaussian forecast under the robot's disc. Instead of growing for a fixed time the tree grows by
//! a fixed number of nodes, so that a run can be repeated.
//!
//! A cycle: the tree of the last one is followed along the path that is driven ([`update`]), every risk is
//! read anew, the tree grows ([`growth`]), and the paths to its best nodes are offered ([`paths`]); the
//! term `risk` then takes the one that Risk-RRT would.

pub mod control_lattice;
pub mod growth;
mod params;
pub mod paths;
pub mod time_tree;
pub mod update;

use crate::candidates::CandidateSet;
use crate::collision::CollisionChecker;
use crate::collision_risk::CollisionRisk;
use crate::generation::{Generated, GenerationInput, Tree};
use crate::geometry::Point2;
use crate::random::{Rng, uniform};
use control_lattice::ControlLattice;
use growth::Growth;
pub use params::RiskRrtParams;
pub use time_tree::TimeTree;

/// The candidates of one cycle.
pub fn generate(
    input: &GenerationInput<'_>,
    tree: Option<Tree>,
    should_stop: &dyn Fn() -> bool,
) -> Generated {
    let params = &input.params.generation.risk_rrt;
    let ground = Ground::new(input);
    let old = tree.and_then(|value| TimeTree::from_value(&value, &ground.lattice, ground.max_depth));
    let tree = ground.take_over(old);
    let people = ground.people(&tree);
    let mut growth = ground.growth(tree, Some(&people), ground.max_depth);
    growth.assess();
    let mut rng = input.samples();
    let mut focus = Focus::new(&growth, input);
    for k in 0..params.nodes {
        if k % 32 == 31 && should_stop() {
            break;
        }
        let target = focus.sample(input, params, &mut rng);
        let Some(new) = growth.extend(target) else { break };
        focus.notice(&growth, input, new);
    }
    Generated { candidates: ground.candidates(&growth), tree: growth.tree.to_value() }
}

/// What a cycle stands on.
pub(super) struct Ground<'a> {
    pub(super) lattice: ControlLattice<'a>,
    pub(super) checker: CollisionChecker<'a>,
    input: &'a GenerationInput<'a>,
    pub(super) max_depth: u32,
}

impl<'a> Ground<'a> {
    pub(super) fn new(input: &'a GenerationInput<'a>) -> Self {
        let (params, tree) = (input.params, &input.params.generation.risk_rrt);
        let lattice = ControlLattice {
            robot: input.robot,
            dt: params.dt,
            v_count: tree.v_controls,
            omega_count: tree.omega_controls,
        };
        let room = (params.steps as u32).saturating_sub(paths::braking_steps(&lattice));
        Self { lattice, checker: input.checker(), input, max_depth: tree.max_depth.min(room) }
    }

    /// Last cycle's tree as far as it is still ahead, or a new one.
    pub(super) fn take_over(&self, old: Option<TimeTree>) -> TimeTree {
        let scene = self.input.scene;
        let (pose, twist) = (scene.belief.pose, scene.belief.twist);
        let off_path = self.input.params.generation.risk_rrt.off_path;
        old.and_then(|tree| update::follow(&tree, scene.stamp, pose, self.input.previous, off_path))
            .unwrap_or_else(|| TimeTree::rooted(scene.stamp, self.input.params.dt, pose, twist))
    }

    /// The risk from people at every depth of a tree, and while braking after it.
    pub(super) fn people(&self, tree: &TimeTree) -> CollisionRisk {
        let scene = self.input.scene;
        let moments =
            (0..=self.input.params.steps + 1).map(|depth| tree.stamp + depth as f64 * tree.dt - scene.stamp);
        let radius = self.input.robot.radius();
        CollisionRisk::new(
            &scene.people,
            self.input.params.forecast,
            radius,
            &self.input.params.risk,
            moments,
        )
    }

    /// A tree that grows among `people`; without them it has no meaning in time.
    pub(super) fn growth(
        &'a self,
        tree: TimeTree,
        people: Option<&'a CollisionRisk>,
        max_depth: u32,
    ) -> Growth<'a> {
        Growth {
            tree,
            lattice: &self.lattice,
            checker: &self.checker,
            people,
            weighing: &self.input.params.risk,
            threshold: self.input.params.generation.risk_rrt.threshold,
            max_depth,
            max_nodes: self.input.params.generation.risk_rrt.max_nodes as usize,
        }
    }

    pub(super) fn candidates(&self, growth: &Growth<'_>) -> CandidateSet {
        let steps = self.input.params.steps;
        let most = self.input.params.generation.risk_rrt.max_candidates as usize;
        let robot = self.input.scene.belief.pose.position();
        paths::candidates(growth, robot, self.input.goal, self.input.scene.stamp, steps, most)
    }
}

/// The node that is best for the goal so far: samples are drawn around it.
struct Focus {
    cost: f64,
    position: Point2,
}

impl Focus {
    fn new(growth: &Growth<'_>, input: &GenerationInput<'_>) -> Self {
        let (node, cost) =
            growth.best(input.goal, |growth, node| growth.is_free(node)).unwrap_or((0, f64::INFINITY));
        Self { cost, position: growth.tree.nodes[node].pose.position() }
    }

    fn notice(&mut self, growth: &Growth<'_>, input: &GenerationInput<'_>, node: usize) {
        let n = &growth.tree.nodes[node];
        let cost = growth.weighing.node_cost(n.pose, n.risk, growth.root_distance(input.goal), input.goal);
        if growth.is_free(node) && cost < self.cost {
            *self = Self { cost, position: n.pose.position() };
        }
    }

    fn sample(&self, input: &GenerationInput<'_>, params: &RiskRrtParams, rng: &mut Rng) -> Point2 {
        if uniform(rng) < params.goal_bias {
            return input.goal;
        }
        growth::sample_window(&input.map.grid, self.position, params.window, rng)
    }
}
