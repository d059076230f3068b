//! Whether a timed trajectory stays clear of walls and of people as they are forecast to move.
//!
//! One checker serves a whole cycle: generators drop colliding candidates with it, and arbitration asks
//! it once more before a decision goes out. Both see the same margins.

use crate::footprint::FootprintShape;
use crate::forecast::ForecastParams;
use crate::geometry::{Point2, Pose2, closest_approach, wrap_angle};
use crate::motion::{Footprint, RobotModel};
use crate::occupancy::StaticMap;
use crate::scene::{People, Scene};
use crate::states::States;

mod params;

pub use params::CollisionParams;

/// What a trajectory runs into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Obstacle {
    /// The static map: occupied or unknown cells, or its edge.
    Wall,
    /// The person with this id.
    Person(u32),
}

/// The first place where a trajectory comes too near to something.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collision {
    /// Start of the offending segment, seconds after the scene's stamp: until then the trajectory is free.
    pub time: f64,
    /// What is in the way.
    pub with: Obstacle,
}

/// Checks poses and timed trajectories of one scene, discs and polygons by their exact shape.
///
/// Where the robot already stands closer than its margins ask, they shrink to the present distance
/// (less a little slack) but not below bodily contact, so that margins alone can never freeze the robot.
/// If the estimate even says contact, turning on the spot and going away stay legal and nothing else does.
#[derive(Debug, Clone)]
pub struct CollisionChecker<'a> {
    map: &'a StaticMap,
    people: &'a People,
    forecast: ForecastParams,
    params: CollisionParams,
    shape: FootprintShape,
    /// Whether the shape differs from its circumscribed disc.
    polygon: bool,
    start: Pose2,
    /// Variance of the robot's position, m2.
    belief_variance: f64,
    /// Room between the shape and walls asked of every pose, metres; negative if it touches one already.
    wall_room: f64,
    /// Distance of the centre from walls now, between cells, metres, if the robot is said to touch one.
    touching_wall: Option<f64>,
    /// Most that may be asked of the gap between shape and each person, metres.
    person_cap: Vec<f64>,
    /// How long each person walks on, seconds ([`CollisionParams::people_stop`]).
    walks_for: Vec<f64>,
    /// Whether the robot has been in one place for [`CollisionParams::tight_after`].
    tight: bool,
    /// Seconds of a trajectory for which people are in its way.
    people_horizon: f64,
}

impl<'a> CollisionChecker<'a> {
    /// How much nearer than now the robot may come to something inside its margin, metres: what
    /// the first moments of turning away need.
    pub const SLACK: f64 = 0.02;
    /// The same for walls, which stay where they are. A robot that may come a little nearer in each cycle ends in
    /// contact.
    pub const WALL_SLACK: f64 = 0.005;
    /// Gap where that ends, metres: what is tracked is not tracked exactly.
    pub const GUARD: f64 = 0.03;
    /// Greatest distance between wall checks along a segment, metres.
    pub const WALL_SPACING: f64 = 0.1;
    /// Between two moments at which a person may stop before the robot, seconds.
    const STOP_STEP: f64 = 0.1;
    /// How hard people brake who stop for a robot, m/s2: comfortably.
    const PERSON_BRAKING: f64 = 1.0;
    /// Poses at which a polygon passing close to a person is checked within one segment.
    const POLYGON_POSES: u32 = 6;

