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
