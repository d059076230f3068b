//! Eight robots that drive side by side, each along its own path.

use crate::generation::path::Path;
use crate::generation::rollout::drive::{Departure, Drive, RolloutParams};
use crate::geometry::{Direction, Facing, Point2, Pose2, Twist, wrap_angle};
use crate::lanes::*;
use crate::motion::RobotModel;
use crate::numerics::atan2;
use crate::states::States;

/// What is the same for all robots and times.
pub(super) struct Law<'a> {
    robot: &'a RobotModel,
    params: &'a RolloutParams,
    /// Substeps per state.
    pieces: usize,
    /// Seconds per substep.
    h: f64,
    /// Cosines of the bearings of the same names.
    turn_from: f64,
    turn_until: f64,
}

impl<'a> Law<'a> {
    pub(super) fn new(from: &Departure<'a>, params: &'a RolloutParams) -> Self {
        let pieces = (from.dt / params.substep - 1e-9).ceil().max(1.0) as usize;
        Self {
            robot: from.robot,
            params,
            pieces,
            h: from.dt / pieces as f64,
            turn_from: Direction::of(params.turn_from).cos,
            turn_until: Direction::of(params.turn_until).cos,
        }
    }

    /// As [`RobotModel::limit_speed`] of a robot that never drives backwards.
    #[inline(always)]
    fn limit_speed<S: Simd>(&self, current: f64x8<S>, wanted: f64x8<S>) -> f64x8<S> {
        let all = |x: f64| f64x8::splat(current.simd, x);
        let change = self.robot.a_max * self.h;
        let least = current - change;
        let most = current + change;
        let v = greater(lesser(wanted, most), least);
        greater(lesser(v, greater(least, all(self.robot.v_max))), lesser(most, all(0.0)))
    }
}

/// The robot in every lane.
pub(super) struct Robots<'a, S: Simd> {
    simd: S,
    drives: &'a [Drive<'a>; LANES],
    x: f64x8<S>,
    y: f64x8<S>,
    heading: f64x8<S>,
    cos: f64x8<S>,
    sin: f64x8<S>,
    v: f64x8<S>,
    omega: f64x8<S>,
    /// Greatest speed that the profile allows, m/s.
    cruise: f64x8<S>,
    /// Index of the path's point the robot has come to.
    progress: [usize; LANES],
    /// 1 while the robot turns on the spot before it drives, then 0.
    turning: f64x8<S>,
}

