//! The state of the robot: what it says becomes the streams of a base, with one tick per sample of odometry.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::sensor::LaserModel;
use curionav_ros2::messages as ros;
use curionav_runtime::convert;
use curionav_runtime::locked::locked;
use curionav_runtime::metrics::{Counter, Tally};
use curionav_runtime::robot_limits::RobotLimits;
use curionav_runtime::robot_service::RobotService;
use curionav_runtime::scanner_limits::ScannerLimits;
use curionav_runtime::topic::{Flow, Topic};
use curionav_schemas::words::say;
use curionav_schemas::{self as wire, Belief, Clock, Odometry, People, Scan};
use nalgebra::Isometry3;

use crate::config::Ros2Config;
use crate::costmap;
use crate::diagnosis::Rate;
use crate::fault::{Fault, FaultKind};
use crate::frames::FrameTree;
use crate::further_sensing;
use crate::further_sensors::{FurtherSensors, Seen};
use crate::gate::{Gate, Source};
use crate::nav2_pose::Nav2Pose;
use crate::people::people;
use crate::problem::{Problem, ProblemKind, Problems};
use crate::robot_clock::{Moment, RobotClock, Sample};
use crate::sensing;
use crate::sensor_intake::Said;
use crate::sweep::Sweep;

/// A scan or people whose stamp lies farther from the robot's clock are of no use, seconds.
const STALE: f64 = 0.5;

/// Between two lines of the log about one topic.
const SAID_EVERY: Duration = Duration::from_secs(5);

/// What operators are told of a gateway, from before the robot's router is found.
#[derive(Clone)]
pub(crate) struct Noted {
    /// Messages that were not used, by topic and fault.
    pub(crate) refused: Tally,
    /// Ticks that were published.
    pub(crate) ticks: Counter,
    /// Zeros that were sent.
    pub(crate) zeros: Counter,
    /// What is wrong.
    pub(crate) problems: Arc<Mutex<Problems>>,
}

/// What is known of the robot.
pub(crate) struct RobotState {
    config: Ros2Config,
    /// The way to the base, which is closed while the robot is silent.
    pub(crate) gate: Arc<Gate>,
    scans: Topic<Scan>,
    odometry: Topic<Odometry>,
    people: Topic<People>,
    /// Where the robot is, if Nav2 says so.
    beliefs: Option<Topic<Belief>>,
    nav2_pose: Nav2Pose,
    frames: FrameTree,
    /// The clock of its odometry.
    pub(crate) clock: RobotClock,
    /// The newest scan, until odometry gives it a tick.
    waiting: Option<Sweep>,
    /// What sees besides the scanner.
    further: FurtherSensors,
    /// Of its own disc, metres.
    radius: f64,
    /// Its scanner.
    pub(crate) laser: Option<LaserModel>,
    /// How often odometry comes.
    pub(crate) rate: Rate,
    refused: Tally,
    /// When the log last had a line about a topic, and what, unless that is over.
    said: Mutex<BTreeMap<String, (Instant, String)>>,
    ticks: Counter,
    /// What its laser shows at least, and how late.
    scanner: ScannerLimits,
    /// What is wrong.
    pub(crate) problems: Arc<Mutex<Problems>>,
}

impl RobotState {
    /// Nothing has been heard; all that happens is added to `noted`.
    ///
    /// # Errors
    /// If a stream cannot be declared.
    pub(crate) fn new(
        config: &Ros2Config,
        limits: &RobotLimits,
        scanner: &ScannerLimits,
        service: &RobotService,
        gate: Arc<Gate>,
        noted: Noted,
    ) -> anyhow::Result<Self> {
        Ok(Self {
            config: config.clone(),
            gate,
            scans: service.topic("scan", Flow::Sensor)?,
            odometry: service.topic("odom", Flow::Sensor)?,
            people: service.topic("people", Flow::Sensor)?,
            beliefs: config.is_controller().then(|| service.topic("belief", Flow::Sensor)).transpose()?,
            nav2_pose: Nav2Pose::default(),
            frames: FrameTree::default(),
            clock: RobotClock::new(limits.tick_s),
            waiting: None,
            further: FurtherSensors::new(config, service, limits.radius)?,
            radius: limits.radius,
            laser: None,
            rate: Rate::default(),
            said: Mutex::default(),
            refused: noted.refused,
            ticks: noted.ticks,
            scanner: *scanner,
            problems: noted.problems,
        })
    }

    /// Takes note that what was said last on a topic is used, or why it is not.
    pub(crate) fn used<T>(&self, topic: &str, outcome: Result<T, Fault>) -> Option<T> {
        let topic = self.config.resolve(topic);
        match outcome {
            Ok(value) => {
                locked(&self.problems).clear(ProblemKind::NotUsed, &topic);
                if let Some((_, last)) = locked(&self.said).get_mut(&topic) {
                    last.clear();
                }
                Some(value)
            }
            Err(fault) => {
                self.refused.add(&[&topic, fault.kind.code()]);
                let problem = Problem::new(ProblemKind::NotUsed, topic.clone(), fault.to_string());
                locked(&self.problems).set(problem.clone());
                self.say(topic, problem.sentence());
                None
            }
        }
    }

