//! The walk-through of `deploy/README.md`: a router on the robot, another with the pools.

use super::program::{Serving, comes_true, curionav, real_time, run, turn, wait_until_running};
use crate::soak::process::port_for_a_restart;

const QUICK: &str = "scenarios/quickstart.toml";

fn well(endpoint: &str) -> bool {
    curionav(&["doctor", "--connect", endpoint, "--listen", "0.1"]).status.success()
}

#[test]
fn losing_the_network_leaves_the_robot_whole() {
    let _turn = turn();
    // A port of its own for the router that comes later.
    let of_pools = format!("tcp/127.0.0.1:{}", port_for_a_restart());
    // The robot starts first: its router waits for no other.
    let robot = Serving::start(&["router", "--listen", "tcp/127.0.0.1:0", "--connect", &of_pools]);
    let robot_at = robot.endpoint().to_owned();
    let service = |role, at: &str| Serving::start(&[role, "--connect", at, "--instance", role]);
    let _driver =
        Serving::start(&["driver", "--connect", &robot_at, "--instance", "driver", "--simulated-base"]);
    let _robot_services = ["localizer", "arbiter", "simulator"].map(|role| service(role, &robot_at));
    assert!(!well(&robot_at), "the pools are not there yet");

    let pools = Serving::start(&["router", "--listen", &of_pools]);
    let _pool_services = ["generator", "cpc", "cnc"].map(|role| service(role, &of_pools));
    assert!(comes_true(|| well(&robot_at)), "the routers did not find each other");

    let (at, speed) = (robot_at.clone(), real_time().to_string());
    let running = std::thread::spawn(move || run(QUICK, &["--connect", &at, "--speed", &speed]));
    wait_until_running(&robot_at);
    drop(pools);
    let json = running.join().unwrap().0;
    assert_eq!(json.outcome, "reached", "{json:?}");
    assert!(json.cycles.degraded > 0, "it drove on its own candidates and scores, and says so: {json:?}");
    assert!(!well(&robot_at));

    // Every service finds the router that comes back.
    let _pools = Serving::start(&["router", "--listen", &of_pools]);
    assert!(comes_true(|| well(&robot_at)), "the pools did not come back");
    let (json, status) = run(QUICK, &["--connect", &robot_at]);
    assert_eq!((json.cycles.degraded, status), (0, 0), "{json:?}");
}
