//! The gateway on its robot: what becomes of what it hears.

mod goals;

use std::sync::Arc;
use std::time::{Duration, Instant};

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::OccupancyGrid;
use curionav_ros2::messages as ros;
use curionav_runtime::command::Commander;
use curionav_runtime::convert;
use curionav_runtime::lease::BaseLease;
use curionav_runtime::locked::locked;
use curionav_runtime::map_store::host;
use curionav_runtime::robot_service::RobotService;
use curionav_runtime::serve::Server;
use curionav_schemas::{
    self as wire, Action, Belief, CommandReason, Confidence, Decision, MapId, MissionCommand,
};

use crate::action_kind::ActionKind;
use crate::action_publishers::ActionPublishers;
use crate::config::Ros2Config;
use crate::diagnosis;
use crate::driver_client::{Answer, DriverClient};
use crate::fault::{Fault, FaultKind};
use crate::frames::planar;
use crate::gate::Gate;
use crate::given_path::GivenPath;
use crate::goals::Goals;
use crate::graph::{Graph, Used};
use crate::journey::{Effect, Id, Journey, id};
use crate::node::Request;
use crate::order::{Orders, Start};
use crate::parameters::Parameters;
use crate::path_planner::PathPlanner;
use crate::pausing;
use crate::problem::{Problem, ProblemKind};
use crate::publishers::Publishers;
use crate::robot_state::RobotState;
use crate::tour::Destination;

/// The localiser answers every tick; if its last answer is older than this, it has nothing to go on from.
const BELIEF_AGE: Duration = Duration::from_secs(2);
/// The driver repeats its mission every second.
const DRIVER_SILENCE: Duration = Duration::from_secs(5);
/// Between two attempts to be localised.
const RETRY: Duration = Duration::from_secs(5);
/// Looks between two diagnoses.
const BEATS_PER_DIAGNOSIS: u32 = 5;

/// What the gateway is made of.
pub(crate) struct Parts {
    /// What it was told.
    pub(crate) config: Ros2Config,
    /// The missions that it may order.
    pub(crate) orders: Orders,
    /// Its place in curionav.
    pub(crate) service: RobotService,
    /// How it commands the robot.
    pub(crate) commander: Commander,
    /// Which driver the base obeys, and whether it is paused.
    pub(crate) lease: Arc<BaseLease>,
    /// The other nodes of ROS.
    pub(crate) graph: Graph,
    /// What it uses there.
    pub(crate) used: Vec<Used>,
    /// The way to the base.
    pub(crate) gate: Arc<Gate>,
    /// What it says to ROS.
    pub(crate) publishers: Publishers,
    /// What it says of goals.
    pub(crate) actions: ActionPublishers,
    /// What it says of its parameters.
    pub(crate) parameters: Parameters,
    /// What looks for paths that clients ask for.
    pub(crate) path_planner: PathPlanner,
    /// The way to the driver.
    pub(crate) driver_client: DriverClient,
    /// What is known of the robot.
    pub(crate) robot_state: RobotState,
}

/// The gateway.
pub(crate) struct Gateway {
    parts: Parts,
    tick_s: f64,
    /// The newest map, and those that are served.
    map: Option<MapId>,
    hosted: Vec<(MapId, Server)>,
    /// The newest belief, odometry of its tick, and when it came.
    belief: Option<(Belief, Pose2, Instant)>,
    /// Where the robot is said to be, and odometry then, until all services are at work in a run that begins there.
    start: Option<(Start, Option<Pose2>)>,
    /// Which order begins there, and which mission it has become.
    start_ordered: Option<u64>,
    start_taken: Option<Id>,
    /// Whether the clock was set back since a run has begun: what the localiser says then is of no use.
    is_lost: bool,
    destination: Option<Destination>,
    /// The path to follow there, if one was given.
    given: Option<GivenPath>,
    journey: Journey,
    /// Goals that ask for paths, which move nothing.
    path_goals: Goals,
    /// Requests for results that wait for the end of their goals.
    results: Vec<(ActionKind, ros::Uuid, Request)>,
    /// Why the driver has given its newest command.
    reason: Option<CommandReason>,
    driver_heard: Instant,
    localize_after: Instant,
    beats: u32,
}

