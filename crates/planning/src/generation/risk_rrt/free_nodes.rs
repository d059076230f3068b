//! The free nodes of a tree side by side: every extension looks at all of them.

use super::time_tree::Node;
use crate::collision_risk::{RiskParams, unit};
use crate::geometry::Point2;
use crate::lanes::*;

/// Free nodes, ascending.
#[derive(Debug, Clone)]
pub(super) struct FreeNodes {
    level: Level,
    len: usize,
    groups: Vec<Group>,
}

/// Eight of them.
#[derive(Debug, Clone)]
#[repr(align(64))]
struct Group {
    node: [u32; LANES],
    /// At infinity beyond the last.
    x: [f64; LANES],
    y: [f64; LANES],
    heading: [f64; LANES],
    /// Of the heading.
    cos: [f64; LANES],
    sin: [f64; LANES],
    risk: [f64; LANES],
    /// The same, but infinite where a node cannot be gone on from.
    open_risk: [f64; LANES],
}

impl Group {
    const NONE: Self = Self {
        node: [0; LANES],
        x: [f64::INFINITY; LANES],
        y: [f64::INFINITY; LANES],
        heading: [0.0; LANES],
        cos: [0.0; LANES],
        sin: [0.0; LANES],
        risk: [f64::INFINITY; LANES],
        open_risk: [f64::INFINITY; LANES],
    };
}

/// A free node that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Found {
    /// Its index in the tree.
    pub(super) node: usize,
    /// Its cost.
    pub(super) cost: f64,
    /// Its place among the free nodes.
    place: usize,
}

impl FreeNodes {
    /// None yet.
    pub(super) fn new(level: Level) -> Self {
        Self { level, len: 0, groups: Vec::new() }
    }

    /// Adds node number `node`.
    pub(super) fn push(&mut self, node: usize, n: &Node, is_open: bool) {
        let lane = self.len % LANES;
        if lane == 0 {
            self.groups.push(Group::NONE);
        }
        if let Some(group) = self.groups.last_mut() {
            group.node[lane] = node as u32;
            (group.x[lane], group.y[lane], group.heading[lane]) = (n.pose.x, n.pose.y, n.pose.heading);
            (group.cos[lane], group.sin[lane], group.risk[lane]) = (n.direction.cos, n.direction.sin, n.risk);
            group.open_risk[lane] = if is_open { n.risk } else { f64::INFINITY };
        }
        self.len += 1;
    }

    /// From this one nothing can be gone on from any more.
    pub(super) fn close(&mut self, found: Found) {
        self.groups[found.place / LANES].open_risk[found.place % LANES] = f64::INFINITY;
    }

    /// The node of least cost for `target`, the first of equals; one that can be gone on from if `is_open`.
    pub(super) fn best(
        &self,
        weighing: &RiskParams,
        target: Point2,
        root_distance: f64,
        is_open: bool,
    ) -> Option<Found> {
        let per_metre = 1.0 / unit(root_distance);
        let per_radian = 1.0 / weighing.rotation_weight;
        let question = Question { weighing, target, root_distance, per_metre, per_radian, is_open };
        dispatch!(self.level, simd => self.best_with(simd, &question))
    }

    #[inline(always)]
    fn best_with<S: Simd>(&self, simd: S, question: &Question<'_>) -> Option<Found> {
        let mut best = None;
        let mut least = f64::INFINITY;
        for (group, first) in self.groups.iter().zip((0..).step_by(LANES)) {
            if !group.may_cost_less(simd, question, least) {
                continue;
            }
            for (lane, &cost) in group.costs(simd, question).iter().enumerate() {
                if cost < least {
                    least = cost;
                    best = Some(Found { node: group.node[lane] as usize, cost, place: first + lane });
                }
            }
        }
        best
    }

    /// The node nearest to `p` among those within `reach` metres, the first of equals.
    pub(super) fn nearest(&self, p: Point2, reach: f64) -> Option<usize> {
        dispatch!(self.level, simd => self.nearest_with(simd, p, reach))
    }

    #[inline(always)]
    fn nearest_with<S: Simd>(&self, simd: S, p: Point2, reach: f64) -> Option<usize> {
        let mut least = reach * reach;
        let mut nearest = None;
        for group in &self.groups {
            let [x, y] = [&group.x, &group.y].map(|of| f64x8::load_array_ref(simd, of));
            let dx = p.x - x;
            let dy = p.y - y;
            let squared = dx * dx + dy * dy;
            if squared.simd_lt(least).any_true() {
                for (lane, &squared) in squared.iter().enumerate() {
                    if squared < least {
                        (least, nearest) = (squared, Some(group.node[lane] as usize));
                    }
                }
            }
        }
        nearest
    }
}

/// Which node is wanted.
struct Question<'a> {
    weighing: &'a RiskParams,
    target: Point2,
    root_distance: f64,
    /// What a metre costs, and the reciprocal of what a radian does: divided once.
    per_metre: f64,
    per_radian: f64,
    is_open: bool,
}

