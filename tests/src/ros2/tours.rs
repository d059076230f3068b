//! Actions with several poses, paths that are only asked for, and whether Nav2 is at work.

use curionav_ros2::messages::{self as ros, Part};
use curionav_ros2::qos::Qos;

use super::actions::SUCCEEDED;
use super::peer::Peer;
use super::robot::{Robot, goal};
use super::site::{in_turn, robots_router, services};

const ABORTED: i8 = 6;

/// Sends a goal of an action; whether it is accepted.
async fn send<G: Part>(peer: &Peer, action: &str, id: u8, goal: G) -> bool {
    let request = ros::SendGoalRequest { goal_id: [id; 16], goal };
    peer.call::<_, ros::SendGoalResponse>(&format!("{action}/_action/send_goal"), &request).await.accepted
}

/// What has become of a goal.
async fn result<R: Part>(peer: &Peer, action: &str, id: u8) -> ros::GetResultResponse<R> {
    let request = ros::GetResultRequest { goal_id: [id; 16] };
    peer.call_of(&R::INTERFACE, &format!("{action}/_action/get_result"), &request).await
}

async fn state(peer: &Peer, node: &str) -> String {
    let request = ros::GetStateRequest::default();
    let said: ros::GetStateResponse = peer.call(&format!("{node}/get_state"), &request).await;
    said.current_state.label
}

fn path_to(x: f64, y: f64) -> ros::PathTo {
    ros::PathTo { goal: goal("map", x, y), ..Default::default() }
}

#[test]
fn nav2_becomes_active_and_tours_and_paths_are_served() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let services = services("r1", &endpoint, "/r1").await;
        let robot = Robot::start(&endpoint, "/r1").await;
        let client = Peer::new(&endpoint, "/r1").await;
        assert_eq!(state(&client, "amcl").await, "active", "it takes a pose");
        assert_eq!(state(&client, "bt_navigator").await, "inactive", "there is no map yet");
        let _map = robot.publish_map();
        robot.say_pose();
        let poses = robot.peer.hear::<ros::PoseWithCovarianceStamped>("amcl_pose", Qos::DEFAULT);
        poses.that(|_| true).await;
        assert_eq!(state(&client, "bt_navigator").await, "active");

        // A path that is not driven, and three that are none.
        let asked = "compute_path_to_pose";
        assert!(send(&client, asked, 1, path_to(9.0, 5.0)).await);
        let found = result::<ros::PathFound>(&client, asked, 1).await;
        let at = robot.truth();
        let first = found.result.path.poses.first().unwrap().pose.position;
        let last = found.result.path.poses.last().unwrap().pose.position;
        assert_eq!((found.status, found.result.error_code), (SUCCEEDED, 0));
        assert!((first.x - at.x).hypot(first.y - at.y) < 0.6, "it begins at the robot: {first:?}");
        assert_eq!((last.x, last.y), (9.0, 5.0));
        for (id, goal, error) in [
            (2, path_to(900.0, 5.0), 204),
            (3, ros::PathTo { goal: super::robot::goal("kitchen", 9.0, 5.0), ..Default::default() }, 202),
        ] {
            assert!(send(&client, asked, id, goal).await);
            let failed = result::<ros::PathFound>(&client, asked, id).await;
            assert_eq!((failed.status, failed.result.error_code), (ABORTED, error), "{:?}", failed.result);
            assert!(!failed.result.error_msg.is_empty() && failed.result.path.poses.is_empty());
        }
        assert!(send(&client, "compute_path_through_poses", 4, ros::PathThrough::default()).await);
        let none = result::<ros::PathThroughFound>(&client, "compute_path_through_poses", 4).await;
        assert_eq!((none.status, none.result.error_code), (ABORTED, 309));

        // Two waypoints, of which the second cannot be reached, are a tour that succeeds and says so.
        let tour = "follow_waypoints";
        let feedback = client.hear::<ros::FeedbackMessage<ros::FollowingWaypoints>>(
            "follow_waypoints/_action/feedback",
            Qos::DEFAULT,
        );
        let at = robot.truth();
        let near = |metres: f64| goal("map", at.x + metres, at.y);
        let poses = vec![near(1.0), goal("map", 900.0, 5.0), near(2.0)];
        let waypoints = ros::Waypoints { poses, ..Default::default() };
        assert!(send(&client, tour, 5, waypoints).await);
        feedback.that(|said| said.feedback.current_waypoint == 2).await;
        let done = result::<ros::FollowedWaypoints>(&client, tour, 5).await;
        let missed: Vec<_> = done
            .result
            .missed_waypoints
            .iter()
            .map(|missed| (missed.waypoint_index, missed.error_code))
            .collect();
        assert_eq!((done.status, done.result.error_code), (SUCCEEDED, 0), "{:?}", done.result.error_msg);
        assert_eq!(missed.iter().map(|(index, _)| *index).collect::<Vec<_>>(), [1], "{missed:?}");
        assert!(send(&client, tour, 6, ros::Waypoints::default()).await);
        let empty = result::<ros::FollowedWaypoints>(&client, tour, 6).await;
        assert_eq!((empty.status, empty.result.error_code), (ABORTED, 602));

        // A way through poses does not stop at them.
        let at = robot.truth();
        let goals = vec![goal("map", at.x + 1.5, at.y), goal("map", at.x + 3.0, at.y)];
        let through =
            ros::ThroughPoses { poses: ros::Goals { goals, ..Default::default() }, ..Default::default() };
        assert!(send(&client, "navigate_through_poses", 7, through).await);
        let went = result::<ros::WentThrough>(&client, "navigate_through_poses", 7).await;
        assert_eq!((went.status, went.result.error_code), (SUCCEEDED, 0), "{:?}", went.result.error_msg);
        assert!(went.result.waypoint_statuses.iter().all(|status| status.waypoint_status == 1));
        services.stop().await;
    });
}
