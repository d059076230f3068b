//! The gate to the base: the one place from which velocities are sent.
//!
//! A thread of its own looks at a clock that nothing sets, so that a base is stopped also when everything else hangs.

use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::Context;
use curionav_planning::geometry::Twist;
use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;
use curionav_runtime::lease::BaseLease;
use curionav_runtime::locked::locked;
use curionav_runtime::metrics::Counter;
use curionav_runtime::robot_limits::RobotLimits;

use crate::config::{Ros2Config, Silence};
use crate::drawing::header;
use crate::fault::Fault;
use crate::node::{Node, Outlet};
use crate::ramp::{Ramp, held_back};
use crate::sensor_config::SensorConfig;

/// Between two looks, and between two zeros.
const PERIOD: Duration = Duration::from_millis(50);
/// For how long zeros are sent once no mission is under way and the robot has braked. After that the gateway is silent,
/// and others may drive the base.
const AFTERWARDS: Duration = Duration::from_secs(1);

/// What has to be heard of for the robot to move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    /// A command of the driver.
    Command,
    /// Odometry.
    Odom,
    /// A scan.
    Scan,
    /// A further sensor that is required, by its place in the configuration.
    Further(usize),
}

/// Something that has to be heard of.
#[derive(Debug, Clone, Copy)]
struct Watched {
    source: Source,
    silence: Duration,
    heard: Option<Instant>,
}

impl Watched {
    fn is_silent(&self, now: Instant) -> bool {
        self.heard.is_none_or(|heard| now.saturating_duration_since(heard) > self.silence)
    }
}

/// Decides what the base is told: pure, with the time as an argument.
#[derive(Debug, Clone)]
pub(crate) struct Watch {
    watched: Vec<Watched>,
    /// Whether a mission is under way.
    engaged: bool,
    /// The velocity that was sent last.
    sent: Twist,
    /// How the robot brakes afterwards, since when, and until when zeros are sent.
    braking: Option<Braking>,
}

#[derive(Debug, Clone, Copy)]
struct Braking {
    ramp: Ramp,
    since: Instant,
    until: Instant,
}

impl Watch {
    /// Nothing has been heard, and no mission is under way.
    pub(crate) fn new(silence: &Silence, sensors: &[SensorConfig]) -> Self {
        let Silence { command, odom, scan } = *silence;
        let own = [(Source::Command, command), (Source::Odom, odom), (Source::Scan, scan)];
        let own = own.map(|(source, seconds)| (source, Duration::from_secs_f64(seconds)));
        let required = sensors.iter().enumerate().filter(|(_, sensor)| sensor.required);
        let further = required.filter_map(|(at, sensor)| Some((Source::Further(at), sensor.silence()?)));
        let watched = own.into_iter().chain(further);
        let watched = watched.map(|(source, silence)| Watched { source, silence, heard: None }).collect();
        Self { watched, engaged: false, sent: Twist::default(), braking: None }
    }

    /// Something has been heard. Of a sensor that is not required nothing depends on it.
    pub(crate) fn heard(&mut self, source: Source, now: Instant) {
        if let Some(watched) = self.watched.iter_mut().find(|watched| watched.source == source) {
            watched.heard = Some(now);
        }
    }

    /// A mission has begun or ended.
    pub(crate) fn engage(&mut self, engaged: bool, now: Instant, limits: &RobotLimits) {
        if self.engaged && !engaged {
            let ramp = Ramp::new(self.sent, limits);
            self.braking = Some(Braking { ramp, since: now, until: now + ramp.duration() + AFTERWARDS });
        }
        self.engaged = engaged;
    }

    /// What is silent.
    pub(crate) fn silent(&self, now: Instant) -> Option<Source> {
        self.watched.iter().find(|watched| watched.is_silent(now)).map(|watched| watched.source)
    }

    /// What of the robot has been heard and is silent now.
    fn ended(&self, now: Instant) -> Option<Source> {
        let of_robot = self.watched.iter().filter(|watched| watched.source != Source::Command);
        let mut ended = of_robot.filter(|watched| watched.heard.is_some() && watched.is_silent(now));
        ended.next().map(|watched| watched.source)
    }

    /// Whether a command is passed on.
    pub(crate) fn passes(&self, now: Instant) -> bool {
        self.engaged && self.silent(now).is_none()
    }