impl Gateway {
    /// Nothing is known yet but where the robot may be; a tick takes `tick_s` seconds.
    pub(crate) fn new(parts: Parts, start: Option<Start>, tick_s: f64) -> Self {
        let now = Instant::now();
        Self {
            start: start.map(|start| (start, None)),
            parts,
            tick_s,
            map: None,
            hosted: Vec::new(),
            belief: None,
            start_ordered: None,
            start_taken: None,
            is_lost: false,
            destination: None,
            given: None,
            journey: Journey::default(),
            path_goals: Goals::default(),
            results: Vec::new(),
            reason: None,
            driver_heard: now,
            localize_after: now,
            beats: 0,
        }
    }

    /// Its place in curionav.
    pub(crate) fn service(&self) -> &RobotService {
        &self.parts.service
    }

    /// What is known of the robot.
    pub(crate) fn robot_state(&mut self) -> &mut RobotState {
        &mut self.parts.robot_state
    }

    /// Whether something wants to see the arbiter's reports.
    pub(crate) fn wants_reports(&self) -> bool {
        self.parts.publishers.wants_reports()
    }

    /// Odometry; if the clock has been set back, nothing of before is of any use.
    pub(crate) fn odom(&mut self, said: &ros::Odometry) {
        if self.parts.robot_state.odom(said) {
            tracing::warn!("the robot's clock was set back: its run is over");
            // A simulation that is begun again puts the robot where it was; a real robot stays where it is.
            let config = &self.parts.config;
            let is_nav2s = config.is_controller();
            self.begins_at(Start::configured(config).filter(|_| config.use_sim_time && !is_nav2s));
            self.belief = None;
            self.is_lost = !is_nav2s;
            let effects = self.journey.fail("the robot's clock was set back");
            self.act(effects);
        }
    }

    /// A map is served from now on, and new runs take place on it.
    pub(crate) fn map(&mut self, map: Result<OccupancyGrid, Fault>) {
        let Some(grid) = self.parts.robot_state.used(&self.parts.config.topics.map, map) else { return };
        let map = convert::occupancy_grid_to_wire(&grid);
        let id = map.map;
        if self.map == Some(id) {
            return;
        }
        match host(&self.parts.service.session, map, &self.parts.service.counts.refused) {
            Ok(server) => {
                // The run that is under way may still need the one before.
                let of_run = self.journey.mission().map(|mission| mission.order.map);
                self.hosted.retain(|(hosted, _)| Some(*hosted) == of_run && *hosted != id);
                self.hosted.push((id, server));
                self.map = Some(id);
                self.parts.path_planner.on(grid);
                self.localize_after = Instant::now();
                tracing::info!(map = %id, "a map has come");
            }
            Err(error) => tracing::error!(%error, "the map cannot be served"),
        }
    }

    /// Where the robot is: a new run begins there, and goes on to the goal that is under way.
    pub(crate) fn initial_pose(&mut self, said: &ros::PoseWithCovarianceStamped) {
        let start = self.in_map(&said.header).and_then(|()| Start::said(said));
        let topic = self.parts.config.topics.initialpose.clone();
        let Some(start) = self.parts.robot_state.used(&topic, start) else { return };
        self.begins_at(Some(start));
        self.localize_after = Instant::now();
        if let Some(destination) = self.journey.goal() {
            let outcome = self.order_anew(destination);
            self.parts.robot_state.used(&topic, outcome);
        }
    }

