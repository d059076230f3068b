//! The gateway as a service.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::Context;
use curionav_ros2::interface::Distribution;
use curionav_ros2::message::Message;
use curionav_ros2::messages as ros;
use curionav_runtime::command::Commander;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::lease::BaseLease;
use curionav_runtime::locked::locked;
use curionav_runtime::metrics::{Counter, Metrics, Tally};
use curionav_runtime::process::{Running, Start};
use curionav_runtime::robot_limits::RobotLimits;
use curionav_runtime::robot_service::RobotService;
use curionav_runtime::session::{self, SessionError};
use curionav_runtime::shutdown::Shutdown;
use curionav_schemas::{MissionCommand, keys};
use zenoh::Session;

use crate::action_publishers::ActionPublishers;
use crate::config::{DialectName, PeopleSource, Ros2Config};
use crate::driver_client::DriverClient;
use crate::gate::Gate;
use crate::gateway::{Gateway, Parts};
use crate::graph::{Graph, Used};
use crate::masks::Masks;
use crate::node::Node;
use crate::order::{self, Orders};
use crate::parameters::Parameters;
use crate::path_planner::PathPlanner;
use crate::problem::{Problem, ProblemKind};
use crate::publishers::Publishers;
use crate::robot_state::{Noted, RobotState};
use crate::sensor_config::SensorKind;
use crate::subscriptions::{Event, OwnWork, Subscriptions};

/// For how long the gateway waits, when it ends, until the driver has heard of it.
const FAREWELL: Duration = Duration::from_millis(500);

/// What the configuration says, read and found sensible.
struct Told {
    ros2: Ros2Config,
    limits: RobotLimits,
    orders: Orders,
    masks: Masks,
}

impl Told {
    fn read(config: &ServiceConfig) -> anyhow::Result<Self> {
        let ros2 =
            Ros2Config::read(config.ros2.as_ref(), config.directory.as_deref().unwrap_or(Path::new("")))?;
        let limits = config.limits.clone().context(
            "limits: are missing; give the robot's own limits in a table [limits], as deploy/ros2.toml shows",
        )?;
        let orders = Orders::new(&config.robot, &ros2, &limits)?;
        let masks = Masks::read(&ros2.mission)?;
        Ok(Self { ros2, limits, orders, masks })
    }
}

/// Whether a gateway can be run with this configuration.
///
/// # Errors
/// Names what is missing or wrong.
pub fn check(config: &ServiceConfig) -> anyhow::Result<()> {
    config.check_real_name()?;
    Told::read(config).map(drop)
}

