//! What the beams of a laser say about the cells of a map (Moravec and Elfes, "High resolution maps from wide angle
//! sonar", 1985; with log-odds as in Thrun, Burgard and Fox, Probabilistic Robotics, 2005, table 9.1).

use curionav_planning::beam::Beam;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::{MAX_CELLS, OccupancyGrid};
use rustc_hash::FxHashMap;

use crate::robot_log::Reading;

/// What a beam that ends in a cell adds to its log-odds of being occupied: a probability of 0.7.
const HIT: f32 = 0.85;
/// What a beam that passes a cell adds: a probability of 0.4.
const PASSED: f32 = -0.4;
/// The log-odds stay within these bounds, so that a door that was opened becomes free.
const MOST: f32 = 3.5;
/// From these log-odds on a cell is occupied: map_server's 0.65.
const OCCUPIED: f32 = 0.62;
/// Up to these it is free: map_server's 0.196.
const FREE: f32 = -1.41;
/// Empty cells around what was seen.
const MARGIN: i64 = 4;

/// Column and row from the origin of the frame of the poses.
type Place = (i64, i64);

/// Log-odds of the cells that beams have told of.
#[derive(Default)]
pub(super) struct Evidence {
    log_odds: FxHashMap<Place, f32>,
    /// Of the scan at hand: whether a beam ended in the cell, or else passed it.
    seen: FxHashMap<Place, bool>,
}

impl Evidence {
    /// Adds one scan, taken with the robot at `pose`. A cell counts once: several beams of one scan that pass it tell
    /// the same, and one that ends in it outweighs those that graze it.
    pub(super) fn add(&mut self, reading: &Reading, pose: Pose2, resolution: f64) {
        self.seen.clear();
        let laser = pose.compose(reading.laser.robot_from_laser);
        for (beam, &range) in reading.ranges.iter().enumerate() {
            // A beam without an echo tells nothing here: glass and what is black send none.
            let Beam::Obstacle(metres) = Beam::of(range, 0.0, reading.laser.range_max) else { continue };
            let (sin, cos) = sin_cos(laser.heading + reading.laser.bearing(beam as u32));
            let end = Point2::new(laser.x + metres * cos, laser.y + metres * sin);
            for place in cells_between(laser.position(), end, resolution) {
                self.seen.entry(place).or_insert(false);
            }
            self.seen.insert(place(end, resolution), true);
        }
        for (&place, &is_hit) in &self.seen {
            let odds = self.log_odds.entry(place).or_default();
            *odds = (*odds + if is_hit { HIT } else { PASSED }).clamp(-MOST, MOST);
        }
    }

    /// Makes the cells free whose centres are at most `radius` metres from a place.
    pub(super) fn clear(&mut self, centre: Point2, radius: f64, resolution: f64) {
        let reach = (radius / resolution).ceil() as i64;
        let (column, row) = place(centre, resolution);
        for place in (column - reach..=column + reach)
            .flat_map(|column| (row - reach..=row + reach).map(move |row| (column, row)))
        {
            let x = (place.0 as f64 + 0.5) * resolution;
            let y = (place.1 as f64 + 0.5) * resolution;
            if Point2::new(x, y).distance(centre) <= radius {
                self.log_odds.insert(place, -MOST);
            }
        }
    }