    fn begins_at(&mut self, start: Option<Start>) {
        let odometry = self.parts.robot_state.clock.newest().map(|sample| sample.pose);
        self.start = start.map(|start| (start, odometry));
        self.start_ordered = None;
        self.start_taken = None;
    }

    fn in_map(&self, header: &ros::Header) -> Result<(), Fault> {
        let map = &self.parts.config.frames.map;
        if header.frame_id == *map { Ok(()) } else { Err(Fault::unknown_frame(&header.frame_id, map)) }
    }

    fn destination_of(&self, said: &ros::PoseStamped) -> Result<Destination, Fault> {
        self.in_map(&said.header)?;
        let pose = planar(&said.pose)?;
        Ok((pose.position(), Some(pose.heading)))
    }

    /// Whether the services know where the robot is, and on which map.
    fn can_go_on(&self) -> bool {
        let knows = self.belief.as_ref().is_some_and(|(_, _, heard)| heard.elapsed() < BELIEF_AGE);
        let on_map = self.journey.mission().is_some_and(|mission| Some(mission.order.map) == self.map);
        knows && on_map && self.start.is_none()
    }

    /// Sends the robot to a place: in the run that knows where it is, or in a new one.
    fn go(&mut self, destination: Destination, given: Option<GivenPath>) -> Result<(), Fault> {
        self.given = given;
        if !self.can_go_on() {
            return self.order_anew(destination);
        }
        let (Point2 { x, y }, heading) = destination;
        let way = self.given.as_ref().map(GivenPath::to_wire);
        let number = self.parts.driver_client.send(MissionCommand::Goal { x, y, heading, way });
        self.destination = Some(destination);
        self.journey.asked_to_go(number, true);
        Ok(())
    }

    /// Where a new run begins: where the robot was said or believed to be, and what it has driven since.
    fn starting(&self) -> Result<Start, Fault> {
        let said = self.start.as_ref().map(|(start, then)| (start.clone(), *then));
        let known = said.or_else(|| {
            let (belief, then, _) = self.belief.as_ref()?;
            Some((Start::believed(belief)?, Some(*then)))
        });
        let Some((start, then)) = known else {
            let why = "it is not known where the robot is: give an initial pose";
            return Err(Fault::new(FaultKind::NotYet, why));
        };
        let driven = then
            .zip(self.parts.robot_state.clock.newest())
            .map_or(Pose2::default(), |(then, now)| then.relative(now.pose));
        Ok(Start { pose: start.pose.compose(driven), ..start })
    }

    /// Orders a new run; gives the number of the order.
    fn order(
        &mut self,
        start: &Start,
        destination: Destination,
        given: Option<&GivenPath>,
    ) -> Result<u64, Fault> {
        let map = self.map.ok_or_else(|| Fault::new(FaultKind::NotYet, "no map has come"))?;
        start.check_map(&map.to_string())?;
        let laser = self.parts.robot_state.laser.as_ref();
        let laser =
            laser.ok_or_else(|| Fault::new(FaultKind::NotYet, "no scan that can be used has come"))?;
        let order = self.parts.orders.order(map, laser, start, destination);
        let order = order.map_err(|reject| Fault::unusable(reject.to_string()))?;
        let order = Box::new(wire::MissionOrder { way: given.map(GivenPath::to_wire), ..order });
        let number = self.parts.driver_client.send(MissionCommand::Set { order });
        self.start_ordered = Some(number);
        Ok(number)
    }

    fn order_anew(&mut self, destination: Destination) -> Result<(), Fault> {
        let number =
            self.starting().and_then(|start| self.order(&start, destination, self.given.clone().as_ref()))?;
        self.destination = Some(destination);
        self.journey.asked_to_go(number, false);
        Ok(())
    }

