//! A laser that shows nothing, or contradicts itself: the robot stands, operators hear why, and it goes on.

use std::time::Instant;

use curionav_planning::geometry::Point2;
use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;
use curionav_runtime::locked::locked;

use super::robot::{Robot, Spoils, WELL, goal};
use super::safety::is_zero;
use super::site::{in_turn, robots_router, services};

/// Where it drives to and fro, metres: it turns round when an end is nearer than `TURNS`.
const ENDS: [Point2; 2] = [Point2 { x: 10.0, y: 5.0 }, Point2 { x: 2.0, y: 5.0 }];
const TURNS: f64 = 2.5;
/// Farthest that it may roll on, metres: 0.5 m/s at 0.5 m/s2 takes 0.25 m, 1 m/s takes 1 m, and what is not used counts
/// as silent after 0.4 s on the wall, 0.27 s of the robot's clock.
const ROLLS: f64 = 1.6;

fn fill(scan: &mut ros::LaserScan, range: f32) {
    scan.ranges.fill(range);
}

/// Makes degrees of radians.
fn in_degrees(scan: &mut ros::LaserScan) {
    for angle in [&mut scan.angle_min, &mut scan.angle_max, &mut scan.angle_increment] {
        *angle = angle.to_degrees();
    }
}

/// What is sent, and what `/diagnostics` says then.
const SPOILT: &[(Spoils, &str)] = &[
    // As failing and covered scanners send it.
    (|s| fill(s, 0.0), "beams say anything"),
    (|s| (fill(s, 0.05), s.range_min = 0.1).1, "too few beams"),
    (|s| s.ranges.iter_mut().step_by(2).for_each(|r| *r = f32::NAN), "beams say anything"),
    (|s| fill(s, f32::NEG_INFINITY), "too few beams"),
    // Degrees instead of radians.
    (in_degrees, "sweep"),
];

#[test]
fn a_blind_laser_stops_the_robot_and_is_named_and_a_good_one_is_driven_by_again() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let services = services("r1", &endpoint, "/r1").await;
        let robot = Robot::start(&endpoint, "/r1").await;
        let _map = robot.publish_map();
        let poses = robot.peer.hear::<ros::PoseWithCovarianceStamped>("amcl_pose", Qos::DEFAULT);
        let diagnoses = robot.peer.hear::<ros::DiagnosticArray>("/diagnostics", Qos::DEFAULT);
        robot.say_pose();
        poses.that(|_| true).await;
        let mut to = ENDS[0];
        for (case, (spoils, named)) in SPOILT.iter().enumerate() {
            if robot.truth().position().distance(to) < TURNS {
                to = if to == ENDS[0] { ENDS[1] } else { ENDS[0] };
            }
            robot.peer.put("goal_pose", &goal("map", to.x, to.y));
            locked(&robot.commands.messages).clear();
            robot.commands.that(|said| said.twist.linear.x > 0.2).await;
            let (then, since) = (robot.truth().position(), Instant::now());
            *locked(&robot.spoils) = *spoils;
            locked(&robot.commands.messages).clear();
            locked(&diagnoses.messages).clear();
            robot.commands.that(is_zero).await;
            diagnoses.that(|said| said.status[0].values.iter().any(|v| v.value.contains(named))).await;
            let rolled = robot.truth().position().distance(then);
            println!("case {case}: {named}: {rolled:.2} m, {:.1} s", since.elapsed().as_secs_f64());
            assert!(rolled < ROLLS, "case {case}: {rolled} m");
            *locked(&robot.spoils) = WELL;
        }
        services.stop().await;
    });
}
