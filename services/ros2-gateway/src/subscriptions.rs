//! The gateway's subscriptions and services, merged into one sequence of events.

use std::sync::Arc;
use std::time::Duration;

use curionav_planning::occupancy::OccupancyGrid;
use curionav_ros2::message::Message;
use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;
use curionav_runtime::lease::BaseLease;
use curionav_runtime::robot_service::RobotService;
use curionav_runtime::topic::Inbox;
use curionav_schemas::{Belief, CycleReport, Decision, Mission, Twist};
use tokio::sync::mpsc;
use tokio::task::JoinHandle;
use tokio::time::{Interval, MissedTickBehavior, interval};

use crate::calls::{Call, Calls};
use crate::config::{Frames, PeopleSource, Ros2Config};
use crate::driver_client::Answer;
use crate::fault::Fault;
use crate::node::{Intake, Node, Request, Serving};
use crate::path_planner::PathMade;
use crate::sensing;
use crate::sensor_intake::{Said, SensorIntake};

/// Between two looks at what changes slowly.
const BEAT: Duration = Duration::from_millis(200);

/// What a subscription, a service or the clock has brought.
pub(crate) enum Event {
    /// A scan of the robot's laser.
    Scan(ros::LaserScan),
    /// What a further sensor says, by its place in the configuration.
    Sensed(usize, Box<Said>),
    /// A sample of the robot's odometry.
    Odom(Box<ros::Odometry>),
    /// Transforms between the robot's frames; `is_static` for frames that stay.
    Transforms { message: ros::TfMessage, is_static: bool },
    /// A map from the robot, or why it cannot be used.
    Map(Result<OccupancyGrid, Fault>),
    /// People that the robot tracks itself.
    People(ros::People),
    /// A goal from a topic.
    GoalPose(ros::PoseStamped),
    /// Where the robot is.
    InitialPose(Box<ros::PoseWithCovarianceStamped>),
    /// How sure Nav2 is of where the robot is.
    AmclPose(Box<ros::PoseWithCovarianceStamped>),
    /// How fast the robot may drive.
    SpeedLimit(ros::SpeedLimit),
    /// The time of a simulation.
    Clock(ros::Clock),
    /// A client of an action, or one that wants to know a state, has called.
    Call(Call, Request),
    /// A path that a client has asked for is found, or not.
    PathMade(Box<PathMade>),
    /// The robot is to be paused, or to go on.
    Pause(bool, Request),
    /// The driver's mission has changed.
    Mission(Box<Mission>),
    /// Where the localizer believes the robot is.
    Belief(Belief),
    /// What the arbiter has decided for a cycle.
    Decision(Decision),
    /// A velocity that the driver commands.
    Command(Twist),
    /// The arbiter's report of a cycle, published only while something wants to see it.
    Report(Box<CycleReport>),
    /// The driver's answer to a command.
    Answer(Box<Answer>),
    /// Some time has passed.
    Beat,
    /// A session is closed.
    Closed,
}

/// What comes out of the gateway's own tasks.
pub(crate) struct OwnWork {
    /// The driver's answers.
    pub(crate) answers: mpsc::Receiver<Answer>,
    /// Paths that were looked for.
    pub(crate) paths: mpsc::Receiver<PathMade>,
}

/// The gateway's subscriptions, services and timer.
pub(crate) struct Subscriptions {
    scan: Intake<ros::LaserScan>,
    sensors: SensorIntake,
    odom: Intake<ros::Odometry>,
    tf: Intake<ros::TfMessage>,
    tf_static: Intake<ros::TfMessage>,
    map: Intake<ros::OccupancyGrid>,
    people: Option<Intake<ros::People>>,
    goal_pose: Option<Intake<ros::PoseStamped>>,
    initialpose: Option<Intake<ros::PoseWithCovarianceStamped>>,
    amcl_pose: Option<Intake<ros::PoseWithCovarianceStamped>>,
    speed_limit: Intake<ros::SpeedLimit>,
    clock: Option<Intake<ros::Clock>>,
    calls: Calls,
    paths: mpsc::Receiver<PathMade>,
    stop: Serving<ros::TriggerRequest>,
    resume: Serving<ros::TriggerRequest>,
    missions: Inbox<Mission>,
    beliefs: Inbox<Belief>,
    decisions: Inbox<Decision>,
    commands: Inbox<Twist>,
    reports: Option<Inbox<CycleReport>>,
    answers: mpsc::Receiver<Answer>,
    /// A map that is being read.
    reading: Option<JoinHandle<Result<OccupancyGrid, Fault>>>,
    frames: Frames,
    beat: Interval,
}

