//! The mode `controller`: stand-ins for AMCL and for bt_navigator, which gives a new path each second.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use curionav_deployment::embedded::Embedded;
use curionav_deployment::service_kind::Kind;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::atan2;
use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::locked::locked;
use curionav_runtime::session;
use tokio::task::JoinHandle;

use super::actions::SUCCEEDED;
use super::peer::Peer;
use super::robot::{Robot, pose};
use super::site::{file, in_turn, robots_router, until};
use crate::end_to_end::program::root;

const ABORTED: i8 = 6;
const CANCELED: i8 = 5;
/// Seconds for which a path is replaced each second.
const SECONDS: u32 = 60;
/// How fast the robot may drive, so that it is on its way for longer than that, m/s.
const SLOW: f64 = 0.12;

/// Everything but a localizer.
async fn services(endpoint: &str) -> Embedded {
    let file = file("r1", endpoint, "/r1");
    let file = file.replace("[ros2]\n", "[ros2]\nmode = \"controller\"\n");
    let config: ServiceConfig = toml::from_str(&file).unwrap();
    let kinds = [Kind::Driver, Kind::Arbiter, Kind::Ros2Gateway];
    Embedded::of(&kinds, session::embedded().await.unwrap(), &config).await.unwrap()
}

/// Says where odometry began in the map each time that odometry comes, as AMCL does.
fn amcl(robot: &Robot) -> JoinHandle<()> {
    let peer = Arc::clone(&robot.peer);
    let world = Arc::clone(&robot.world);
    let odometry = peer.hear::<ros::Odometry>("odom", Qos::SENSOR);
    tokio::spawn(async move {
        let mut said = 0;
        loop {
            tokio::time::sleep(Duration::from_millis(20)).await;
            let Some(odom) = odometry.newest().filter(|_| odometry.count() > said) else { continue };
            said = odometry.count();
            let at = odom.pose.pose;
            let heading = 2.0 * atan2(at.orientation.z, at.orientation.w);
            let odom_pose = Pose2::new(at.position.x, at.position.y, heading);
            let truth = locked(&world).truth().pose;
            let map_from_odom = pose(truth.compose(odom_pose.relative(Pose2::default())));
            let ros::Point { x, y, z } = map_from_odom.position;
            let transform =
                ros::Transform { translation: ros::Vector3 { x, y, z }, rotation: map_from_odom.orientation };
            let header = ros::Header { frame_id: "map".into(), ..odom.header };
            let one = ros::TransformStamped { header, child_frame_id: "odom".into(), transform };
            peer.put("tf", &ros::TfMessage { transforms: vec![one] });
        }
    })
}

/// A straight path from the robot to a goal, as a planner of Nav2 gives it in an empty hall.
fn path(from: Pose2, to: Point2) -> ros::PathToFollow {
    let metres = from.position().distance(to);
    let count = (metres / 0.1).ceil().max(1.0);
    let at = |k: f64| {
        let share = k / count;
        let x = from.x + share * (to.x - from.x);
        let y = from.y + share * (to.y - from.y);
        ros::PoseStamped { pose: pose(Pose2::new(x, y, 0.0)), ..Default::default() }
    };
    let poses = (0..=count as u32).map(|k| at(f64::from(k))).collect();
    let header = ros::Header { frame_id: "map".into(), ..Default::default() };
    ros::PathToFollow { path: ros::Path { header, poses }, ..Default::default() }
}

async fn follow(peer: &Peer, id: u32, path: ros::PathToFollow) -> bool {
    let request = ros::SendGoalRequest { goal_id: name(id), goal: path };
    peer.call::<_, ros::SendGoalResponse>("follow_path/_action/send_goal", &request).await.accepted
}

async fn result(peer: &Peer, id: u32) -> ros::GetResultResponse<ros::FollowedPath> {
    let request = ros::GetResultRequest { goal_id: name(id) };
    let interface = <ros::FollowedPath as ros::Part>::INTERFACE;
    peer.call_of(&interface, "follow_path/_action/get_result", &request).await
}

fn name(id: u32) -> ros::Uuid {
    let mut name = [1; 16];
    name[..4].copy_from_slice(&id.to_le_bytes());
    name
}

/// Gives the robot `count` new paths to `goal`, one after each `pause`, and asserts that it is never told to stand. The
/// first goal's number is `first`.
async fn replace_paths(robot: &Robot, client: &Peer, goal: Point2, first: u32, count: u32, pause: Duration) {
    let begun = robot.truth();
    let commanded = robot.commands.count();
    for path_number in 1..=count {
        tokio::time::sleep(pause).await;
        assert!(follow(client, first + path_number, path(robot.truth(), goal)).await, "path {path_number}");
    }
    let seconds = f64::from(count) * pause.as_secs_f64();
    let driven = robot.truth().position().distance(begun.position());
    let speeds: Vec<f64> = {
        let commands = locked(&robot.commands.messages);
        commands[commanded..].iter().map(|command| command.twist.linear.x).collect()
    };
    let least = speeds.iter().copied().fold(f64::INFINITY, f64::min);
    let most = speeds.iter().copied().fold(0.0, f64::max);
    assert!(least > 0.0, "it was told to stand among {} commands", speeds.len());
    assert!(most <= SLOW + 1e-9, "{most} m/s, and the limit is {SLOW}");
    assert!(driven > 0.8 * SLOW * seconds, "{driven:.2} m in {seconds} s");
}