    /// Puts it into the log: once, however often it is so, and no flood of other faults fills the log.
    fn say(&self, topic: String, sentence: String) {
        let mut said = locked(&self.said);
        let now = Instant::now();
        let is_due = said
            .get(&topic)
            .is_none_or(|(then, last)| *last != sentence && now.duration_since(*then) > SAID_EVERY);
        if is_due {
            tracing::warn!("{sentence}");
            said.insert(topic, (now, sentence));
        }
    }

    /// Takes note of transforms; `is_static` says on which topic they came.
    pub(crate) fn transforms(&mut self, message: &ros::TfMessage, is_static: bool) {
        let frames = &self.config.frames;
        let placed = self.nav2_pose.transforms(message, &frames.map, &frames.odom);
        let outcome = self.frames.take_in(message, &frames.odom).and(placed);
        let topics = &self.config.topics;
        self.used(if is_static { &topics.tf_static } else { &topics.tf }, outcome);
    }

    /// Nav2 has said how sure it is of where the robot is.
    pub(crate) fn amcl_pose(&mut self, said: &ros::PoseWithCovarianceStamped) {
        let outcome = self.nav2_pose.pose(said);
        self.used(&self.config.topics.amcl_pose, outcome);
    }

    /// How fast the robot may drive from now on.
    pub(crate) fn speed_limit(&self, said: &ros::SpeedLimit) {
        let limit = self.gate.limit_speed(said);
        self.used(&self.config.topics.speed_limit, limit);
    }

    /// The stamp of something that is of now, in seconds of the robot's clock, and the newest sample of odometry.
    fn fresh(&self, stamp: ros::Time) -> Result<(f64, Sample), Fault> {
        let (Some(stamp), Some(now)) = (self.clock.seconds(stamp), self.clock.newest()) else {
            return Err(Fault::new(FaultKind::NotYet, "no odometry that can be used has come"));
        };
        let behind = now.stamp - stamp;
        if behind.abs() > STALE {
            let detail = format!("its stamp is {behind:.1} s behind that of odometry");
            return Err(Fault::new(FaultKind::Stale, detail));
        }
        Ok((stamp, *now))
    }

    /// A scan waits for the next odometry, which says where the robot was when it was taken.
    pub(crate) fn scan(&mut self, scan: &ros::LaserScan) {
        let read = sensing::scan(scan, &self.frames, &self.config.frames.base, self.scanner.valid_share);
        let beam_s = f64::from(scan.time_increment);
        let read = read.and_then(|wire| {
            let seen = convert::scan(&wire, self.config.mission.range_sigma);
            let (_, laser) = seen.map_err(|reject| Fault::unusable(reject.to_string()))?;
            let (stamp, _) = self.fresh(scan.header.stamp)?;
            let scan = Scan { stamp: stamp - self.scanner.delay_s, ..wire };
            Ok((Sweep { scan, beam_s }, laser))
        });
        if let Some((sweep, laser)) = self.used(&self.config.topics.scan, read) {
            self.gate.heard(Source::Scan);
            self.laser = Some(laser);
            self.waiting = Some(sweep);
        }
    }

    /// A further sensor has said something, which waits for the next odometry as a scan does.
    pub(crate) fn sensed(&mut self, index: usize, said: &Said) {
        let Some(topic) = self.config.sensors.get(index).map(|sensor| sensor.topic.clone()) else { return };
        let seen = self.seen(index, said);
        if let Some(seen) = self.used(&topic, seen) {
            self.gate.heard(Source::Further(index));
            self.further.heard(index, seen, Instant::now());
        }
    }

    /// What a further sensor has seen.
    fn seen(&self, index: usize, said: &Said) -> Result<Seen, Fault> {
        let (header, scan) = match said {
            Said::Bumper(bumper) => return Ok(Seen::Pressed(bumper.data)),
            Said::Cloud(cloud) => {
                let mount = self.mount(&cloud.header)?;
                let config = &self.config.sensors[index];
                (&cloud.header, further_sensing::cloud(cloud, &mount, config, self.radius)?)
            }
            Said::Costmap(costmap) => {
                let costmap = costmap.as_ref().map_err(Fault::clone)?;
                let mount = self.mount(&costmap.header)?;
                let config = &self.config.sensors[index];
                (&costmap.header, costmap::scan(costmap, &mount, config, self.radius)?)
            }
            Said::Scan(scan) => {
                let base = &self.config.frames.base;
                let read = sensing::scan(scan, &self.frames, base, self.scanner.valid_share)?;
                (&scan.header, further_sensing::scan(read, self.radius))
            }
            Said::Range(range) => {
                (&range.header, further_sensing::range(range, &self.mount(&range.header)?)?)
            }
        };
        let (stamp, _) = self.fresh(header.stamp)?;
        Ok(Seen::Scan(Scan { stamp, ..scan }))
    }

    /// Where the frame of a message is on the robot.
    fn mount(&self, header: &ros::Header) -> Result<Isometry3<f64>, Fault> {
        let base = &self.config.frames.base;
        let frame = &header.frame_id;
        self.frames.pose_in(base, frame).ok_or_else(|| Fault::unknown_frame(frame, base))
    }

