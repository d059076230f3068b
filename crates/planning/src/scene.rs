//! What the robot knows at one instant: where it thinks it is, and who is around.

use nalgebra::Matrix3;

use crate::geometry::{Point2, Pose2, Twist};
use crate::numerics::{eigenvalues, hypot};
use crate::occupancy::Obstacles;

/// The localiser's answer: mean and covariance of the pose, and the robot's current motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Belief {
    /// Mean pose, map frame.
    pub pose: Pose2,
    /// Covariance of (x, y, heading): m2, m rad, rad2. Symmetric, positive semi-definite.
    pub covariance: Matrix3<f64>,
    /// Measured speed and turn rate.
    pub twist: Twist,
}

impl Belief {
    /// Mean pose and measured twist: where a trajectory decided on now starts.
    pub fn motion(&self) -> (Pose2, Twist) {
        (self.pose, self.twist)
    }

    /// The localisation uncertainty `l` of eq. 9: the trace of the covariance (m2 + rad2, A8).
    pub fn uncertainty(&self) -> f64 {
        self.covariance.trace()
    }

    /// Standard deviation of position along its worst direction, metres.
    pub fn position_sigma(&self) -> f64 {
        let a = self.covariance[(0, 0)];
        let b = self.covariance[(0, 1)];
        let c = self.covariance[(1, 1)];
        eigenvalues(a, b, c).0.max(0.0).sqrt()
    }
}

/// People around the robot: structure of arrays, all of equal length, map frame. The two arrays of variances are empty
/// if people are known without error.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct People {
    /// Identity of each person, unique, ascending.
    pub id: Vec<u32>,
    /// Metres.
    pub x: Vec<f64>,
    /// Metres.
    pub y: Vec<f64>,
    /// m/s.
    pub vx: Vec<f64>,
    /// m/s.
    pub vy: Vec<f64>,
    /// Variance of each position on its worst axis, m2.
    pub position_variance: Vec<f64>,
    /// Variance of each velocity on its worst axis, m2/s2.
    pub velocity_variance: Vec<f64>,
    /// Radius of the disc that stands for one person, metres.
    pub radius: f64,
}

impl People {
    /// Identity of what only the driver sees ([`crate::arbitration::Observer::observe_braking`]); no tracker gives it.
    pub const UNSEEN: u32 = u32::MAX;

    /// Radius of what only the driver sees where no people say theirs, metres: a person's.
    pub(crate) const UNSEEN_RADIUS: f64 = 0.25;

    /// People of `radius` metres, each at (x, y), who walks with (vx, vy): metres and m/s, map frame. They are known
    /// without error and numbered from 0.
    pub fn walking(radius: f64, each: &[[f64; 4]]) -> Self {
        let column = |at: usize| each.iter().map(|person| person[at]).collect();
        let id = (0..each.len() as u32).collect();
        Self { id, x: column(0), y: column(1), vx: column(2), vy: column(3), radius, ..Self::default() }
    }

    /// Adds one who stands; `id` is greater than all others.
    pub(crate) fn push_standing(&mut self, id: u32, at: Point2) {
        if self.radius <= 0.0 {
            self.radius = Self::UNSEEN_RADIUS;
        }
        // Without variances all people are known without error.
        for variance in [&mut self.position_variance, &mut self.velocity_variance] {
            if !variance.is_empty() {
                variance.push(0.0);
            }
        }
        self.id.push(id);
        self.x.push(at.x);
        self.y.push(at.y);
        self.vx.push(0.0);
        self.vy.push(0.0);
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.id.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.id.is_empty()
    }

    /// Position of the i-th person.
    pub fn position(&self, i: usize) -> Point2 {
        Point2::new(self.x[i], self.y[i])
    }

    /// Where the i-th person will be after `t` seconds: at constant velocity (A20).
    pub fn position_after(&self, i: usize, t: f64) -> Point2 {
        Point2::new(self.x[i] + self.vx[i] * t, self.y[i] + self.vy[i] * t)
    }

    /// Speed of the i-th person, m/s.
    pub fn speed(&self, i: usize) -> f64 {
        hypot(self.vx[i], self.vy[i])
    }

    /// How badly the i-th person's position and velocity are known, m2 and m2/s2: 0 without error.
    pub fn variances(&self, i: usize) -> (f64, f64) {
        let of = |all: &[f64]| all.get(i).copied().unwrap_or(0.0);
        (of(&self.position_variance), of(&self.velocity_variance))
    }

    /// Variance of the i-th person's position after `t` seconds for want of better knowledge now, m2.
    pub fn variance_after(&self, i: usize, t: f64) -> f64 {
        let (position, velocity) = self.variances(i);
        position + velocity * t * t
    }

    /// All of them after `t` seconds, before if negative: at constant velocity (A20). What is not known of a velocity
    /// makes a position less known.
    pub fn after(mut self, t: f64) -> Self {
        self.position_variance =
            (0..self.position_variance.len()).map(|i| self.variance_after(i, t)).collect();
        let moved: Vec<Point2> = (0..self.len()).map(|i| self.position_after(i, t)).collect();
        (self.x, self.y) = moved.iter().map(|p| (p.x, p.y)).unzip();
        self
    }

    /// Those with these indices, in this order.
    pub fn pick(&self, indices: impl IntoIterator<Item = usize>) -> Self {
        let mut kept = Self { radius: self.radius, ..Self::default() };
        for i in indices {
            kept.id.push(self.id[i]);
            kept.x.push(self.x[i]);
            kept.y.push(self.y[i]);
            kept.vx.push(self.vx[i]);
            kept.vy.push(self.vy[i]);
            kept.position_variance.extend(self.position_variance.get(i));
            kept.velocity_variance.extend(self.velocity_variance.get(i));
        }
        kept
    }
}

/// When a cycle takes place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Simulation or sensor tick: samples depend on it.
    pub tick: u64,
    /// Robot's clock, seconds.
    pub stamp: f64,
}

/// Everything a candidate's cost may depend on besides the candidate itself and the static map.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Simulation or sensor tick.
    pub tick: u64,
    /// Robot's clock, seconds.
    pub stamp: f64,
    /// The robot's own state.
    pub belief: Belief,
    /// The people inside the Working Zone.
    pub people: People,
    /// What stands around the robot and is on no map.
    pub obstacles: Obstacles,
    /// The least room that the way ahead leaves beside the robot, metres, if that is little
    /// ([`crate::planner::Course::passage`]): what is asked of walls never closes the way through a door.
    pub passage: Option<f64>,
    /// Whether CPC is switched on (eq. 5), with hysteresis (D3). Part of the scene, so that every
    /// evaluator of the cycle sees the same.
    pub uncertain: bool,
    /// For how long the robot has not left the place where it is, seconds
    /// ([`crate::generation::RecoveryParams::radius`]).
    pub in_place: f64,
    /// Whether terms which give way count less: the robot has stayed where it is for long, or people are at its goal
    /// ([`crate::profile::Patience`]).
    pub impatient: bool,
}

impl Scene {
    /// The scene at the beginning: the position counts as certain, and the robot has just come to where it is.
    pub fn new(belief: Belief, people: People) -> Self {
        let obstacles = Obstacles::default();
        Self {
            tick: 0,
            stamp: 0.0,
            belief,
            people,
            obstacles,
            passage: None,
            uncertain: false,
            in_place: 0.0,
            impatient: false,
        }
    }
}
