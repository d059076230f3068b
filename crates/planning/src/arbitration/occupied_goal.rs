//! Waiting for a goal at which people stand.

use std::f64::consts::TAU;

use crate::collision::CollisionChecker;
use crate::geometry::{Point2, Pose2};
use crate::motion::RobotModel;
use crate::numerics::sin_cos;
use crate::scene::Scene;
use crate::trajectory::Trajectory;

/// The robot waits with so much room between it and those who stand at its goal, metres: where personal distance ends
/// and social distance begins (Hall, 1966).
const POLITE: f64 = 1.2;
/// Nearer to an occupied goal the robot stops instead of being led away from it, metres: it does not circle.
const STAYS_WITHIN: f64 = 3.0;
/// Metres by which what a robot before its goal would drive must end nearer for it to go on.
const NEARER: f64 = 0.05;
/// Who is faster does not stand, m/s: what a tracker takes for the speed of people who stand stays below it.
const STANDS: f64 = 0.3;
/// Directions from the goal in which places are tried.
const DIRECTIONS: u32 = 16;
/// Their distances from the goal, as shares of the distance at which the robot has arrived.
const SHARES: [f64; 3] = [0.0, 0.5, 0.95];

/// A goal, and who is around.
pub(super) struct Goal<'a> {
    pub(super) at: Point2,
    /// Nearer to it the robot has arrived, metres.
    pub(super) tolerance: f64,
    pub(super) scene: &'a Scene,
    pub(super) robot: &'a RobotModel,
    pub(super) checker: &'a CollisionChecker<'a>,
}

/// Whether the robot is to wait instead of driving `trajectory`: people leave it no room at its goal, and it would come
/// too near to one of them before it stands, or would be led away.
pub(super) fn is_awaited(goal: &Goal<'_>, trajectory: &Trajectory) -> bool {
    let Goal { at: goal, tolerance, scene, robot, checker } = *goal;
    let Scene { people, belief, .. } = scene;
    let here = belief.pose;
    let to_go = here.position().distance(goal);
    let body = robot.radius() + people.radius;
    // Where people stand, and how far the robot's centre has to keep from there.
    let stand = (0..people.len()).filter(|i| people.speed(*i) < STANDS);
    let discs = stand.map(|i| (people.position(i), body + checker.gap_asked(i, 0.0)));
    let at_goal: Vec<(Point2, f64)> =
        discs.filter(|(p, radius)| p.distance(goal) < radius + tolerance).collect();
    let near = body + POLITE + robot.stopping_distance(belief.twist.v);
    let is_near = at_goal.iter().any(|(p, _)| p.distance(here.position()) < near);
    let end = trajectory.states().poses(0..trajectory.len()).last();
    let ends_nearer = end.is_none_or(|end| is_nearer(end, goal, to_go));
    if !is_near && (ends_nearer || to_go > STAYS_WITHIN) {
        return false;
    }
    // A place without room beside walls is not taken by people.
    let mut places = places(goal, tolerance).filter(|p| checker.wall_clear(Pose2 { x: p.x, y: p.y, ..here }));
    let is_taken = |place: Point2| at_goal.iter().any(|(p, radius)| p.distance(place) < *radius);
    places.next().is_some_and(is_taken) && places.all(is_taken)
}

/// Whether a way that ends at `end` brings a robot nearer that has `to_go` metres left.
pub(super) fn is_nearer(end: Pose2, goal: Point2, to_go: f64) -> bool {
    end.position().distance(goal) < to_go - NEARER
}

/// The goal, and places around it.
fn places(goal: Point2, tolerance: f64) -> impl Iterator<Item = Point2> {
    SHARES.into_iter().flat_map(move |share| {
        let metres = share * tolerance;
        let directions = if metres > 0.0 { DIRECTIONS } else { 1 };
        (0..directions).map(move |k| {
            let (sin, cos) = sin_cos(TAU * f64::from(k) / f64::from(directions));
            Point2::new(goal.x + metres * cos, goal.y + metres * sin)
        })
    })
}