    /// What is silent, for which the robot stands.
    pub(crate) fn silence_of(&self, source: Source) -> Problem {
        let topics = &self.config.topics;
        let (topic, why) = match source {
            Source::Command => {
                return Problem::new(ProblemKind::Silent, "cmd", "no command of the driver comes");
            }
            Source::Odom => (&topics.odom, "no odometry that can be used comes"),
            Source::Scan => (&topics.scan, "no scan that can be used comes"),
            Source::Further(index) => (&self.config.sensors[index].topic, "nothing that can be used comes"),
        };
        Problem::new(ProblemKind::Silent, self.config.resolve(topic), why)
    }

    /// What operators are told of further sensors.
    pub(crate) fn further_problems(&self) -> Vec<Problem> {
        self.further.problems(&self.config, Instant::now())
    }

    /// The driver has said what to do, and perhaps that it takes the laser for blind.
    pub(crate) fn commanded(&self, command: &wire::Twist) {
        self.gate.command(Twist { v: command.v, omega: command.omega });
        let topic = self.config.resolve(&self.config.topics.scan);
        if !command.reason.is_blind() {
            locked(&self.problems).clear(ProblemKind::Blind, &topic);
            return;
        }
        let problem = Problem::new(ProblemKind::Blind, topic.clone(), say("command_reason", &command.reason));
        locked(&self.problems).set(problem.clone());
        self.say(topic, problem.sentence());
    }

    /// Odometry makes the ticks; whether it says that the clock has been set back, which ends the run.
    pub(crate) fn odom(&mut self, said: &ros::Odometry) -> bool {
        let read = sensing::odometry(said, &self.frames, &self.config.frames);
        let Some((pose, twist)) = self.used(&self.config.topics.odom, read) else { return false };
        let stamp = said.header.stamp;
        let moment = self.clock.measured(stamp, pose, twist);
        if moment == Moment::SetBack {
            self.gate.stop();
            self.waiting = None;
            self.nav2_pose.forget();
            self.further.forget();
            return true;
        }
        self.gate.heard(Source::Odom);
        if !self.config.use_sim_time {
            self.gate.clock(stamp);
        }
        if let Moment::Tick(sample) = moment {
            self.rate.heard(Instant::now());
            self.publish(&sample);
        }
        false
    }

    /// The scan that waits, as it is seen from where the robot is at this tick, and odometry.
    fn publish(&mut self, sample: &Sample) {
        let Sample { tick, stamp, pose, twist } = *sample;
        if let Some(scan) = self.waiting.take()
            && let Some(scan) = scan.seen_at(&self.clock, sample)
        {
            self.scans.publish(&scan, Clock::Realtime);
        }
        self.further.publish(sample, &self.clock);
        let Pose2 { x, y, heading } = pose;
        let Twist { v, omega } = twist;
        self.odometry.publish(&Odometry { tick, stamp, x, y, heading, v, omega }, Clock::Realtime);
        if let Some(beliefs) = &self.beliefs
            && let Some(belief) = self.nav2_pose.belief(sample, |stamp| self.clock.seconds(stamp))
        {
            beliefs.publish(&belief, Clock::Realtime);
        }
        self.ticks.inc();
    }

    /// The time of a simulation.
    pub(crate) fn sim_time(&self, clock: &ros::Clock) {
        self.gate.clock(clock.clock);
    }

    /// People of the robot's own tracker.
    pub(crate) fn people(&self, said: &ros::People) {
        let radius = self.config.mission.person_radius;
        let found = self.fresh(said.header.stamp).and_then(|(stamp, now)| {
            people(said, (now.tick, stamp), (&self.frames, &self.config.frames, &self.clock), radius)
        });
        if let Some(people) = self.used(&self.config.topics.people, found) {
            self.people.publish(&people, Clock::Realtime);
        }
    }

    /// What has to come before a mission can begin, besides a map and what says where the robot is.
    pub(crate) fn awaited(&self, has_map: bool, knows_place: bool) -> Vec<Problem> {
        let topics = &self.config.topics;
        let missing = [
            (&topics.odom, self.clock.newest().is_none(), "no odometry that can be used has come"),
            (&topics.scan, self.laser.is_none(), "no scan that can be used has come"),
            (&topics.map, !has_map, "no map that can be used has come"),
        ];
        let mut awaited: Vec<_> = missing.into_iter().filter(|(_, is_missing, _)| *is_missing).collect();
        let further = self.further.awaited();
        awaited.extend(further.map(|sensor| (&sensor.topic, true, "nothing that can be used has come")));
        if awaited.is_empty() && !knows_place {
            awaited.push(if self.config.is_controller() {
                (&topics.tf, true, "no transform from map to odometry that is of now has come: start amcl")
            } else {
                (&topics.initialpose, true, "say where the robot is; in rviz: 2D Pose Estimate")
            });
        }
        awaited
            .into_iter()
            .map(|(topic, _, why)| Problem::new(ProblemKind::Awaited, self.config.resolve(topic), why))
            .collect()
    }
}
