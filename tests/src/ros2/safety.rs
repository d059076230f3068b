//! What stops a robot, and what operators are told.

use std::sync::atomic::Ordering;
use std::time::Instant;

use curionav_ros2::interface::Distribution;
use curionav_ros2::message::Message;
use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;
use curionav_ros2::token::{Endpoint, EntityKind};
use curionav_runtime::locked::locked;

use super::robot::{Robot, goal};
use super::site::{in_turn, metric, robots_router, services, status, until};

const FAR: (f64, f64) = (10.0, 5.0);

pub(super) fn is_zero(said: &ros::TwistStamped) -> bool {
    said.twist == ros::Twist::default()
}

/// A robot that drives.
async fn driving(endpoint: &str) -> (Robot, zenoh_ext::AdvancedPublisher<'static>) {
    let robot = Robot::start(endpoint, "/r1").await;
    let map = robot.localise().await;
    robot.peer.put("goal_pose", &goal("map", FAR.0, FAR.1));
    robot.commands.that(|said| said.twist.linear.x > 0.3).await;
    (robot, map)
}

/// Waits until the robot is told to stand; gives how long that took.
async fn told_to_stand(robot: &Robot) -> f64 {
    let since = Instant::now();
    locked(&robot.commands.messages).clear();
    robot.commands.that(is_zero).await;
    since.elapsed().as_secs_f64()
}

#[test]
fn a_robot_whose_scans_or_odometry_end_is_told_to_stand_and_drives_on_when_they_are_back() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let services = services("r1", &endpoint, "/r1").await;
        let (robot, _map) = driving(&endpoint).await;
        for stream in [&robot.scans, &robot.odometry] {
            stream.store(false, Ordering::Relaxed);
            println!("told to stand after {:.2} s", told_to_stand(&robot).await);
            // At rate, and nothing else.
            locked(&robot.commands.messages).clear();
            until(|| robot.commands.count() >= 5).await;
            assert!(locked(&robot.commands.messages).iter().all(is_zero));
            stream.store(true, Ordering::Relaxed);
            locked(&robot.commands.messages).clear();
            robot.commands.that(|said| said.twist.linear.x > 0.3).await;
        }
        assert!(metric(&status(&services).await, "curionav_ros2_zeros_total", "") >= 10.0);
        // The last thing that a gateway says is that the robot is to stand.
        services.stop().await;
        until(|| robot.commands.newest().is_some_and(|said| is_zero(&said))).await;
    });
}

#[test]
fn a_clock_that_is_set_back_ends_the_run_until_it_is_known_again_where_the_robot_is() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let services = services("r1", &endpoint, "/r1").await;
        let (robot, _map) = driving(&endpoint).await;
        robot.back_ms.store(5000, Ordering::Relaxed);
        told_to_stand(&robot).await;
        let diagnoses = robot.peer.hear::<ros::DiagnosticArray>("/diagnostics", Qos::DEFAULT);
        robot.peer.put("goal_pose", &goal("map", FAR.0, FAR.1));
        let lost = |said: &ros::DiagnosticArray| said.status[0].message.contains("give an initial pose");
        diagnoses.that(lost).await;
        robot.say_pose();
        let poses = robot.peer.hear::<ros::PoseWithCovarianceStamped>("amcl_pose", Qos::DEFAULT);
        poses.that(|_| true).await;
        locked(&robot.commands.messages).clear();
        robot.peer.put("goal_pose", &goal("map", FAR.0, FAR.1));
        robot.commands.that(|said| said.twist.linear.x > 0.3).await;
        services.stop().await;
    });
}

#[test]
fn a_second_publisher_of_velocities_and_another_type_are_named() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let services = services("r1", &endpoint, "/r1").await;
        let robot = Robot::start(&endpoint, "/r1").await;
        let endpoint_of = |interface: curionav_ros2::interface::Interface, topic: &str| Endpoint {
            topic: robot.peer.topic(topic),
            type_name: interface.dds(),
            hash: interface.hash(Distribution::Kilted).to_owned(),
            qos: Qos::DEFAULT,
        };
        robot
            .peer
            .declare_token(EntityKind::Publisher, Some(endpoint_of(ros::TwistStamped::INTERFACE, "cmd_vel")));
        robot.peer.declare_token(EntityKind::Subscriber, Some(endpoint_of(ros::Twist::INTERFACE, "cmd_vel")));
        for kind in ["second_publisher", "other_type"] {
            let mut named = false;
            while !named {
                let status = status(&services).await;
                named = metric(&status, "curionav_ros2_problem", kind) > 0.0;
                tokio::time::sleep(std::time::Duration::from_millis(20)).await;
            }
        }
        services.stop().await;
    });
}

#[test]
fn a_robot_that_a_service_stops_stands_until_it_is_resumed_whatever_goal_comes() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let services = services("r1", &endpoint, "/r1").await;
        let (robot, _map) = driving(&endpoint).await;
        let ask = ros::TriggerRequest { structure_needs_at_least_one_member: 0 };
        let stopped: ros::TriggerResponse = robot.peer.call("curionav/stop", &ask).await;
        assert!(stopped.success && stopped.message == "paused", "{stopped:?}");
        told_to_stand(&robot).await;
        let diagnoses = robot.peer.hear::<ros::DiagnosticArray>("/diagnostics", Qos::DEFAULT);
        robot.peer.put("goal_pose", &goal("map", FAR.0, FAR.1 - 0.5));
        let paused = |said: &ros::DiagnosticArray| said.status[0].message.contains("is paused");
        let said = diagnoses.that(paused).await;
        assert_eq!(said.status[0].hardware_id, "r1");
        locked(&robot.commands.messages).clear();
        until(|| robot.commands.count() >= 10).await;
        assert!(locked(&robot.commands.messages).iter().all(is_zero), "it moves although it is paused");
        let resumed: ros::TriggerResponse = robot.peer.call("curionav/resume", &ask).await;
        assert!(resumed.success, "{resumed:?}");
        robot.commands.that(|said| said.twist.linear.x > 0.3).await;
        services.stop().await;
    });
}

#[test]
fn a_clock_that_is_set_back_a_little_stops_the_robot_until_it_has_gone_right_for_a_while() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let services = services("r1", &endpoint, "/r1").await;
        let (robot, _map) = driving(&endpoint).await;
        let diagnoses = robot.peer.hear::<ros::DiagnosticArray>("/diagnostics", Qos::DEFAULT);
        // Less than what ends the run, and more than any link brings late.
        robot.back_ms.store(400, Ordering::Relaxed);
        println!("told to stand after {:.2} s", told_to_stand(&robot).await);
        let named =
            |said: &ros::DiagnosticArray| said.status[0].message.contains("clock jumps, crawls or stands");
        diagnoses.that(named).await;
        locked(&robot.commands.messages).clear();
        robot.commands.that(|said| said.twist.linear.x > 0.3).await;
        services.stop().await;
    });
}
