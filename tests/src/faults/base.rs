//! A simulated base with a watchdog, what its localiser says, and the people around it.

use curionav_crowdsim::lidar;
use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::motion::{RobotModel, step};
use curionav_planning::occupancy::StaticMap;
use curionav_planning::random::{Rng, rng, standard_normal};
use curionav_planning::sensor::LaserModel;
use curionav_runtime::convert;
use curionav_schemas::{Belief, Confidence, Frame, Health, Mission, Odometry, People, Scan};
use curionav_testing::golden;

/// Seconds between two ticks.
pub(crate) const TICK: f64 = 0.1;
/// The base stops by itself without a command for this long, seconds.
const COMMAND_AGE_MAX: f64 = 0.3;
/// People in each corridor.
const PEOPLE: usize = 6;

pub(crate) struct Base {
    pub(crate) model: RobotModel,
    rng: Rng,
    pub(crate) tick: u64,
    pub(crate) pose: Pose2,
    pub(crate) twist: Twist,
    people: People,
}

impl Base {
    pub(crate) fn new(mission: &Mission) -> Self {
        let mut rng = rng(mission.order.seed, 78);
        let mut draw = |scale: f64, mean: f64| -> Vec<f64> {
            (0..PEOPLE).map(|_| mean + scale * standard_normal(&mut rng)).collect()
        };
        let (x, y, vx, vy) = (draw(6.0, 14.0), draw(1.5, 4.0), draw(0.3, -0.2), draw(0.2, 0.0));
        let people = People {
            tick: 0,
            stamp: 0.0,
            frame: Frame::Map,
            radius: 0.25,
            id: (0..PEOPLE as u32).collect::<Vec<_>>().into(),
            x: x.into(),
            y: y.into(),
            vx: vx.into(),
            vy: vy.into(),
            position_covariance: None,
            velocity_covariance: None,
            age: None,
            probability: None,
        };
        let model = convert::robot_model(&mission.order.robot_model);
        let pose = convert::pose(mission.order.initial_pose);
        Self { model, rng, tick: 0, pose, twist: Twist::default(), people }
    }

    /// Seconds of the robot's clock.
    pub(crate) fn now(&self) -> f64 {
        self.tick as f64 * TICK
    }

    /// Moves for a tick on a command and its stamp; gives the metres it went.
    pub(crate) fn roll(&mut self, command: Option<(f64, Twist)>) -> f64 {
        let fresh = command.filter(|(stamp, _)| self.now() - stamp <= COMMAND_AGE_MAX + 1e-9);
        let wanted = fresh.map_or(Twist::default(), |(_, twist)| twist);
        self.twist = self.model.limit(self.twist, wanted, TICK);
        let from = self.pose;
        self.pose = step(self.pose, self.twist, TICK);
        self.tick += 1;
        from.position().distance(self.pose.position())
    }

    pub(crate) fn odometry(&self) -> Odometry {
        let (Pose2 { x, y, heading }, Twist { v, omega }) = (self.pose, self.twist);
        Odometry { tick: self.tick, stamp: self.now(), x, y, heading, v, omega }
    }

    /// Nearly the truth, and certain of it for two seconds out of four.
    pub(crate) fn belief(&mut self) -> Belief {
        let variance = if (self.tick / 20).is_multiple_of(2) { 0.01 } else { 0.06 };
        let mut near = |value: f64| value + 0.02 * standard_normal(&mut self.rng);
        let (x, y) = (near(self.pose.x), near(self.pose.y));
        let covariance = vec![variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, 0.01];
        Belief {
            tick: self.tick,
            stamp: self.now(),
            x,
            y,
            heading: self.pose.heading,
            covariance: covariance.into(),
            v: self.twist.v,
            omega: self.twist.omega,
            health: Health {
                outside_weight: 0.0,
                scan_fit: 1.0,
                particles: 500,
                confidence: Confidence::Sure,
            },
        }
    }

    /// All people, a tick later than before; those who leave the corridor come back at the other end.
    pub(crate) fn people(&mut self) -> People {
        let now = self.now();
        let people = &mut self.people;
        (people.tick, people.stamp) = (self.tick, now);
        for i in 0..people.x.0.len() {
            people.x.0[i] = (people.x.0[i] + TICK * people.vx.0[i]).rem_euclid(30.0);
            people.y.0[i] = (people.y.0[i] + TICK * people.vy.0[i]).rem_euclid(8.0);
        }
        people.clone()
    }

    /// A scan without walls: what is close is for the tests of the guard.
    pub(crate) fn scan(&self) -> Scan {
        let mut scan = golden::scan();
        (scan.tick, scan.stamp) = (self.tick, self.now());
        let range_max = scan.range_max as f32;
        scan.ranges.0.fill(range_max);
        scan
    }

    /// What a laser measures of the walls and the people.
    pub(crate) fn measured(&mut self, laser: &LaserModel, map: &StaticMap) -> Scan {
        let bodies = lidar::Bodies::discs(&convert::people(&self.people, Pose2::default()));
        let ranges = lidar::scan(laser, map, self.pose, &bodies, &mut self.rng);
        convert::scan_to_wire(laser, ranges, self.tick, self.now())
    }
}
