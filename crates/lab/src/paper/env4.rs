//! Environment 4: a terminal hall crossed from corner to corner.
//!
//! ```text
//!   north-west: lounge, 7 people        north-east: goal among desks
//!        open hall, bare            /  . crowd: check-in, 20 people
//!                               /  . row of counters
//!                           /  . free lane
//!        start, bare    /  stepped shop fronts
//! ```
//! The direct way first crosses bare floor, then the crowd. The lane between the shop fronts and the row
//! of counters is free and never without a landmark; the open hall to the north-west is free and bare.

use curionav_planning::geometry::{Point2, Pose2};

use super::layout::{Layout, Polygon, polygon, rectangle};
use super::plan::Plan;
use super::scene::{Route, RouteKind};

const START: Point2 = Point2::new(4.2, 4.2);

/// The point `ahead` metres along the diagonal from the start and `right` metres to its right.
fn along(ahead: f64, right: f64) -> Point2 {
    let s = std::f64::consts::FRAC_1_SQRT_2;
    Point2::new(START.x + s * (ahead + right), START.y + s * (ahead - right))
}

/// A counter parallel to the diagonal: from `ahead` to `ahead + length`, `right` to `right + depth`.
fn counter(ahead: f64, length: f64, right: f64, depth: f64) -> Polygon {
    vec![
        along(ahead, right),
        along(ahead + length, right),
        along(ahead + length, right + depth),
        along(ahead, right + depth),
    ]
}

/// A piece of the check-in hall, `from` to `to` metres ahead.
fn crowd(from: f64, to: f64, right: f64) -> Polygon {
    vec![along(from, right), along(to, right), along(to, -5.8), along(from, -5.8)]
}

/// A pillar: an octagon of `radius` metres.
fn pillar(x: f64, y: f64, radius: f64) -> Polygon {
    let d = radius * std::f64::consts::FRAC_1_SQRT_2;
    polygon(&[
        (x + radius, y),
        (x + d, y + d),
        (x, y + radius),
        (x - d, y + d),
        (x - radius, y),
        (x - d, y - d),
        (x, y - radius),
        (x + d, y - d),
    ])
}

/// The floor plan and the task of one scenario. `s1` and `s3` share a map on which the first two shop
/// fronts stand back: the laser of `s1` sees 7 m, and only so its start lies out of reach of them.
/// `s3` with its 5 m starts nearer to them.
pub(super) fn plan(scenario: &str) -> Plan {
    let goal = Point2::new(30.575, 30.575);
    let set_back = scenario != "s2";
    let start = if scenario == "s3" { along(0.8, 1.7) } else { START };
    let route = |kind, via: &[(f64, f64)]| {
        let via = via.iter().map(|&(ahead, right)| along(ahead, right));
        Route { kind, way: std::iter::once(start).chain(via).chain([goal]).collect() }
    };
    let right = if set_back { 1.1 } else { 0.45 };
    let lane: &[(f64, f64)] = match scenario {
        "s1" => &[(6.0, 3.2), (13.0, 3.7), (29.8, 3.7)],
        "s2" => &[(6.0, 2.6), (13.0, 3.7), (29.8, 3.7)],
        _ => &[(5.0, 3.8), (9.5, 4.0), (13.0, 3.7), (29.8, 3.7)],
    };
    let bare: &[(f64, f64)] = match scenario {
        "s1" => &[(9.0, -9.0), (27.0, -10.6), (34.0, -1.5)],
        _ => &[(10.5, -8.0), (26.0, -9.4), (34.0, -1.3)],
    };
    Plan {
        layout: Layout {
            outline: outline(set_back),
            masonry: masonry(set_back),
            furniture: furniture(set_back),
        },
        start: Pose2::new(start.x, start.y, std::f64::consts::FRAC_PI_4),
        goal,
        routes: vec![
            route(RouteKind::Bare, bare),
            route(RouteKind::Crowded, &[(18.0, -0.2), (28.0, -0.6), (31.5, -1.1)]),
            route(RouteKind::Landmarks, lane),
        ],
        crowds: vec![
            // before and behind the desks of the check-in; the two overlap
            (crowd(16.4, 24.2, right), 10.0 / 27.0),
            (crowd(21.5, 30.2, right), 10.0 / 27.0),
            (rectangle(-0.9, 26.5, 7.0, 34.8), 7.0 / 27.0),
        ],
        description: "Terminal hall, 27 people: the direct way is bare, then crowded; a free lane \
                      follows the shop fronts.",
    }
}

/// The floor: shop fronts step up along the diagonal in the south-east, the rest is open hall.
fn outline(set_back: bool) -> Polygon {
    let first_fronts: &[(f64, f64)] = if set_back {
        &[(11.7, 0.0), (11.7, 1.35), (15.2, 1.35), (15.2, 4.6), (17.2, 7.4), (17.2, 8.8), (18.0, 9.6)]
    } else {
        &[(10.16, 0.0), (10.16, 2.9), (13.7, 2.9), (13.7, 6.1), (16.2, 6.1), (17.2, 7.1), (17.2, 9.6)]
    };
    let corners = [
        (20.1, 9.6),
        (20.1, 12.5),
        (21.2, 12.5),
        (23.6, 14.9),
        (23.6, 16.2),
        (27.1, 16.2),
        (27.1, 19.9),
        (30.0, 19.9),
        (30.0, 23.6),
        (33.8, 25.0),
        (33.8, 33.8),
        (26.0, 33.8),
        (26.0, 35.6),
        (-1.3, 35.6),
        (-1.3, 0.0),
    ];
    polygon(&[first_fronts, &corners].concat())
}

fn masonry(set_back: bool) -> Vec<Polygon> {
    vec![
        // shops in the south-east
        rectangle(if set_back { 11.65 } else { 10.1 }, -3.0, 36.0, 25.2),
        // the goal's corner
        rectangle(27.5, 25.0, 36.0, 36.0),
        // lounge
        rectangle(-4.5, 27.0, 0.1, 38.0),
        rectangle(-4.5, 35.5, 6.5, 38.0),
    ]
}

fn furniture(set_back: bool) -> Vec<Polygon> {
    // Nearer to the row on the map of 7 m range, so that the open hall stays bare.
    let (desks, depth) = if set_back { ((-3.2, -3.2), 1.6) } else { ((-4.2, -3.7), 2.1) };
    let mut things = vec![
        // the row between lane and crowd
        counter(16.3, 3.0, 0.85, 0.95),
        counter(21.9, 3.1, 0.85, 1.0),
        pillar(24.57, 23.73, 0.4),
        // check-in: two desks and pillars
        counter(20.6, 1.0, desks.0, depth),
        counter(25.6, 1.0, desks.1, depth),
        pillar(15.7, 18.1, 0.4),
        pillar(23.0, 25.9, 0.4),
        pillar(26.55, 26.4, 0.4),
        // desks by the goal
        rectangle(31.9, 27.0, 33.0, 29.0),
        rectangle(28.0, 32.6, 30.2, 33.3),
        pillar(27.6, 31.4, 0.35),
    ];
    if set_back {
        things.push(pillar(14.0, 3.3, 0.5));
    }
    // rows of seats in the lounge
    for row in 0..4 {
        let y = 28.0 + 1.9 * f64::from(row);
        things.push(rectangle(0.2, y, 3.2, y + 0.5));
    }
    things
}
