//! A robot's router, and curionav's services for one robot with a gateway between both.

use std::time::Duration;

use curionav_deployment::embedded::Embedded;
use curionav_deployment::service_kind::Kind;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::query::fetch;
use curionav_runtime::session::{self, RouterSettings};
use curionav_schemas::{ServiceStatus, keys};
use zenoh::Session;

use crate::end_to_end::program::{LIMIT, turn};

/// Everything that a robot's missions need; the arbiter generates and evaluates itself.
const KINDS: [Kind; 4] = [Kind::Driver, Kind::Localizer, Kind::Arbiter, Kind::Ros2Gateway];

/// Runs a test that keeps the pace of the wall clock, when it is its turn.
pub(super) fn in_turn(test: impl Future<Output = ()>) {
    let _turn = turn();
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(4).enable_all().build().unwrap();
    runtime.block_on(test);
}

/// Waits until something is so.
pub(super) async fn until(is: impl Fn() -> bool) {
    let wait = async {
        while !is() {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    tokio::time::timeout(LIMIT, wait).await.expect("it comes true");
}

/// A router as `rmw_zenohd` is one, and where it listens.
pub(super) async fn robots_router() -> (Session, String) {
    let router =
        session::router(RouterSettings { listen: &["tcp/127.0.0.1:0".to_owned()], ..Default::default() })
            .await
            .unwrap();
    let endpoint = session::locators(&router).await.into_iter().find(|l| l.starts_with("tcp/127.")).unwrap();
    (router, endpoint)
}

/// The configuration of `robot`.
pub(super) fn file(robot: &str, endpoint: &str, namespace: &str) -> String {
    format!(
        "robot = \"{robot}\"\n\
         [limits]\nv_max = 1.0\na_max = 0.5\nomega_max = 1.0\nalpha_max = 1.0\nradius = 0.3\ntick_s = 0.1\n\
         [ros2]\nendpoint = \"{endpoint}\"\nnamespace = \"{namespace}\"\npeople = \"topic\"\n\
         [ros2.silence]\ncommand = 0.4\nodom = 0.4\nscan = 0.4\n\
         [ros2.mission]\nprofile = \"distance-only\"\n"
    )
}

/// The services of `robot`, on a session of their own.
pub(super) async fn services(robot: &str, endpoint: &str, namespace: &str) -> Embedded {
    services_with(&file(robot, endpoint, namespace), namespace).await
}

/// The services of the robot whose file this is.
pub(super) async fn services_with(file: &str, namespace: &str) -> Embedded {
    let config: ServiceConfig = toml::from_str(file).unwrap();
    let services = Embedded::of(&KINDS, session::embedded().await.unwrap(), &config).await.unwrap();
    // The gateway is ready before it has found the robot's router; once it listens, it says what it awaits.
    let odometry = format!("topic=\"{namespace}/odom\"");
    let listens = async || metric(&status(&services).await, "curionav_ros2_problem", &odometry) > 0.0;
    tokio::time::timeout(LIMIT, async { while !listens().await {} }).await.expect("the gateway listens");
    services
}

/// What the gateway says of itself.
pub(super) async fn status(services: &Embedded) -> ServiceStatus {
    let key = keys::status(keys::ROS2_GATEWAY, keys::ROS2_GATEWAY).unwrap();
    fetch(&services.session, &key, LIMIT).await.unwrap()
}

/// The sum of a metric's samples whose labels have this text.
pub(super) fn metric(status: &ServiceStatus, name: &str, label: &str) -> f64 {
    let samples = status.metrics.iter();
    samples
        .filter(|(sample, _)| sample.starts_with(name) && sample.contains(label))
        .map(|(_, number)| number)
        .sum()
}