    /// The velocity that is due by itself: a zero if something is silent, and once the mission has ended the way down
    /// to it.
    pub(crate) fn due(&self, now: Instant) -> Option<Twist> {
        if self.engaged {
            return self.silent(now).map(|_| Twist::default());
        }
        let braking = self.braking.filter(|braking| now < braking.until)?;
        Some(braking.ramp.after(now.saturating_duration_since(braking.since)))
    }
}

enum Velocity {
    Plain(Outlet<ros::Twist>),
    Stamped(Outlet<ros::TwistStamped>),
}

struct State {
    watch: Watch,
    ended: bool,
    velocity: Velocity,
    /// How fast the robot may drive as the topic `speed_limit` says, m/s.
    speed_limit: Option<f64>,
    /// The newest stamp of the robot's clock and when it was heard: time goes on from there.
    clock: Option<(ros::Time, Instant)>,
}

/// The gate. Dropping it sends zeros and ends its thread.
pub(crate) struct Gate {
    state: Arc<Mutex<State>>,
    limits: RobotLimits,
    /// Whether the base is paused.
    lease: Arc<BaseLease>,
    base: String,
    thread: Option<JoinHandle<()>>,
    /// Velocities that were sent because something was silent, or a mission had ended.
    zeros: Counter,
}

/// How the frame of velocities is named, and where they go.
struct Sink<'a> {
    state: &'a State,
    base: &'a str,
}

impl Sink<'_> {
    fn send(&self, twist: Twist, now: Instant) {
        let said = ros::Twist {
            linear: ros::Vector3 { x: twist.v, ..ros::Vector3::default() },
            angular: ros::Vector3 { z: twist.omega, ..ros::Vector3::default() },
        };
        match &self.state.velocity {
            Velocity::Plain(outlet) => outlet.put(&said),
            Velocity::Stamped(outlet) => {
                let at =
                    self.state.clock.map_or(ros::Time::default(), |(stamp, heard)| later(stamp, now - heard));
                outlet.put(&ros::TwistStamped { header: header(at, self.base), twist: said });
            }
        }
    }
}

/// A velocity that is no faster than the limit, on the same curve.
fn slowed(twist: Twist, limit: Option<f64>) -> Twist {
    match limit {
        Some(limit) if twist.v.abs() > limit => {
            let share = limit / twist.v.abs();
            Twist { v: share * twist.v, omega: share * twist.omega }
        }
        _ => twist,
    }
}

/// The stamp `after` so long.
pub(crate) fn later(stamp: ros::Time, after: Duration) -> ros::Time {
    let nanoseconds = i64::try_from(after.as_nanos()).unwrap_or(i64::MAX);
    ros::Time::from_nanoseconds(stamp.nanoseconds().saturating_add(nanoseconds))
}

impl Gate {
    /// Closed, with its thread running; its zeros are counted in `zeros`.
    ///
    /// # Errors
    /// If publisher or thread cannot be had.
    pub(crate) fn new(
        node: &Node,
        config: &Ros2Config,
        limits: &RobotLimits,
        lease: Arc<BaseLease>,
        zeros: Counter,
    ) -> anyhow::Result<Self> {
        let topic = &config.topics.cmd_vel;
        let velocity = if config.is_stamped() {
            Velocity::Stamped(node.outlet(topic, Qos::DEFAULT)?)
        } else {
            Velocity::Plain(node.outlet(topic, Qos::DEFAULT)?)
        };
        let watch = Watch::new(&config.silence, &config.sensors);
        let state =
            Arc::new(Mutex::new(State { watch, ended: false, velocity, speed_limit: None, clock: None }));
        let base = config.frames.base.clone();
        let watched = Arc::clone(&state);
        let counted = zeros.clone();
        let frame = base.clone();
        let thread = std::thread::Builder::new().name("gate".into()).spawn(move || {
            loop {
                std::thread::sleep(PERIOD);
                let now = Instant::now();
                let mut state = locked(&watched);
                if state.ended {
                    return;
                }
                if let Some(twist) = state.watch.due(now) {
                    state.watch.sent = twist;
                    Sink { state: &state, base: &frame }.send(twist, now);
                    counted.inc();
                }
            }
        });
        let thread = thread.context("the gate's thread")?;
        Ok(Self { state, limits: limits.clone(), lease, base, thread: Some(thread), zeros })
    }