impl<'a, S: Simd> Robots<'a, S> {
    #[inline(always)]
    pub(super) fn new(simd: S, drives: &'a [Drive<'a>; LANES], from: &Departure<'_>) -> Self {
        let Facing { pose, direction } = from.pose.into();
        let all = |x: f64| f64x8::splat(simd, x);
        Self {
            simd,
            drives,
            x: all(pose.x),
            y: all(pose.y),
            heading: all(pose.heading),
            cos: all(direction.cos),
            sin: all(direction.sin),
            v: all(from.twist.v),
            omega: all(from.twist.omega),
            cruise: f64x8::from_fn(simd, |i| drives[i].profile.fraction * from.robot.v_max),
            progress: [0; LANES],
            turning: f64x8::from_fn(simd, |i| f64::from(u8::from(drives[i].profile.turn_first))),
        }
    }

    /// Drives for `steps` states and puts those of the first `count` lanes into `states` from `first` on,
    /// `[lane, step]`.
    #[inline(always)]
    pub(super) fn drive(
        mut self,
        law: &Law<'_>,
        steps: usize,
        states: &mut States,
        (first, count): (usize, usize),
    ) {
        let total = steps * law.pieces;
        for k in 1..=total {
            let (v, omega) = self.pursue(law);
            self.limit(law, (total - k) as f64 * law.h, v, omega);
            self.step(law.h);
            if k % law.pieces == 0 {
                for lane in 0..count {
                    let (pose, twist) = self.state(lane);
                    states.set(first + lane * steps + k / law.pieces - 1, pose, twist);
                }
            }
        }
    }

    #[inline(always)]
    fn state(&self, lane: usize) -> (Pose2, Twist) {
        let pose = Pose2::new(self.x[lane], self.y[lane], wrap_angle(self.heading[lane]));
        (pose, Twist { v: self.v[lane], omega: self.omega[lane] })
    }

    /// The twists that lead towards the points ahead on the paths.
    #[inline(always)]
    fn pursue(&mut self, law: &Law<'_>) -> (f64x8<S>, f64x8<S>) {
        let RobotModel { a_max, omega_max, alpha_max, .. } = *law.robot;
        let all = |x: f64| f64x8::splat(self.simd, x);
        let [mut target_x, mut target_y, mut remaining] = [[0.0; LANES]; 3];
        for (i, Drive { path, .. }) in self.drives.iter().enumerate() {
            self.progress[i] = path.advance(self.progress[i], Point2::new(self.x[i], self.y[i]));
            let s = self.progress[i] as f64 * Path::SPACING;
            remaining[i] = path.length() - s;
            let target = path.at(s + law.params.lookahead + law.params.lookahead_time * self.v[i]);
            (target_x[i], target_y[i]) = (target.x, target.y);
        }
        let [dx, dy, remaining_lanes] =
            [target_x, target_y, remaining].map(|lanes| f64x8::load_array_ref(self.simd, &lanes));
        let dx = dx - self.x;
        let dy = dy - self.y;
        let ahead = self.cos * dx + self.sin * dy;
        let left = self.cos * dy - self.sin * dx;
        let squared = ahead * ahead + left * left;
        let distance = squared.sqrt();
        // A bearing is greater than an angle where its cosine, ahead / distance, is less than the angle's.
        self.turning = ahead.simd_lt(distance * law.turn_until).select(self.turning, all(0.0));
        let on_the_spot = ahead.simd_lt(distance * law.turn_from).select(all(1.0), self.turning);
        // Braking in steps of h: half a step's speed less keeps the stop before the path's end.
        let v_stop = (greater(remaining_lanes, all(0.0)) * (2.0 * a_max)).sqrt() - 0.5 * a_max * law.h;
        let curvature = left * 2.0 / greater(squared, all(1e-6));
        let v_bend = law.params.turn_share * omega_max / greater(curvature.abs(), all(1e-6));
        let mut v = greater(lesser(lesser(self.cruise, v_bend), v_stop), all(0.0));
        let mut omega = curvature * law.limit_speed(self.v, v);
        if on_the_spot.simd_gt(0.0).any_true() {
            for i in (0..LANES).filter(|&i| on_the_spot[i] > 0.0) {
                let bearing = atan2(left[i], ahead[i]);
                let rate = (1.6 * alpha_max * bearing.abs()).sqrt().min(omega_max);
                let rate = if remaining[i] > 0.0 { rate } else { 0.0 };
                (v[i], omega[i]) = (0.0, rate * bearing.signum());
            }
        }
        (v, omega)
    }

    /// Takes over wanted twists as far as the limits let the robot stand when `left` seconds are over.
    #[inline(always)]
    fn limit(&mut self, law: &Law<'_>, left: f64, v: f64x8<S>, omega: f64x8<S>) {
        let RobotModel { a_max, omega_max, alpha_max, .. } = *law.robot;
        let all = |x: f64| f64x8::splat(self.simd, x);
        let v_cap = all(a_max * left);
        let omega_cap = all(alpha_max * left);
        let is_fast = v.simd_gt(v_cap);
        // Slower on the same curve.
        let wanted = is_fast.select(omega * (v_cap / v), omega);
        let wanted = greater(lesser(wanted, omega_cap), -omega_cap);
        let change = alpha_max * law.h;
        let omega = greater(lesser(wanted, self.omega + change), self.omega - change);
        self.omega = greater(lesser(omega, all(omega_max)), all(-omega_max));
        self.v = law.limit_speed(self.v, lesser(v, v_cap));
    }

    /// As [`crate::motion::step_facing`]; headings are not wrapped.
    #[inline(always)]
    fn step(&mut self, h: f64) {
        let half = self.omega * (0.5 * h);
        let (sinc, cos) = library::sinc_cos(half);
        let sin = half * sinc;
        let chord = self.v * h * sinc;
        let middle = (self.cos * cos - self.sin * sin, self.sin * cos + self.cos * sin);
        self.x += chord * middle.0;
        self.y += chord * middle.1;
        self.cos = middle.0 * cos - middle.1 * sin;
        self.sin = middle.1 * cos + middle.0 * sin;
        self.heading += half * 2.0;
    }
}
