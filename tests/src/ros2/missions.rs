//! Goals of the topic, from the first map to the arrival; and two robots that do not hear each other.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use curionav_planning::geometry::Point2;
use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;
use curionav_runtime::locked::locked;

use super::peer::Peer;
use super::robot::{Robot, goal};
use super::site::{file, in_turn, metric, robots_router, services, services_with, status};
use crate::deploy_files::documented_metrics;
use crate::end_to_end::obstacles::foyer;
use crate::end_to_end::program::LIMIT;

/// Two metres and a half ahead of where the robot of quickstart begins.
const NEAR: (f64, f64) = (3.5, 4.2);

/// Beyond the box in the foyer, which stands across the way.
const BEYOND: Point2 = Point2 { x: 7.0, y: 4.6 };

#[test]
fn a_box_that_is_on_no_map_is_driven_around() {
    in_turn(async {
        let folder = tempfile::tempdir().unwrap();
        let scenario = foyer(folder.path());
        for profile in ["curionav", "mppi"] {
            let (_router, endpoint) = robots_router().await;
            let file = file("r1", &endpoint, "/r1").replace("distance-only", profile);
            let services = services_with(&file, "/r1").await;
            let robot = Robot::of(&scenario, &endpoint, "/r1").await;
            let _map = robot.localise().await;
            robot.peer.put("goal_pose", &goal("map", BEYOND.x, BEYOND.y));
            let since = Instant::now();
            let mut room = f64::INFINITY;
            while robot.truth().position().distance(BEYOND) > 0.8 {
                assert!(since.elapsed() < LIMIT, "{profile}: {:?} is as far as it comes", robot.truth());
                room = room.min(locked(&robot.world).truth().wall_clearance);
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
            println!("{profile}: {room:.2} m of room, {:.0} s", since.elapsed().as_secs_f64());
            assert!(room > 0.0, "{profile}: {room} m");
            services.stop().await;
        }
    });
}

#[test]
fn a_goal_of_the_topic_is_reached_on_a_map_that_came_late() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let services = services("r1", &endpoint, "/r1").await;
        let robot = Robot::start(&endpoint, "/r1").await;
        let poses = robot.peer.hear::<ros::PoseWithCovarianceStamped>("amcl_pose", Qos::DEFAULT);
        let diagnoses = robot.peer.hear::<ros::DiagnosticArray>("/diagnostics", Qos::DEFAULT);
        // A goal without a map is refused, and that is said.
        robot.peer.put("goal_pose", &goal("map", NEAR.0, NEAR.1));
        diagnoses.that(|said| said.status[0].message.starts_with("/r1/goal_pose is not used")).await;
        let _map = robot.publish_map();
        robot.say_pose();
        poses.that(|_| true).await;
        assert_eq!(robot.commands.count(), 0, "a robot that is only localised is told nothing");
        let begun = robot.truth().position();
        let candidates = robot.peer.hear::<ros::MarkerArray>("curionav/candidates", Qos::DEFAULT);
        robot.peer.put("goal_pose", &goal("map", NEAR.0, NEAR.1));
        candidates.that(|drawn| drawn.markers.len() > 1).await;
        // Once it has come to a stand at the goal, the plan is empty; a late listener hears the last.
        let there = Point2::new(NEAR.0, NEAR.1);
        let plans = robot.peer.hear::<ros::Path>("plan", Qos::LATCHED);
        plans.that(|plan| !plan.poses.is_empty()).await;
        plans.that(|plan| plan.poses.is_empty()).await;
        let arrived = robot.truth().position();
        println!("from {begun:?} to {arrived:?}");
        assert!(arrived.distance(there) < 1.0 && begun.distance(there) > 2.0, "{arrived:?}");
        // A subscriber that comes after all this is still given the newest plan.
        let late = Peer::new(&endpoint, "/r1").await;
        late.hear::<ros::Path>("plan", Qos::LATCHED).that(|plan| plan.poses.is_empty()).await;
        for (what, malformed) in [
            ("cmd_vel", &robot.commands.malformed),
            ("amcl_pose", &poses.malformed),
            ("plan", &plans.malformed),
            ("candidates", &candidates.malformed),
            ("diagnostics", &diagnoses.malformed),
        ] {
            assert_eq!(malformed.load(Ordering::Relaxed), 0, "{what}");
        }
        let within = |said: &ros::TwistStamped| {
            let (v, omega) = (said.twist.linear.x, said.twist.angular.z);
            (0.0..=1.0).contains(&v) && omega.abs() <= 1.0 && said.header.frame_id == "base_link"
        };
        assert!(robot.commands.messages.lock().unwrap().iter().all(within));
        // Every number that the gateway has is in the page for operators.
        let status = status(&services).await;
        assert!(metric(&status, "curionav_ros2_ticks_total", "") > 20.0);
        let documented = documented_metrics();
        for sample in status.metrics.keys() {
            let name = sample.split('{').next().unwrap();
            let family =
                ["_bucket", "_count", "_sum"].iter().find_map(|end| name.strip_suffix(end)).unwrap_or(name);
            assert!(documented.contains(family), "{sample} is not in docs/running.md");
        }
        services.stop().await;
    });
}

#[test]
fn two_robots_on_one_router_do_not_hear_each_other() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let (first, second) =
            (services("r1", &endpoint, "/r1").await, services("r2", &endpoint, "/r2").await);
        let (one, two) = (Robot::start(&endpoint, "/r1").await, Robot::start(&endpoint, "/r2").await);
        let _maps = (one.publish_map(), two.publish_map());
        let poses = [&one, &two].map(|robot| {
            robot.say_pose();
            robot.peer.hear::<ros::PoseWithCovarianceStamped>("amcl_pose", Qos::DEFAULT)
        });
        for heard in &poses {
            heard.that(|_| true).await;
        }
        let begun = two.truth();
        one.peer.put("goal_pose", &goal("map", NEAR.0, NEAR.1));
        one.commands.that(|said| said.twist.linear.x > 0.3).await;
        // The second robot's own run lets it stand.
        let stands = |said: &ros::TwistStamped| said.twist == ros::Twist::default();
        assert!(two.commands.messages.lock().unwrap().iter().all(stands));
        assert_eq!(two.truth(), begun);
        // Nor are they a second publisher to each other.
        for services in [&first, &second] {
            let problems = metric(&status(services).await, "curionav_ros2_problem", "second_publisher");
            assert!(problems == 0.0);
        }
        first.stop().await;
        second.stop().await;
    });
}