    /// Something has been heard of the robot.
    pub(crate) fn heard(&self, source: Source) {
        locked(&self.state).watch.heard(source, Instant::now());
    }

    /// The robot's clock shows `stamp` now.
    pub(crate) fn clock(&self, stamp: ros::Time) {
        locked(&self.state).clock = Some((stamp, Instant::now()));
    }

    /// The robot drives no faster from now on; a limit of 0 is none.
    ///
    /// # Errors
    /// If it is no speed.
    pub(crate) fn limit_speed(&self, said: &ros::SpeedLimit) -> Result<(), Fault> {
        let limit = said.speed_limit;
        if !limit.is_finite() || limit < 0.0 {
            return Err(Fault::malformed(format!("a speed limit of {limit} is none")));
        }
        let metres = if said.percentage { 0.01 * limit * self.limits.v_max } else { limit };
        locked(&self.state).speed_limit = (limit > 0.0).then_some(metres);
        Ok(())
    }

    /// What the robot's clock shows.
    pub(crate) fn robot_time(&self) -> ros::Time {
        let clock = locked(&self.state).clock;
        clock.map_or(ros::Time::default(), |(stamp, heard)| later(stamp, heard.elapsed()))
    }

    /// A mission is under way, or not.
    pub(crate) fn engage(&self, engaged: bool) {
        locked(&self.state).watch.engage(engaged, Instant::now(), &self.limits);
    }

    /// What is silent: all that the robot stands for while a mission is under way, otherwise what has been heard of the
    /// robot.
    pub(crate) fn silent(&self) -> Option<Source> {
        let now = Instant::now();
        let state = locked(&self.state);
        let watch = &state.watch;
        if watch.engaged { watch.silent(now) } else { watch.ended(now) }
    }

    /// Passes on a command of the driver: finite, and within the robot's own limits. If something else is silent, the
    /// thread sends zeros instead.
    pub(crate) fn command(&self, twist: Twist) {
        let now = Instant::now();
        let mut state = locked(&self.state);
        state.watch.heard(Source::Command, now);
        if state.watch.passes(now) {
            let held = held_back(twist, self.lease.paused_for(), &self.limits);
            let twist = slowed(self.limits.clamp(held), state.speed_limit);
            state.watch.sent = twist;
            Sink { state: &state, base: &self.base }.send(twist, now);
        }
    }

    /// Sends a zero now, whatever is under way, and lets no further command pass.
    pub(crate) fn stop(&self) {
        let now = Instant::now();
        let mut state = locked(&self.state);
        let was_engaged = state.watch.engaged || state.watch.braking.is_some_and(|it| now < it.until);
        state.watch.sent = Twist::default();
        state.watch.engage(false, now, &self.limits);
        if let Some(braking) = &mut state.watch.braking {
            braking.ramp = Ramp::default();
        }
        if was_engaged {
            Sink { state: &state, base: &self.base }.send(Twist::default(), now);
            self.zeros.inc();
        }
    }
}

