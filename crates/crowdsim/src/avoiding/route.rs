//! Where a person wants to go: from corner to corner of its route.

use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::{Cell, StaticMap};

use crate::scenario::{WalkMode, Walker};
use crate::walkers::WalkerState;

/// A corner that came no nearer for this long is given up for the next one, seconds: a person stands there.
const PATIENCE_S: f64 = 8.0;
/// Coming nearer by less than this is none, metres.
const NEARER_M: f64 = 0.1;
/// Times the stretch from the foot of the leg to its corner is halved to find a point in sight.
const HALVINGS: i32 = 4;

#[derive(Debug, Clone)]
pub(crate) struct Route {
    /// Corners of a full cycle; the first again at the end when it repeats.
    corners: Vec<Point2>,
    /// The leg being walked leads from this corner to the next.
    leg: usize,
    /// Corner with a rest before the last, if there is one.
    turn: Option<usize>,
    repeats: bool,
    arrived: bool,
    pause_s: f64,
    resting: f64,
    /// Least distance to the corner so far and seconds since it fell.
    nearest: f64,
    stuck_s: f64,
}

impl Route {
    /// The route at t = 0 and where on it the person is.
    pub(crate) fn new(walker: &Walker) -> (Self, Point2) {
        let script = WalkerState::new(walker);
        let back_and_forth = walker.mode == WalkMode::BackAndForth;
        let position = script.position();
        let route = Self {
            leg: script.leg(),
            turn: back_and_forth.then(|| walker.route.len() - 1),
            repeats: back_and_forth || walker.mode == WalkMode::Loop,
            arrived: walker.mode == WalkMode::Stand,
            pause_s: walker.pause_s,
            resting: 0.0,
            nearest: f64::INFINITY,
            stuck_s: 0.0,
            corners: script.corners,
        };
        (route, position)
    }

    /// The corner the person walks to, or stays at; none while it rests.
    pub(crate) fn corner(&self) -> Option<Point2> {
        (self.resting <= 0.0).then(|| self.corners[(self.leg + 1).min(self.corners.len() - 1)])
    }

    /// The point to walk to from `at`: the corner if it is in sight past walls, else the farthest point of
    /// the leg that is. Legs keep clear of walls, so a person pushed aside finds back to its own.
    pub(crate) fn aim(&self, at: Point2, map: &StaticMap, radius: f64) -> Option<Point2> {
        let corner = self.corner()?;
        if in_sight(map, at, corner, radius) {
            return Some(corner);
        }
        let from = self.corners[self.leg.min(self.corners.len() - 1)];
        let dx = corner.x - from.x;
        let dy = corner.y - from.y;
        let length_squared = dx * dx + dy * dy;
        let along = (at.x - from.x) * dx + (at.y - from.y) * dy;
        let foot = if length_squared > 0.0 { (along / length_squared).clamp(0.0, 1.0) } else { 1.0 };
        let in_view = (1..=HALVINGS)
            .map(|k| foot + (1.0 - foot) * 0.5_f64.powi(k))
            .map(|s| Point2::new(from.x + s * dx, from.y + s * dy))
            .find(|p| in_sight(map, at, *p, radius));
        Some(in_view.unwrap_or(Point2::new(from.x + foot * dx, from.y + foot * dy)))
    }

    /// `dt` seconds have passed and the person is at `at`: rests, turns to the next corner when this one is
    /// nearer than `goal_radius`, or when it is out of reach.
    pub(crate) fn advance(&mut self, at: Point2, goal_radius: f64, dt: f64) {
        if self.resting > 0.0 {
            self.resting -= dt;
            return;
        }
        let Some(corner) = self.corner().filter(|_| !self.arrived) else { return };
        let distance = at.distance(corner);
        if distance < self.nearest - NEARER_M {
            self.nearest = distance;
            self.stuck_s = 0.0;
        } else {
            self.stuck_s += dt;
        }
        if distance < goal_radius || self.stuck_s > PATIENCE_S {
            self.turn_to_next();
        }
    }

    fn turn_to_next(&mut self) {
        self.nearest = f64::INFINITY;
        self.stuck_s = 0.0;
        let reached = self.leg + 1;
        let ends = reached + 1 >= self.corners.len();
        if ends && !self.repeats {
            self.arrived = true;
            return;
        }
        if ends || self.turn == Some(reached) {
            self.resting = self.pause_s;
        }
        self.leg = if ends { 0 } else { reached };
    }
}

