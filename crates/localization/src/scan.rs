//! One laser scan, and the choice of beams an update uses.

use curionav_planning::geometry::Point2;
use curionav_planning::numerics::sin_cos;
use curionav_planning::sensor::LaserModel;

use crate::params::LocalizerParams;
use crate::pieces::Pieces;

/// One sweep of the laser.
#[derive(Debug, Clone, Copy)]
pub struct Scan<'a> {
    /// Metres, in the order of the beams. Beams of at least `range_max` met nothing on all their way; those
    /// that are not positive or not a number say nothing.
    pub ranges: &'a [f32],
    /// The scanner they came from.
    pub laser: LaserModel,
}

/// The beams of one update.
#[derive(Default)]
pub(crate) struct Selection {
    /// Where those that met something ended, robot frame, metres; piece after piece.
    pub(crate) ends: Vec<Point2>,
    /// The pieces they belong to, in order.
    pub(crate) pieces: Vec<Piece>,
    /// Ways that were seen to be free, robot frame, metres: from the laser to some of the ends, or as far as
    /// the laser sees where nothing was met, less the tolerance.
    pub(crate) free: Vec<Point2>,
    /// Where the laser is, robot frame.
    pub(crate) laser: Point2,
    /// Beams looked at, with those that met nothing.
    pub(crate) looked_at: usize,
}

/// Beams that met one body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Piece {
    /// How many of the selected ends are of it.
    pub(crate) beams: usize,
    /// Whether a person can be as wide as what was seen of it.
    pub(crate) narrow: bool,
}

/// Unit vectors of all beams in the robot frame.
pub(crate) struct BeamDirections {
    laser: LaserModel,
    directions: Vec<Point2>,
    pieces: Pieces,
}

impl BeamDirections {
    pub(crate) fn new(laser: LaserModel) -> Self {
        let directions = (0..laser.beams)
            .map(|i| {
                let (s, c) = sin_cos(laser.robot_from_laser.heading + laser.bearing(i));
                Point2::new(c, s)
            })
            .collect();
        Self { laser, directions, pieces: Pieces::default() }
    }

    /// Follows a scanner that differs from the announced one.
    pub(crate) fn adopt(&mut self, laser: &LaserModel) {
        if self.laser != *laser {
            *self = Self::new(*laser);
        }
    }

    /// Takes evenly spaced beams into `selection`. `turn` moves the choice on by one beam, so that
    /// successive updates see different beams and do not repeat each other's errors.
    pub(crate) fn select(
        &mut self,
        ranges: &[f32],
        turn: u64,
        params: &LocalizerParams,
        selection: &mut Selection,
    ) {
        selection.ends.clear();
        selection.pieces.clear();
        selection.free.clear();
        let available = ranges.len().min(self.directions.len());
        let used = params.beams.min(available);
        selection.looked_at = used;
        if used == 0 {
            return;
        }
        let range_max = self.laser.range_max;
        let met = |range: f64| range > 0.0 && range < range_max - 1e-6;
        let step = self.laser.bearing(1) - self.laser.bearing(0);
        self.pieces.split(&ranges[..available], step, met);
        let offset = (turn % (available / used) as u64) as usize;
        let origin = self.laser.robot_from_laser.position();
        selection.laser = origin;
        let mut last = None;
        for k in 0..used {
            let i = k * available / used + offset;
            let range = f64::from(ranges[i]);
            let d = self.directions[i];
            let seen = range.min(range_max) - params.agreement_distance;
            if k % FREE_EVERY == turn as usize % FREE_EVERY && seen > 0.0 {
                selection.free.push(Point2::new(origin.x + seen * d.x, origin.y + seen * d.y));
            }
            if !met(range) {
                continue;
            }
            selection.ends.push(Point2::new(origin.x + range * d.x, origin.y + range * d.y));
            let number = self.pieces.number[i];
            match selection.pieces.last_mut() {
                Some(piece) if last == Some(number) => piece.beams += 1,
                _ => {
                    let narrow = self.pieces.width[number as usize] <= params.person_width;
                    selection.pieces.push(Piece { beams: 1, narrow });
                }
            }
            last = Some(number);
        }
    }
}

/// Of the selected beams every n-th is checked for having passed through walls: neighbours tell the same.
const FREE_EVERY: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beams_that_meet_nothing_are_left_out_and_all_beams_get_their_turn() {
        let laser = LaserModel::default();
        let mut beams = BeamDirections::new(laser);
        let mut ranges = vec![5.0_f32; 181];
        let params = LocalizerParams::default();
        let mut seen = Selection::default();
        beams.select(&ranges, 0, &params, &mut seen);
        assert_eq!((seen.looked_at, seen.ends.len()), (30, 0));
        // Straight ahead is beam 90 = 3 * 30 + 0: k = 15, 15 * 181 / 30 = 90, offset 0.
        ranges[90] = 2.0;
        beams.select(&ranges, 6, &params, &mut seen);
        assert_eq!(seen.pieces, [Piece { beams: 1, narrow: true }]);
        assert!((seen.ends[0].x - 2.0).abs() < 1e-9 && seen.ends[0].y.abs() < 1e-9);
        ranges.fill(f32::NAN);
        beams.select(&ranges, 0, &params, &mut seen);
        assert!(seen.ends.is_empty() && seen.pieces.is_empty());
    }
}
