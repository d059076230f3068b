//! Pieces of a sweep: runs of neighbouring beams that met one thing.

use curionav_planning::numerics::sin_cos;

/// Runs of beams between jumps of the range. The beams of one piece met one body, so they are right or
/// wrong about the map together.
#[derive(Default)]
pub(crate) struct Pieces {
    /// Number of the piece of every beam.
    pub(crate) number: Vec<u32>,
    /// Distance between the ends of a piece's first and last beam, metres.
    pub(crate) width: Vec<f64>,
}

/// Neighbouring ranges differ by more than this, metres, where one thing ends and another begins ...
const JUMP: f64 = 0.2;
/// ... and by this share of the range more: a wall seen at a flat angle runs away from the laser.
const JUMP_PER_METRE: f64 = 0.05;

impl Pieces {
    /// Splits a sweep. `met` says of a range whether its beam met anything; `step` is the angle between
    /// neighbouring beams, radians.
    pub(crate) fn split(ranges: &[f32], step: f64, met: impl Fn(f64) -> bool) -> Self {
        let (mut pieces, mut first) = (Self::default(), 0);
        for i in 0..ranges.len() {
            let range = f64::from(ranges[i]);
            let joins = i > 0 && {
                let last = f64::from(ranges[i - 1]);
                met(last) && met(range) && (range - last).abs() <= JUMP + JUMP_PER_METRE * range.min(last)
            };
            if !joins {
                first = i;
                pieces.width.push(0.0);
            }
            pieces.number.push(pieces.width.len() as u32 - 1);
            if let Some(width) = pieces.width.last_mut() {
                let (a, b) = (f64::from(ranges[first]), range);
                let (_, cos) = sin_cos(step * (i - first) as f64);
                *width = (a * a + b * b - 2.0 * a * b * cos).max(0.0).sqrt();
            }
        }
        pieces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_person_before_a_wall_is_a_narrow_piece_between_wide_ones() {
        // A wall 3 m ahead over 60 degrees, and a person's front, 0.4 m wide, at 1.5 m.
        let step = 1.0_f64.to_radians();
        let ranges: Vec<f32> = (-30..=30)
            .map(|i: i32| if i.abs() <= 7 { 1.5 } else { (3.0 / (f64::from(i) * step).cos()) as f32 })
            .collect();
        let pieces = Pieces::split(&ranges, step, |r| r < 4.9);
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
        let pieces = Pieces::split(&[2.0, 2.0, 5.0, 5.0, 2.0, f32::NAN, 2.0], 0.01, |r| r > 0.0 && r < 4.9);
        let numbers: Vec<u32> = (0..7).map(|i| pieces.number[i]).collect();
        assert_eq!(numbers, [0, 0, 1, 2, 3, 4, 5]);
        assert_eq!(pieces.width[1], 0.0);
    }
}