    /// Begins a run in which the robot stands, if it is known where it is and no run on this map knows it.
    fn localize(&mut self) {
        let journey = &self.journey;
        let is_under_way = journey.is_engaged() || journey.is_localizing() || journey.is_asking();
        let is_nav2s = self.parts.config.is_controller();
        if self.can_go_on() || is_nav2s || is_under_way || Instant::now() < self.localize_after {
            return;
        }
        let Ok(start) = self.starting() else { return };
        if let Ok(number) = self.order(&start, (start.pose.position(), None), None) {
            self.localize_after = Instant::now() + RETRY;
            self.journey.asked_to_localize(number);
        }
    }

    /// A goal of the topic.
    pub(crate) fn goal_pose(&mut self, said: &ros::PoseStamped) {
        let outcome = self.destination_of(said).and_then(|destination| self.go(destination, None));
        if self.parts.robot_state.used(&self.parts.config.topics.goal_pose, outcome).is_some() {
            let effects = self.journey.replaced();
            self.act(effects);
        }
    }

    fn act(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            match effect {
                Effect::Tell(command) => drop(self.parts.driver_client.send(command)),
                Effect::Goals => self.goals_changed(),
                Effect::NoPlan => self.parts.publishers.no_plan(self.parts.gate.robot_time()),
                Effect::GoOn(destination) => {
                    if let Err(fault) = self.go(destination, None) {
                        let effects = self.journey.fail(&fault.to_string());
                        self.act(effects);
                    }
                }
                Effect::OrderAnew => {
                    let outcome = self.destination.map_or(Ok(()), |destination| self.order_anew(destination));
                    if let Err(fault) = outcome {
                        let effects = self.journey.fail(&fault.to_string());
                        self.act(effects);
                    }
                }
                Effect::Refused(reject) => {
                    let problem = Problem::new(ProblemKind::Refused, "mission", reject.to_string());
                    tracing::warn!("{}", problem.sentence());
                    locked(&self.parts.robot_state.problems).set(problem);
                }
            }
        }
        self.parts.gate.engage(self.journey.is_engaged());
    }

    fn tick(&self) -> u64 {
        self.parts.robot_state.clock.newest().map_or(0, |sample| sample.tick)
    }

    /// The driver has answered a command.
    pub(crate) fn answer(&mut self, answer: Answer) {
        self.driver_heard = Instant::now();
        if answer.outcome.is_ok() {
            locked(&self.parts.robot_state.problems).clear(ProblemKind::Refused, "mission");
            if self.start_ordered == Some(answer.number) {
                self.start_taken = answer.outcome.as_ref().ok().map(id);
            }
        }
        let effects = self.journey.answered(answer.number, answer.outcome, self.tick());
        self.act(effects);
        self.begun();
    }

    /// The driver has said how the mission stands.
    pub(crate) fn mission(&mut self, mission: wire::Mission) {
        self.driver_heard = Instant::now();
        let effects = self.journey.said(mission, self.tick());
        self.act(effects);
        self.begun();
    }

    /// Once all services are at work in the run that begins where the robot was said to be, the localiser knows it.
    /// What it has said until then belongs to the run before.
    fn begun(&mut self) {
        if self.start_taken.is_some() && self.start_taken == self.journey.running() {
            self.begins_at(None);
            self.belief = None;
            self.is_lost = false;
        }
    }

    /// The localiser has said where the robot is.
    pub(crate) fn believed(&mut self, belief: Belief) {
        let clock = &self.parts.robot_state.clock;
        let Some(sample) = clock.of_tick(belief.tick).filter(|_| !self.is_lost && self.start.is_none())
        else {
            return;
        };
        self.parts.publishers.belief(&belief, sample.pose, clock.stamp(sample.stamp));
        let here = Point2::new(belief.x, belief.y);
        self.belief = Some((belief, sample.pose, Instant::now()));
        let effects = self.journey.is_at(here);
        if !effects.is_empty() {
            self.act(effects);
        }
    }

    /// The arbiter has decided.
    pub(crate) fn decided(&mut self, decision: &Decision) {
        if self.journey.is_engaged() && decision.action != Action::Stop {
            self.parts.publishers.plan(decision, self.parts.robot_state.clock.stamp(decision.stamp));
        }
        let effects = self.journey.decided(decision);
        self.act(effects);
    }

    /// The driver has said what to do.
    pub(crate) fn commanded(&mut self, command: &wire::Twist) {
        self.reason = Some(command.reason);
        self.parts.robot_state.commanded(command);
    }

    /// The robot is to be paused, or to go on.
    pub(crate) fn pause(&self, paused: bool, asked: Request) {
        pausing::pause(self.parts.commander.clone(), &self.parts.lease, paused, asked);
    }

    /// The arbiter has said what it has weighed.
    pub(crate) fn reported(&self, report: &wire::CycleReport) {
        self.parts.publishers.report(report, self.parts.robot_state.clock.stamp(report.scene.stamp));
    }

    /// Some time has passed.
    pub(crate) fn beat(&mut self) {
        let lease = self.journey.mission().map(|mission| mission.lease);
        let is_replaced = lease.is_some_and(|lease| lease != self.parts.lease.number());
        if self.journey.is_engaged() && (is_replaced || self.driver_heard.elapsed() > DRIVER_SILENCE) {
            tracing::warn!(is_replaced, "the driver says nothing any more: its mission is lost");
            let effects = self.journey.forget_mission();
            self.act(effects);
        }
        self.localize();
        self.feedback();
        if self.beats.is_multiple_of(BEATS_PER_DIAGNOSIS) {
            self.diagnose();
        }
        self.beats = self.beats.wrapping_add(1);
    }

    fn diagnose(&self) {
        let Parts { config, graph, used, gate, publishers, robot_state, .. } = &self.parts;
        let mut problems = locked(&robot_state.problems);
        problems.replace(&[ProblemKind::SecondPublisher, ProblemKind::OtherType], graph.problems(used));
        let silent = gate.silent().map(|source| robot_state.silence_of(source));
        problems.replace(&[ProblemKind::Silent], silent.into_iter().collect());
        problems.replace(&[ProblemKind::Unheard, ProblemKind::Pressed], robot_state.further_problems());
        let slow = robot_state.rate.fault(self.tick_s);
        let slow = slow.map(|why| Problem::new(ProblemKind::Rate, config.resolve(&config.topics.odom), why));
        problems.replace(&[ProblemKind::Rate], slow.into_iter().collect());
        let knows_place = self.start.is_some() || self.belief.is_some();
        problems.replace(&[ProblemKind::Awaited], robot_state.awaited(self.map.is_some(), knows_place));
        let lease = self.parts.lease.state();
        let paused = lease.paused.then(|| Problem::new(ProblemKind::Paused, "robot", "resume lets it go on"));
        problems.replace(&[ProblemKind::Paused], paused.into_iter().collect());
        let reason = self.reason.filter(|_| self.journey.is_engaged());
        problems.replace(&[ProblemKind::Stopped], reason.and_then(diagnosis::stopped).into_iter().collect());
        let believed = self.belief.as_ref().map(|(belief, ..)| belief.health.confidence);
        problems.replace(&[ProblemKind::Unsure], believed.and_then(diagnosis::unsure).into_iter().collect());
        let driver = lease.holder.as_deref();
        let status = diagnosis::status(
            self.parts.orders.robot(),
            &problems.all(),
            self.journey.mission(),
            driver,
            believed.is_some_and(|confidence| confidence != Confidence::Lost),
        );
        drop(problems);
        publishers.diagnostics(status, gate.robot_time());
    }

    /// The robot stands, and what was under way has failed; whether the driver has to be told.
    pub(crate) fn end(&mut self) -> bool {
        self.parts.gate.stop();
        let effects = self.journey.fail("the gateway ends");
        let tells = effects.iter().any(|effect| matches!(effect, Effect::Tell(_)));
        self.act(effects);
        tells
    }
}