impl Subscriptions {
    /// Listens to the robot through `node`, and to curionav through `service`.
    ///
    /// # Errors
    /// If something cannot be declared.
    pub(crate) fn new(
        node: &Node,
        service: &RobotService,
        config: &Ros2Config,
        own: OwnWork,
        lease: &Arc<BaseLease>,
    ) -> anyhow::Result<Self> {
        let topics = &config.topics;
        let mut beat = interval(BEAT);
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        // In the mode `controller` goals and poses are for other nodes of Nav2.
        let is_navigator = !config.is_controller();
        let follows_people = config.people == PeopleSource::Topic;
        Ok(Self {
            scan: node.intake(&topics.scan, Qos::SENSOR)?,
            sensors: SensorIntake::new(node, config)?,
            odom: node.intake(&topics.odom, Qos::SENSOR)?,
            tf: node.intake(&topics.tf, Qos { depth: 100, ..Qos::DEFAULT })?,
            tf_static: node.intake(&topics.tf_static, Qos { depth: 100, ..Qos::LATCHED })?,
            map: node.intake(&topics.map, Qos::LATCHED)?,
            people: follows_people.then(|| node.intake(&topics.people, Qos::DEFAULT)).transpose()?,
            goal_pose: is_navigator.then(|| node.intake(&topics.goal_pose, Qos::DEFAULT)).transpose()?,
            initialpose: is_navigator.then(|| node.intake(&topics.initialpose, Qos::DEFAULT)).transpose()?,
            amcl_pose: (!is_navigator).then(|| node.intake(&topics.amcl_pose, Qos::LATCHED)).transpose()?,
            speed_limit: node.intake(&topics.speed_limit, Qos::DEFAULT)?,
            clock: config.use_sim_time.then(|| node.intake(&topics.clock, Qos::SENSOR)).transpose()?,
            calls: Calls::new(node, config)?,
            paths: own.paths,
            stop: node.service(&topics.stop)?,
            resume: node.service(&topics.resume)?,
            missions: service.inbox("mission")?,
            beliefs: service.inbox("belief")?,
            decisions: service.inbox("decision")?,
            commands: lease.commands(service.inbox("cmd")?),
            reports: None,
            answers: own.answers,
            reading: None,
            frames: config.frames.clone(),
            beat,
        })
    }

    /// Listens to the arbiter's reports, which are made only while something does, or no longer.
    ///
    /// # Errors
    /// If that cannot be declared.
    pub(crate) fn follow_reports(&mut self, wanted: bool, service: &RobotService) -> anyhow::Result<()> {
        if wanted != self.reports.is_some() {
            self.reports = wanted.then(|| service.inbox("report")).transpose()?;
        }
        Ok(())
    }

    /// What happens next. Cancel-safe.
    pub(crate) async fn next(&mut self) -> Event {
        loop {
            let is_reading = self.reading.is_some();
            let reading = async {
                match &mut self.reading {
                    Some(reading) => reading.await,
                    None => std::future::pending().await,
                }
            };
            let report = async {
                match &self.reports {
                    Some(reports) => reports.next().await,
                    None => std::future::pending().await,
                }
            };
            return tokio::select! {
                said = self.commands.next() => heard(said, Event::Command),
                said = self.scan.next() => heard(said, Event::Scan),
                said = self.sensors.next() => heard(said, |(index, said)| Event::Sensed(index, Box::new(said))),
                said = self.odom.next() => heard(said, |odom| Event::Odom(Box::new(odom))),
                said = self.beliefs.next() => heard(said, Event::Belief),
                said = self.decisions.next() => heard(said, Event::Decision),
                said = self.missions.next() => heard(said, |mission| Event::Mission(Box::new(mission))),
                said = self.answers.recv() => heard(said, |answer| Event::Answer(Box::new(answer))),
                said = self.tf.next() => heard(said, |message| Event::Transforms { message, is_static: false }),
                said = self.tf_static.next() => heard(said, |message| Event::Transforms { message, is_static: true }),
                said = optional(self.people.as_ref()) => heard(said, Event::People),
                said = optional(self.clock.as_ref()) => heard(said, Event::Clock),
                said = optional(self.goal_pose.as_ref()) => heard(said, Event::GoalPose),
                said = optional(self.amcl_pose.as_ref()) => heard(said, |pose| Event::AmclPose(Box::new(pose))),
                said = self.speed_limit.next() => heard(said, Event::SpeedLimit),
                said = optional(self.initialpose.as_ref()) => heard(said, |pose| Event::InitialPose(Box::new(pose))),
                said = self.calls.next() => heard(said, |(call, asked)| Event::Call(call, asked)),
                said = self.paths.recv() => heard(said, |path| Event::PathMade(Box::new(path))),
                said = self.stop.next() => heard(said, |(_, asked)| Event::Pause(true, asked)),
                said = self.resume.next() => heard(said, |(_, asked)| Event::Pause(false, asked)),
                said = report => heard(said, |report| Event::Report(Box::new(report))),
                // One map after the other, on a thread that may take its time.
                payload = self.map.next_payload(), if !is_reading => {
                    let Some(payload) = payload else { return Event::Closed };
                    let names = self.frames.clone();
                    self.reading = Some(tokio::task::spawn_blocking(move || {
                        let map = ros::OccupancyGrid::decode(&payload).map_err(|error| Fault::unread(&error))?;
                        sensing::map(map, &names)
                    }));
                    continue;
                }
                read = reading => {
                    self.reading = None;
                    Event::Map(read.unwrap_or_else(|error| Err(Fault::unusable(error.to_string()))))
                }
                _ = self.beat.tick() => Event::Beat,
            };
        }
    }
}

fn heard<T>(said: Option<T>, event: impl FnOnce(T) -> Event) -> Event {
    said.map_or(Event::Closed, event)
}

async fn optional<M: Message>(intake: Option<&Intake<M>>) -> Option<M> {
    match intake {
        Some(intake) => intake.next().await,
        None => std::future::pending().await,
    }
}
