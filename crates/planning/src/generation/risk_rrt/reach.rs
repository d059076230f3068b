//! Which control leads nearest.

use super::control_lattice::ControlLattice;
use super::time_tree::Node;
use crate::collision_risk::RiskParams;
use crate::geometry::{Point2, Pose2};
use crate::lanes::*;
use crate::motion::Bend;

/// Of the controls that `from` has left, the one after which the cost for `target` is least, and the pose it leads to.
#[inline(always)]
pub(super) fn nearest_control<S: Simd>(
    simd: S,
    lattice: &ControlLattice<'_>,
    weighing: &RiskParams,
    from: &Node,
    (target, root_distance): (Point2, f64),
) -> Option<(u32, Pose2)> {
    const MOST: usize = ControlLattice::MOST as usize;
    let ([mut x, mut y, mut heading], facing) = ([[0.0; MOST]; 3], from.facing());
    let rates = lattice.rates(from.twist);
    let stride = rates.len();
    for (rate, omega) in rates.enumerate() {
        let bend = Bend::new(omega * lattice.dt);
        for (k, v) in (rate..).step_by(stride).zip(lattice.speeds(from.twist)) {
            let Pose2 { x: px, y: py, heading: h } = bend.end(facing, v * lattice.dt).pose;
            (x[k], y[k], heading[k]) = (px, py, h);
        }
    }
    let mut best = None;
    let mut least = f64::INFINITY;
    let count = lattice.count() as usize;
    for first in (0..count).step_by(LANES) {
        let load = |of: &[f64; MOST]| f64x8::from_slice(simd, &of[first..first + LANES]);
        let pose = [load(&x), load(&y), load(&heading)];
        let costs = weighing.node_costs(pose, f64x8::splat(simd, 0.0), root_distance, target);
        for (k, &cost) in (first..count).zip(costs.iter()) {
            if cost < least && from.closed & (1 << k) == 0 {
                (least, best) = (cost, Some(k));
            }
        }
    }
    best.map(|k| (k as u32, Pose2::new(x[k], y[k], heading[k])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generation::risk_rrt::time_tree::TimeTree;
    use crate::geometry::Twist;
    use crate::lanes::tests::levels;
    use crate::motion::{RobotModel, step};
    use crate::random::{rng, uniform};

    #[test]
    fn the_control_is_the_one_that_trying_each_finds_bit_for_bit() {
        let quick = RobotModel { omega_max: 12.0, alpha_max: 30.0, ..RobotModel::default() };
        for (seed, robot) in [(1, RobotModel::default()), (2, quick)] {
            let weighing = RiskParams::default();
            let mut r = rng(seed, 0);
            let lattices = [(5, 9), (1, 1), (3, 5), (8, 16)];
            for (k, (speeds, rates)) in lattices.into_iter().cycle().take(800).enumerate() {
                let lattice = ControlLattice::new(&robot, 0.3, speeds, rates);
                let mut draw = |most: f64| most * (2.0 * uniform(&mut r) - 1.0);
                let pose = Pose2::new(draw(3.0), draw(3.0), draw(3.1));
                let target = Point2::new(draw(3.0), draw(3.0));
                let twist = Twist { v: draw(1.0).abs(), omega: draw(robot.omega_max) };
                let mut from = TimeTree::rooted(0.0, 0.3, pose, twist).nodes[0];
                from.closed = (draw(1e9).abs() as u128) << (k % 3 * 40) & ((1 << (lattice.count() - 1)) - 1);
                let open = (0..lattice.count()).filter(|control| from.closed & (1 << control) == 0);
                let reached = open.map(|control| {
                    let pose = step(pose, lattice.twist(twist, control), 0.3);
                    (weighing.node_cost(pose, 0.0, 2.0, target), control, pose)
                });
                let expected =
                    reached.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, control, pose)| (control, pose));
                for level in levels() {
                    let found = dispatch!(level, simd => {
                        nearest_control(simd, &lattice, &weighing, &from, (target, 2.0))
                    });
                    assert_eq!(found, expected, "seed {seed}, {level:?}, case {k}");
                }
            }
        }
    }
}
