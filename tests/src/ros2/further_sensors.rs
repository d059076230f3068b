//! What a camera, a bumper and a costmap tell beside the laser.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use curionav_planning::geometry::Point2;
use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;
use curionav_runtime::locked::locked;

use super::robot::{Robot, TABLE, goal};
use super::site::{file, in_turn, robots_router, services_with};
use crate::end_to_end::program::LIMIT;

const GOAL: Point2 = Point2 { x: 10.0, y: 5.0 };
/// Of the robot's disc, m.
const RADIUS: f64 = 0.3;

const SENSORS: &str = "\
    [[ros2.sensors]]\nname = \"camera\"\nkind = \"cloud\"\ntopic = \"camera/points\"\nheight = [0.1, 1.2]\n\
    [[ros2.sensors]]\nname = \"bumper\"\nkind = \"bumper\"\ntopic = \"bumper\"\nrequired = true\n";

/// A robot with both, which stands and knows where it is.
async fn localized(endpoint: &str) -> (Robot, zenoh_ext::AdvancedPublisher<'static>) {
    let robot = Robot::start(endpoint, "/r1").await;
    let map = robot.localise().await;
    (robot, map)
}

#[test]
fn a_table_that_the_camera_alone_sees_is_driven_around() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let services = services_with(&(file("r1", &endpoint, "/r1") + SENSORS), "/r1").await;
        let (robot, _map) = localized(&endpoint).await;
        drive_around_a_table(&robot).await;
        services.stop().await;
    });
}

#[test]
fn a_table_is_driven_around_that_a_costmap_shows_by_its_changes_alone() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let costmap = "[[ros2.sensors]]\nname = \"costmap\"\nkind = \"costmap\"\ntopic = \"costmap\"\nrequired = true\n";
        let services = services_with(&(file("r1", &endpoint, "/r1") + costmap), "/r1").await;
        let robot = Robot::start(&endpoint, "/r1").await;
        robot.further.costmap.store(true, Ordering::Relaxed);
        let _map = robot.localise().await;
        drive_around_a_table(&robot).await;
        services.stop().await;
    });
}

/// A table stands half way to the goal, where no laser sees it.
async fn drive_around_a_table(robot: &Robot) {
    let start = robot.truth().position();
    let table = Point2::new(0.5 * (start.x + GOAL.x), 0.5 * (start.y + GOAL.y));
    *locked(&robot.further.table) = Some(table);
    robot.peer.put("goal_pose", &goal("map", GOAL.x, GOAL.y));
    let mut room = f64::INFINITY;
    let since = Instant::now();
    while robot.truth().position().distance(GOAL) > 0.8 {
        assert!(since.elapsed() < LIMIT, "{:?} is as far as it comes", robot.truth());
        room = room.min(robot.truth().position().distance(table) - TABLE - RADIUS);
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    println!("{room:.2} m of room to the table, {:.0} s", since.elapsed().as_secs_f64());
    assert!(room > 0.0 && room < 2.0, "{room} m");
}

#[test]
fn a_robot_whose_bumper_is_pressed_stands_and_drives_on_past_what_it_touched() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let services = services_with(&(file("r1", &endpoint, "/r1") + SENSORS), "/r1").await;
        let (robot, _map) = localized(&endpoint).await;
        robot.peer.put("goal_pose", &goal("map", GOAL.x, GOAL.y));
        robot.commands.that(|said| said.twist.linear.x > 0.3).await;
        let diagnoses = robot.peer.hear::<ros::DiagnosticArray>("/diagnostics", Qos::DEFAULT);
        robot.further.pressed.store(true, Ordering::Relaxed);
        locked(&robot.commands.messages).clear();
        robot.commands.that(|said| said.twist.linear.x == 0.0).await;
        let pressed = "/r1/bumper is pressed, so the robot does not drive on: the bumper `bumper`";
        diagnoses.that(|said| said.status[0].values.iter().any(|v| v.value == pressed)).await;
        locked(&robot.commands.messages).clear();
        super::site::until(|| robot.commands.count() >= 10).await;
        let speeds: Vec<f64> =
            locked(&robot.commands.messages).iter().map(|said| said.twist.linear.x).collect();
        // It may turn away, and a turn may begin with a crawl.
        assert!(speeds.iter().all(|speed| speed.abs() < 0.02), "{speeds:?}");
        robot.further.pressed.store(false, Ordering::Relaxed);
        robot.commands.that(|said| said.twist.linear.x > 0.2).await;
        services.stop().await;
    });
}