/// Makes one robot of ROS 2 one of curionav's until `shutdown`. `on_ready` is called once curionav knows the gateway;
/// the robot's router may come later.
pub fn run(start: Start<'_>) -> Running<'_> {
    Box::pin(async move {
        let Start { config, session, mut shutdown, on_ready, .. } = start;
        let Told { ros2, limits, orders, masks } = Told::read(config)?;
        let start = if ros2.is_controller() {
            None
        } else {
            order::Start::configured(&ros2).or_else(|| order::Start::kept(config, &ros2))
        };
        let scanner = config.scanner.unwrap_or_default();
        let service = tokio::select! {
            () = shutdown.requested() => return Ok(()),
            service = RobotService::with_control(keys::ROS2_GATEWAY, config, session) => service?,
        };
        let noted = Noted {
            refused: Tally::new(&["topic", "fault"]),
            ticks: Counter::default(),
            zeros: Counter::default(),
            problems: Arc::default(),
        };
        locked(&noted.problems).set(awaited(&ros2));
        let (lease, _lease) = BaseLease::serve(session, config, keys::ROS2_GATEWAY, &service.counts.refused)?;
        let commander = Commander::new(session, &config.robot, &config.identity(keys::ROS2_GATEWAY)?);
        // Known, and asked what is missing, also while the robot is still booting.
        let announced = service.announce(metrics(&service, &noted))?;
        on_ready(announced.metrics_address());
        let robots = tokio::select! {
            () = shutdown.requested() => return Ok(()),
            robots = robots_session(&ros2) => robots?,
        };
        let node = Node::new(&robots, &ros2, noted.refused.clone(), Arc::clone(&noted.problems))?;
        let gate = Arc::new(Gate::new(&node, &ros2, &limits, Arc::clone(&lease), noted.zeros.clone())?);
        let (mut driver_client, answers) = DriverClient::start(commander.clone(), Arc::clone(&lease));
        let (path_planner, paths) = PathPlanner::new(limits.radius, ros2.mission.goal_tolerance);
        // What a gateway before this one has begun, nothing watches any more.
        if service.mission().await?.is_some_and(|mission| !mission.is_over()) {
            driver_client.send(MissionCommand::Cancel);
        }
        let domain = (ros2.dialect == DialectName::RmwZenoh).then_some(ros2.domain);
        let graph = Graph::follow(&robots, domain, &noted.refused)?;
        let robot_state = RobotState::new(&ros2, &limits, &scanner, &service, Arc::clone(&gate), noted)?;
        let mut subscriptions =
            Subscriptions::new(&node, &service, &ros2, OwnWork { answers, paths }, &lease)?;
        let publishers = Publishers::new(&node, &ros2)?;
        let actions = ActionPublishers::new(&node, &ros2)?;
        let parameters = Parameters::of(&ros2)?;
        let used = used(&ros2);
        let config = ros2;
        let parts = Parts {
            config,
            orders,
            service,
            commander,
            lease,
            graph,
            used,
            gate,
            publishers,
            actions,
            parameters,
            path_planner,
            driver_client,
            robot_state,
        };
        let mut gateway = Gateway::new(parts, start, limits.tick_s);
        let outcome = serve(&mut gateway, &masks, &mut subscriptions, shutdown).await;
        // The base first. The driver is told on a task of its own, which ends with this program.
        if gateway.end() {
            let told =
                async { while !matches!(subscriptions.next().await, Event::Answer(_) | Event::Closed) {} };
            let _ = tokio::time::timeout(FAREWELL, told).await;
        }
        drop(gateway);
        session::close(&robots);
        outcome
    })
}

/// The service's numbers, with those of the gateway.
fn metrics(service: &RobotService, noted: &Noted) -> Metrics {
    let mut metrics = service.metrics();
    metrics.tally("ros2_refused", "Messages of ROS that are not used, by topic and fault", &noted.refused);
    let zeros = "Velocities because something was silent, or down to zero after a mission";
    metrics.count("ros2_zeros", zeros, noted.zeros.clone());
    metrics.count("ros2_ticks", "Samples of odometry that became ticks", noted.ticks.clone());
    let problems = Arc::clone(&noted.problems);
    metrics.gauges_by(
        "ros2_problem",
        "Always 1; the labels say what is wrong with a topic of ROS",
        &["kind", "topic", "detail"],
        move || {
            let labels = |problem: Problem| {
                vec![problem.kind.code().to_owned(), problem.topic.clone(), problem.label()]
            };
            locked(&problems).all().into_iter().map(|problem| (labels(problem), 1.0)).collect()
        },
    );
    metrics
}

/// A session with the robot's own router, waited for as long as it takes.
async fn robots_session(ros2: &Ros2Config) -> Result<Session, SessionError> {
    let config = ServiceConfig {
        connect: vec![ros2.endpoint.clone()],
        zenoh_config: ros2.zenoh_config.clone(),
        ..ServiceConfig::default()
    };
    let first = AtomicBool::new(true);
    session::awaited(
        || session::client_elsewhere(&config),
        |_| {
            if first.swap(false, Ordering::Relaxed) {
                tracing::warn!("{}", awaited(ros2).sentence());
            }
        },
    )
    .await
}

/// What is awaited before anything else. The first look at the robot takes its place.
fn awaited(ros2: &Ros2Config) -> Problem {
    let why = "the robot's router, such as rmw_zenohd, does not answer there";
    Problem::new(ProblemKind::Awaited, ros2.endpoint.as_str(), why)
}

/// What the gateway says and hears, for comparison with what other nodes do under the same names.
fn used(ros2: &Ros2Config) -> Vec<Used> {
    fn of<M: Message>(ros2: &Ros2Config, topic: &str, is_exclusive: bool) -> Used {
        let hash = M::INTERFACE.hash(ros2.distribution()).to_owned();
        Used { topic: ros2.resolve(topic), type_name: M::INTERFACE.dds(), hash, is_exclusive }
    }
    let topics = &ros2.topics;
    let velocity = if ros2.is_stamped() { of::<ros::TwistStamped> } else { of::<ros::Twist> };
    let people = (ros2.people == PeopleSource::Topic).then(|| of::<ros::People>(ros2, &topics.people, false));
    let always = [
        of::<ros::LaserScan>(ros2, &topics.scan, false),
        of::<ros::Odometry>(ros2, &topics.odom, false),
        of::<ros::TfMessage>(ros2, &topics.tf, false),
        of::<ros::TfMessage>(ros2, &topics.tf_static, false),
        of::<ros::OccupancyGrid>(ros2, &topics.map, false),
        of::<ros::PoseStamped>(ros2, &topics.goal_pose, false),
        of::<ros::PoseWithCovarianceStamped>(ros2, &topics.initialpose, false),
        of::<ros::PoseWithCovarianceStamped>(ros2, &topics.amcl_pose, !ros2.is_controller()),
        of::<ros::Path>(ros2, ros2.plan(), true),
        velocity(ros2, &topics.cmd_vel, true),
    ];
    let range =
        if ros2.distribution() == Distribution::Humble { of::<ros::RangeHumble> } else { of::<ros::Range> };
    let costmaps = ros2.sensors.iter().filter(|sensor| sensor.kind == SensorKind::Costmap);
    let updates = costmaps.map(|sensor| of::<ros::OccupancyGridUpdate>(ros2, &sensor.updates(), false));
    let sensors = ros2.sensors.iter().map(|sensor| match sensor.kind {
        SensorKind::Cloud => of::<ros::PointCloud2>(ros2, &sensor.topic, false),
        SensorKind::Scan => of::<ros::LaserScan>(ros2, &sensor.topic, false),
        SensorKind::Range => range(ros2, &sensor.topic, false),
        SensorKind::Bumper => of::<ros::Bool>(ros2, &sensor.topic, false),
        SensorKind::Costmap => of::<ros::OccupancyGrid>(ros2, &sensor.topic, false),
    });
    always.into_iter().chain(people).chain(sensors).chain(updates).collect()
}

async fn serve(
    gateway: &mut Gateway,
    masks: &Masks,
    subscriptions: &mut Subscriptions,
    mut shutdown: Shutdown,
) -> anyhow::Result<()> {
    loop {
        let event = tokio::select! {
            biased;
            () = shutdown.requested() => return Ok(()),
            event = subscriptions.next() => event,
        };
        match event {
            Event::Command(command) => gateway.commanded(&command),
            Event::Scan(scan) => gateway.robot_state().scan(&scan),
            Event::Sensed(index, said) => gateway.robot_state().sensed(index, &said),
            Event::Odom(odometry) => gateway.odom(&odometry),
            Event::Belief(belief) => gateway.believed(belief),
            Event::Decision(decision) => gateway.decided(&decision),
            Event::Mission(mission) => gateway.mission(*mission),
            Event::Answer(answer) => gateway.answer(*answer),
            Event::Transforms { message, is_static } => gateway.robot_state().transforms(&message, is_static),
            Event::Map(map) => gateway.map(map.and_then(|map| masks.on(map))),
            Event::People(people) => gateway.robot_state().people(&people),
            Event::Clock(clock) => gateway.robot_state().sim_time(&clock),
            Event::GoalPose(pose) => gateway.goal_pose(&pose),
            Event::InitialPose(pose) => gateway.initial_pose(&pose),
            Event::Call(call, asked) => gateway.called(call, asked),
            Event::PathMade(path) => gateway.path_made(*path),
            Event::AmclPose(pose) => gateway.robot_state().amcl_pose(&pose),
            Event::SpeedLimit(limit) => gateway.robot_state().speed_limit(&limit),
            Event::Pause(paused, asked) => gateway.pause(paused, asked),
            Event::Report(report) => gateway.reported(&report),
            Event::Beat => {
                gateway.beat();
                subscriptions.follow_reports(gateway.wants_reports(), gateway.service())?;
            }
            Event::Closed => return Ok(()),
        }
    }
}
