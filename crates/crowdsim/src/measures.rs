//! The paper's nine measures of a run, the time until the error is small, collisions and the least gap; the standard
//! social measures are in [`social`].
//!
//! Distances to people are between centres (A28), except the gap. TD and MD are measured twice: of all people, as in
//! the paper, and of those that no wall hides from where the robot truly is. Every row stands for the time since the
//! row before it; the first has none.

mod overlaps;
pub mod social;

use std::collections::BTreeMap;

use curionav_planning::geometry::Pose2;

use crate::world::{Touch, Truth};

/// `Thr_c`: the localiser has converged while the trace of its covariance is at most this, m2 + rad2. It is the
/// threshold that switches CPC on in the shipped planners (A9, A10); runs are judged by it whatever the planner's own
/// threshold is.
const CONVERGED_TRACE: f64 = 0.1;
/// The trace must stay converged this long to count, seconds.
const CONVERGED_FOR_S: f64 = 1.0;
/// Another loss of convergence is counted only after the trace fell below this share of `Thr_c`.
const REARM_SHARE: f64 = 0.8;
/// The estimate is at the robot while it is nearer than this to where the robot is, metres.
const SMALL_ERROR: f64 = 0.3;
/// The error must stay small this long to count, seconds.
const SMALL_FOR_S: f64 = 2.0;
/// Half a microsecond for the rounding of times that are multiples of a tick.
const TIME_ROUNDING_S: f64 = 5e-7;
/// Comfortable distance between centres, metres (A16).
const COMFORT_DISTANCE: f64 = 1.5;
/// A contact counts as a collision when the robot is faster than this, m/s (D11).
const COLLISION_SPEED: f64 = 0.05;
/// A contact with a wall lasts until the gap exceeds this, metres.
const WALL_RELEASE: f64 = 0.02;

/// The measures of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct Measures {
    /// Root mean square of the position error of the estimate, metres.
    pub rmse_m: f64,
    /// Share of the run before the localiser first converged, 0 to 1; 1 when it never did.
    pub tcm: f64,
    /// Times the localiser lost convergence again; none when it never converged.
    pub nm: Option<u32>,
    /// Seconds until the error of the estimate stayed small; none when it never did. What the localiser says of itself
    /// does not count here, nor does any threshold of a planner.
    pub tce_s: Option<f64>,
    /// Share of the run with a person nearer than the comfortable distance, 0 to 1.
    pub td: f64,
    /// Least distance to a person, metres; none when no person was ever there.
    pub md_m: Option<f64>,
    /// The share of `td` among people that no wall hides from the robot, 0 to 1.
    pub td_in_view: f64,
    /// Least distance to a person that no wall hides from the robot, metres; none when there never was one.
    pub md_in_view_m: Option<f64>,
    /// Times a person came nearer than the comfortable distance.
    pub nt: u32,
    /// Mean speed, m/s.
    pub vel_mps: f64,
    /// Length of the way driven, metres.
    pub length_m: f64,
    /// Duration, seconds.
    pub time_s: f64,
    /// Contacts with people or walls in which the robot was moving; one for each episode (D11), in their order.
    pub collisions: Vec<Contact>,
    /// Least gap between the robot's body and a wall or a person, metres; negative for an overlap.
    pub clearance_min_m: f64,
}

/// The first moment of a contact in which the robot was moving.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Seconds since the start.
    pub time: f64,
    /// The person's id; none for a wall.
    pub person: Option<u32>,
    /// How fast the robot came towards the person or hit the wall, m/s; negative if it went away.
    pub robot_speed: f64,
    /// How fast the person came towards the robot, m/s; negative if the person went away, 0 for a wall.
    pub person_speed: f64,
}

/// One tick of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// What really was.
    pub truth: Truth,
    /// The localiser's mean pose.
    pub estimate: Pose2,
    /// The trace of its covariance, m2 + rad2.
    pub trace: f64,
}

impl Row {
    fn squared_error(&self) -> f64 {
        self.estimate.position().distance_squared(self.truth.pose.position())
    }
}

