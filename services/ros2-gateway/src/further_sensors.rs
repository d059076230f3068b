//! The robot's further sensors: what they have said last, and what becomes of it at the next tick.

use std::time::Instant;

use curionav_runtime::robot_service::RobotService;
use curionav_runtime::topic::Topic;
use curionav_schemas::{Clock, Scan};

use crate::config::Ros2Config;
use crate::further_sensing;
use crate::problem::{Problem, ProblemKind};
use crate::robot_clock::{RobotClock, Sample};
use crate::sensor_config::SensorConfig;

/// One sensor.
struct Sensor {
    config: SensorConfig,
    scans: Topic<Scan>,
    /// What it has seen last, until odometry gives it a tick.
    waiting: Option<Scan>,
    /// Whether it is a bumper that is pressed: it is until it says otherwise.
    is_pressed: bool,
    heard: Option<Instant>,
}

/// All of them, in the order of the configuration.
pub(crate) struct FurtherSensors {
    sensors: Vec<Sensor>,
    /// Of the robot's own disc, metres.
    radius: f64,
}

/// What a sensor has said, read.
pub(crate) enum Seen {
    /// What it sees.
    Scan(Scan),
    /// Whether it is pressed.
    Pressed(bool),
}

impl FurtherSensors {
    /// None of them has been heard.
    ///
    /// # Errors
    /// If a stream cannot be declared.
    pub(crate) fn new(config: &Ros2Config, service: &RobotService, radius: f64) -> anyhow::Result<Self> {
        let sensors = config.sensors.iter().map(|config| {
            let scans = service.further_scan(&config.name)?;
            let config = config.clone();
            Ok(Sensor { config, scans, waiting: None, is_pressed: false, heard: None })
        });
        Ok(Self { sensors: sensors.collect::<anyhow::Result<_>>()?, radius })
    }

    /// A sensor has been heard, and what it said is used.
    pub(crate) fn heard(&mut self, index: usize, seen: Seen, now: Instant) {
        let Some(sensor) = self.sensors.get_mut(index) else { return };
        sensor.heard = Some(now);
        match seen {
            Seen::Scan(scan) => sensor.waiting = Some(scan),
            Seen::Pressed(is_pressed) => sensor.is_pressed = is_pressed,
        }
    }

    /// The clock has been set back: what was seen before is of no use.
    pub(crate) fn forget(&mut self) {
        self.sensors.iter_mut().for_each(|sensor| sensor.waiting = None);
    }

    /// Publishes what has been seen since the last tick, and at every tick that a bumper is pressed.
    pub(crate) fn publish(&mut self, sample: &Sample, clock: &RobotClock) {
        for sensor in &mut self.sensors {
            let pressed = sensor.is_pressed.then(|| {
                let rim = further_sensing::bumper(&sensor.config, self.radius);
                Scan { tick: sample.tick, stamp: sample.stamp, ..rim }
            });
            if let Some(scan) = pressed.or_else(|| clock.seen_at(sample, sensor.waiting.take()?)) {
                sensor.scans.publish(&scan, Clock::Realtime);
            }
        }
    }

    /// What operators are told: bumpers that are pressed, and sensors that are silent although they should not be. Of
    /// those that are required the gate says so.
    pub(crate) fn problems(&self, config: &Ros2Config, now: Instant) -> Vec<Problem> {
        let mut problems = Vec::new();
        for sensor in &self.sensors {
            let name = &sensor.config.name;
            let topic = config.resolve(&sensor.config.topic);
            if sensor.is_pressed {
                problems.push(Problem::new(
                    ProblemKind::Pressed,
                    topic.as_str(),
                    format!("the bumper `{name}`"),
                ));
            }
            let is_silent = sensor.config.silence().is_some_and(|most| {
                sensor.heard.is_none_or(|heard| now.saturating_duration_since(heard) > most)
            });
            if is_silent && !sensor.config.required {
                let why = format!("nothing that can be used comes from the sensor `{name}`");
                problems.push(Problem::new(ProblemKind::Unheard, topic, why));
            }
        }
        problems
    }

    /// The sensors that the robot stands without and that have never been heard.
    pub(crate) fn awaited(&self) -> impl Iterator<Item = &SensorConfig> {
        let missing = self.sensors.iter().filter(|sensor| sensor.config.required && sensor.heard.is_none());
        missing.map(|sensor| &sensor.config)
    }
}