    /// A checker for `robot` in `scene`, whose people move as `forecast` says.
    pub fn new(
        map: &'a StaticMap,
        robot: &RobotModel,
        scene: &'a Scene,
        forecast: ForecastParams,
        params: &CollisionParams,
    ) -> Self {
        let start = scene.belief.pose;
        let sigma = scene.belief.position_sigma();
        let inflation = (params.sigma_factor * sigma).min(params.max_inflation);
        let tight = params.tight_after > 0.0 && scene.in_place >= params.tight_after;
        let mut wall_room = params.wall_margin + inflation;
        if tight {
            wall_room = wall_room.min(Self::GUARD);
        }
        if let Some(passage) = scene.passage {
            wall_room = wall_room.min((0.5 * passage).max(Self::GUARD));
        }
        let mut checker = Self {
            map,
            people: &scene.people,
            forecast,
            params: *params,
            shape: FootprintShape::from(&robot.footprint),
            polygon: matches!(robot.footprint, Footprint::Polygon { .. }),
            start,
            belief_variance: sigma * sigma,
            wall_room,
            touching_wall: None,
            person_cap: Vec::new(),
            walks_for: vec![f64::INFINITY; scene.people.len()],
            tight,
            people_horizon: params.people_horizon(scene.impatient),
        };
        checker.relax_walls();
        checker.person_cap = (0..scene.people.len())
            .map(|i| {
                let now = checker.gap(start, scene.people.position(i));
                if now > Self::GUARD { (now - Self::SLACK).max(Self::GUARD) } else { now - 1e-3 }
            })
            .collect();
        if params.people_stop {
            checker.walks_for = (0..scene.people.len()).map(|i| checker.until_stopped(i)).collect();
        }
        checker
    }

    /// Seconds until the i-th person has come as near to the robot as it may, if the robot stays where it is. Infinite
    /// for those who pass, and for those who come too fast to stop before it: for these it is time to stand.
    fn until_stopped(&self, i: usize) -> f64 {
        let start = self.start.position();
        let steps = (self.params.horizon / Self::STOP_STEP).ceil() as usize;
        let least = 0.5 * self.people.speed(i) / Self::PERSON_BRAKING;
        for step in 0..steps {
            let t = step as f64 * Self::STOP_STEP;
            let position = self.people.position_after(i, t);
            let approach =
                (start.x - position.x) * self.people.vx[i] + (start.y - position.y) * self.people.vy[i];
            if approach <= 0.0 {
                return f64::INFINITY;
            }
            let next = t + Self::STOP_STEP;
            if self.gap(self.start, self.people.position_after(i, next)) < self.gap_asked(i, next) {
                return if t < least { f64::INFINITY } else { t };
            }
        }
        f64::INFINITY
    }

    /// Lowers what is asked of walls to what the robot has now.
    fn relax_walls(&mut self) {
        if self.wall_clear(self.start) {
            return;
        }
        let clearance = self.map.to_obstacle.exact_clearance(&self.map.grid, self.start.position());
        let now = clearance - self.shape.circumscribed_radius() - Self::WALL_SLACK;
        self.wall_room = if self.polygon { 0.0 } else { now.clamp(0.0, self.wall_room) };
        if !self.wall_clear(self.start) {
            self.touching_wall =
                Some(self.map.to_obstacle.between_cells(&self.map.grid, self.start.position()));
            self.wall_room = now;
        }
    }

    /// Whether the robot standing at `pose` keeps its distance from walls.
    pub fn wall_clear(&self, pose: Pose2) -> bool {
        self.wall_spare(pose) >= 0.0
    }

    /// How far the robot may move from `pose` in any way before its distance from walls has to be
    /// looked at again, metres; negative when it is too near already.
    pub fn wall_spare(&self, pose: Pose2) -> f64 {
        let enough = self.shape.circumscribed_radius() + self.wall_room;
        let spare = self.map.to_obstacle.clearance(&self.map.grid, pose.position(), enough) - enough;
        let close = spare < 0.0 && self.polygon && self.touching_wall.is_none();
        if close && !self.shape.comes_within(pose, self.map, self.wall_room) { 0.0 } else { spare }
    }

    /// Room to walls beyond what is asked at `pose`, metres, between the cells of the map: it grows with every step
    /// away from a wall, to a cell's exactness. Negative where the pose is not clear.
    pub fn wall_gap(&self, pose: Pose2) -> f64 {
        let spare = self.wall_spare(pose);
        if spare < 0.0 {
            return spare;
        }
        let grid = &self.map.grid;
        let to_wall = self.map.to_obstacle.between_cells(grid, pose.position()) - 0.5 * grid.resolution();
        (to_wall - self.shape.circumscribed_radius() - self.wall_room).max(0.0)
    }