impl Measures {
    /// The measures of a whole run, row by row.
    pub fn of(rows: &[Row]) -> Self {
        let start = rows.first().map_or(0.0, |row| row.truth.time);
        let time = rows.last().map_or(start, |row| row.truth.time) - start;
        let length = total(steps(rows).map(|(a, b)| a.pose.position().distance(b.pose.position())));
        let near = steps(rows).filter(|(_, b)| is_near(b)).map(|(a, b)| b.time - a.time);
        let seen = steps(rows).filter(|(_, b)| b.seen_person_distance < COMFORT_DISTANCE);
        let seen_near = seen.map(|(a, b)| b.time - a.time);
        let gaps = rows.iter().map(|row| row.truth.wall_clearance.min(row.truth.person_clearance));
        let (converged, losses) = convergence(rows);
        Self {
            rmse_m: (total(rows.iter().map(Row::squared_error)) / rows.len().max(1) as f64).sqrt(),
            tcm: converged.map_or(1.0, |since| share(since - start, time)),
            nm: converged.map(|_| losses),
            tce_s: since_lasting(rows, SMALL_FOR_S, |row| row.squared_error() < SMALL_ERROR * SMALL_ERROR)
                .map(|since| since - start),
            td: share(total(near), time),
            md_m: least(rows.iter().map(|row| row.truth.person_distance)),
            td_in_view: share(total(seen_near), time),
            md_in_view_m: least(rows.iter().map(|row| row.truth.seen_person_distance)),
            // A person who is near from the first row on has not come near.
            nt: steps(rows).filter(|(a, b)| !is_near(a) && is_near(b)).count() as u32,
            vel_mps: share(length, time),
            length_m: length,
            time_s: time,
            collisions: collisions(rows),
            clearance_min_m: gaps.fold(f64::INFINITY, f64::min),
        }
    }
}

fn steps(rows: &[Row]) -> impl Iterator<Item = (&Truth, &Truth)> {
    rows.windows(2).map(|pair| (&pair[0].truth, &pair[1].truth))
}

fn is_near(truth: &Truth) -> bool {
    truth.person_distance < COMFORT_DISTANCE
}

/// The least distance; none if all are infinite.
fn least(distances: impl Iterator<Item = f64>) -> Option<f64> {
    distances.reduce(f64::min).filter(|d| d.is_finite())
}

/// The share of `time` that a part is; of a run that takes no time, none.
fn share(part: f64, time: f64) -> f64 {
    if time > 0.0 { part / time } else { 0.0 }
}

/// The sum; of nothing it is 0 and not the -0 that `sum` gives.
fn total(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |sum, value| sum + value)
}

/// Since when `holds` has been true for the first time that it was so for `seconds`.
fn since_lasting(rows: &[Row], seconds: f64, holds: impl Fn(&Row) -> bool) -> Option<f64> {
    let mut since = None;
    rows.iter().find_map(|row| {
        let time = row.truth.time;
        since = holds(row).then(|| since.unwrap_or(time));
        since.filter(|since| time - since >= seconds - TIME_ROUNDING_S)
    })
}

/// When the localiser first converged, and how often it lost convergence again.
fn convergence(rows: &[Row]) -> (Option<f64>, u32) {
    let since = since_lasting(rows, CONVERGED_FOR_S, |row| row.trace <= CONVERGED_TRACE);
    let Some(start) = since else { return (None, 0) };
    let mut losses = 0;
    let mut is_lost = false;
    for row in rows.iter().skip_while(|row| row.truth.time < start + CONVERGED_FOR_S - TIME_ROUNDING_S) {
        if row.trace > CONVERGED_TRACE && !is_lost {
            losses += 1;
            is_lost = true;
        }
        if row.trace < REARM_SHARE * CONVERGED_TRACE {
            is_lost = false;
        }
    }
    (since, losses)
}

/// Contacts that are collisions; each is an episode with one person or with walls.
fn collisions(rows: &[Row]) -> Vec<Contact> {
    let mut collisions = Vec::new();
    // What is touched, a person or walls, and whether the episode has been counted.
    let mut touched: BTreeMap<Option<u32>, bool> = BTreeMap::new();
    for Row { truth, .. } in rows {
        let lasts = touched.contains_key(&None) && truth.wall_clearance <= WALL_RELEASE;
        let mut touches = BTreeMap::new();
        for (contact, is_hit) in contacts(truth, lasts) {
            let was_counted = touched.get(&contact.person) == Some(&true);
            if is_hit && !was_counted {
                collisions.push(contact);
            }
            touches.insert(contact.person, was_counted || is_hit);
        }
        touched = touches;
    }
    collisions
}

/// What the robot touches, people and then walls, and whether it drives into it. `lasts` says that a contact with walls
/// goes on.
fn contacts(truth: &Truth, lasts: bool) -> Vec<(Contact, bool)> {
    let time = truth.time;
    let mut contacts: Vec<(Contact, bool)> = truth
        .touching
        .iter()
        .map(|&Touch { id, robot_speed, person_speed }| {
            let contact = Contact { time, person: Some(id), robot_speed, person_speed };
            (contact, truth.twist.v.abs() > COLLISION_SPEED)
        })
        .collect();
    if truth.wall_impact.is_some() || lasts {
        let robot_speed = truth.wall_impact.unwrap_or_default();
        let contact = Contact { time, person: None, robot_speed, person_speed: 0.0 };
        contacts.push((contact, robot_speed > COLLISION_SPEED));
    }
    contacts
}

#[cfg(test)]
mod tests;
