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

impl Selection {
    /// Takes evenly spaced beams of a scan. `turn` moves the choice on by one beam, so that successive updates see
    /// different beams and do not repeat each other's errors.
    pub(crate) fn of(scan: &Scan<'_>, turn: u64, params: &LocalizerParams) -> Self {
        let Scan { ranges, laser: model } = scan;
        let available = ranges.len().min(model.beams as usize);
        let used = params.beams.min(available);
        let laser = model.robot_from_laser.position();
        let mut selection = Self { laser, looked_at: used, ..Self::default() };
        if used == 0 {
            return selection;
        }
        let range_max = model.range_max;
        let met = |range: f64| range > 0.0 && range < range_max - 1e-6;
        let step = model.bearing(1) - model.bearing(0);
        let pieces = Pieces::split(&ranges[..available], step, met);
        let offset = (turn % (available / used) as u64) as usize;
        let mut last = None;
        for k in 0..used {
            let i = k * available / used + offset;
            let range = f64::from(ranges[i]);
            let (sin, cos) = sin_cos(model.robot_from_laser.heading + model.bearing(i as u32));
            let seen = range.min(range_max) - params.agreement_distance;
            if k % FREE_EVERY == turn as usize % FREE_EVERY && seen > 0.0 {
                selection.free.push(Point2::new(laser.x + seen * cos, laser.y + seen * sin));
            }
            if !met(range) {
                continue;
            }
            selection.ends.push(Point2::new(laser.x + range * cos, laser.y + range * sin));
            let number = pieces.number[i];
            match selection.pieces.last_mut() {
                Some(piece) if last == Some(number) => piece.beams += 1,
                _ => {
                    let narrow = pieces.width[number as usize] <= params.person_width;
                    selection.pieces.push(Piece { beams: 1, narrow });
                }
            }
            last = Some(number);
        }
        selection
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
        let select =
            |ranges: &[f32], turn| Selection::of(&Scan { ranges, laser }, turn, &LocalizerParams::default());
        let mut ranges = vec![5.0_f32; 181];
        let mut seen = select(&ranges, 0);
        assert_eq!((seen.looked_at, seen.ends.len()), (30, 0));
        // Straight ahead is beam 90 = 3 * 30 + 0: k = 15, 15 * 181 / 30 = 90, offset 0.
        ranges[90] = 2.0;
        seen = select(&ranges, 6);
        assert_eq!(seen.pieces, [Piece { beams: 1, narrow: true }]);
        assert!((seen.ends[0].x - 2.0).abs() < 1e-9 && seen.ends[0].y.abs() < 1e-9);
        ranges.fill(f32::NAN);
        seen = select(&ranges, 0);
        assert!(seen.ends.is_empty() && seen.pieces.is_empty());
    }
}
