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

mod braking;
pub mod control_lattice;
mod free_nodes;
pub mod growth;
pub mod paths;
mod reach;
pub mod time_tree;
pub mod update;

use crate::generation::{Generated, GenerationInput, Pace, Tree};
use crate::geometry::Point2;
use crate::random::{Rng, uniform};
pub use control_lattice::RiskRrtParams;
use growth::{Ground, Growth};
pub use time_tree::TimeTree;

/// The candidates of one cycle.
pub fn generate(input: &GenerationInput<'_>, tree: Option<Tree>, pace: &Pace<'_>) -> Generated {
    let params = &input.params.generation.risk_rrt;
    let ground = Ground::new(input);
    let old = tree.and_then(|value| TimeTree::from_value(&value, &ground.lattice, ground.max_depth));
    let mut growth = ground.growth(old);
    let mut rng = input.samples();
    let mut focus = Focus::new(&growth, input);
    for k in 0..params.nodes {
        if k % 32 == 31 && pace.is_over(Pace::GROWTH) {
            break;
        }
        let target = focus.sample(input, params, &mut rng);
        let Some(new) = growth.extend(target) else { break };
        focus.notice(&growth, input, new);
    }
    Generated { candidates: paths::candidates(&growth), tree: growth.tree.to_value() }
}

/// The node that is best for the goal so far: samples are drawn around it.
struct Focus {
    cost: f64,
    position: Point2,
}

impl Focus {
    fn new(growth: &Growth<'_>, input: &GenerationInput<'_>) -> Self {
        let best = growth.best(input.goal, false);
        let (node, cost) = best.map_or((0, f64::INFINITY), |best| (best.node, best.cost));
        Self { cost, position: growth.tree.nodes[node].pose.position() }
    }

    fn notice(&mut self, growth: &Growth<'_>, input: &GenerationInput<'_>, node: usize) {
        let n = &growth.tree.nodes[node];
        let cost = input.params.risk.node_cost(n.pose, n.risk, growth.root_distance(input.goal), input.goal);
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
