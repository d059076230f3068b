//! Timing a path: the unicycle is driven along it in closed loop, under its limits, and braked so that it
//! stands when the horizon ends (D14).

mod drive;
mod robots;

use crate::lanes::{LANES, Level, dispatch};
use crate::states::States;
pub use drive::{Departure, Drive, RolloutParams, SpeedProfile};
use robots::{Law, Robots};

/// Drives along every path from `from.pose` and adds `from.steps` states of each to `states`: where the robot is dt, 2
/// dt, ... after the start. Speeds, turn rates and their changes obey the robot's limits at every substep, and the last
/// state stands still (if the limits allow it to stop at all within the horizon).
pub fn rollouts(drives: &[Drive<'_>], from: &Departure<'_>, params: &RolloutParams, states: &mut States) {
    rollouts_with(Level::new(), drives, from, params, states);
}

fn rollouts_with(
    level: Level,
    drives: &[Drive<'_>],
    from: &Departure<'_>,
    params: &RolloutParams,
    states: &mut States,
) {
    let law = Law::new(from, params);
    for chunk in drives.chunks(LANES) {
        // The last group is filled up with copies of the last drive.
        let drives: [Drive<'_>; LANES] = std::array::from_fn(|lane| chunk[lane.min(chunk.len() - 1)]);
        let first = states.len();
        states.lengthen(chunk.len() * from.steps);
        let rows = (first, chunk.len());
        dispatch!(level, simd => Robots::new(simd, &drives, from).drive(&law, from.steps, states, rows));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generation::path::Path;
    use crate::geometry::{Point2, Pose2, Twist};
    use crate::lanes::tests::levels;
    use crate::motion::RobotModel;
    use crate::random::{rng, uniform};

    fn driven(path: &Path, fraction: f64, turn_first: bool, from: &Departure<'_>) -> States {
        let mut states = States::default();
        let drive = Drive { path, profile: SpeedProfile { fraction, turn_first } };
        rollouts(&[drive], from, &RolloutParams::default(), &mut states);
        states
    }

    fn departure(robot: &RobotModel, v: f64) -> Departure<'_> {
        Departure { pose: Pose2::default(), twist: Twist { v, omega: 0.0 }, robot, steps: 13, dt: 0.3 }
    }

    #[test]
    fn whatever_the_path_limits_hold_and_the_robot_stands_at_the_end() {
        let robot = RobotModel::default();
        let mut r = rng(11, 0);
        for _ in 0..500 {
            let points: Vec<Point2> = (0..6)
                .map(|_| Point2::new(4.0 * uniform(&mut r) - 1.0, 4.0 * uniform(&mut r) - 2.0))
                .collect();
            let path = Path::new(Point2::default(), points, 5.0);
            let fraction = 0.2 + 0.8 * uniform(&mut r);
            let turn_first = uniform(&mut r) < 0.3;
            let from = departure(&robot, uniform(&mut r));
            let out = driven(&path, fraction, turn_first, &from);
            assert_eq!(out.len(), 13);
            let mut pose = from.pose;
            let mut twist = from.twist;
            for k in 0..13 {
                assert!(out.v[k] >= 0.0 && out.v[k] <= robot.v_max && out.omega[k].abs() <= robot.omega_max);
                assert!((out.v[k] - twist.v).abs() <= robot.a_max * 0.3 + 1e-9);
                assert!((out.omega[k] - twist.omega).abs() <= robot.alpha_max * 0.3 + 1e-9);
                let next = out.at(k);
                assert!(pose.position().distance(next.0.position()) <= robot.v_max * 0.3 + 1e-9);
                (pose, twist) = next;
            }
            assert!(twist.v.abs() < 1e-9 && twist.omega.abs() < 1e-9, "{twist:?}");
        }
    }

    #[test]
    fn a_straight_path_from_rest_goes_as_far_as_acceleration_and_braking_allow() {
        let robot = RobotModel::default();
        let path = Path::new(Point2::default(), [Point2::new(10.0, 0.0)], 10.0);
        let out = driven(&path, 1.0, false, &departure(&robot, 0.0));
        // 0.5 m/s2 up for 1.95 s and down for 1.95 s: 0.975 * 1.95 = 1.9 m
        assert!((out.x[12] - 1.9).abs() < 0.06, "{}", out.x[12]);
        // Nothing is faster, so a candidate is slow below half of its mean speed if `min_speed` is half of the
        // greatest.
        let mean_speed = out.v.iter().sum::<f64>() / 13.0;
        assert!((robot.slow_below(0.5 * robot.v_max, 0.0, 13, 0.3) - 0.5 * mean_speed).abs() < 0.02);
    }

    #[test]
    fn a_path_that_ends_early_is_stopped_at() {
        let robot = RobotModel::default();
        let path = Path::new(Point2::default(), [Point2::new(1.0, 0.0)], 10.0);
        let out = driven(&path, 1.0, false, &departure(&robot, 0.5));
        assert!((out.x[12] - 1.0).abs() < 0.12, "{}", out.x[12]);
    }

    #[test]
    fn a_path_that_starts_behind_is_turned_to_on_the_spot() {
        let robot = RobotModel::default();
        let path = Path::new(Point2::default(), [Point2::new(-5.0, -0.5)], 10.0);
        let out = driven(&path, 1.0, true, &Departure { steps: 25, ..departure(&robot, 0.0) });
        assert!(out.x[3].abs() < 0.05 && out.heading[3].abs() > 0.3);
        assert!(out.x[24] < -1.0, "{}", out.x[24]);
    }

    #[test]
    fn every_kind_of_vectors_gives_the_same_bits() {
        let robot = RobotModel { omega_max: 12.0, alpha_max: 30.0, ..RobotModel::default() };
        let mut r = rng(12, 0);
        let paths: Vec<Path> = (0..45)
            .map(|_| {
                let mut draw = || Point2::new(4.0 * uniform(&mut r) - 1.0, 4.0 * uniform(&mut r) - 2.0);
                Path::new(Point2::default(), [draw(), draw(), draw()], 5.0)
            })
            .collect();
        let profile =
            |k: usize| SpeedProfile { fraction: 0.2 + 0.1 * (k % 8) as f64, turn_first: k.is_multiple_of(3) };
        let drives: Vec<Drive<'_>> =
            paths.iter().enumerate().map(|(k, path)| Drive { path, profile: profile(k) }).collect();
        let from = departure(&robot, 0.4);
        let params = RolloutParams::default();
        let driven = levels().into_iter().map(|level| {
            let mut states = States::default();
            rollouts_with(level, &drives, &from, &params, &mut states);
            states
        });
        let driven: Vec<_> = driven.collect();
        assert!(driven.len() > 1 && driven.iter().all(|d| *d == driven[0]));
        // A drive does not depend on those beside it.
        let mut alone = States::default();
        rollouts_with(levels()[0], &drives[40..41], &from, &params, &mut alone);
        assert!(alone.poses(0..13).eq(driven[0].poses(40 * 13..41 * 13)));
    }
}
