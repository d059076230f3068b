//! Beams of a laser: where they point, and how far they come past walls and outlines.

use curionav_planning::geometry::Point2;
use curionav_planning::numerics::{atan2, sin_cos};
use curionav_planning::occupancy::{RayCaster, StaticMap};
use curionav_planning::sensor::LaserModel;

/// The unit vector of a beam, laser frame.
pub(crate) fn direction(laser: &LaserModel, beam: u32) -> (f64, f64) {
    let (s, c) = sin_cos(laser.bearing(beam));
    (c, s)
}

/// The beams of one scan, in the laser's frame.
pub(crate) struct Beams<'a> {
    laser: &'a LaserModel,
    /// Unit vectors.
    directions: Vec<(f64, f64)>,
    /// How far each has come, metres.
    ranges: Vec<f64>,
}

impl<'a> Beams<'a> {
    pub(crate) fn new(laser: &'a LaserModel) -> Self {
        let directions = (0..laser.beams).map(|beam| direction(laser, beam)).collect();
        Self { laser, directions, ranges: Vec::new() }
    }

    /// Gives each beam the range of its direction.
    pub(crate) fn cast(&mut self, range: impl Fn((f64, f64)) -> f64) {
        self.ranges = self.directions.iter().map(|direction| range(*direction)).collect();
    }

    /// How far each has come, metres.
    pub(crate) fn into_ranges(self) -> Vec<f64> {
        self.ranges
    }

    pub(crate) fn len(&self) -> usize {
        self.directions.len()
    }

    /// Shortens the beams to the range that `range` gives for a beam and its direction. Only beams are looked at inside
    /// the angle that the disc around `centre` subtends.
    pub(crate) fn shorten(
        &mut self,
        centre: Point2,
        radius: f64,
        mut range: impl FnMut(usize, (f64, f64)) -> f64,
    ) {
        let laser = self.laser;
        let distance = centre.distance(Point2::default());
        if distance - radius >= laser.range_max {
            return;
        }
        let half = if distance > radius {
            atan2(radius, (distance * distance - radius * radius).sqrt())
        } else {
            std::f64::consts::PI
        };
        let gap = laser.bearing(1) - laser.bearing(0);
        let middle = (atan2(centre.y, centre.x) - laser.bearing(0)) / gap;
        let half = half / gap + 1.0;
        let turn = std::f64::consts::TAU / gap;
        for middle in [middle - turn, middle, middle + turn] {
            // Casts saturate: a window outside the field of view is empty.
            let first = (middle - half).ceil().max(0.0) as usize;
            let last = (middle + half).floor();
            let count = if last < 0.0 { 0 } else { (last as usize + 1).saturating_sub(first) };
            for beam in first..(first + count).min(self.ranges.len()) {
                self.ranges[beam] = self.ranges[beam].min(range(beam, self.directions[beam]));
            }
        }
    }
}

/// Rays from one point against the occupied cells of a map.
pub(crate) struct Rays<'a> {
    caster: RayCaster<'a>,
    resolution: f64,
    /// Origin in cell units.
    origin: (f64, f64),
    /// Cosine and sine of the turn from the map frame into the grid's axes.
    turn: (f64, f64),
}

impl<'a> Rays<'a> {
    /// Rays from `origin`, map frame.
    pub(crate) fn new(map: &'a StaticMap, origin: Point2) -> Self {
        let grid = &map.grid;
        let (s, c) = sin_cos(-grid.origin().heading);
        Self {
            caster: RayCaster::new(map),
            resolution: grid.resolution(),
            origin: grid.grid_from_map(origin),
            turn: (c, s),
        }
    }

    /// Distance along the unit vector `direction` (map frame) to the first occupied cell, metres;
    /// `range_max` when there is none before. Unknown space is transparent, and nothing is outside.
    pub(crate) fn range(&self, direction: (f64, f64), range_max: f64) -> f64 {
        let (c, s) = self.turn;
        let dx = c * direction.0 - s * direction.1;
        let dy = s * direction.0 + c * direction.1;
        let reach = range_max * (1.0 / self.resolution);
        let range = self.caster.range(self.origin, (dx, dy), reach);
        range.map_or(range_max, |range| range * self.resolution)
    }
}

/// Distance along the unit vector `direction` from the origin to a disc; 0 inside it, infinite past it.
pub(crate) fn disc_range(centre: Point2, radius: f64, direction: (f64, f64)) -> f64 {
    let along = centre.x * direction.0 + centre.y * direction.1;
    let excess = centre.x * centre.x + centre.y * centre.y - radius * radius;
    if excess <= 0.0 {
        return 0.0;
    }
    let inside = along * along - excess;
    if along <= 0.0 || inside < 0.0 { f64::INFINITY } else { along - inside.sqrt() }
}
