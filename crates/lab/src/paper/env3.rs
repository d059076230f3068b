//! Environment 3: a trade-fair hall, crossed from the foyer in the east to the desks in the west.
//!
//! ```text
//!     people                               \
//!         . . . open floor, bare . . . .     \
//!    #  .                                .    \  glass
//!    # goal - - forum (crowd) - - - bare - - start
//!    #  .      \\           \\           .     |
//!    #    . . . . free aisle . . . . .        |
//!    #     //   //   //   //   //   //       /
//!    ############################
//! ```
//! The direct way is bare, then crosses the forum. The free aisle runs between two rows of stands, set
//! slantwise like fish bones, so that the laser meets faces across the aisle as well as along it. The open
//! floor to the north is free and bare.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::sin_cos;

use super::layout::{Layout, Polygon, polygon, rectangle};
use super::plan::Plan;
use super::scene::{Route, RouteKind};

/// The floor plan and the task of one scenario. A laser of 7 m (`s1`, `sx`) wants the start farther from
/// the stands than one of 5 m; `sx` has the longest way, `s3` two stands more. The direct way passes the
/// northern row on the forum's side; from where the first stands give the robot its place, the shortest
/// way on is the aisle.
pub(super) fn plan(scenario: &str) -> Plan {
    let (start, goal) = match scenario {
        "s1" => (Point2::new(36.0, 13.0), Point2::new(2.0, 10.6)),
        "sx" => (Point2::new(37.75, 12.4), Point2::new(2.0, 10.6)),
        _ => (Point2::new(37.0, 10.7), Point2::new(2.0, 11.2)),
    };
    let route = |kind, via: &[(f64, f64)]| {
        let via = via.iter().map(|&(x, y)| Point2::new(x, y));
        Route { kind, way: std::iter::once(start).chain(via).chain([goal]).collect() }
    };
    Plan {
        layout: Layout { outline: outline(), masonry: masonry(), furniture: furniture(scenario == "s3") },
        start: Pose2::new(start.x, start.y, std::f64::consts::PI),
        goal,
        routes: vec![
            route(RouteKind::Bare, &[(26.0, 19.5), (12.0, 19.5)]),
            route(RouteKind::Crowded, &[(20.0, 12.2), (10.0, 12.2)]),
            route(RouteKind::Landmarks, &[(31.5, 7.8), (24.0, 6.7), (12.0, 6.7), (4.5, 9.3)]),
        ],
        crowds: vec![
            (rectangle(6.0, 10.5, 20.0, 16.8), 0.44),
            // the forum's open side: the shortest way along the aisle grazes it
            (rectangle(11.4, 9.2, 18.6, 14.5), 0.24),
            (rectangle(3.0, 22.1, 25.0, 25.9), 0.32),
        ],
        description: "Trade fair: the direct way is bare, then crosses the forum; a free aisle leads \
                      between the stands.",
    }
}

/// The floor: the south-east and the north are glass.
fn outline() -> Polygon {
    polygon(&[
        (-1.5, 1.0),
        (33.0, 1.0),
        (36.0, 4.0),
        (41.5, 6.5),
        (41.5, 17.0),
        (30.0, 26.0),
        (-1.5, 26.0),
        (-1.5, 24.0),
        (-4.5, 24.0),
        (-4.5, 20.0),
        (-1.5, 20.0),
    ])
}

fn masonry() -> Vec<Polygon> {
    vec![
        // the hall's back, and the west end with the goal
        rectangle(-4.0, -1.0, 27.0, 1.2),
        rectangle(-4.0, -1.0, -1.3, 17.5),
    ]
}

/// A stand: `length` by `depth` metres around (`x`, `y`), turned by `degrees`.
fn stand(x: f64, y: f64, (length, depth): (f64, f64), degrees: f64) -> Polygon {
    let (s, c) = sin_cos(degrees.to_radians());
    [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
        .map(|(u, v)| Point2::new(x + c * u * length - s * v * depth, y + s * u * length + c * v * depth))
        .to_vec()
}

fn furniture(more: bool) -> Vec<Polygon> {
    // Turned so that who comes from the east sees two faces of each.
    let south = |(x, y): (f64, f64)| stand(x, y, (2.5, 1.1), 20.0);
    let north = |x: f64| stand(x, 10.8, (2.0, 0.8), -20.0);
    let mut things = vec![
        // the first to be seen from the foyer
        stand(34.35, 4.0, (1.5, 1.5), 45.0),
        // where the aisle ends
        stand(7.2, 10.2, (0.8, 0.8), 45.0),
        stand(2.8, 6.6, (1.5, 1.5), -10.0),
        // desks by the goal
        stand(-0.2, 11.6, (0.8, 0.8), 45.0),
        stand(-0.2, 14.6, (2.0, 0.9), -20.0),
        stand(-0.2, 8.8, (2.0, 0.9), 20.0),
    ];
    let row = [(29.8, 4.1), (26.1, 4.2), (22.4, 4.2), (18.4, 4.2), (14.4, 4.2), (10.4, 4.2), (6.4, 4.6)];
    things.extend(row.map(south));
    things.extend([19.4, 10.6].map(north));
    if more {
        things.push(stand(4.0, 2.4, (2.0, 1.0), 20.0));
        things.push(stand(12.8, 2.2, (2.0, 1.0), 20.0));
    }
    things
}