    /// Radius of a disc around `p` in which every pose is known to keep its distance from walls, metres; none if
    /// negative.
    pub fn wall_free(&self, p: Point2) -> f64 {
        let grid = &self.map.grid;
        let clearance = self.map.to_obstacle.least_clearance(grid, p);
        let spare = clearance - self.shape.circumscribed_radius() - self.wall_room;
        // The field holds single precision, and nothing beyond the map.
        (spare - 1e-6 * (1.0 + clearance)).min(grid.to_edge(p))
    }

    /// Whether the straight way from `from` to `to` keeps the distance from walls, `from` excluded.
    pub fn segment_wall_clear(&self, from: Pose2, to: Pose2) -> bool {
        self.continue_wall_clear(&mut (from.position(), -1.0), from, to)
    }

    /// The same for one segment after another: `free` is a disc that is known to be free.
    pub(crate) fn continue_wall_clear(&self, free: &mut (Point2, f64), from: Pose2, to: Pose2) -> bool {
        let holds = |&(centre, radius): &(Point2, f64)| {
            let reached = |p: Pose2| radius > 0.0 && centre.distance_squared(p.position()) <= radius * radius;
            reached(from) && reached(to)
        };
        if holds(free) {
            return true;
        }
        *free = (from.position(), self.wall_free(from.position()));
        if holds(free) {
            return true;
        }
        let turn = if self.polygon { wrap_angle(to.heading - from.heading).abs() } else { 0.0 };
        let travel = from.position().distance(to.position()) + self.shape.circumscribed_radius() * turn;
        let pieces = (travel / Self::WALL_SPACING).ceil().max(1.0);
        (1..=pieces as usize).all(|k| self.wall_clear(from.toward(to, k as f64 / pieces)))
    }

    /// Gap asked between the robot's shape and the i-th person `t` seconds from now, metres, before it is
    /// relaxed for people who are already nearer.
    pub fn person_gap(&self, i: usize, t: f64) -> f64 {
        if self.tight && self.stands(i) {
            return Self::GUARD;
        }
        let t = self.ahead(i, t);
        let forecast = self.forecast.variance_at(self.people.speed(i), t) + self.people.variance_after(i, t);
        let sigma = (self.belief_variance + forecast).sqrt();
        self.params.person_margin + (self.params.sigma_factor * sigma).min(self.params.max_inflation)
    }

    /// Whether the i-th person stands ([`CollisionParams::standing`]).
    fn stands(&self, i: usize) -> bool {
        self.people.speed(i) < self.params.standing
    }

    /// How far ahead the i-th person is forecast, to know where the person is `t` seconds from now, seconds.
    fn ahead(&self, i: usize, t: f64) -> f64 {
        if self.stands(i) { 0.0 } else { t.min(self.walks_for[i]) }
    }

    /// Where the i-th person is forecast to be `t` seconds from now.
    fn person_at(&self, i: usize, t: f64) -> Point2 {
        self.people.position_after(i, self.ahead(i, t))
    }

    /// How far the i-th person is forecast to walk in `t` seconds, metres.
    fn walked(&self, i: usize, t: f64) -> f64 {
        self.people.speed(i) * self.ahead(i, t)
    }

    /// Whether the gap to the i-th person can become too narrow within `t` seconds, in which the robot gets no farther
    /// than `reach` metres.
    fn comes_near(&self, i: usize, t: f64, reach: f64) -> bool {
        let least = self.people.position(i).distance(self.start.position()) - reach - self.walked(i, t);
        let body = self.shape.circumscribed_radius() + self.people.radius;
        let widest = self.person_gap(i, t).max(Self::GUARD);
        least <= body + widest + TrajectoryChecker::ROUNDING
    }

    /// Where people are now, and how far the robot's centre has to keep from them there by its circumscribed disc,
    /// metres. People who are too far away to be met within `reach` metres are left out.
    pub(crate) fn discs(&self, reach: f64) -> impl Iterator<Item = (Point2, f64)> {
        let here = self.start.position();
        let body = self.shape.circumscribed_radius() + self.people.radius;
        let disc = move |i| (self.people.position(i), body + self.gap_asked(i, 0.0));
        let comes_near = move |&(p, radius): &(Point2, f64)| p.distance(here) < reach + radius;
        (0..self.people.len()).map(disc).filter(comes_near)
    }

