//! The recorded track of a run: what the social measures are computed from.

use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::numerics::sin_cos;
use curionav_planning::scene::People;

use crate::world::Truth;

/// One tick of a track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackRow {
    /// Seconds since the start.
    pub time: f64,
    /// The robot's pose, map frame.
    pub pose: Pose2,
    /// Its speed and turn rate.
    pub twist: Twist,
    /// Between the centres of the robot and the nearest person, metres; infinite with nobody there.
    pub person_distance: f64,
    /// Between their bodies, metres; negative for an overlap.
    pub person_gap: f64,
    /// Between the robot's body and the nearest wall, metres.
    pub wall_gap: f64,
    /// Whether a wall stopped the robot.
    pub hit_wall: bool,
    /// Seconds until it and somebody touch if all go on as they go; infinite when nobody will.
    pub time_to_collision: f64,
}

/// The true track of one run, a row a tick.
#[derive(Debug, Clone, Default)]
pub struct Track {
    rows: Vec<TrackRow>,
}

impl Track {
    /// One tick: the truth and everybody there; `robot_radius` is metres.
    pub fn record(&mut self, truth: &Truth, people: &People, robot_radius: f64) {
        let times = (0..people.len()).map(|i| time_to_collision(truth, people, i, robot_radius));
        self.rows.push(TrackRow {
            time: truth.time,
            pose: truth.pose,
            twist: truth.twist,
            person_distance: truth.person_distance,
            person_gap: truth.person_clearance,
            wall_gap: truth.wall_clearance,
            hit_wall: truth.wall_impact.is_some(),
            time_to_collision: times.fold(f64::INFINITY, f64::min),
        });
    }

    /// All rows so far.
    pub fn rows(&self) -> &[TrackRow] {
        &self.rows
    }
}

impl From<Vec<TrackRow>> for Track {
    fn from(rows: Vec<TrackRow>) -> Self {
        Self { rows }
    }
}

/// When two discs at constant velocities first touch: |p + v t| = R. 0 if they do already.
fn time_to_collision(truth: &Truth, people: &People, i: usize, robot_radius: f64) -> f64 {
    let (sine, cosine) = sin_cos(truth.pose.heading);
    let (px, py) = (people.x[i] - truth.pose.x, people.y[i] - truth.pose.y);
    let (vx, vy) = (people.vx[i] - truth.twist.v * cosine, people.vy[i] - truth.twist.v * sine);
    let reach = robot_radius + people.radius;
    let beyond = px * px + py * py - reach * reach;
    if beyond <= 0.0 {
        return 0.0;
    }
    let (closing, speed_squared) = (-(px * vx + py * vy), vx * vx + vy * vy);
    let discriminant = closing * closing - speed_squared * beyond;
    if closing <= 0.0 || discriminant < 0.0 {
        return f64::INFINITY;
    }
    // the smaller root, in the form that loses no digits
    beyond / (closing + discriminant.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(x: f64, y: f64, vx: f64, vy: f64) -> f64 {
        let truth = Truth {
            tick: 0,
            time: 0.0,
            pose: Pose2::default(),
            twist: Twist { v: 1.0, omega: 0.0 },
            person_distance: 0.0,
            person_clearance: 0.0,
            wall_clearance: 3.0,
            wall_impact: None,
            touching: Vec::new(),
        };
        let people = People { id: vec![7], x: vec![x], y: vec![y], vx: vec![vx], vy: vec![vy], radius: 0.2 };
        let mut track = Track::default();
        track.record(&truth, &people, 0.3);
        track.rows()[0].time_to_collision
    }

    #[test]
    fn time_to_collision_is_that_of_two_discs() {
        // 4.5 m ahead, towards each other at 1 + 1 m/s, radii 0.3 + 0.2: (4.5 - 0.5) / 2 = 2 s
        assert!((seconds(4.5, 0.0, -1.0, 0.0) - 2.0).abs() < 1e-12);
        // standing 0.3 m aside: touched where 0.5^2 = 0.3^2 + 0.4^2, 2.4 - 0.4 = 2 m ahead
        assert!((seconds(2.4, 0.3, 0.0, 0.0) - 2.0).abs() < 1e-12);
        // 0.6 m aside, as fast as the robot, going away, behind: never
        for never in [(2.0, 0.6, 0.0, 0.0), (2.0, 0.0, 1.0, 0.0), (2.0, 0.0, 1.5, 0.0), (-2.0, 0.0, 0.0, 0.0)]
        {
            assert_eq!(seconds(never.0, never.1, never.2, never.3), f64::INFINITY);
        }
        assert_eq!(seconds(0.3, 0.3, 5.0, 0.0), 0.0); // overlap
    }
}
