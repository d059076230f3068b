//! The action `navigate_to_pose`.

use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;

use super::peer::Peer;
use super::robot::{Robot, goal};
use super::site::{in_turn, robots_router, services};

pub(super) const SUCCEEDED: i8 = 4;
const CANCELED: i8 = 5;
const ABORTED: i8 = 6;

pub(super) fn action(name: &str) -> String {
    format!("navigate_to_pose/_action/{name}")
}

pub(super) async fn send(peer: &Peer, id: u8, frame: &str, (x, y): (f64, f64)) -> bool {
    let goal = ros::NavigatingTo { pose: goal(frame, x, y), behavior_tree: String::new() };
    let request = ros::SendGoalRequest { goal_id: [id; 16], goal };
    peer.call::<_, ros::SendGoalResponse>(&action("send_goal"), &request).await.accepted
}

pub(super) async fn result(peer: &Peer, id: u8) -> ros::GetResultResponse {
    peer.call(&action("get_result"), &ros::GetResultRequest { goal_id: [id; 16] }).await
}

#[test]
fn goals_are_accepted_refused_replaced_canceled_and_reached() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let services = services("r1", &endpoint, "/r1").await;
        let robot = Robot::start(&endpoint, "/r1").await;
        let client = Peer::new(&endpoint, "/r1").await;
        let another = Peer::new(&endpoint, "/r1").await;
        let feedback = client.hear::<ros::NavigationFeedback>(&action("feedback"), Qos::DEFAULT);
        let status = client.hear::<ros::GoalStatusArray>(&action("status"), Qos::LATCHED);
        let of = |array: &ros::GoalStatusArray, id: u8| {
            array.status_list.iter().find(|goal| goal.goal_info.goal_id == [id; 16]).map(|goal| goal.status)
        };
        assert!(!send(&client, 1, "map", (3.5, 4.2)).await, "there is no map yet");
        let _map = robot.publish_map();
        robot.say_pose();
        let poses = robot.peer.hear::<ros::PoseWithCovarianceStamped>("amcl_pose", Qos::DEFAULT);
        poses.that(|_| true).await;
        // One who comes late is told as well.
        let late = another.hear::<ros::PoseWithCovarianceStamped>("amcl_pose", Qos::LATCHED);
        late.that(|_| true).await;
        assert!(!send(&client, 2, "kitchen", (3.5, 4.2)).await, "no transform leads to the kitchen");
        assert_eq!(result(&client, 2).await.status, 0, "what was refused is not known");

        // A second client takes the robot; the first is told.
        assert!(send(&client, 3, "map", (9.0, 5.0)).await);
        feedback.that(|said| said.goal_id == [3; 16] && said.distance_remaining > 2.0).await;
        let first = async { result(&client, 3).await };
        let second = async { send(&another, 4, "map", (8.0, 5.0)).await };
        let (first, accepted) = tokio::join!(first, second);
        assert!(accepted && first.status == ABORTED && !first.result.error_msg.is_empty(), "{first:?}");

        // It is given up on the way.
        feedback.that(|said| said.goal_id == [4; 16]).await;
        let all = ros::CancelGoalRequest::default();
        let canceled: ros::CancelGoalResponse = another.call(&action("cancel_goal"), &all).await;
        assert_eq!((canceled.return_code, canceled.goals_canceling.len()), (0, 1));
        assert_eq!(result(&another, 4).await.status, CANCELED);
        let again: ros::CancelGoalResponse = another
            .call(
                &action("cancel_goal"),
                &ros::CancelGoalRequest {
                    goal_info: ros::GoalInfo { goal_id: [4; 16], ..Default::default() },
                },
            )
            .await;
        assert_eq!(again.return_code, 3, "it has ended");

        // And one is reached: a metre and a half from where the robot is now.
        let at = robot.truth();
        assert!(send(&client, 5, "map", (at.x + 1.5, at.y)).await);
        let reached = result(&client, 5).await;
        assert_eq!((reached.status, reached.result.error_code), (SUCCEEDED, 0), "{reached:?}");
        status.that(|array| of(array, 5) == Some(SUCCEEDED) && of(array, 4) == Some(CANCELED)).await;
        status.that(|array| of(array, 3) == Some(ABORTED)).await;
        assert!(!send(&client, 5, "map", (3.0, 4.0)).await, "a name counts once");
        services.stop().await;
    });
}
