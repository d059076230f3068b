//! What is derived from a map: distance from walls, distance to go, and what a scan tells about the pose. Drawn with
//! characters, one per 0.5 m, the lighter the less.
//!
//! `cargo run --release -p curionav-planning --example map_fields`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use std::sync::Arc;

use curionav_planning::evaluation::cpc::InformationParams;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
use curionav_planning::sensor::LaserModel;
use curionav_planning::terms::DerivedFields;

const SHADES: &[u8] = b".:-=+*%@";

/// One line per 0.5 m of the map, top first: `#` where it is occupied, else the shade of `value` between 0 and `most`,
/// and a blank where there is none.
fn drawing(map: &StaticMap, most: f64, value: impl Fn(Point2) -> f64) -> Vec<String> {
    let grid = &map.grid;
    let spot = |column: usize, row: usize| {
        let p = grid.centre(column, row);
        let shade = value(p) / most * SHADES.len() as f64;
        if map.to_occupied.at(grid, p) < 0.25 {
            '#'
        } else if shade.is_finite() {
            char::from(SHADES[(shade as usize).min(SHADES.len() - 1)])
        } else {
            ' '
        }
    };
    let line = |row: usize| (0..grid.width()).step_by(5).map(|column| spot(column, row)).collect();
    (0..grid.height()).step_by(5).rev().map(line).collect()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Two rooms of 15 m by 12 m with a door between them. Cells of 0.1 m.
    let solid = |c: usize, r: usize| {
        c < 3 || r < 3 || c >= 297 || r >= 117 || (c.abs_diff(150) < 3 && r.abs_diff(90) > 8)
    };
    let cells = (0..300 * 120).map(|i| if solid(i % 300, i / 300) { 100 } else { 0 }).collect();
    let map = Arc::new(StaticMap::new(OccupancyGrid::new(300, 120, 0.1, Pose2::default(), cells)?));

    println!("Distance from what a robot must not touch, up to 4 m:");
    let clearance = |p| map.to_obstacle.at(&map.grid, p);
    drawing(&map, 4.0, clearance).iter().for_each(|line| println!("{line}"));

    let goal = Point2::new(27.0, 3.0);
    let to_go = map.geodesic(goal, 0.3)?;
    println!("Distance to go to the lower right corner, up to 32 m:");
    drawing(&map, 32.0, |p| to_go.at(p)).iter().for_each(|line| println!("{line}"));

    let information = map.information(LaserModel::default(), &InformationParams::default())?;
    let seen = |p: Point2| {
        let j = information.at(Pose2::new(p.x, p.y, 0.0));
        (j[(0, 0)] + j[(1, 1)]).sqrt()
    };
    println!("What a scan to the right tells about the position, up to 1 / 0.1 m:");
    drawing(&map, 10.0, seen).iter().for_each(|line| println!("{line}"));

    let (behind, before) = (to_go.at(Point2::new(3.0, 3.0)), to_go.at(Point2::new(18.0, 3.0)));
    println!("{before:.1} m to go from this side of the wall, {behind:.1} m from the other.");
    if seen(Point2::new(26.0, 6.0)) <= seen(Point2::new(20.0, 6.0)) {
        return Err("near walls a scan should tell more".into());
    }
    Ok(())
}

#[test]
fn near_walls_a_scan_tells_more() {
    main().unwrap();
}