    /// Gap asked between the robot's shape and the i-th person `t` seconds from now, metres.
    pub fn gap_asked(&self, i: usize, t: f64) -> f64 {
        self.person_gap(i, t).min(self.person_cap[i])
    }

    /// The same checks for many trajectories of up to `steps` states, `dt` seconds apart, that stay within `reach`
    /// metres of where the robot is.
    pub fn over(&self, steps: usize, dt: f64, reach: f64) -> TrajectoryChecker<'_> {
        let checked = steps.min(steps_in(self.params.horizon, dt));
        TrajectoryChecker::new(self, checked, dt, reach)
    }

    /// [`TrajectoryChecker::first_collision`] of one trajectory.
    pub fn first_collision(&self, states: &States, dt: f64) -> Option<Collision> {
        self.over(states.len(), dt, f64::INFINITY).first_collision(states.poses(0..states.len()))
    }

    /// Whether the robot ends a trajectory at `end` no farther from the wall that it touches now.
    ///
    /// It has to go away from the wall, not along it: or every cycle could go one cell nearer. A turn on the spot goes
    /// nowhere, and a robot that faces the wall needs it to get away at all.
    fn stays_at_wall(&self, end: Point2) -> bool {
        let moves = end != self.start.position();
        let distance = || self.map.to_obstacle.between_cells(&self.map.grid, end);
        self.touching_wall.is_some_and(|now| moves && distance() <= now)
    }

    /// Whether a person comes too near who moves from `p` to `q` while the robot moves from `from` to `to`. At least
    /// `asked` metres are asked of the gap.
    fn meets(&self, (from, to): (Pose2, Pose2), (p, q): (Point2, Point2), asked: f64) -> bool {
        let start = Point2::new(from.x - p.x, from.y - p.y);
        let end = Point2::new(to.x - q.x, to.y - q.y);
        let nearest = closest_approach(start, end) - self.people.radius;
        if nearest - self.shape.circumscribed_radius() >= asked {
            return false;
        }
        !self.polygon
            || nearest - self.shape.inscribed_radius() < asked
            || (1..=Self::POLYGON_POSES).any(|k| {
                let s = f64::from(k) / f64::from(Self::POLYGON_POSES);
                self.gap(from.toward(to, s), p.toward(q, s)) < asked
            })
    }

    /// Distance between the robot's shape at `pose` and a person's disc, metres, negative if they overlap.
    fn gap(&self, pose: Pose2, person: Point2) -> f64 {
        let distance = if self.polygon {
            self.shape.distance_to_point(pose, person)
        } else {
            pose.position().distance(person) - self.shape.circumscribed_radius()
        };
        distance - self.people.radius
    }
}

/// Steps of `dt` seconds in a horizon. One of whole steps may exceed them by its rounding.
fn steps_in(horizon: f64, dt: f64) -> usize {
    (horizon / dt - 1e-9).ceil() as usize
}

/// A [`CollisionChecker`] with everything computed that depends on people and time alone, so that most people are
/// passed over with one comparison.
#[derive(Debug, Clone)]
pub struct TrajectoryChecker<'a> {
    checker: &'a CollisionChecker<'a>,
    /// States that are checked, and those of them for which people are in the way.
    steps: usize,
    people_steps: usize,
    dt: f64,
    /// Those who can come near, as indices into the scene's people.
    near: Vec<usize>,
    /// Where they are at the start of each step and at the end of the last, `[step, person]`.
    at: Vec<Point2>,
    /// Gap asked of each during each step, metres, `[step, person]`.
    asked: Vec<f64>,
    /// Distance that each moves in one step, metres.
    stride: Vec<f64>,
}

impl<'a> TrajectoryChecker<'a> {
    /// Rounding of distances, metres, and more.
    const ROUNDING: f64 = 1e-6;