/// Whether a body of this radius can go straight from one point to the other, judged as the scenario's
/// check judges routes.
pub(crate) fn in_sight(map: &StaticMap, from: Point2, to: Point2, radius: f64) -> bool {
    let length = from.distance(to);
    let least = 0.5 * map.grid.resolution();
    let mut s = 0.0;
    loop {
        let share = if length > 0.0 { (s / length).min(1.0) } else { 1.0 };
        let p = from.toward(to, share);
        let distance = map.to_obstacle.at(&map.grid, p);
        // A person who was pushed nearer to a wall than that may look out from there.
        let leaving = s < radius && map.grid.at(p) == Cell::Free;
        if distance < radius && !leaving {
            return false;
        }
        if s >= length {
            return true;
        }
        // No wall is nearer than the field says, half a cell aside.
        s += (distance - radius - 2.0 * least).max(least);
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Pose2;
    use curionav_planning::occupancy::OccupancyGrid;

    use super::*;

    fn route(mode: WalkMode, start_offset: f64, pause_s: f64) -> Route {
        let route = vec![Point2::new(1.0, 1.0), Point2::new(5.0, 1.0), Point2::new(5.0, 4.0)];
        Route::new(&Walker { route, speed: 1.0, mode, start_offset, pause_s, heedless: false }).0
    }

    /// Corners in the order they are walked to, each reached at once.
    fn order(mut route: Route, corners: usize) -> Vec<(f64, f64)> {
        let mut visited = Vec::new();
        while visited.len() < corners {
            let corner = route.corner().unwrap();
            visited.push((corner.x, corner.y));
            route.advance(corner, 0.3, 0.1);
        }
        visited
    }

    #[test]
    fn corners_come_in_the_order_of_the_mode() {
        let (a, b, c) = ((1.0, 1.0), (5.0, 1.0), (5.0, 4.0));
        assert_eq!(order(route(WalkMode::BackAndForth, 0.0, 0.0), 6), [b, c, b, a, b, c]);
        assert_eq!(order(route(WalkMode::Loop, 0.0, 0.0), 5), [b, c, a, b, c]);
        assert_eq!(order(route(WalkMode::Once, 0.0, 0.0), 4), [b, c, c, c]);
        // 5 m along: 1 m into the second leg
        assert_eq!(order(route(WalkMode::Once, 5.0, 0.0), 2), [c, c]);
    }

    #[test]
    fn it_rests_at_the_ends_only() {
        let mut r = route(WalkMode::BackAndForth, 0.0, 0.25);
        r.advance(Point2::new(5.0, 1.0), 0.3, 0.1);
        assert!(r.corner().is_some());
        r.advance(Point2::new(5.0, 4.0), 0.3, 0.1);
        for _ in 0..3 {
            assert_eq!(r.corner(), None);
            r.advance(Point2::new(5.0, 4.0), 0.3, 0.1);
        }
        assert_eq!(r.corner(), Some(Point2::new(5.0, 1.0)));
    }

    #[test]
    fn a_corner_out_of_reach_is_given_up() {
        let mut r = route(WalkMode::BackAndForth, 0.0, 0.0);
        for _ in 0..90 {
            r.advance(Point2::new(4.0, 1.0), 0.3, 0.1);
        }
        assert_eq!(r.corner(), Some(Point2::new(5.0, 4.0)));
    }

    #[test]
    fn a_corner_behind_a_wall_is_reached_by_the_leg() {
        // a wall along y = 2 from x = 0 to 4, above the first leg
        let wall = |i: usize| (i / 60) == 20 && (i % 60) < 40;
        let cells = (0..3600).map(|i| if wall(i) { 100 } else { 0 }).collect();
        let map = StaticMap::new(OccupancyGrid::new(60, 60, 0.1, Pose2::default(), cells).unwrap());
        let r = route(WalkMode::Once, 0.0, 0.0);
        let corner = Point2::new(5.0, 1.0);
        assert_eq!(r.aim(Point2::new(2.0, 1.5), &map, 0.25), Some(corner));
        // pushed to the far side of the wall: the corner is not in sight, the nearest points neither
        let aim = r.aim(Point2::new(4.7, 2.6), &map, 0.25).unwrap();
        assert_eq!(aim, corner);
        let aim = r.aim(Point2::new(3.0, 2.6), &map, 0.25).unwrap();
        assert!((aim.y - 1.0).abs() < 1e-12 && aim.x < 5.0);
    }
}
