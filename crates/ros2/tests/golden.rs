//! What real nodes have sent is read, and written with the same bytes.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test that cannot go on stops")]

use curionav_ros2::attachment::Attachment;
use curionav_ros2::dialect::{Dialect, RmwZenoh, Ros2Dds, outgoing};
use curionav_ros2::interface::Distribution;
use curionav_ros2::message::Message;
use curionav_ros2::messages::{LaserScan, OccupancyGrid, Odometry, People, TfMessage};
use curionav_ros2::qos::Qos;
use curionav_ros2::testing::{TYPES, Type};
use curionav_ros2::token::{EntityKind, Token};

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect()
}

/// The lines of one kind, each split at its spaces.
fn golden(kind: &str) -> Vec<Vec<&'static str>> {
    let lines = include_str!("golden.txt").lines().map(|line| line.split(' ').collect::<Vec<_>>());
    lines.filter(|line| line[0] == kind).map(|line| line[1..].to_vec()).collect()
}

/// The first payload of a type.
fn payload<M: Message>() -> Vec<u8> {
    let name = format!("/{}/", M::INTERFACE.dds());
    let line = golden("message").into_iter().find(|line| line[0].contains(&name));
    bytes(line.expect("the type is among the golden lines")[2])
}

fn of_key(key: &str) -> &'static Type {
    TYPES.iter().find(|of| key.contains(&format!("/{}/", of.interface.dds()))).expect("the type is known")
}

const KILTED: RmwZenoh = RmwZenoh { domain: 0, distribution: Distribution::Kilted };

#[test]
fn tokens_of_real_nodes_are_read_and_written_alike() {
    let tokens = golden("token");
    assert_eq!(tokens.len(), 11);
    for line in &tokens {
        let token: Token = line[0].parse().unwrap();
        assert_eq!(KILTED.token_key(&token).unwrap(), line[0]);
        assert_eq!((token.domain, token.node_path().as_str()), (0, "/r1/base"));
        let Some(endpoint) = token.endpoint else {
            assert_eq!((token.kind, token.node_id), (EntityKind::Node, token.entity_id));
            continue;
        };
        let of = TYPES.iter().find(|of| of.interface.dds() == endpoint.type_name).unwrap();
        assert_eq!(endpoint.hash, of.interface.hash(Distribution::Kilted));
    }
    let first: Token = tokens[1][0].parse().unwrap();
    let endpoint = first.endpoint.unwrap();
    assert_eq!((first.kind, endpoint.topic.as_str()), (EntityKind::Publisher, "/r1/scan"));
    assert_eq!((endpoint.qos, Qos::SENSOR.to_string().as_str()), (Qos::SENSOR, "2::,5:,:,:,,"));
    assert_eq!(
        (Qos::DEFAULT.to_string(), Qos::LATCHED.to_string()),
        ("::,10:,:,:,,".into(), ":1:,1:,:,:,,".into())
    );
}

#[test]
fn keys_attachments_and_payloads_of_real_nodes_are_written_alike() {
    let messages = golden("message");
    assert_eq!(messages.len(), 8);
    for line in messages {
        let [key, attachment, payload] = [line[0], line[1], line[2]];
        let of = of_key(key);
        let topic = key.strip_prefix("0").and_then(|rest| rest.split_once(&of.interface.dds())).unwrap().0;
        assert_eq!(KILTED.key(topic, &of.interface), key);
        let read = Attachment::decode(&bytes(attachment)).unwrap();
        assert_eq!(read.encode()[..], bytes(attachment));
        // A writer of C++ leaves in the padding what was there before; all other bytes are the same.
        let (sent, again) = (bytes(payload), (of.recode)(&bytes(payload)).unwrap());
        assert_eq!(sent.len(), again.len());
        let differ = sent.iter().zip(&again).filter(|(sent, again)| sent != again);
        assert!(differ.clone().all(|(_, again)| *again == 0), "{key}");
        assert!(differ.count() <= 6, "{key}");
    }
}

#[test]
fn what_real_nodes_say_is_understood() {
    let scan = LaserScan::decode(&payload::<LaserScan>()).unwrap();
    assert_eq!((scan.header.frame_id.as_str(), scan.range_max), ("laser", 10.0));
    assert_eq!((scan.ranges[..3].to_vec(), scan.ranges[4]), (vec![1.0, 2.0, f32::INFINITY], 5.0));
    assert!(scan.ranges[3].is_nan() && scan.intensities.is_empty());
    let map = OccupancyGrid::decode(&payload::<OccupancyGrid>()).unwrap();
    assert_eq!((map.info.width, map.info.height, map.info.resolution), (4, 2, 0.05));
    assert_eq!(map.data, [0, 100, -1, 0, 0, 50, -1, 100]);
    let odometry = Odometry::decode(&payload::<Odometry>()).unwrap();
    assert_eq!((odometry.child_frame_id.as_str(), odometry.twist.twist.linear.x), ("base_link", 0.5));
    let people = People::decode(&payload::<People>()).unwrap();
    let person = &people.people[0];
    assert_eq!((person.name.as_str(), person.position.x, person.velocity.x), ("7", 1.0, 0.5));
    let tf = TfMessage::decode(&payload::<TfMessage>()).unwrap();
    let mount = &tf.transforms[0];
    assert_eq!((mount.header.frame_id.as_str(), mount.child_frame_id.as_str()), ("base_link", "laser"));
    assert_eq!(mount.transform.translation.x, 0.2);
}

#[test]
fn each_dialect_says_the_same_message_in_its_own_way() {
    let twist = curionav_ros2::messages::Twist::default();
    let attachment = Attachment { sequence: 1, stamp_ns: 2, gid: [7; 16] };
    let native = outgoing(&KILTED, &twist, attachment).unwrap();
    let dds = outgoing(&Ros2Dds, &twist, attachment).unwrap();
    assert_eq!(native.payload(), dds.payload());
    assert_eq!((native.attachment().map(<[u8]>::len), dds.attachment()), (Some(33), None));
    assert_eq!(Ros2Dds.key("/r1/cmd_vel", &curionav_ros2::messages::Twist::INTERFACE), "r1/cmd_vel");
    let humble = RmwZenoh { domain: 3, distribution: Distribution::Humble };
    assert_eq!(
        humble.key("/cmd_vel", &curionav_ros2::messages::Twist::INTERFACE),
        "3/cmd_vel/geometry_msgs::msg::dds_::Twist_/TypeHashNotSupported"
    );
}
