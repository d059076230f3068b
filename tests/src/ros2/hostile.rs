//! Bytes, attachments and tokens that are none: the gateway survives and counts, and no listener hears anything
//! malformed.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use curionav_ros2::attachment::Attachment;
use curionav_ros2::dialect::Dialect;
use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;
use curionav_ros2::testing::{Rng, TYPES, Type};
use zenoh::Wait;

use super::peer::DIALECT;
use super::robot::{Robot, goal};
use super::site::{file, in_turn, metric, robots_router, services, status};
use crate::end_to_end::program::Deployment;
use crate::foreign_bytes::ceilings::{Load, Memory, flood};

const SEED: u64 = 47;
/// Of each kind of message.
const ROUNDS: usize = 60;

/// How long the largest messages are sent.
const FLOOD: Duration = Duration::from_secs(10);

/// Where the gateway listens, by type.
const TOPICS: [(&str, &str); 9] = [
    ("scan", "sensor_msgs/msg/LaserScan"),
    ("odom", "nav_msgs/msg/Odometry"),
    ("tf", "tf2_msgs/msg/TFMessage"),
    ("map", "nav_msgs/msg/OccupancyGrid"),
    ("people", "people_msgs/msg/People"),
    ("goal_pose", "geometry_msgs/msg/PoseStamped"),
    ("initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped"),
    ("navigate_to_pose/_action/send_goal", "nav2_msgs/action/NavigateToPose_SendGoal_Request"),
    ("navigate_to_pose/_action/cancel_goal", "action_msgs/srv/CancelGoal_Request"),
];

/// A payload of a type, whole or not, and an attachment, whole or not.
fn spoilt(rng: &mut Rng, of: &Type) -> (Vec<u8>, Vec<u8>) {
    let mut payload = (of.random)(rng).unwrap();
    let attachment = Attachment { sequence: 1, stamp_ns: 1, gid: [1; 16] }.encode().to_vec();
    let at = rng.below(payload.len());
    match rng.below(6) {
        // Whole, but its numbers mean nothing.
        0 => {}
        1 => payload.truncate(at),
        2 => payload[at] ^= 1 << rng.below(8),
        3 => drop(payload.splice(at..at, [0xff; 4])),
        4 => return (payload, vec![16; rng.below(64)]),
        _ => payload = (0..rng.below(400)).map(|_| rng.below(256) as u8).collect(),
    }
    (payload, attachment)
}

#[test]
fn hostile_bytes_are_counted_and_harm_neither_gateway_nor_listener() {
    in_turn(async {
        println!("seed {SEED}");
        let mut rng = Rng::new(SEED);
        let (_router, endpoint) = robots_router().await;
        let services = services("r1", &endpoint, "/r1").await;
        let robot = Robot::start(&endpoint, "/r1").await;
        let poses = robot.peer.hear::<ros::PoseWithCovarianceStamped>("amcl_pose", Qos::DEFAULT);
        let session = &robot.peer.session;
        for _ in 0..ROUNDS {
            for (topic, name) in TOPICS {
                let of = TYPES.iter().find(|of| of.name == name).unwrap();
                let (payload, attachment) = spoilt(&mut rng, of);
                let key = DIALECT.key(&robot.peer.topic(topic), &of.interface);
                if topic.contains("_action") {
                    drop(session.get(key).payload(payload).attachment(attachment).wait().unwrap());
                } else {
                    session.put(key, payload).attachment(attachment).wait().unwrap();
                }
            }
        }
        for token in
            ["@ros2_lv/0/what", "@ros2_lv/0/a/b/c/MP/%/%/n/%t/T/H/::,10:,:,:,,", "@ros2_lv/0/a/0/1/XX/%/%/n"]
        {
            session.liveliness().declare_token(token).wait().unwrap().undeclare().wait().unwrap();
        }
        // What is too long is refused before it is read.
        let scan = TYPES[0];
        let key = DIALECT.key(&robot.peer.topic("scan"), &scan.interface);
        session.put(key, vec![0; scan.max_bytes + 1]).wait().unwrap();
        loop {
            let status = status(&services).await;
            let topics = TOPICS.iter().map(|(topic, _)| format!("topic=\"/r1/{topic}\""));
            let refused = |label: &str| metric(&status, "curionav_ros2_refused_total", label);
            if topics.map(|label| refused(&label)).all(|count| count > 0.0) && refused("@ros2_lv") >= 3.0 {
                break;
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        // A clock far ahead or behind may have been told: it is set back to the robot's own, and it drives as if
        // nothing had been.
        let _map = robot.publish_map();
        robot.say_pose();
        poses.that(|_| true).await;
        robot.peer.put("goal_pose", &goal("map", 10.0, 5.0));
        robot.commands.that(|said| said.twist.linear.x > 0.3).await;
        assert_eq!(
            poses.malformed.load(Ordering::Relaxed) + robot.commands.malformed.load(Ordering::Relaxed),
            0
        );
        services.stop().await;
    });
}

#[test]
fn the_largest_messages_of_ros_take_the_gateway_not_above_its_ceiling() {
    in_turn(async {
        let (_router, endpoint) = robots_router().await;
        let configured = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(configured.path(), file("r1", &endpoint, "/r1")).unwrap();
        let text = format!(
            "robot = \"r1\"\nmetrics_port = 0\nros2_config = {:?}\n[replicas]\nsimulator = 0\n",
            configured.path()
        );
        let deployment = Deployment::of(&text, &[]);
        let robot = Robot::start(&endpoint, "/r1").await;
        let memory = Memory::watch(deployment.processes());
        let end = Instant::now() + FLOOD;
        std::thread::scope(|scope| {
            for (topic, name) in TOPICS {
                let of = TYPES.iter().find(|of| of.name == name).unwrap();
                let key = DIALECT.key(&robot.peer.topic(topic), &of.interface);
                let attachment = Attachment { sequence: 1, stamp_ns: 1, gid: [1; 16] }.encode().to_vec();
                // As long as can be, and longer than can be.
                let loads = [of.max_bytes, of.max_bytes + 1].map(|bytes| Load {
                    payload: vec![0; bytes].into(),
                    encoding: "zenoh/bytes",
                    attachment: Some(attachment.clone()),
                });
                let session = &robot.peer.session;
                scope.spawn(move || flood(session, &key, topic.contains("_action"), &loads, end));
            }
        });
        memory.judge();
        // As if nothing had been.
        let poses = robot.peer.hear::<ros::PoseWithCovarianceStamped>("amcl_pose", Qos::DEFAULT);
        let _map = robot.publish_map();
        robot.say_pose();
        poses.that(|_| true).await;
        assert_eq!(deployment.stop(), 0);
    });
}