impl Group {
    fn risk(&self, question: &Question<'_>) -> &[f64; LANES] {
        if question.is_open { &self.open_risk } else { &self.risk }
    }

    /// Whether one of the nodes may cost less than `least`. Most are too far away, or would have to turn too far, which
    /// the cosine of the turn tells without the turn itself.
    #[inline(always)]
    fn may_cost_less<S: Simd>(&self, simd: S, question: &Question<'_>, least: f64) -> bool {
        let &Question { weighing, target, root_distance, per_metre, per_radian, .. } = question;
        let load = |of| f64x8::load_array_ref(simd, of);
        let dx = target.x - load(&self.x);
        let dy = target.y - load(&self.y);
        let squared = dx * dx + dy * dy;
        // What is left for distance and turn; the slack is more than rounding may differ by.
        let left = least - load(self.risk(question)) * weighing.social_weight + SLACK * (1.0 + least);
        let farthest = greater(left, f64x8::splat(simd, 0.0)) * unit(root_distance);
        if squared.simd_gt(farthest * farthest).all_true() {
            return false;
        }
        let ahead = load(&self.cos) * dx + load(&self.sin) * dy;
        let distance = squared.sqrt();
        let turn = (left - distance * per_metre) * per_radian;
        let z = turn * turn;
        // Below the cosine everywhere.
        let cosine = 1.0 - z * (0.5 - z * (1.0 / 24.0 - z * (1.0 / 720.0)));
        let is_far = turn.simd_lt(0.0) | ahead.simd_lt(distance * (cosine - SLACK));
        !is_far.all_true()
    }

    #[inline(always)]
    fn costs<S: Simd>(&self, simd: S, question: &Question<'_>) -> f64x8<S> {
        let load = |of| f64x8::load_array_ref(simd, of);
        let pose = [load(&self.x), load(&self.y), load(&self.heading)];
        let risk = load(self.risk(question));
        question.weighing.node_costs(pose, risk, question.root_distance, question.target)
    }
}

/// More than rounding can add to a cost, as a share of it, or to a cosine.
const SLACK: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generation::risk_rrt::time_tree::TimeTree;
    use crate::geometry::{Pose2, Twist};
    use crate::lanes::tests::levels;
    use crate::random::{rng, uniform};

    #[test]
    fn finds_what_a_scan_finds_and_of_equals_the_first() {
        for seed in 0..40 {
            let mut r = rng(seed, 0);
            let weighing = RiskParams {
                rotation_weight: [0.0, 0.5, 3.0][seed as usize % 3],
                social_weight: [1.0, 0.0][seed as usize % 2],
                ..RiskParams::default()
            };
            let mut free = levels().into_iter().map(FreeNodes::new).collect::<Vec<_>>();
            let mut nodes = Vec::<Node>::new();
            let mut open = Vec::<bool>::new();
            for k in 0..400 {
                // Some are as another is, and costs fall on both sides of each bound.
                let coarse = |number: f64| if k % 4 == 0 { number.round() } else { number };
                let mut place = || coarse(12.0 * uniform(&mut r) - 6.0);
                let pose = Pose2::new(place(), place(), 0.5 * place());
                let mut node = TimeTree::rooted(0.0, 0.3, pose, Twist::default()).nodes[0];
                node.risk = coarse(0.9 * uniform(&mut r));
                open.push(uniform(&mut r) < 0.8);
                free.iter_mut().for_each(|free| free.push(k, &node, open[k]));
                nodes.push(node);

                let target = Point2::new(coarse(14.0 * uniform(&mut r)), 3.0);
                let root_distance = 10.0 * uniform(&mut r);
                let costs = || {
                    let cost = |n: &Node| weighing.node_cost(n.pose, n.risk, root_distance, target);
                    nodes.iter().map(cost).enumerate()
                };
                let cheapest = |is_open: bool| {
                    let all = costs().filter(|&(k, _)| open[k] || !is_open);
                    all.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, cost)| (k, cost.to_bits()))
                };
                let near = |reach: f64| {
                    let all = nodes.iter().map(|n| n.pose.position().distance_squared(target)).enumerate();
                    let within = all.filter(|(_, squared)| *squared < reach * reach);
                    within.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
                };
                let mut found = None;
                for free in &free {
                    for is_open in [true, false] {
                        found = free.best(&weighing, target, root_distance, is_open);
                        let best = found.map(|found| (found.node, found.cost.to_bits()));
                        assert_eq!(best, cheapest(is_open), "seed {seed}, node {k}, {is_open}, {free:?}");
                    }
                    assert_eq!(free.nearest(target, 2.0), near(2.0), "seed {seed}, node {k}");
                }
                if let Some(found) = found.filter(|_| k % 5 == 0) {
                    open[found.node] = false;
                    free.iter_mut().for_each(|free| free.close(found));
                }
            }
        }
    }
}