    fn new(checker: &'a CollisionChecker<'a>, steps: usize, dt: f64, reach: f64) -> Self {
        let people_steps = steps.min(steps_in(checker.people_horizon, dt));
        let end = people_steps as f64 * dt;
        let near: Vec<usize> =
            (0..checker.people.len()).filter(|&i| checker.comes_near(i, end, reach)).collect();
        let mut at = Vec::with_capacity((people_steps + 1) * near.len());
        for step in 0..=people_steps {
            at.extend(near.iter().map(|&i| checker.person_at(i, step as f64 * dt)));
        }
        let mut asked = Vec::with_capacity(people_steps * near.len());
        for step in 0..people_steps {
            asked.extend(near.iter().map(|&i| checker.gap_asked(i, step as f64 * dt + dt)));
        }
        let stride = near.iter().map(|&i| checker.walked(i, dt)).collect();
        Self { checker, steps, people_steps, dt, near, at, asked, stride }
    }

    /// The first collision of the trajectory that starts at the belief's pose at time 0 and is at pose k of `poses` at
    /// `(k + 1) * dt`; between poses robot and people move in straight lines, checked continuously. Nothing is checked
    /// beyond the last one, where the robot stands, nor beyond [`CollisionParams::horizon`].
    pub fn first_collision(&self, poses: impl ExactSizeIterator<Item = Pose2>) -> Option<Collision> {
        let checker = self.checker;
        let poses = poses.take(self.steps);
        let last = poses.len().saturating_sub(1);
        let mut from = checker.start;
        let mut free = (Point2::default(), -1.0);
        for (step, to) in poses.enumerate() {
            let with = if !checker.continue_wall_clear(&mut free, from, to) {
                Some(Obstacle::Wall)
            } else if step < self.people_steps {
                self.person_hit(from, to, step).map(Obstacle::Person)
            } else {
                None
            };
            if let Some(with) = with {
                return Some(Collision { time: step as f64 * self.dt, with });
            }
            from = to;
        }
        let collision = Collision { time: last as f64 * self.dt, with: Obstacle::Wall };
        checker.stays_at_wall(from.position()).then_some(collision)
    }

    /// Id of the first person who comes too near while the robot moves from `from` to `to` during a step.
    fn person_hit(&self, from: Pose2, to: Pose2, step: usize) -> Option<u32> {
        let people = self.checker.people;
        let count = self.near.len();
        let (now, next) = self.at[step * count..(step + 2) * count].split_at(count);
        let asked = &self.asked[step * count..(step + 1) * count];
        let body = self.checker.shape.circumscribed_radius() + people.radius;
        let body = body + from.position().distance(to.position()) + Self::ROUNDING;
        let hit = (0..count).find(|&j| {
            // Neither moves farther than its stride from where they are now.
            let far = body + asked[j] + self.stride[j];
            now[j].distance_squared(from.position()) <= far * far
                && self.checker.meets((from, to), (now[j], next[j]), asked[j])
        })?;
        Some(people.id[self.near[hit]])
    }

    /// Whether the robot could still stop short of all people if they stopped walking right now: driving the
    /// first state's segment and then `braking` more metres along the trajectory touches none of them where they
    /// are. A polygon counts as its circumscribed disc. Without [`CollisionParams::stop_short`] it is always said to.
    ///
    /// A forecast lets a robot follow on a person's heels; this keeps the braking distance.
    pub fn stops_short(&self, poses: impl Iterator<Item = Pose2>, braking: f64) -> bool {
        let checker = self.checker;
        if !checker.params.stop_short {
            return true;
        }
        let contact = checker.shape.circumscribed_radius() + checker.people.radius;
        let mut from = checker.start.position();
        let mut left = f64::INFINITY;
        for (k, pose) in poses.enumerate() {
            let mut to = pose.position();
            let length = from.distance(to);
            if length > left {
                to = from.toward(to, left / length);
            }
            let far = contact + CollisionChecker::GUARD + length + Self::ROUNDING;
            let touches = self.near.iter().zip(&self.at).any(|(&i, p)| {
                let start = Point2::new(from.x - p.x, from.y - p.y);
                let end = Point2::new(to.x - p.x, to.y - p.y);
                p.distance_squared(from) <= far * far
                    && closest_approach(start, end) - contact
                        < CollisionChecker::GUARD.min(checker.person_cap[i])
            });
            if touches {
                return false;
            }
            left = if k == 0 { braking } else { left - length };
            if left <= 0.0 {
                return true;
            }
            from = to;
        }
        true
    }
}

#[cfg(test)]
#[path = "collision_tests.rs"]
mod tests;
