//! Patrols: straight ways that people of a crowd walk back and forth (methods 2.3, A31).

use anyhow::Context;
use curionav_planning::geometry::Point2;
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::{Cell, StaticMap};
use curionav_planning::random::{Rng, uniform};

use super::layout::bounds;
use curionav_crowdsim::scenario::{WalkMode, Walker, contains};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PatrolParams {
    /// Least and greatest length, metres.
    length: (f64, f64),
    /// Least distance to the ways that are to stay free of people, metres.
    away: f64,
}

impl Default for PatrolParams {
    fn default() -> Self {
        Self { length: (4.0, 10.0), away: 2.6 }
    }
}

/// Least and greatest speed, m/s.
const SPEED: (f64, f64) = (0.3, 1.0);
/// Least distance to walls and to unknown space, metres.
const CLEARANCE_M: f64 = 0.35;
/// Least distance between two people at the beginning, metres.
const APART_M: f64 = 0.8;
/// Share of people who rest at the ends of their patrol.
const RESTING: f64 = 0.33;
/// How long they rest, seconds.
const PAUSE_S: (f64, f64) = (0.5, 6.0);
/// Most draws for one walker: a crowd zone takes one draw in about twenty.
const MAX_DRAWS: usize = 20_000;

/// Draws `count` walkers whose patrols stay inside `zone` and `away` from the `kept_free` points; appends
/// them to `walkers`.
pub(super) fn draw(
    walkers: &mut Vec<Walker>,
    count: usize,
    zone: &[Point2],
    kept_free: &[Point2],
    map: &StaticMap,
    params: &PatrolParams,
    rng: &mut Rng,
) -> anyhow::Result<()> {
    let (least, most) = bounds(zone);
    let between = |rng: &mut Rng, (a, b): (f64, f64)| a + (b - a) * uniform(rng);
    for _ in 0..count {
        let mut found = None;
        for _ in 0..MAX_DRAWS {
            let middle = Point2::new(between(rng, (least.x, most.x)), between(rng, (least.y, most.y)));
            let (s, c) = sin_cos(std::f64::consts::TAU * uniform(rng));
            let half = 0.5 * between(rng, params.length);
            let end = |sign: f64| {
                Point2::new(rounded(middle.x + sign * half * c), rounded(middle.y + sign * half * s))
            };
            let route = vec![end(-1.0), end(1.0)];
            let length = route[0].distance(route[1]);
            let rests = uniform(rng) < RESTING;
            let walker = Walker {
                speed: rounded(between(rng, SPEED)),
                mode: WalkMode::BackAndForth,
                start_offset: rounded(between(rng, (0.0, 1.99 * length))),
                pause_s: if rests { rounded(between(rng, PAUSE_S)) } else { 0.0 },
                heedless: false,
                route,
            };
            let fits = points(&walker.route, 0.05).iter().all(|&p| {
                contains(zone, p)
                    && map.grid.at(p) == Cell::Free
                    && map.to_obstacle.at(&map.grid, p) >= CLEARANCE_M
                    && kept_free.iter().all(|k| k.distance(p) >= params.away)
            });
            let begin = at_start(&walker);
            if fits && walkers.iter().all(|w| at_start(w).distance(begin) >= APART_M) {
                found = Some(walker);
                break;
            }
        }
        let placed = walkers.len();
        walkers.push(found.with_context(|| {
            format!("no room for another patrol after {placed} people; enlarge the crowd zones")
        })?);
    }
    Ok(())
}

/// Where a walker of a straight patrol is at t = 0.
fn at_start(walker: &Walker) -> Point2 {
    let a = walker.route[0];
    let b = walker.route[1];
    let length = a.distance(b);
    let along =
        if walker.start_offset <= length { walker.start_offset } else { 2.0 * length - walker.start_offset };
    a.toward(b, along / length)
}

/// Points along a polyline, at most `spacing` apart, ends and corners included.
pub(super) fn points(polyline: &[Point2], spacing: f64) -> Vec<Point2> {
    let mut all: Vec<Point2> = polyline.first().copied().into_iter().collect();
    for pair in polyline.windows(2) {
        let a = pair[0];
        let b = pair[1];
        let steps = (a.distance(b) / spacing).ceil().max(1.0) as usize;
        all.extend((1..=steps).map(|k| a.toward(b, k as f64 / steps as f64)));
    }
    all
}

/// To the millimetre: what a scenario file prints.
pub(crate) fn rounded(metres: f64) -> f64 {
    (metres * 1000.0).round() / 1000.0
}
