//! The baseline Bi-Risk-RRT (Ma et al., 2022): Risk-RRT helped by a second tree that grows from the goal.
//!
//! The two trees are never joined, so no boundary-value problem has to be solved. Once they come near each
//! other, the reverse tree's way becomes a heuristic: the tree in time draws part of its samples around
//! it. Reverse nodes have no meaning in time and are checked against walls alone (`docs/methods.md`, Baselines).

pub mod heuristic;
mod params;

use crate::generation::risk_rrt::growth::{Ground, Growth, sample_map};
use crate::generation::risk_rrt::{TimeTree, paths};
use crate::generation::{Generated, GenerationInput, Pace, Tree};
use crate::geometry::Point2;
use crate::random::{Rng, standard_normal, uniform};
use heuristic::Heuristic;
pub use params::BiRiskRrtParams;

/// The candidates of one cycle.
pub fn generate(input: &GenerationInput<'_>, tree: Option<Tree>, pace: &Pace<'_>) -> Generated {
    let params = &input.params.generation;
    let ground = Ground::new(input);
    let robot = input.scene.belief.pose.position();
    let old = tree
        .and_then(|value| Heuristic::split(&value, &ground.lattice, ground.max_depth, &params.bi_risk_rrt));
    let (old, heuristic) = old.unzip();
    let mut heuristic = heuristic
        .filter(|h| h.goal() == input.goal)
        .unwrap_or_else(|| Heuristic::rooted(input.goal, robot, input.params.dt));
    heuristic.pass(robot);
    let mut growth = ground.growth(old);
    let mut search = Search {
        params: &params.bi_risk_rrt,
        input,
        goal_bias: params.risk_rrt.goal_bias,
        rng: input.samples(),
    };
    let mut left = params.risk_rrt.nodes as usize;
    if !heuristic.is_found {
        let max_depth = params.bi_risk_rrt.reverse_depth;
        let mut reverse = Growth::new(&ground, heuristic.tree, None, max_depth);
        let met = search.grow_both(&mut growth, &mut reverse, &mut left, pace);
        heuristic = Heuristic { tree: reverse.tree, is_found: false };
        if let Some(node) = met {
            heuristic.find(node);
        }
    }
    search.towards(&heuristic, &mut growth, left, pace);
    let candidates = paths::candidates(&growth);
    let mut tree = growth.tree.to_value();
    heuristic.append_to(&mut tree);
    Generated { candidates, tree }
}

struct Search<'a> {
    params: &'a BiRiskRrtParams,
    input: &'a GenerationInput<'a>,
    goal_bias: f64,
    rng: Rng,
}

impl Search<'_> {
    /// Grows both trees in turns until they meet or `left` nodes are spent; the reverse tree's node where
    /// they met.
    fn grow_both<'g>(
        &mut self,
        forward: &mut Growth<'g>,
        reverse: &mut Growth<'g>,
        left: &mut usize,
        pace: &Pace<'_>,
    ) -> Option<usize> {
        let mut turn = 0;
        let mut stuck = 0;
        while *left > 0 && stuck < 2 {
            if turn % 8 == 7 && pace.is_over(Pace::GROWTH) {
                return None;
            }
            let forwards = turn % 2 == 0;
            let (one, other) =
                if forwards { (&mut *forward, &mut *reverse) } else { (&mut *reverse, &mut *forward) };
            let before = *left;
            if let Some((own, others)) = self.connect(one, other, left) {
                return Some(if forwards { others } else { own });
            }
            // A tree that is full or closed cannot go on; the other may.
            stuck = if *left == before { stuck + 1 } else { 0 };
            turn += 1;
        }
        None
    }

    /// Extends `one` to a sample and the `other` towards the new node; the nodes of each where they met.
    fn connect(
        &mut self,
        one: &mut Growth<'_>,
        other: &mut Growth<'_>,
        left: &mut usize,
    ) -> Option<(usize, usize)> {
        let root = other.tree.nodes[0].pose.position();
        let target = self.sample(root);
        let new = one.extend(target)?;
        *left = left.saturating_sub(1);
        if !one.is_free(new) {
            return None;
        }
        let p = one.tree.nodes[new].pose.position();
        if let Some(met) = other.nearest(p, self.params.connect_distance) {
            return Some((new, met));
        }
        for _ in 0..self.params.connect_steps {
            let greedy = (*left > 0).then(|| other.extend(p)).flatten()?;
            *left -= 1;
            let near = other.tree.nodes[greedy].pose.position().distance(p) < self.params.connect_distance;
            if near && other.is_free(greedy) {
                return Some((new, greedy));
            }
        }
        None
    }

    /// Grows the tree in time by `left` nodes, around the heuristic if there is one.
    fn towards(&mut self, heuristic: &Heuristic, forward: &mut Growth<'_>, left: usize, pace: &Pace<'_>) {
        for k in 0..left {
            let target = if heuristic.is_found {
                self.sample_around(&heuristic.tree)
            } else {
                self.sample(self.input.goal)
            };
            if (k % 32 == 31 && pace.is_over(Pace::GROWTH)) || forward.extend(target).is_none() {
                return;
            }
        }
    }

    /// The whole map, or with the goal bias `favourite`.
    fn sample(&mut self, favourite: Point2) -> Point2 {
        if uniform(&mut self.rng) < self.goal_bias {
            return favourite;
        }
        sample_map(&self.input.map.grid, favourite, &mut self.rng)
    }

    /// The goal, the whole map, or around a node of the heuristic.
    fn sample_around(&mut self, path: &TimeTree) -> Point2 {
        if uniform(&mut self.rng) < self.goal_bias {
            return self.input.goal;
        }
        if uniform(&mut self.rng) < self.params.uniform_share {
            return sample_map(&self.input.map.grid, self.input.goal, &mut self.rng);
        }
        let node = &path.nodes[(uniform(&mut self.rng) * path.nodes.len() as f64) as usize];
        let x = node.pose.x + self.params.spread * standard_normal(&mut self.rng);
        Point2::new(x, node.pose.y + self.params.spread * standard_normal(&mut self.rng))
    }
}
