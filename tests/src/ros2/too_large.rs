//! Messages that are too long to be read, and two robots on one topic of diagnostics.

use std::sync::atomic::Ordering;

use curionav_ros2::attachment::Attachment;
use curionav_ros2::dialect::Dialect;
use curionav_ros2::interface::Interface;
use curionav_ros2::message::Message;
use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;
use zenoh::Wait;
use zenoh::qos::CongestionControl;

use super::peer::DIALECT;
use super::robot::Robot;
use super::site::{in_turn, robots_router, services};

fn says(said: &ros::DiagnosticArray, robot: &str, what: &str) -> bool {
    said.status.iter().any(|status| {
        let is_of = status.name == format!("curionav: {robot}") && status.hardware_id == robot;
        is_of && status.values.iter().any(|value| value.value.contains(what))
    })
}

/// Bytes that no encoder of ours would write.
fn say(robot: &Robot, topic: &str, interface: &Interface, payload: Vec<u8>) {
    let key = DIALECT.key(&robot.peer.topic(topic), interface);
    let attachment = Attachment { sequence: 1, stamp_ns: 1, gid: [1; 16] }.encode().to_vec();
    let put = robot.peer.session.put(key, payload).attachment(attachment);
    put.congestion_control(CongestionControl::Block).wait().unwrap();
}

/// A scan of so many beams, made of one of a single beam, whose last words are their number, the beam, and that it has
/// no intensities.
fn nine_thousand_beams() -> Vec<u8> {
    let scan = ros::LaserScan { ranges: vec![1.0], ..Default::default() };
    let mut bytes = scan.encode().unwrap();
    bytes.truncate(bytes.len() - 12);
    bytes.extend(9000_u32.to_le_bytes());
    (0..9000).for_each(|_| bytes.extend(1.0_f32.to_le_bytes()));
    bytes.extend(0_u32.to_le_bytes());
    bytes
}

#[test]
fn what_is_too_large_is_named_so_with_its_robot_until_what_follows_is_not() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let first = services("r1", &endpoint, "/r1").await;
        let second = services("r2", &endpoint, "/r2").await;
        let robot = Robot::start(&endpoint, "/r1").await;
        let other = Robot::start(&endpoint, "/r2").await;
        let diagnoses = robot.peer.hear::<ros::DiagnosticArray>("/diagnostics", Qos::DEFAULT);
        // 8192 beams are the most. What is well would take the place of what is not.
        robot.scans.store(false, Ordering::Relaxed);
        say(&robot, "scan", &ros::LaserScan::INTERFACE, nine_thousand_beams());
        let scan = "/r1/scan is not used: it is too large: ranges: has a length of 9000; the most is 8192";
        diagnoses.that(|said| says(said, "r1", scan)).await;
        // As many cells as no map may have.
        say(&robot, "map", &ros::OccupancyGrid::INTERFACE, vec![0; 4100 * 4100]);
        diagnoses.that(|said| says(said, "r1", "/r1/map is not used: it is too large: 168100")).await;
        // Of the other robot nothing of this is said.
        diagnoses.that(|said| says(said, "r2", "/r2/map is awaited")).await;
        let all = diagnoses.messages.lock().unwrap().clone();
        assert!(!all.iter().any(|said| says(said, "r2", "too large")));
        robot.scans.store(true, Ordering::Relaxed);
        drop((all, other));
        diagnoses.messages.lock().unwrap().clear();
        diagnoses.that(|said| says(said, "r1", "") && !says(said, "r1", scan)).await;
        first.stop().await;
        second.stop().await;
    });
}
