use std::f64::consts::{FRAC_PI_2, PI};

use curionav_schemas::Pose;

use super::*;

/// A scan over `fov` radians around `ahead`, one degree between beams, of which nothing is met within 10 m.
fn scan(stamp: f64, fov: f64, ahead: f64) -> Scan {
    let beams = (fov.to_degrees().round() as usize) + 1;
    Scan {
        tick: 0,
        stamp,
        angle_min: ahead - 0.5 * fov,
        angle_increment: 1.0_f64.to_radians(),
        range_min: None,
        range_max: 10.0,
        laser: Pose { x: 0.15, y: 0.0, heading: 0.0 },
        ranges: vec![10.0; beams].into(),
    }
}

/// The speed that is left of `command` at `now` when `scans` have been seen by a robot that stands.
fn left_of(command: Twist, scans: &[Scan], now: f64) -> f64 {
    let mut seen = SeenWay::default();
    scans.iter().for_each(|scan| seen.see(scan, 0.0));
    seen.slowed(command, Pose2::default(), now, &RobotModel::default(), 0.1).v
}

const FAST: Twist = Twist { v: 1.0, omega: 0.0 };

#[test]
fn usual_lasers_slow_no_robot_that_drives_forwards() {
    for degrees in [180.0_f64, 190.0, 240.0, 270.0, 360.0] {
        for v in [0.05, 0.1, 0.3, 0.5, 1.0] {
            for omega in [-1.0, -0.5, -0.1, 0.0, 0.1, 0.5, 1.0] {
                let command = Twist { v, omega };
                let left = left_of(command, &[scan(0.0, degrees.to_radians(), 0.0)], 0.1);
                assert_eq!(left, v, "{degrees} degrees, {command:?}");
            }
        }
    }
}

#[test]
fn the_robot_does_not_drive_where_it_has_not_looked() {
    // To the rear, to the left alone, to the right alone, nowhere.
    let quarter = FRAC_PI_2;
    for looked in
        [vec![scan(0.0, PI, PI)], vec![scan(0.0, quarter, 1.0)], vec![scan(0.0, quarter, -1.0)], vec![]]
    {
        assert!(left_of(FAST, &looked, 0.1) < 0.1, "{looked:?}");
    }
    // Turning on the spot stays possible, and shows what is there.
    assert_eq!(left_of(Twist { v: 0.0, omega: 1.0 }, &[], 0.1), 0.0);
}

#[test]
fn backwards_is_driven_only_where_the_laser_has_looked() {
    for (v, omega) in [(-0.3, -0.3), (-0.3, 0.0), (-0.3, 0.3), (-0.05, 0.0)] {
        let back = Twist { v, omega };
        for degrees in [180.0_f64, 240.0, 270.0] {
            assert_eq!(left_of(back, &[scan(0.0, degrees.to_radians(), 0.0)], 0.1), 0.0, "{degrees} degrees");
        }
        assert_eq!(left_of(back, &[scan(0.0, 2.0 * PI, 0.0)], 0.1), v);
        assert_eq!(left_of(back, &[scan(0.0, PI, PI)], 0.1), v);
        assert_eq!(left_of(back, &[scan(0.0, PI, PI)], 1.2), 0.0, "a second later");
    }
}

#[test]
fn a_look_holds_for_a_second_and_through_a_turn() {
    let seen = [scan(5.0, PI, 0.0)];
    assert_eq!(left_of(FAST, &seen, 6.0), 1.0);
    assert!(left_of(FAST, &seen, 6.11) < 0.1);
    // The robot has turned by a third of a turn since: it now faces what was at the side, or has not been seen.
    let mut way = SeenWay::default();
    way.see(&seen[0], 0.0);
    let facing =
        |heading: f64| way.slowed(FAST, Pose2::new(0.0, 0.0, heading), 5.5, &RobotModel::default(), 0.1).v;
    assert_eq!(facing(0.6), 1.0);
    assert!(facing(2.0) < 0.1 && facing(-2.0) < 0.1);
}

#[test]
fn beams_that_say_nothing_have_not_seen_the_way() {
    let mut sparse = scan(0.0, PI, 0.0);
    (0..sparse.ranges.len()).filter(|i| i % 5 == 0).for_each(|i| sparse.ranges.0[i] = f32::NAN);
    assert_eq!(left_of(FAST, &[sparse.clone()], 0.1), 1.0);
    // A block of 40 degrees straight ahead fails.
    sparse.ranges.0[70..111].fill(0.0);
    assert!(left_of(FAST, &[sparse], 0.1) < 0.1);
}

#[test]
fn a_short_sight_slows_as_far_as_it_reaches() {
    // From 2 m/s at 0.25 m/s2 it takes 8.2 m to stop; it sees 4.85 m from its centre, 4.55 m from its front.
    let robot = RobotModel { v_max: 2.0, a_max: 0.25, ..RobotModel::default() };
    let mut way = SeenWay::default();
    way.see(&Scan { range_max: 5.0, ..scan(0.0, PI, 0.0) }, 0.0);
    let command = Twist { v: 2.0, omega: 0.1 };
    let slowed = way.slowed(command, Pose2::default(), 0.1, &robot, 0.1);
    let to_stop = 0.1 * slowed.v + robot.stopping_distance(slowed.v);
    assert!((4.0..=4.55).contains(&to_stop) && slowed.omega == 0.1, "{slowed:?}: {to_stop} m");
}
