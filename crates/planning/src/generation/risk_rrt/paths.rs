//! From nodes to candidates: the path to each of the best nodes, and braking after it.

use super::control_lattice::ControlLattice;
use super::growth::Growth;
use super::time_tree::TimeTree;
use crate::candidates::CandidateSet;
use crate::geometry::{Point2, Pose2, Twist};
use crate::motion::step;

/// Paths to nodes of `growth`, the node of greatest weight for `goal` first (the one Risk-RRT drives),
/// at most `most`, none a part of one before it. Each has `steps` states, the first one step after
/// `now`, and ends in braking to a standstill; those that would brake into a wall are left out.
pub fn candidates(growth: &Growth<'_>, goal: Point2, now: f64, steps: usize, most: usize) -> CandidateSet {
    let tree = &growth.tree;
    let root_distance = growth.root_distance(goal);
    let mut ranked: Vec<(f64, usize)> = (1..tree.nodes.len())
        .filter(|&node| growth.is_free(node) && tree.time(node) > now + 1e-6)
        .map(|node| {
            let n = &tree.nodes[node];
            (growth.weighing.node_cost(n.pose, n.risk, root_distance, goal), node)
        })
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut states = States::default();
    let mut covered = vec![false; tree.nodes.len()];
    for (_, node) in ranked {
        if states.count as usize >= most {
            break;
        }
        if covered[node] {
            continue;
        }
        let branch = tree.branch(node);
        let Some(arcs) = arcs(growth, &branch, now, steps) else { continue };
        branch.iter().for_each(|&n| covered[n] = true);
        states.append(tree, &arcs, now, steps);
    }
    let id = (0..states.count).collect();
    let States { x, y, heading, v, omega, .. } = states;
    // Arcs from a finite root are finite and of equal number; anything else offers nothing.
    CandidateSet::new(steps, tree.dt, id, x, y, heading, v, omega)
        .unwrap_or_else(|_| CandidateSet::empty(steps, tree.dt))
}

/// The twists of a branch and of braking after it, one a step from the root; `None` if braking takes
/// too long or leads into a wall.
fn arcs(growth: &Growth<'_>, branch: &[usize], now: f64, steps: usize) -> Option<Vec<Twist>> {
    let tree = &growth.tree;
    let mut arcs: Vec<Twist> = branch.iter().map(|&n| tree.nodes[n].twist).collect();
    let end = &tree.nodes[*branch.last()?];
    let (mut pose, mut twist) = (end.pose, end.twist);
    while twist != Twist::default() {
        twist = growth.lattice.braked(twist);
        let next = step(pose, twist, tree.dt);
        if !growth.checker.segment_wall_clear(pose, next) {
            return None;
        }
        pose = next;
        arcs.push(twist);
    }
    let ends = tree.stamp + arcs.len() as f64 * tree.dt;
    (ends <= now + steps as f64 * tree.dt + 1e-6).then_some(arcs)
}

/// States of candidates one after the other.
#[derive(Default)]
struct States {
    count: u32,
    x: Vec<f64>,
    y: Vec<f64>,
    heading: Vec<f64>,
    v: Vec<f64>,
    omega: Vec<f64>,
}

impl States {
    /// Drives `arcs` from the root and records where the robot is one step, two steps, ... after `now`.
    fn append(&mut self, tree: &TimeTree, arcs: &[Twist], now: f64, steps: usize) {
        let passed = (now - tree.stamp) / tree.dt;
        let whole = (passed + 1e-6).floor();
        let part = if passed - whole < 1e-6 { 0.0 } else { (passed - whole) * tree.dt };
        let mut pose = tree.nodes[0].pose;
        for k in 0..=whole as usize + steps {
            let twist = arcs.get(k).copied().unwrap_or_default();
            if part > 0.0 && k > whole as usize {
                self.push(step(pose, twist, part), twist);
            }
            pose = step(pose, twist, tree.dt);
            if part == 0.0 && k >= whole as usize && k < whole as usize + steps {
                self.push(pose, twist);
            }
        }
        self.count += 1;
    }

    fn push(&mut self, pose: Pose2, twist: Twist) {
        self.x.push(pose.x);
        self.y.push(pose.y);
        self.heading.push(pose.heading);
        self.v.push(twist.v);
        self.omega.push(twist.omega);
    }
}

/// Steps of braking from top speed and fastest turning.
pub fn braking_steps(lattice: &ControlLattice<'_>) -> u32 {
    let mut twist = Twist { v: lattice.robot.v_max, omega: lattice.robot.omega_max };
    let mut steps = 0;
    while twist != Twist::default() && steps < u32::from(u16::MAX) {
        twist = lattice.braked(twist);
        steps += 1;
    }
    steps
}
