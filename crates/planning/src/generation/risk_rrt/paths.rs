//! From nodes to candidates: the path to each of the best nodes, and braking after it.

use super::growth::Growth;
use super::time_tree::TimeTree;
use crate::candidates::CandidateSet;
use crate::geometry::Twist;
use crate::motion::step;
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
    let (tree, input) = (&growth.tree, growth.ground.input);
    let (now, steps) = (input.scene.stamp, input.params.steps);
    let most = input.params.generation.risk_rrt.max_candidates;
    let (mut states, mut count) = (States::default(), 0);
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
        let mut arcs: Vec<Twist> = branch.iter().map(|&n| tree.nodes[n].twist).collect();
        let mut twist = tree.nodes[node].twist;
        while twist != Twist::default() {
            twist = growth.ground.lattice.braked(twist);
            arcs.push(twist);
        }
        append(&mut states, tree, &arcs, now, steps);
        count += 1;
    }
    // Arcs from a finite root are finite and of equal number; anything else offers nothing.
    CandidateSet::new(steps, tree.dt, (0..count).collect(), states)
        .unwrap_or_else(|_| CandidateSet::empty(steps, tree.dt))
}

/// Free nodes ahead from which the robot can brake in time and clear of walls, the best path first.
fn ranked(growth: &Growth<'_>) -> Vec<usize> {
    let (tree, input) = (&growth.tree, growth.ground.input);
    let (now, goal) = (input.scene.stamp, input.goal);
    let root_distance = input.scene.belief.pose.position().distance(goal);
    let latest = ((now - tree.stamp) / tree.dt + 1e-6).floor() as u32 + input.params.steps as u32;
    // The best pose on the way to each node; parents come first.
    let mut best = vec![f64::INFINITY; tree.nodes.len()];
    let mut ranked = Vec::new();
    for (index, n) in tree.nodes.iter().enumerate().skip(1) {
        let own = growth.weighing().node_cost(n.pose, n.risk, root_distance, goal);
        best[index] = own.min(best[n.parent as usize]);
        if !growth.is_free(index) || tree.time(index) <= now + 1e-6 {
            continue;
        }
        if let Some(braking) = braking_cost(growth, index, root_distance, latest) {
            ranked.push((best[index].min(braking), index));
        }
    }
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    ranked.into_iter().map(|(_, node)| node).collect()
}

/// The least node cost while braking from `node`; `None` if braking takes longer than until depth `latest`
/// or leads into a wall.
fn braking_cost(growth: &Growth<'_>, node: usize, root_distance: f64, latest: u32) -> Option<f64> {
    let goal = growth.ground.input.goal;
    let n = &growth.tree.nodes[node];
    let (mut pose, mut twist, mut depth, mut risk) = (n.pose, n.twist, n.depth, n.risk);
    let mut best = f64::INFINITY;
    while twist != Twist::default() {
        twist = growth.ground.lattice.braked(twist);
        depth += 1;
        let next = step(pose, twist, growth.tree.dt);
        if depth > latest || !growth.ground.checker.segment_wall_clear(pose, next) {
            return None;
        }
        risk =
            risk.max(growth.people.as_ref().map_or(0.0, |people| people.at(depth as usize, next.position())));
        best = best.min(growth.weighing().node_cost(next, risk, root_distance, goal));
        pose = next;
    }
    Some(best)
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

/// Drives `arcs` from the root and adds to `states` where the robot is one step, two steps, ... after `now`.
fn append(states: &mut States, tree: &TimeTree, arcs: &[Twist], now: f64, steps: usize) {
    let passed = (now - tree.stamp) / tree.dt;
    let whole = (passed + 1e-6).floor();
    let part = if passed - whole < 1e-6 { 0.0 } else { (passed - whole) * tree.dt };
    let mut pose = tree.nodes[0].pose;
    for k in 0..=whole as usize + steps {
        let twist = arcs.get(k).copied().unwrap_or_default();
        if part > 0.0 && k > whole as usize {
            states.push(step(pose, twist, part), twist);
        }
        pose = step(pose, twist, tree.dt);
        if part == 0.0 && k >= whole as usize && k < whole as usize + steps {
            states.push(pose, twist);
        }
    }
}
