//! One laser scan, the pieces that its beams make, and the choice of beams an update uses.

use curionav_planning::beam::Beam;
use curionav_planning::geometry::Point2;
use curionav_planning::numerics::sin_cos;
use curionav_planning::sensor::LaserModel;

use crate::params::LocalizerParams;

/// One sweep of the laser.
#[derive(Debug, Clone, Copy)]
pub struct Scan<'a> {
    /// Metres, in the order of the beams; [`Beam`] says what they mean.
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
        let step = model.bearing(1) - model.bearing(0);
        let pieces = Pieces::split(&ranges[..available], step, model.range_max);
        let offset = (turn % (available / used) as u64) as usize;
        let mut last = None;
        for k in 0..used {
            let i = k * available / used + offset;
            let range = f64::from(ranges[i]);
            let (sin, cos) = sin_cos(model.robot_from_laser.heading + model.bearing(i as u32));
            if !Beam::of(ranges[i], 0.0, model.range_max).speaks() {
                continue;
            }
            let seen = range.min(model.range_max) - params.agreement_distance;
            if k % FREE_EVERY == turn as usize % FREE_EVERY && seen > 0.0 {
                selection.free.push(Point2::new(laser.x + seen * cos, laser.y + seen * sin));
            }
            if !meets_something(ranges[i], model.range_max) {
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

fn meets_something(range: f32, range_max: f64) -> bool {
    matches!(Beam::of(range, 0.0, range_max), Beam::Obstacle(_))
}

/// Of the selected beams every n-th is checked for having passed through walls: neighbours tell the same.
const FREE_EVERY: usize = 3;

/// Runs of beams between jumps of the range. The beams of one piece met one body, so they are right or
/// wrong about the map together.
#[derive(Default)]
struct Pieces {
    /// Number of the piece of every beam.
    number: Vec<u32>,
    /// Distance between the ends of a piece's first and last beam, metres.
    width: Vec<f64>,
}

/// Neighbouring ranges differ by more than this, metres, where one thing ends and another begins ...
const JUMP: f64 = 0.2;
/// ... and by this share of the range more: a wall seen at a flat angle runs away from the laser.
const JUMP_PER_METRE: f64 = 0.05;

impl Pieces {
    /// Splits a sweep of a laser that sees as far as `range_max`, with `step` radians between neighbouring beams.
    fn split(ranges: &[f32], step: f64, range_max: f64) -> Self {
        let mut pieces = Self::default();
        let mut first = 0;
        for i in 0..ranges.len() {
            let range = f64::from(ranges[i]);
            let joins = i > 0 && {
                let last = f64::from(ranges[i - 1]);
                meets_something(ranges[i - 1], range_max)
                    && meets_something(ranges[i], range_max)
                    && (range - last).abs() <= JUMP + JUMP_PER_METRE * range.min(last)
            };
            if !joins {
                first = i;
                pieces.width.push(0.0);
            }
            pieces.number.push(pieces.width.len() as u32 - 1);
            if let Some(width) = pieces.width.last_mut() {
                let a = f64::from(ranges[first]);
                let (_, cos) = sin_cos(step * (i - first) as f64);
                *width = (a * a + range * range - 2.0 * a * range * cos).max(0.0).sqrt();
            }
        }
        pieces
    }
}

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
        // What says nothing has not seen a free way either, and a failed beam is no obstacle.
        assert!(seen.free.is_empty());
        ranges.fill(0.0);
        seen = select(&ranges, 0);
        assert!(seen.ends.is_empty() && seen.free.is_empty());
    }

    #[test]
    fn a_single_beam_is_looked_at() {
        let laser = LaserModel { beams: 1, ..LaserModel::default() };
        let seen = Selection::of(&Scan { ranges: &[2.0], laser }, 0, &LocalizerParams::default());
        assert!(seen.ends[0].distance(Point2::new(0.0, -2.0)) < 1e-9, "{:?}", seen.ends);
    }

    #[test]
    fn a_person_before_a_wall_is_a_narrow_piece_between_wide_ones() {
        // A wall 3 m ahead over 60 degrees, and a person's front, 0.4 m wide, at 1.5 m.
        let step = 1.0_f64.to_radians();
        let ranges: Vec<f32> = (-30..=30)
            .map(|i: i32| if i.abs() <= 7 { 1.5 } else { (3.0 / (f64::from(i) * step).cos()) as f32 })
            .collect();
        let pieces = Pieces::split(&ranges, step, 4.9);
        assert_eq!(
            (pieces.number[0], pieces.number[22], pieces.number[23], pieces.number[37], pieces.number[60]),
            (0, 0, 1, 1, 2)
        );
        // 2 * 1.5 m * sin 7 degrees, and 3 m * (tan 30 - tan 8)
        assert!((pieces.width[1] - 0.3656).abs() < 1e-3);
        assert!((pieces.width[0] - 1.3104).abs() < 1e-3 && (pieces.width[2] - 1.3104).abs() < 1e-3);
    }

    #[test]
    fn beams_that_meet_nothing_part_pieces() {
        let pieces = Pieces::split(&[2.0, 2.0, 5.0, 5.0, 2.0, f32::NAN, 2.0], 0.01, 4.9);
        let numbers: Vec<u32> = (0..7).map(|i| pieces.number[i]).collect();
        assert_eq!(numbers, [0, 0, 1, 2, 3, 4, 5]);
        assert_eq!(pieces.width[1], 0.0);
    }
}
