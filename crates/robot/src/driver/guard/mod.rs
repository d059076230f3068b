//! The guard: the last line of defence, which judges each command from raw scans.
//!
//! It asks where the robot is and how fast when the command reaches it, which way braking takes from there with a
//! share of the declared brakes, and what stands in that way or comes into it. Then it lets through the greatest speed
//! that is safe. `docs/guard.md` has the rules, the parameters and a table of what was tried.

mod approach;
mod braking;
mod sweep;
mod zones;

use std::collections::{BTreeMap, VecDeque};
use std::f64::consts::PI;

use curionav_mission::guard_settings::{GuardSettings, Zone};
use curionav_planning::geometry::{Direction, Point2, Pose2, Twist};
use curionav_planning::motion::RobotModel;
use curionav_schemas::Scan;

use self::approach::{Approach, Movers};
use self::braking::{Approaching, Standing, is_safe};
use self::sweep::{Bearings, Sweep};

/// Earlier scans are kept at least so far apart, seconds.
const SPACING: f64 = 0.09;
/// How many are kept: half a second of them.
const KEPT: usize = 7;
/// A scan is compared with one that is at least so much older, seconds: for what comes fast.
const APART_FAST: f64 = 0.2;
/// And with one that is as much older, seconds: for what comes slowly.
const APART_SLOW: f64 = 0.5;
/// And, for what both of them have not seen, with one that is as much older, seconds.
const APART_NEW: f64 = 0.1;
/// A scan that is older by more is of no use, seconds.
const APART_MAX: f64 = 1.0;
/// Halvings in the search for the greatest safe speed: a fiftieth of what a base can change in a period.
const HALVINGS: usize = 6;
/// Slower driving is not worth it, m/s: the robot stands.
const CREEP: f64 = 0.03;
/// A robot that may drive no faster counts as braked, m/s: it does not get on.
const SLOW: f64 = 0.1;
/// Slower things do not cap the speed of a robot that has them ahead, m/s.
const WALKS: f64 = 0.3;

/// How the robot will be moving when a command of now reaches it.
#[derive(Debug, Clone, Copy)]
pub struct Arrival {
    /// Where it will be, in the odometry's frame.
    pub pose: Pose2,
    /// Its speed and turn rate.
    pub twist: Twist,
    /// Seconds from the odometry until then.
    pub after: f64,
}

/// What a command is judged from.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    /// Where the odometry has the robot now.
    pub pose: Pose2,
    /// Stamp of the odometry, seconds of the robot's clock.
    pub now: f64,
    /// The robot when the command reaches it.
    pub arrival: Arrival,
    /// What the base does when it has to stop.
    pub stopping: &'a RobotModel,
    /// Seconds until the next command.
    pub period: f64,
    /// For so long a scan of a further sensor counts, seconds.
    pub further_age_max: f64,
}

/// What becomes of a command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// It is safe.
    Safe,
    /// The robot may drive only so fast, but need not brake hard.
    Slower(Twist),
    /// The robot brakes, or stands.
    Brakes(Twist),
}

/// The newest scan of a further sensor.
#[derive(Debug, Default)]
struct Further {
    bearings: Bearings,
    now: Sweep,
}

/// The guard of one robot, with what it remembers of earlier scans.
#[derive(Debug)]
pub struct Guard {
    settings: GuardSettings,
    zones: Vec<Zone>,
    bearings: Bearings,
    now: Sweep,
    /// The newest first.
    earlier: VecDeque<Sweep>,
    /// What further sensors have seen last, by their names.
    further: BTreeMap<String, Further>,
    approach: Approach,
    movers: Movers,
    standing: Standing,
}

impl Guard {
    /// Has seen nothing yet. The zones have been checked.
    pub fn new(settings: GuardSettings, zones: Vec<Zone>) -> Self {
        Self {
            settings,
            zones,
            bearings: Bearings::default(),
            now: Sweep::default(),
            earlier: VecDeque::with_capacity(KEPT + 1),
            further: BTreeMap::new(),
            approach: Approach::default(),
            movers: Movers::default(),
            standing: Standing::default(),
        }
    }

    /// Forgets all scans: they are of a clock that is over.
    pub fn forget(&mut self) {
        self.earlier.clear();
        self.further.clear();
        self.now.stamp = f64::NEG_INFINITY;
    }

    /// Takes in a scan of a robot that was at `pose` of the odometry. One that it has seen changes nothing.
    pub fn see(&mut self, scan: &Scan, pose: Pose2) {
        if scan.stamp == self.now.stamp {
            return;
        }
        if scan.stamp < self.now.stamp {
            self.forget();
        }
        self.keep();
        self.now.take(scan, pose, &mut self.bearings);
        let earlier =
            [APART_FAST, APART_SLOW, APART_NEW].map(|apart| reference(&self.earlier, scan.stamp, apart));
        self.approach.find(&self.now, earlier, pose.position(), &self.settings, &mut self.movers);
    }

    /// Takes in a scan of a further sensor of a robot that was at `pose` of the odometry. What it shows counts as
    /// standing: a camera sees things appear because it nods, and a ranger sees an arc and no surface.
    pub fn see_further(&mut self, sensor: &str, scan: &Scan, pose: Pose2) {
        let Further { bearings, now } = self.further.entry(sensor.to_owned()).or_default();
        if now.stamp != scan.stamp {
            now.take(scan, pose, bearings);
        }
    }