impl Drop for Gate {
    fn drop(&mut self) {
        self.stop();
        locked(&self.state).ended = true;
        if let Some(thread) = self.thread.take() {
            // It only ends; a panic of it has been logged.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    #[test]
    fn a_robot_is_stopped_within_half_a_second_whatever_is_silent() {
        for silent in [Source::Command, Source::Odom, Source::Scan] {
            let mut watch = Watch::new(&Silence::default(), &[]);
            let start = Instant::now();
            watch.engage(true, start, &limits());
            assert!(watch.due(start).is_some(), "before anything is heard");
            for source in [Source::Command, Source::Odom, Source::Scan] {
                watch.heard(source, start);
            }
            assert!(watch.passes(start) && watch.due(start).is_none());
            let later = start + Duration::from_millis(450);
            for source in [Source::Command, Source::Odom, Source::Scan].into_iter().filter(|s| *s != silent) {
                watch.heard(source, later);
            }
            assert_eq!(watch.silent(later), Some(silent));
            assert!(watch.due(later) == Some(Twist::default()) && !watch.passes(later));
        }
    }

    #[test]
    fn a_sensor_that_is_required_stops_the_robot_by_its_silence_and_no_other_does() {
        let sensor = |required: bool| -> SensorConfig {
            let text = format!("name = \"s\"\nkind = \"range\"\ntopic = \"s\"\nrequired = {required}");
            toml::from_str(&text).unwrap()
        };
        let mut watch = Watch::new(&Silence::default(), &[sensor(false), sensor(true)]);
        let start = Instant::now();
        watch.engage(true, start, &limits());
        for source in [Source::Command, Source::Odom, Source::Scan, Source::Further(0)] {
            watch.heard(source, start);
        }
        assert_eq!(watch.silent(start), Some(Source::Further(1)));
        watch.heard(Source::Further(1), start);
        assert!(watch.passes(start));
        for source in [Source::Command, Source::Odom, Source::Scan] {
            watch.heard(source, start + ms(450));
        }
        assert_eq!(watch.silent(start + ms(450)), Some(Source::Further(1)));
        assert_eq!(watch.due(start + ms(450)), Some(Twist::default()));
    }

    #[test]
    fn after_a_mission_there_are_zeros_for_a_second_and_then_others_may_drive() {
        let mut watch = Watch::new(&Silence::default(), &[]);
        let start = Instant::now();
        assert!(watch.due(start).is_none() && !watch.passes(start));
        watch.engage(true, start, &limits());
        watch.engage(false, start, &limits());
        assert_eq!(watch.due(start + ms(900)), Some(Twist::default()));
        assert_eq!(watch.due(start + ms(1100)), None);
        for source in [Source::Command, Source::Odom, Source::Scan] {
            watch.heard(source, start);
        }
        assert!(!watch.passes(start));
    }

    #[test]
    fn at_the_end_of_a_mission_the_velocity_goes_down_as_fast_as_the_base_brakes() {
        let mut watch = Watch::new(&Silence::default(), &[]);
        let start = Instant::now();
        watch.engage(true, start, &limits());
        watch.sent = Twist { v: 0.4, omega: 0.0 };
        watch.engage(false, start, &limits());
        let mut last = 0.4;
        for k in 1..=16 {
            let v = watch.due(start + ms(50 * k)).unwrap().v;
            assert!(last - v <= 0.5 * 0.05 + 1e-9, "a step from {last} to {v} m/s");
            last = v;
        }
        assert!(last < 1e-9, "{last} m/s after the time that braking takes");
        assert_eq!(watch.due(start + ms(1700)), Some(Twist::default()));
        assert_eq!(watch.due(start + ms(1900)), None);
    }

    fn limits() -> RobotLimits {
        toml::from_str(
            "v_max = 0.8\na_max = 0.5\nomega_max = 1.0\nalpha_max = 1.0\nradius = 0.3\ntick_s = 0.1",
        )
        .unwrap()
    }

    #[test]
    fn a_speed_limit_slows_down_and_leaves_the_curve_as_it_is() {
        let fast = Twist { v: 0.8, omega: 0.4 };
        assert_eq!(slowed(fast, Some(0.2)), Twist { v: 0.2, omega: 0.1 });
        let backwards = Twist { v: -0.8, omega: 0.4 };
        assert_eq!(slowed(backwards, Some(0.2)), Twist { v: -0.2, omega: 0.1 });
        let turning = Twist { v: 0.0, omega: 0.4 };
        assert_eq!((slowed(turning, Some(0.2)), slowed(fast, None)), (turning, fast));
    }

    #[test]
    fn no_velocity_is_beyond_the_limits() {
        let limits = limits();
        for (v, omega, expected) in [
            (f64::NAN, 0.0, (0.0, 0.0)),
            (0.5, f64::INFINITY, (0.0, 0.0)),
            (9.0, -9.0, (0.8, -1.0)),
            (-1.0, 0.2, (0.0, 0.2)),
        ] {
            let sent = limits.clamp(Twist { v, omega });
            assert_eq!((sent.v, sent.omega), expected);
        }
        let backs = RobotLimits { v_reverse: 0.2, ..limits };
        assert_eq!(backs.clamp(Twist { v: -1.0, omega: 0.2 }), Twist { v: -0.2, omega: 0.2 });
    }
}
