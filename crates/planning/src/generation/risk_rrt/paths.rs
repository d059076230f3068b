//! From nodes to candidates: the path to each of the best nodes, and braking after it.

use super::braking::{braking_costs, node_costs};
use super::growth::Growth;
use crate::candidates::CandidateSet;
use crate::geometry::{Facing, Twist};
use crate::motion::step_facing;
use crate::states::States;

/// Paths to nodes of `growth`, the one of greatest weight for the goal first (that is the one Risk-RRT
/// drives), none a part of one before it. The first state of each is one step after now, and each ends in
/// braking to a standstill; those that would brake into a wall are left out.
///
/// A path is worth as much as the best pose on it, braking included. Distances count as shares of that
/// from where the robot is believed to be, not from the root, which it may miss by a little: the
/// term `risk` can know nothing else. The other paths are what is left if the first cannot be driven;
/// the root's children take turns, so that not all of them begin alike.
pub fn candidates(growth: &Growth<'_>) -> CandidateSet {
    let tree = &growth.tree;
    let input = growth.ground.input;
    let steps = input.params.steps;
    let most = input.params.generation.risk_rrt.max_candidates;
    let mut states = States::default();
    let mut count = 0;
    let mut covered = vec![false; tree.nodes.len()];
    for node in in_turns(growth, ranked(growth)) {
        if count >= most {
            break;
        }
        if covered[node] {
            continue;
        }
        let branch = tree.branch(node);
        branch.iter().for_each(|&n| covered[n] = true);
        append(&mut states, growth, &branch, node);
        count += 1;
    }
    // Arcs from a finite root are finite and of equal number; anything else offers nothing.
    let all = CandidateSet::new(steps, tree.dt, (0..count).collect(), states);
    input.stoppable(all.unwrap_or_else(|_| CandidateSet::empty(steps, tree.dt)))
}

/// Free nodes ahead from which the robot can brake in time and clear of walls, the best path first.
fn ranked(growth: &Growth<'_>) -> Vec<usize> {
    let tree = &growth.tree;
    let now = growth.ground.input.scene.stamp;
    let root_distance = growth.ground.input.scene.belief.pose.position().distance(growth.ground.input.goal);
    let ahead = |node: usize| tree.time(node) > now + 1e-6;
    // The best pose on the way to each node; parents come first.
    let mut best = node_costs(growth, root_distance);
    best[0] = f64::INFINITY;
    for (index, n) in tree.nodes.iter().enumerate().skip(1) {
        best[index] = best[index].min(best[n.parent as usize]);
    }
    let offered: Vec<usize> = (1..tree.nodes.len()).filter(|&n| growth.is_free(n) && ahead(n)).collect();
    let braking = braking_costs(growth, &offered, root_distance);
    let costs = offered.into_iter().zip(braking);
    let mut ranked: Vec<(f64, usize)> =
        costs.filter_map(|(node, braking)| Some((best[node].min(braking?), node))).collect();
    ranked.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    ranked.into_iter().map(|(_, node)| node).collect()
}

/// The same nodes, but the root's children take turns: first the best of each, then the second of each.
fn in_turns(growth: &Growth<'_>, ranked: Vec<usize>) -> Vec<usize> {
    let tree = &growth.tree;
    let mut child = vec![0; tree.nodes.len()];
    for (index, n) in tree.nodes.iter().enumerate().skip(1) {
        child[index] = if n.depth == 1 { index } else { child[n.parent as usize] };
    }
    let mut seen = vec![0_u32; tree.nodes.len()];
    let mut turns: Vec<(u32, usize, usize)> = Vec::with_capacity(ranked.len());
    for (rank, &node) in ranked.iter().enumerate() {
        let turn = &mut seen[child[node]];
        turns.push((*turn, rank, node));
        *turn += 1;
    }
    turns.sort_unstable();
    turns.into_iter().map(|(.., node)| node).collect()
}

/// Drives from the root along `branch` to `node`, brakes, and adds to `states` where the robot is one step, two steps,
/// ... after now.
fn append(states: &mut States, growth: &Growth<'_>, branch: &[usize], node: usize) {
    let tree = &growth.tree;
    let input = growth.ground.input;
    let last = &tree.nodes[node];
    // Where each step begins, and how it is driven.
    let mut way: Vec<(Facing, Twist)> = Vec::with_capacity(branch.len() + 8);
    let mut from = tree.nodes[0].facing();
    for &n in branch {
        way.push((from, tree.nodes[n].twist));
        from = tree.nodes[n].facing();
    }
    let mut twist = last.twist;
    while twist != Twist::default() {
        twist = growth.ground.lattice.braked(twist);
        way.push((from, twist));
        from = step_facing(from, twist, tree.dt).pose.into();
    }
    way.push((from, Twist::default()));
    let rest = (step_facing(from, Twist::default(), tree.dt).pose.into(), Twist::default());

    let passed = (input.scene.stamp - tree.stamp) / tree.dt;
    let whole = (passed + 1e-6).floor();
    let part = if passed - whole < 1e-6 { 0.0 } else { (passed - whole) * tree.dt };
    let at = |k: usize| way.get(k).copied().unwrap_or(rest);
    for k in whole as usize..whole as usize + input.params.steps {
        let (end, after) = at(k + 1);
        if part > 0.0 {
            states.push(step_facing(end, after, part).pose, after);
        } else {
            states.push(end.pose, at(k).1);
        }
    }
}