    /// Puts the scan that has been the newest among the earlier ones, unless there is one of nearly the same time.
    fn keep(&mut self) {
        let spare = match self.earlier.front() {
            _ if self.now.stamp == f64::NEG_INFINITY => return,
            Some(newest) if self.now.stamp - newest.stamp < SPACING => return,
            _ if self.earlier.len() >= KEPT => self.earlier.pop_back().unwrap_or_default(),
            _ => Sweep::default(),
        };
        self.earlier.push_front(std::mem::replace(&mut self.now, spare));
    }

    /// Judges a command. A robot that drives backwards is judged as one that faces the other way and drives forwards.
    pub fn judge(&mut self, told: Twist, situation: &Situation<'_>) -> Verdict {
        let further = self.further.values().map(|further| &further.now);
        let fresh = further.filter(|it| (situation.now - it.stamp).abs() <= situation.further_age_max);
        let seen: Vec<&Sweep> = std::iter::once(&self.now).chain(fresh).collect();
        let zone = zones::limit(&self.zones, &seen, situation.pose);
        if zone == Some(0.0) {
            return Verdict::Brakes(Twist::default());
        }
        if told.v == 0.0 {
            return Verdict::Safe;
        }
        let sign = told.v.signum();
        let told = Twist { v: sign * told.v, ..told };
        let robot = self.approaching(situation, sign);
        self.standing.gather(&seen, &robot, told.v);
        let cap = zone.unwrap_or(f64::INFINITY).min(self.speed_near_movers(&robot));
        let wanted = told.v.min(cap);
        let brakes = situation.stopping.a_max * situation.period;
        let slowest = (robot.speed - brakes).max(0.0).min(wanted);
        let v = self.greatest_safe(&robot, Twist { v: wanted, ..told }, slowest);
        if v == told.v {
            return Verdict::Safe;
        }
        if v < CREEP {
            // The disc of a robot that stands may turn as it likes.
            return Verdict::Brakes(Twist { v: 0.0, omega: told.omega });
        }
        let twist = Twist { v: sign * v, omega: told.omega * v / told.v };
        let brakes_hard = v < SLOW || v < robot.speed - 0.5 * brakes;
        if brakes_hard { Verdict::Brakes(twist) } else { Verdict::Slower(twist) }
    }

    /// The robot that is judged: it faces where it drives, which is backwards if `sign` is -1.
    fn approaching(&self, situation: &Situation<'_>, sign: f64) -> Approaching {
        let Situation { now, arrival, stopping, period, .. } = *situation;
        let Pose2 { x, y, heading } = arrival.pose;
        let facing = if sign < 0.0 { heading + PI } else { heading };
        Approaching {
            pose: Pose2::new(x, y, facing),
            speed: sign * arrival.twist.v,
            after: now - self.now.stamp + arrival.after,
            period,
            braking: self.settings.braking_share * stopping.a_max,
            radius: stopping.radius(),
            meeting_speed: self.settings.meeting_speed,
        }
    }

    /// The greatest safe speed from `slowest`, which the base can just reach, to that of `told`; 0 if none is.
    fn greatest_safe(&self, robot: &Approaching, told: Twist, slowest: f64) -> f64 {
        let is_safe = |v: f64| is_safe(robot, Twist { v, ..told }, &self.standing, &self.movers);
        if is_safe(told.v) {
            return told.v;
        }
        if !is_safe(slowest) {
            return 0.0;
        }
        let mut safe = slowest;
        let mut unsafe_ = told.v;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (safe + unsafe_);
            if is_safe(middle) { safe = middle } else { unsafe_ = middle }
        }
        safe
    }

    /// The greatest speed near what moves ahead, m/s: `near_speed` at `near_gap`, and with more room what it could
    /// brake down from on the way. What walks away may be followed as fast as it goes.
    fn speed_near_movers(&self, robot: &Approaching) -> f64 {
        let GuardSettings { near_gap, near_speed, near_angle, .. } = self.settings;
        let heading = Direction::of(robot.pose.heading);
        let least_cos = Direction::of(near_angle).cos;
        let mut least = f64::INFINITY;
        for i in 0..self.movers.seen {
            let velocity = Point2::new(self.movers.vx[i], self.movers.vy[i]);
            if velocity.distance_squared(Point2::default()) < WALKS * WALKS {
                continue;
            }
            let x = self.movers.x[i] + velocity.x * robot.after;
            let y = self.movers.y[i] + velocity.y * robot.after;
            let (ahead, left) = heading.ahead_and_left(robot.pose.position(), Point2::new(x, y));
            let distance = (ahead * ahead + left * left).sqrt();
            if ahead < least_cos * distance {
                continue;
            }
            let room = (distance - robot.radius - near_gap).max(0.0);
            let away = (heading.cos * velocity.x + heading.sin * velocity.y).max(0.0);
            least = least.min((near_speed * near_speed + 2.0 * robot.braking * room).sqrt() + away);
        }
        least
    }
}

/// The newest scan that is older than one of `stamp` by at least `apart` seconds, or else the oldest.
fn reference(earlier: &VecDeque<Sweep>, stamp: f64, apart: f64) -> Option<&Sweep> {
    let usable = || earlier.iter().filter(|sweep| stamp - sweep.stamp <= APART_MAX);
    usable().find(|sweep| stamp - sweep.stamp >= apart - 1e-6).or_else(|| usable().next_back())
}

#[cfg(test)]
mod tests;