/// Limits the speed and asks for a first path, as Nav2 does, until the controller is ready and the robot moves. Gives
/// the goal's number.
async fn set_out(robot: &Robot, client: &Peer, goal: Point2) -> u32 {
    let feedback =
        client.hear::<ros::FeedbackMessage<ros::FollowingPath>>("follow_path/_action/feedback", Qos::DEFAULT);
    let header = ros::Header::default();
    client.put("speed_limit", &ros::SpeedLimit { header, percentage: false, speed_limit: SLOW });
    let mut first = 0;
    while !follow(client, first, path(robot.truth(), goal)).await {
        first += 1;
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    feedback.that(|said| said.feedback.speed > 0.08).await;
    first
}

#[test]
fn a_robot_drives_on_while_paths_come_faster_than_their_ways_are_derived() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let services = services(&endpoint).await;
        let folder = tempfile::tempdir().unwrap();
        let robot = Robot::of(&large_hall(folder.path()), &endpoint, "/r1").await;
        let amcl = amcl(&robot);
        let client = Peer::new(&endpoint, "/r1").await;
        let _map = robot.publish_map();
        let goal = Point2::new(10.0, 4.0);
        let first = set_out(&robot, &client, goal).await;
        // None of these is derived before the next one comes.
        let count = 150;
        replace_paths(&robot, &client, goal, first, count, Duration::from_millis(100)).await;
        let replaced = result(&client, first + count - 1).await;
        assert_eq!(replaced.status, ABORTED, "another goal has taken its place");
        amcl.abort();
        services.stop().await;
    });
}

#[test]
fn a_path_that_is_replaced_each_second_is_followed_without_a_stop() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let services = services(&endpoint).await;
        let folder = tempfile::tempdir().unwrap();
        let robot = Robot::of(&hall(folder.path()), &endpoint, "/r1").await;
        let amcl = amcl(&robot);
        let client = Peer::new(&endpoint, "/r1").await;
        let _map = robot.publish_map();
        let goal = Point2::new(10.0, 4.0);
        let first = set_out(&robot, &client, goal).await;
        replace_paths(&robot, &client, goal, first, SECONDS, Duration::from_secs(1)).await;
        let replaced = result(&client, first).await;
        assert_eq!(replaced.status, ABORTED, "another goal has taken its place");

        // Without the limit it arrives; the next one is given up on the way, and one that is none fails.
        client.put("speed_limit", &ros::SpeedLimit::default());
        let last = first + SECONDS;
        let reached = result(&client, last).await;
        assert_eq!(
            (reached.status, reached.result.error_code),
            (SUCCEEDED, 0),
            "{}",
            reached.result.error_msg
        );
        let home = Point2::new(2.0, 4.0);
        assert!(follow(&client, last + 1, path(robot.truth(), home)).await);
        let at = robot.truth();
        until(|| robot.truth().position().distance(at.position()) > 0.3).await;
        let all = ros::CancelGoalRequest::default();
        let canceled: ros::CancelGoalResponse = client.call("follow_path/_action/cancel_goal", &all).await;
        assert_eq!(canceled.goals_canceling.len(), 1);
        assert_eq!(result(&client, last + 1).await.status, CANCELED);
        assert!(follow(&client, last + 2, ros::PathToFollow::default()).await);
        assert_eq!(result(&client, last + 2).await.result.error_code, 102, "it is in no frame");

        // Nav2 sees a controller at work, and nothing else of it.
        let request = ros::GetStateRequest::default();
        let state: ros::GetStateResponse = client.call("controller_server/get_state", &request).await;
        assert_eq!(state.current_state.label, "active");
        amcl.abort();
        services.stop().await;
    });
}

/// The hall of quickstart without people, as a scenario in `folder`.
fn hall(folder: &Path) -> PathBuf {
    on_map(folder, &root().join("scenarios/maps/quickstart.yaml"))
}

/// The same task in an empty hall of 80 m by 60 m, whose map has cells of 0.05 m.
fn large_hall(folder: &Path) -> PathBuf {
    let (columns, rows) = (1600, 1200);
    let mut image = format!("P5\n{columns} {rows}\n255\n").into_bytes();
    for row in 0..rows {
        let is_wall = |column: usize| row < 4 || row >= rows - 4 || column < 4 || column >= columns - 4;
        image.extend((0..columns).map(|column| if is_wall(column) { 0 } else { 254 }));
    }
    std::fs::write(folder.join("large.pgm"), image).unwrap();
    let map = folder.join("large.yaml");
    let text = "image: large.pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n\
                occupied_thresh: 0.65\nfree_thresh: 0.196\n";
    std::fs::write(&map, text).unwrap();
    on_map(folder, &map)
}

/// The task of quickstart without people on this map, as a scenario in `folder`.
fn on_map(folder: &Path, map: &Path) -> PathBuf {
    let text = std::fs::read_to_string(root().join("scenarios/quickstart.toml")).unwrap();
    let people = text.find("[[walkers]]").unwrap();
    let file = folder.join("hall.toml");
    std::fs::write(&file, text[..people].replace("maps/quickstart.yaml", &map.to_string_lossy())).unwrap();
    file
}
