//! What the robot senses: laser scan, odometry, people.

use crate::check::{
    array, checks, each, fraction, length, non_negative, number, optional, part, planar_covariances,
    positive, within,
};
use crate::limits::{MAX_BEAMS, MAX_LASER_DISTANCE, MAX_MAGNITUDE, MAX_PEOPLE};
use crate::{F32Array, F64Array, Pose, Refusal, Reject, U32Array};
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
    /// What is nearer than this is not measured, m; absent: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_min: Option<f64>,
    /// Range, m.
    pub range_max: f64,
    /// Pose of the laser in the robot frame.
    pub laser: Pose,
    /// Range of each beam, m; `range_max` or more: it hit nothing; NaN or 0: it says nothing; less than `range_min`:
    /// it hit something there.
    pub ranges: F32Array,
}

/// Beams are counted as a full turn although they overlap by this much, rad: rounding.
const TURN_ROUNDING: f64 = 1e-6;

/// Refuses beams that all look one way, and those that look over more than a turn and one step.
fn sweeps(beams: usize) -> impl Fn(&str, &f64) -> Result<(), Reject> {
    move |field, increment| {
        if beams < 2 {
            return Ok(());
        }
        let step = increment.abs();
        let gaps = (beams - 1) as f64;
        let widest = std::f64::consts::TAU / (gaps - 1.0).max(1.0) + TURN_ROUNDING;
        if step > 0.0 && step <= widest {
            return Ok(());
        }
        let detail = format!("{beams} beams that are {increment} rad apart sweep {} rad", gaps * step);
        Err(Refusal::invalid(format!("{detail}; a scan sweeps more than 0 and at most a turn and a step"))
            .at(field))
    }
}

/// Refuses a laser that sits farther from the robot than any robot is large.
fn mounted(field: &str, laser: &Pose) -> Result<(), Reject> {
    let distance = laser.x.hypot(laser.y);
    within(0.0, MAX_LASER_DISTANCE)(&format!("{field}.distance"), &distance)
}

/// Refuses a least range that is not less than the greatest.
fn below(most: f64) -> impl Fn(&str, &f64) -> Result<(), Reject> {
    move |field, least| {
        if *least < most {
            return Ok(());
        }
        Err(Refusal::OutOfRange { found: *least, least: 0.0, most }.at(field))
    }
}

/// Refuses what is neither a distance nor NaN.
fn range(field: &str, range: &f32) -> Result<(), Reject> {
    if range.is_nan() { Ok(()) } else { non_negative(field, range) }
}

/// Every range. Without an early exit the loop runs several at a time; the place is looked up only on refusal.
fn ranges(field: &str, ranges: &F32Array) -> Result<(), Reject> {
    let good = |one: &f32| one.is_nan() | ((*one >= 0.0) & (f64::from(*one) <= MAX_MAGNITUDE));
    if ranges.iter().fold(true, |all, one| all & good(one)) {
        return Ok(());
    }
    each(range)(field, ranges)
}

checks! { scan: Scan {
    stamp, angle_min, angle_increment: number;
    angle_increment: sweeps(scan.ranges.len());
    range_max: positive;
    range_min: optional(non_negative);
    range_min: optional(below(scan.range_max));
    laser: part;
    laser: mounted;
    ranges: length(1, MAX_BEAMS);
    ranges: ranges;
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
    /// How sure it is that each is a person and not a thing, 0 to 1; absent if all of them surely are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probability: Option<F32Array>,
}

checks! { people: People {
    stamp: number;
    radius: non_negative;
    id: length(0, MAX_PEOPLE);
    x, y, vx, vy: array(people.id.len());
    position_covariance, velocity_covariance: optional(planar_covariances(people.id.len()));
    age: optional(array(people.id.len()));
    age: optional(each(non_negative));
    probability: optional(array(people.id.len()));
    probability: optional(each(fraction));
}}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Validate;

    fn scan(beams: usize, angle_increment: f64) -> Scan {
        Scan {
            tick: 0,
            stamp: 0.0,
            angle_min: -1.5,
            angle_increment,
            range_min: Some(0.1),
            range_max: 10.0,
            laser: Pose { x: 0.2, y: 0.0, heading: 0.0 },
            ranges: vec![3.0; beams].into(),
        }
    }

    #[test]
    fn what_contradicts_itself_is_refused_with_the_numbers() {
        let degree = 1.0_f64.to_radians();
        for good in [scan(1, 0.0), scan(181, degree), scan(361, degree), scan(361, -degree), scan(2, 0.1)] {
            assert_eq!(good.validate(), Ok(()));
        }
        let far = Pose { x: 1e6, y: 0.0, heading: 0.0 };
        // No step, degrees instead of radians, two turns, a laser on another robot, a least range that is none.
        let contradictory = [
            (scan(181, 0.0), "181 beams that are 0 rad apart sweep 0 rad"),
            (scan(361, 1.0), "361 beams that are 1 rad apart sweep 360 rad"),
            (scan(361, -2.0 * degree), "sweep 12.566"),
            (Scan { laser: far, ..scan(181, degree) }, "laser.distance: 1000000 is not within 0 to 5"),
            (Scan { range_min: Some(10.0), ..scan(181, degree) }, "range_min: 10 is not within 0 to 10"),
        ];
        for (scan, said) in contradictory {
            let reject = scan.validate().unwrap_err().to_string();
            assert!(reject.contains(said), "{reject}");
        }
    }

    #[test]
    fn a_probability_is_one_for_each_person_and_between_nothing_and_certainty() {
        let with = |probability: &[f32]| {
            let people = People {
                tick: 0,
                stamp: 0.0,
                frame: Frame::Robot,
                radius: 0.25,
                id: vec![1, 2].into(),
                x: vec![1.0; 2].into(),
                y: vec![0.0; 2].into(),
                vx: vec![0.0; 2].into(),
                vy: vec![0.0; 2].into(),
                position_covariance: None,
                velocity_covariance: None,
                age: None,
                probability: Some(probability.into()),
            };
            people.validate().map_err(|reject| reject.field)
        };
        assert_eq!(with(&[0.0, 1.0]), Ok(()));
        assert_eq!(with(&[0.75]), Err(Some("probability".into())));
        for wrong in [-0.1, 1.1, f32::NAN] {
            assert_eq!(with(&[0.5, wrong]), Err(Some("probability[1]".into())), "{wrong}");
        }
    }

    #[test]
    fn a_range_may_be_no_number_but_not_negative_or_infinite() {
        let with = |range: f32| {
            let mut scan = scan(181, 0.01);
            scan.ranges.0[7] = range;
            scan.validate().map_err(|reject| reject.field)
        };
        for range in [f32::NAN, 0.0, 0.05, 25.0] {
            assert_eq!(with(range), Ok(()), "{range}");
        }
        for range in [-0.1, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(with(range), Err(Some("ranges[7]".into())), "{range}");
        }
    }
}