    /// The map of what was seen: free, occupied, and elsewhere unknown.
    ///
    /// # Errors
    /// If nothing was seen, or it would have more cells than a map may.
    pub(super) fn grid(&self, resolution: f64) -> anyhow::Result<OccupancyGrid> {
        let columns = self.log_odds.keys().map(|place| place.0);
        let rows = self.log_odds.keys().map(|place| place.1);
        let bounds = columns.clone().min().zip(columns.max()).zip(rows.clone().min().zip(rows.max()));
        let Some(((left, right), (bottom, top))) = bounds else {
            anyhow::bail!("it has no poses to build a map from: --reference takes them from another log");
        };
        let width = (right - left + 1 + 2 * MARGIN) as usize;
        let height = (top - bottom + 1 + 2 * MARGIN) as usize;
        let corner = (left - MARGIN, bottom - MARGIN);
        anyhow::ensure!(
            width.saturating_mul(height) <= MAX_CELLS,
            "its map would have {width} x {height} cells, more than {}: choose a coarser --resolution",
            MAX_CELLS
        );
        let mut cells = vec![-1; width * height];
        for (&(column, row), &odds) in &self.log_odds {
            let index = (row - corner.1) as usize * width + (column - corner.0) as usize;
            cells[index] = match odds {
                odds if odds >= OCCUPIED => 100,
                odds if odds <= FREE => 0,
                _ => -1,
            };
        }
        let origin = Pose2::new(corner.0 as f64 * resolution, corner.1 as f64 * resolution, 0.0);
        Ok(OccupancyGrid::new(width, height, resolution, origin, cells)?)
    }
}

fn place(p: Point2, resolution: f64) -> Place {
    ((p.x / resolution).floor() as i64, (p.y / resolution).floor() as i64)
}

/// The cells between two points, without that of the second: in steps of half a cell.
fn cells_between(from: Point2, to: Point2, resolution: f64) -> impl Iterator<Item = Place> {
    let steps = (2.0 * from.distance(to) / resolution).ceil().max(1.0) as usize;
    let last = place(to, resolution);
    (0..steps)
        .map(move |k| place(from.toward(to, k as f64 / steps as f64), resolution))
        .filter(move |place| *place != last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cells_of_a_beam_are_those_it_passes() {
        let places: Vec<Place> =
            cells_between(Point2::new(0.05, 0.05), Point2::new(0.45, 0.05), 0.1).collect();
        let mut unique = places.clone();
        unique.dedup();
        assert_eq!(unique, [(0, 0), (1, 0), (2, 0), (3, 0)]);
        let diagonal: Vec<Place> =
            cells_between(Point2::new(-0.05, -0.05), Point2::new(0.15, 0.15), 0.1).collect();
        assert!(diagonal.contains(&(-1, -1)) && diagonal.contains(&(0, 0)) && !diagonal.contains(&(1, 1)));
    }

    #[test]
    fn what_is_cleared_is_free_and_what_is_beside_it_stays() {
        let laser = curionav_planning::sensor::LaserModel::default();
        let ranges = vec![2.0; laser.beams as usize];
        let odometry = Pose2::default();
        let reading = Reading { stamp: 0.0, ranges, laser, odometry, reference: None };
        let mut evidence = Evidence::default();
        (0..20).for_each(|_| evidence.add(&reading, Pose2::default(), 0.1));
        evidence.clear(Point2::new(2.0, 0.0), 0.4, 0.1);
        let grid = evidence.grid(0.1).unwrap();
        use curionav_planning::occupancy::Cell;
        assert_eq!(grid.at(Point2::new(2.0, 0.01)), Cell::Free);
        // 0.7 m from there on the same circle: cos and sin of 0.35 rad, times 2 m.
        assert_eq!(grid.at(Point2::new(1.879, 0.686)), Cell::Occupied);
    }

    #[test]
    fn a_door_that_was_opened_becomes_free() {
        let laser = curionav_planning::sensor::LaserModel::default();
        let reading = |range: f32| Reading {
            stamp: 0.0,
            ranges: vec![range; laser.beams as usize],
            laser,
            odometry: Pose2::default(),
            reference: None,
        };
        let mut evidence = Evidence::default();
        (0..20).for_each(|_| evidence.add(&reading(2.0), Pose2::default(), 0.1));
        let ahead = Point2::new(2.0, 0.01);
        let occupied = evidence.grid(0.1).unwrap();
        assert_eq!(occupied.at(ahead), curionav_planning::occupancy::Cell::Occupied);
        (0..20).for_each(|_| evidence.add(&reading(4.0), Pose2::default(), 0.1));
        assert_eq!(evidence.grid(0.1).unwrap().at(ahead), curionav_planning::occupancy::Cell::Free);
    }
}
