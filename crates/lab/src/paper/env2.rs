//! Environment 2: the entrance hall of a hospital, crossed from west to east.
//!
//! ```text
//!        \_ward_/\_ward_/\_ward_/\_ward_/\_ward_/\_
//!          .  .  .  .  free lane  .  .  .  .      \_
//!       /                desks ####  ###    .  .    |#
//!   start - - - bare - - - waiting room (crowd) - goal
//!       \                                     .     |#
//!          .  .  .  open hall, bare  .  .  .  .
//!                     pharmacy (the other people) ###
//! ```
//! The direct way is bare, then crosses the waiting room. The free lane follows the bay windows of the
//! wards, whose slanting sides hold the pose along the lane as well as across; desks part it from the
//! waiting room. The hall to the south is free and bare.

use curionav_planning::geometry::{Point2, Pose2};

use super::layout::{Layout, Polygon, polygon, rectangle};
use super::plan::Plan;
use super::scene::{Route, RouteKind};

const GOAL: Point2 = Point2::new(27.6, 12.4);

/// Bay windows from east to west: between which x, and how far south they reach, metres.
const BAYS: [(f64, f64, f64); 8] = [
    (25.1, 26.2, 16.6),
    (22.8, 23.6, 17.2),
    (20.2, 21.0, 18.2),
    (17.2, 18.0, 18.3),
    (14.2, 15.0, 18.3),
    (11.4, 12.1, 18.9),
    (8.5, 9.2, 19.05),
    (5.5, 6.3, 19.1),
];

/// The floor plan and the task of one scenario. The laser of `s1` sees 6 m, so its start has to lie
/// farther from the wards than with the 4 m of the others; `s3` has more furniture.
pub(super) fn plan(scenario: &str) -> Plan {
    let start = if scenario == "s1" { Pose2::new(2.0, 13.0, 0.35) } else { Pose2::new(2.8, 14.88, 0.25) };
    let route = |kind, via: &[(f64, f64)]| {
        let via = via.iter().map(|&(x, y)| Point2::new(x, y));
        Route { kind, way: std::iter::once(start.position()).chain(via).chain([GOAL]).collect() }
    };
    Plan {
        layout: Layout { outline: outline(), masonry: masonry(), furniture: furniture(scenario == "s3") },
        start,
        goal: GOAL,
        routes: vec![
            route(RouteKind::Bare, &[(8.5, 8.3), (19.5, 5.6)]),
            route(RouteKind::Crowded, &[(12.0, 12.6), (20.0, 12.4)]),
            route(RouteKind::Landmarks, &[(6.5, 16.4), (21.0, 16.6)]),
        ],
        crowds: vec![
            (rectangle(11.6, 10.8, 22.5, 14.2), 0.4),
            (rectangle(11.0, 8.0, 22.0, 12.4), 0.25),
            (rectangle(13.0, -0.6, 29.0, 3.4), 0.35),
        ],
        description: "Hospital entrance: the direct way is bare, then crosses the waiting room; a free lane \
                      follows the wards.",
    }
}

/// The floor; its north edge is the bay windows of the wards, with slanting sides.
fn outline() -> Polygon {
    let mut corners = polygon(&[(0.4, 21.2), (0.4, -1.5), (29.6, -1.5)]);
    let mut east = Point2::new(29.6, 16.8);
    corners.push(east);
    for (from, to, y) in BAYS {
        corners.push(Point2::new(0.5 * (east.x + to), 0.5 * (east.y + y) + 0.5 * (east.x - to)));
        corners.extend([Point2::new(to, y), Point2::new(from, y)]);
        east = Point2::new(from, y);
    }
    corners.push(Point2::new(east.x - 2.1, 21.2));
    corners
}

/// A square planter, turned so that its corners point along the axes, `radius` metres from its middle.
fn planter(x: f64, y: f64, radius: f64) -> Polygon {
    polygon(&[(x + radius, y), (x, y + radius), (x - radius, y), (x, y - radius)])
}

fn masonry() -> Vec<Polygon> {
    vec![
        // wards
        rectangle(3.3, 16.0, 34.0, 24.0),
        // east wall
        rectangle(29.0, 9.0, 34.0, 24.0),
        // pharmacy
        rectangle(24.0, -4.0, 34.0, 3.0),
    ]
}

fn furniture(more: bool) -> Vec<Polygon> {
    let mut things = vec![
        // desks between lane and waiting room
        rectangle(16.4, 14.4, 18.6, 15.1),
        rectangle(19.8, 14.3, 21.3, 14.8),
        // by the goal
        planter(28.4, 14.3, 0.8),
        rectangle(28.2, 9.3, 29.6, 10.0),
    ];
    if more {
        things.push(rectangle(14.6, 10.8, 15.8, 11.8));
        things.push(rectangle(18.8, 10.6, 19.8, 11.6));
    }
    things
}
