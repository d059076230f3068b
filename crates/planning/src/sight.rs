//! Which people walls hide: lines of sight between people, and from the places where candidates lead.
//!
//! A wall is what the map has as occupied. Unknown floor and obstacles that are on no map hide no person.

use std::sync::Arc;

use crate::geometry::Point2;
use crate::occupancy::{RayCaster, StaticMap};
use crate::scene::People;

mod view;

pub(crate) use view::{InView, Shares, View};

crate::parameters! {
    /// Whether people count through walls, for the terms `cnc`, `human-space`, `doppler` and `collision-risk`.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct SightParams {
        /// Whether a person counts only at states from which no wall of the map hides where it is expected. At `false`
        /// all people count everywhere, as in the paper.
        pub walls_hide: bool = false,
    }
}

/// What hides people from a robot, and how far its candidates lead.
#[derive(Debug, Clone)]
pub struct Sight {
    map: Arc<StaticMap>,
    v_max: f64,
}

impl Sight {
    /// The walls of `map`, for a robot whose greatest speed is `v_max` m/s.
    pub fn new(map: Arc<StaticMap>, v_max: f64) -> Self {
        Self { map, v_max }
    }

    /// Whether no wall lies on the line between two points of the map frame.
    pub fn is_free(&self, a: Point2, b: Point2) -> bool {
        is_free(&self.map, a, b)
    }

    /// Seconds until a person who walks on is at a wall; infinite where there is none within `horizon` seconds.
    fn until_wall(&self, people: &People, i: usize, horizon: f64) -> f64 {
        let speed = people.speed(i);
        if speed <= 0.0 {
            return f64::INFINITY;
        }
        let grid = &self.map.grid;
        let from = grid.grid_from_map(people.position(i));
        let to = grid.grid_from_map(people.position_after(i, horizon));
        let met = Line::new(from, to).first_wall(&RayCaster::new(&self.map));
        met.map_or(f64::INFINITY, |cells| (cells - BEFORE_WALL).max(0.0) * grid.resolution() / speed)
    }
}

/// How far from a wall a person stops who would walk into it, cells.
const BEFORE_WALL: f64 = 0.01;

/// Whether no wall of `map` lies on the line between two points of the map frame.
///
/// Nothing is hidden from a point that itself lies in a wall. People and robots do not stand there: one who seems to
/// does so by an error of the belief, and it is not known on which side.
pub fn is_free(map: &StaticMap, a: Point2, b: Point2) -> bool {
    let rays = RayCaster::new(map);
    let from = map.grid.grid_from_map(a);
    let to = map.grid.grid_from_map(b);
    is_in_wall(&rays, from) || is_in_wall(&rays, to) || Line::new(from, to).first_wall(&rays).is_none()
}

/// Whether a point, in cells of the grid, lies in a wall.
fn is_in_wall(rays: &RayCaster<'_>, (column, row): (f64, f64)) -> bool {
    rays.clearance(column.floor() as i64, row.floor() as i64) == Some(0.0)
}

/// From one point to another, in cells of the grid.
struct Line {
    from: (f64, f64),
    towards: (f64, f64),
    length: f64,
}

impl Line {
    fn new(from: (f64, f64), to: (f64, f64)) -> Self {
        let dx = to.0 - from.0;
        let dy = to.1 - from.1;
        let length = (dx * dx + dy * dy).sqrt();
        let towards = if length > 0.0 { (dx / length, dy / length) } else { (1.0, 0.0) };
        Self { from, towards, length }
    }

    /// How far along it the first wall is, cells. What is so far away that its distance has no number is on no map.
    fn first_wall(&self, rays: &RayCaster<'_>) -> Option<f64> {
        if self.length.is_finite() { rays.range(self.from, self.towards, self.length) } else { None }
    }
}

#[cfg(test)]
mod tests;
