//! Environment 1: a mall whose shops stand in an arc, walked from the south to the north.
//!
//! ```text
//!   seats (some of              goal  |_#
//!   the people)            .   |  . \ _#
//!                        .     |    . ]#
//!     open hall,       .   food court # . ]#
//!     bare             .    (crowd)   # . ]# shops
//!                       .      |     . ]#
//!                         .    |   . /#
//!                             start
//! ```
//! The direct way is the chord of the arc: bare floor, then the food court. The free lane follows the shop
//! fronts, whose piers stand forward; kiosks part it from the food court. The hall to the west is free and
//! bare.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::sin_cos;

use super::layout::{Layout, Polygon, polygon, rectangle};
use super::plan::Plan;
use super::scene::{Route, RouteKind};

const START: Point2 = Point2::new(8.0, 3.0);
const GOAL: Point2 = Point2::new(8.0, 35.3);
/// Middle and radius of the circle that the free lane follows, metres; it passes through start and goal.
const MIDDLE: Point2 = Point2::new(-18.05, 19.15);
const RADIUS: f64 = 30.65;

/// The point `outward` metres outside the lane, `degrees` north of the middle of the arc.
fn arc(degrees: f64, outward: f64) -> Point2 {
    let (s, c) = sin_cos(degrees.to_radians());
    Point2::new(MIDDLE.x + (RADIUS + outward) * c, MIDDLE.y + (RADIUS + outward) * s)
}

/// A thing that follows the arc.
fn kiosk(from: f64, to: f64, inner: f64, outer: f64) -> Polygon {
    vec![arc(from, inner), arc(to, inner), arc(to, outer), arc(from, outer)]
}

/// The floor plan and the task of one scenario. `s1` has a map of its own: a larger hall, one kiosk less.
pub(super) fn plan(scenario: &str) -> Plan {
    let first = scenario == "s1";
    let route = |kind, via: Vec<Point2>| Route {
        kind,
        way: std::iter::once(START).chain(via).chain([GOAL]).collect(),
    };
    let lane = [-22.0, -14.0, -7.0, 0.0, 7.0, 14.0, 22.0].map(|degrees| arc(degrees, 0.0));
    Plan {
        layout: Layout { outline: outline(first), masonry: masonry(), furniture: furniture(first) },
        start: Pose2::new(START.x, START.y, std::f64::consts::FRAC_PI_2),
        goal: GOAL,
        routes: vec![
            route(RouteKind::Bare, vec![Point2::new(2.0, 11.5), Point2::new(0.7, 24.5)]),
            route(RouteKind::Crowded, vec![Point2::new(7.9, 16.0), Point2::new(7.9, 26.0)]),
            route(RouteKind::Landmarks, lane.to_vec()),
        ],
        crowds: vec![
            (rectangle(4.8, 10.8, 9.4, 17.5), 0.27),
            (rectangle(3.6, 14.5, 9.6, 28.0), 0.43),
            (rectangle(-6.3, 27.5, 0.0, 37.0), 0.3),
        ],
        description: "Mall: the direct way is bare, then crosses the food court; a free lane follows the arc \
                      of shops.",
    }
}

/// The floor; its east edge is the shop fronts, with a pier between every two. The piers' flanks hold the
/// pose along the lane.
fn outline(first: bool) -> Polygon {
    let west = if first { -7.65 } else { -6.55 };
    let mut corners = polygon(&[(west, 0.8), (16.0, 0.8), (16.0, 6.6)]);
    let mut front = |from: f64, to: f64, outward: f64| {
        corners.extend([arc(from, outward), arc(0.5 * (from + to), outward), arc(to, outward)]);
    };
    front(-22.4, -16.0, 3.0);
    for k in 0..5 {
        let pier = -16.0 + 8.2 * f64::from(k);
        let width = if k == 4 { 3.4 } else { 6.0 };
        front(pier, pier + 2.2, 1.8);
        front(pier + 2.2, pier + 2.2 + width, 3.6);
    }
    front(22.4, 24.6, 1.8);
    corners.extend(polygon(&[(12.4, 33.2), (12.4, 34.4), (11.0, 34.4), (10.8, 37.8), (west, 37.8)]));
    corners
}

fn masonry() -> Vec<Polygon> {
    let mut shops: Polygon = (-5..=6).map(|k| arc(4.5 * f64::from(k), 1.0)).collect();
    shops.extend(polygon(&[(10.0, 37.0), (10.0, 42.0), (30.0, 42.0), (30.0, 4.5), (14.0, 4.5)]));
    vec![shops, rectangle(4.0, 36.0, 30.0, 42.0)]
}

fn furniture(first: bool) -> Vec<Polygon> {
    let mut things = vec![
        // kiosks between lane and food court
        kiosk(-4.5, -0.5, -2.8, -1.6),
        kiosk(4.5, 8.5, -2.8, -1.6),
        kiosk(12.5, 16.0, -2.8, -1.6),
        // counters in the food court
        rectangle(6.4, 19.6, 7.2, 21.0),
        rectangle(6.5, 25.0, 7.2, 26.4),
        // information desk by the goal
        rectangle(5.0, 35.1, 5.9, 36.5),
    ];
    // rows of seats in the north-west
    for row in 0..4 {
        let y = 29.0 + 2.2 * f64::from(row);
        things.push(rectangle(-6.0, y, -4.0, y + 0.5));
    }
    if !first {
        things.push(rectangle(8.6, 22.0, 9.6, 23.4));
    }
    things
}
