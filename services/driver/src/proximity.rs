//! The last line of defence: the raw scan against where the command leads.

use curionav_planning::beam::Beam;
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::motion::{RobotModel, step};
use curionav_runtime::convert;
use curionav_schemas::Scan;

use crate::sight::end;

/// Room kept between the robot's circumscribed disc and anything the scan shows, metres.
const MARGIN: f64 = 0.05;
/// Step at which the way to a stop is looked along, seconds.
const STEP: f64 = 0.1;

/// The command, or braking if driving it for `period` seconds and then braking fully at its turn rate would bring the
/// robot closer than the margin to a point of the scan it is not already moving away from.
/// `scan_from_robot` is where the robot is now, seen from where it was when it took the scan.
pub fn guard(command: Twist, scan: &Scan, scan_from_robot: Pose2, robot: &RobotModel, period: f64) -> Twist {
    if command.v <= 0.0 {
        return command;
    }
    let reach = robot.radius() + MARGIN;
    let farthest = reach + robot.v_max * period + robot.stopping_distance(robot.v_max);
    let points = points(scan, scan_from_robot, farthest);
    if points.is_empty() {
        return command;
    }
    let mut pose = Pose2::default();
    let mut twist = command;
    let mut time = 0.0;
    // It ends: the range of `a_max` leaves out 0.
    loop {
        pose = step(pose, twist, STEP);
        let hits = points.iter().any(|p| {
            let now = pose.position().distance(*p);
            // What is already inside the margin may be left, not approached.
            now < reach && now < p.distance(Point2::default()) - 1e-3
        });
        if hits {
            return Twist { v: 0.0, omega: command.omega };
        }
        time += STEP;
        if time >= period {
            twist.v -= robot.a_max * STEP;
            if twist.v <= 0.0 {
                return command;
            }
        }
    }
}

/// End points of the beams that met something, as the robot sees them now: those within `reach` metres.
fn points(scan: &Scan, scan_from_robot: Pose2, reach: f64) -> Vec<Point2> {
    let laser = convert::pose(scan.laser);
    let hits = convert::beams(scan).enumerate().filter_map(|(i, beam)| match beam {
        Beam::Obstacle(metres) => Some(scan_from_robot.inverse_transform(end(scan, laser, i, metres))),
        Beam::Silent | Beam::Free(_) => None,
    });
    hits.filter(|p| p.distance(Point2::default()) < reach).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_schemas::{F32Array, Pose};

    fn wall_ahead(distance: f64) -> Scan {
        let n = 181;
        let increment = std::f64::consts::PI / f64::from(n - 1);
        let ranges: F32Array = (0..n)
            .map(|i| {
                let bearing = -std::f64::consts::FRAC_PI_2 + increment * f64::from(i);
                (distance / bearing.cos().max(1e-3)).min(10.0) as f32
            })
            .collect();
        Scan {
            tick: 0,
            stamp: 0.0,
            angle_min: -std::f64::consts::FRAC_PI_2,
            angle_increment: increment,
            range_min: None,
            range_max: 10.0,
            laser: Pose { x: 0.0, y: 0.0, heading: 0.0 },
            ranges,
        }
    }

    #[test]
    fn it_brakes_while_it_still_can() {
        let robot = RobotModel::default();
        let drive = Twist { v: 1.0, omega: 0.0 };
        // From 1 m/s: 0.1 m in a period and 1 m of braking, radius 0.3, margin 0.05: 1.45 m.
        assert_eq!(guard(drive, &wall_ahead(1.7), Pose2::default(), &robot, 0.1), drive);
        assert_eq!(guard(drive, &wall_ahead(1.2), Pose2::default(), &robot, 0.1).v, 0.0);
    }

    #[test]
    fn an_old_scan_is_moved_by_what_was_driven_since() {
        let robot = RobotModel::default();
        let drive = Twist { v: 1.0, omega: 0.0 };
        // The wall was 1.7 m ahead when it was seen, half a metre ago.
        let since = Pose2::new(0.5, 0.0, 0.0);
        assert_eq!(guard(drive, &wall_ahead(1.7), since, &robot, 0.1).v, 0.0);
    }

    #[test]
    fn it_looks_along_the_whole_way_to_a_stop() {
        // From 2 m/s at 0.25 m/s2: 0.2 m in a period and 8 m of braking, which take 8.1 s.
        let robot = RobotModel { v_max: 2.0, a_max: 0.25, ..RobotModel::default() };
        let drive = Twist { v: 2.0, omega: 0.0 };
        assert_eq!(guard(drive, &wall_ahead(9.0), Pose2::default(), &robot, 0.1), drive);
        assert_eq!(guard(drive, &wall_ahead(8.2), Pose2::default(), &robot, 0.1).v, 0.0);
    }

    #[test]
    fn what_is_beside_or_behind_does_not_stop_it() {
        let robot = RobotModel::default();
        let mut scan = wall_ahead(9.0);
        scan.ranges.0[0] = 0.33;
        scan.ranges.0[180] = 0.33;
        let creep = Twist { v: 0.3, omega: 0.0 };
        assert_eq!(guard(creep, &scan, Pose2::default(), &robot, 0.1), creep);
    }
}
