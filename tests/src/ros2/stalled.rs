//! The link to the robot's router stalls: nothing passes in either direction, and no connection ends.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;
use curionav_runtime::session;
use zenoh::Session;

use super::actions::{SUCCEEDED, action, result, send};
use super::peer::Peer;
use super::robot::Robot;
use super::site::{in_turn, services};

const STALL: Duration = Duration::from_secs(10);
/// A robot is localised within it.
const SOON: Duration = Duration::from_secs(60);
/// Each pose makes the mission anew, and the services prepare for it within this.
const AGAIN: Duration = Duration::from_secs(10);
const LOOK: Duration = Duration::from_millis(5);

/// A router that waits for 60 s for a sign of life, as `rmw_zenohd` does, and where it listens.
async fn patient_router() -> (Session, String) {
    let mut config = session::built_in().unwrap();
    for (key, value) in [
        ("mode", r#""router""#),
        ("listen/endpoints", r#"["tcp/127.0.0.1:0"]"#),
        ("transport/link/tx/lease", "60000"),
    ] {
        config.insert_json5(key, value).unwrap();
    }
    let router = zenoh::open(config).await.unwrap();
    let endpoint = session::locators(&router).await.into_iter().find(|l| l.starts_with("tcp/127.")).unwrap();
    (router, endpoint)
}

/// Passes on what comes, unless the link stalls.
fn pass(mut from: TcpStream, mut to: TcpStream, stalls: &AtomicBool) {
    let mut bytes = [0; 65_536];
    loop {
        while stalls.load(Ordering::Relaxed) {
            sleep(LOOK);
        }
        let Ok(count @ 1..) = from.read(&mut bytes) else { break };
        // What was on its way when the link began to stall waits, too.
        while stalls.load(Ordering::Relaxed) {
            sleep(LOOK);
        }
        if to.write_all(&bytes[..count]).is_err() {
            break;
        }
    }
    let _ = to.shutdown(std::net::Shutdown::Both);
}

/// A way to `endpoint` that can stall: where it begins, and the switch.
fn relay(endpoint: &str) -> (String, Arc<AtomicBool>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let begins = format!("tcp/{}", listener.local_addr().unwrap());
    let target = endpoint.strip_prefix("tcp/").unwrap().to_owned();
    let stalls = Arc::<AtomicBool>::default();
    let switch = Arc::clone(&stalls);
    std::thread::spawn(move || {
        for client in listener.incoming() {
            let client = client.unwrap();
            let Ok(server) = TcpStream::connect(&target) else { continue };
            [&client, &server].iter().for_each(|end| end.set_nodelay(true).unwrap());
            for (from, to) in [(&client, &server), (&server, &client)] {
                let ends = (from.try_clone().unwrap(), to.try_clone().unwrap());
                let stalls = Arc::clone(&stalls);
                std::thread::spawn(move || pass(ends.0, ends.1, &stalls));
            }
        }
    });
    (begins, switch)
}

#[test]
fn a_client_of_the_action_gets_its_result_although_the_link_has_stalled_for_ten_seconds() {
    in_turn(async {
        let (_router, endpoint) = patient_router().await;
        let (way, stalls) = relay(&endpoint);
        let services = services("r1", &way, "/r1").await;
        let robot = Robot::start(&endpoint, "/r1").await;
        let client = Peer::new(&endpoint, "/r1").await;
        let feedback = client.hear::<ros::NavigationFeedback>(&action("feedback"), Qos::DEFAULT);
        let poses = client.hear::<ros::PoseWithCovarianceStamped>("amcl_pose", Qos::DEFAULT);
        let diagnoses = client.hear::<ros::DiagnosticArray>("/diagnostics", Qos::DEFAULT);
        let _map = robot.publish_map();
        // Again and again: what is said once before the gateway's subscriber is known is lost.
        let localized = async {
            while poses.newest().is_none() {
                robot.say_pose();
                tokio::time::sleep(AGAIN).await;
            }
        };
        let localized = tokio::time::timeout(SOON, localized).await;
        assert!(localized.is_ok(), "it is not localised: {:?}", diagnoses.newest());
        assert!(send(&client, 1, "map", (4.5, 4.2)).await);
        feedback.that(|said| said.goal_id == [1; 16]).await;
        let stall = async {
            stalls.store(true, Ordering::Relaxed);
            tokio::time::sleep(STALL).await;
            let commanded = robot.commands.count();
            tokio::time::sleep(Duration::from_millis(500)).await;
            assert_eq!(robot.commands.count(), commanded, "something passes although the link stalls");
            stalls.store(false, Ordering::Relaxed);
            Instant::now()
        };
        let (ended, answer) = tokio::join!(stall, result(&client, 1));
        println!("the result came {:.1} s after the stall: {answer:?}", ended.elapsed().as_secs_f64());
        assert_eq!((answer.status, answer.result.error_code), (SUCCEEDED, 0), "{answer:?}");
        services.stop().await;
    });
}
