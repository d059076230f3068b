//! Halls like those of `open`, as many as tests over places need: each of another shape, with columns, kiosks and
//! benches.

use curionav_crowdsim::World;
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::random::{Rng, rng, uniform};

use super::files::{File, between, map_files, rectangle, scenario_file};
use super::rooms::drawn_task;
use crate::paper::{Layout, Polygon, bounds, rounded};

const FOLDER: &str = "halls";
/// Halls: a test over places needs some two dozen.
const HALLS: u64 = 25;
/// Side of a cell, metres.
const CELL_M: f64 = 0.1;
/// Random streams of the halls, others than those of the other suites.
const STREAM: u64 = 0x4841_4c4c;
/// Least and greatest length of a task, metres.
const LENGTHS_M: [f64; 2] = [16.0, 36.0];
/// Way that is left between things and along walls, metres.
const AISLE_M: f64 = 1.8;
/// Seeds for which the people are looked at.
const SEEDS: [u64; 10] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10];
/// Draws before a hall counts as too small.
const DRAWS: u64 = 50;

pub(super) fn files() -> anyhow::Result<Vec<File>> {
    let mut files = Vec::new();
    for k in 0..HALLS {
        files.extend(hall(k)?);
    }
    Ok(files)
}

/// Map and scenario of the k-th hall.
fn hall(k: u64) -> anyhow::Result<Vec<File>> {
    let name = format!("hall-{:02}", k + 1);
    let map_file = format!("maps/{name}.yaml");
    for draw in 0..DRAWS {
        let mut random = rng(STREAM + k, draw);
        let map = StaticMap::new(layout(&mut random).grid(CELL_M, None)?);
        let Ok(mut scenario) = drawn_task(&name, &map_file, &map, LENGTHS_M, k, &mut random) else {
            continue;
        };
        // Shorter than the halls are wide, so that landmarks get out of sight.
        scenario.laser.range_max = rounded(between(5.0, 8.0, &mut random));
        if SEEDS.into_iter().all(|seed| World::new(&scenario, map.clone(), Vec::new(), seed).is_ok()) {
            let mut files = map_files(FOLDER, &name, &map.grid)?.to_vec();
            files.push(scenario_file(FOLDER, &scenario)?);
            return Ok(files);
        }
    }
    anyhow::bail!("{name} has no room for its task in {DRAWS} draws")
}

/// A hall with what stands in it.
fn layout(random: &mut Rng) -> Layout {
    let width = rounded(between(24.0, 38.0, random));
    let depth = rounded(between(18.0, 28.0, random));
    let outline = outline(width, depth, random);
    let mut furniture = Vec::new();
    if uniform(random) < 0.5 {
        furniture.extend(columns(width, depth, random));
    }
    let things = 2 + (9.0 * uniform(random)) as usize;
    for _ in 0..things {
        let thing = thing(width, depth, random);
        if furniture.iter().all(|other| are_apart(&thing, other)) {
            furniture.push(thing);
        }
    }
    Layout { outline, masonry: vec![rectangle(-1.0, -1.0, width + 1.0, depth + 1.0)], furniture }
}

/// A rectangle of which up to two corners are cut out, as of halls with wings.
fn outline(width: f64, depth: f64, random: &mut Rng) -> Polygon {
    let corner = |x: f64, y: f64| Point2::new(rounded(x), rounded(y));
    let cut_x = width * between(0.2, 0.45, random);
    let cut_y = depth * between(0.2, 0.45, random);
    let south_east = uniform(random) < 0.5;
    let north_west = uniform(random) < 0.5;
    let mut corners = vec![corner(0.0, 0.0)];
    if south_east {
        corners.extend([corner(width - cut_x, 0.0), corner(width - cut_x, cut_y), corner(width, cut_y)]);
    } else {
        corners.push(corner(width, 0.0));
    }
    corners.push(corner(width, depth));
    if north_west {
        corners.extend([corner(cut_x, depth), corner(cut_x, depth - cut_y), corner(0.0, depth - cut_y)]);
    } else {
        corners.push(corner(0.0, depth));
    }
    corners
}

/// Square columns on a grid.
fn columns(width: f64, depth: f64, random: &mut Rng) -> Vec<Polygon> {
    let side = rounded(between(0.4, 0.8, random));
    let apart_x = between(5.0, 9.0, random);
    let apart_y = between(5.0, 9.0, random);
    let mut columns = Vec::new();
    let mut x = apart_x;
    while x < width - 2.0 {
        let mut y = apart_y;
        while y < depth - 2.0 {
            columns.push(rectangle(rounded(x), rounded(y), rounded(x + side), rounded(y + side)));
            y += apart_y;
        }
        x += apart_x;
    }
    columns
}

/// A kiosk or a bench, anywhere.
fn thing(width: f64, depth: f64, random: &mut Rng) -> Polygon {
    let is_kiosk = uniform(random) < 0.4;
    let long = if is_kiosk { between(2.0, 4.0, random) } else { between(1.2, 2.4, random) };
    let wide = if is_kiosk { between(1.5, 3.0, random) } else { 0.6 };
    let is_turned = uniform(random) < 0.5;
    let size_x = if is_turned { wide } else { long };
    let size_y = if is_turned { long } else { wide };
    let x = between(AISLE_M, width - AISLE_M - size_x, random);
    let y = between(AISLE_M, depth - AISLE_M - size_y, random);
    rectangle(rounded(x), rounded(y), rounded(x + size_x), rounded(y + size_y))
}

/// Whether two rectangles leave an aisle between them.
fn are_apart(a: &Polygon, b: &Polygon) -> bool {
    let (a_low, a_high) = bounds(a);
    let (b_low, b_high) = bounds(b);
    a_high.x + AISLE_M <= b_low.x
        || b_high.x + AISLE_M <= a_low.x
        || a_high.y + AISLE_M <= b_low.y
        || b_high.y + AISLE_M <= a_low.y
}
