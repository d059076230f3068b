//! What the robot senses: laser scan, odometry, people.

use crate::check::{
    array, checks, each, length, non_negative, number, numbers, optional, part, planar_covariances, positive,
};
use crate::limits::{MAX_BEAMS, MAX_PEOPLE};
use crate::{F32Array, F64Array, Pose, U32Array};
use serde::{Deserialize, Serialize};

/// One sweep of the laser.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// Tick of the streams this belongs to.
    pub tick: u64,
    /// Robot clock, s.
    pub stamp: f64,
    /// Angle of the first beam in the laser frame, rad.
    pub angle_min: f64,
    /// From one beam to the next, rad; negative for a laser that turns clockwise.
    pub angle_increment: f64,
    /// Range, m.
    pub range_max: f64,
    /// Pose of the laser in the robot frame.
    pub laser: Pose,
    /// Range of each beam, m; `range_max` means that it hit nothing.
    pub ranges: F32Array,
}

checks! { scan: Scan {
    stamp, angle_min, angle_increment: number;
    range_max: positive;
    laser: part;
    ranges: length(1, MAX_BEAMS);
    ranges: numbers;
    ranges: each(non_negative);
}}

/// Dead reckoning since the robot was switched on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    /// Tick of the streams this belongs to.
    pub tick: u64,
    /// Robot clock, s.
    pub stamp: f64,
    /// Odometry frame, m.
    pub x: f64,
    /// Odometry frame, m.
    pub y: f64,
    /// Odometry frame, rad.
    pub heading: f64,
    /// Forward speed, m/s.
    pub v: f64,
    /// Turn rate, rad/s.
    pub omega: f64,
}

checks! { odometry: Odometry {
    stamp, x, y, heading, v, omega: number;
}}

/// Frame in which people are reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Frame {
    /// The map.
    Map,
    /// The robot: x ahead, y to the left. Velocities are over ground, along the robot's axes.
    Robot,
}

/// The people a tracker sees; arrays have one entry a person, covariances three.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct People {
    /// Tick of the streams this belongs to.
    pub tick: u64,
    /// Robot clock, s.
    pub stamp: f64,
    /// Frame of the positions and velocities.
    pub frame: Frame,
    /// Radius of a person, m.
    pub radius: f64,
    /// Tracker's identifiers, steady over time.
    pub id: U32Array,
    /// Metres.
    pub x: F64Array,
    /// Metres.
    pub y: F64Array,
    /// Metres per second.
    pub vx: F64Array,
    /// Metres per second.
    pub vy: F64Array,
    /// Covariance (xx, xy, yy) of each position, m^2, in the frame of the positions; absent if they are without error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_covariance: Option<F64Array>,
    /// The same of each velocity, m^2/s^2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity_covariance: Option<F64Array>,
    /// For how long each has not been seen, s; absent if all of them are seen now.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub age: Option<F32Array>,
}

checks! { people: People {
    stamp: number;
    radius: non_negative;
    id: length(0, MAX_PEOPLE);
    x, y, vx, vy: array(people.id.len());
    position_covariance, velocity_covariance: optional(planar_covariances(people.id.len()));
    age: optional(array(people.id.len()));
    age: optional(each(non_negative));
}}
