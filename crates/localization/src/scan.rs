//! One laser scan, and the choice of beams an update uses.

use curionav_planning::geometry::Point2;
use curionav_planning::numerics::sin_cos;
use curionav_planning::sensor::LaserModel;

/// One sweep of the laser.
#[derive(Debug, Clone, Copy)]
pub struct Scan<'a> {
    /// Metres, in the order of the beams. Values that are not finite, not positive or at least
    /// `range_max` met nothing and say nothing.
    pub ranges: &'a [f32],
    /// The scanner they came from.
    pub laser: LaserModel,
}

/// Unit vectors of all beams in the robot frame.
pub(crate) struct BeamDirections {
    laser: LaserModel,
    directions: Vec<Point2>,
}

impl BeamDirections {
    pub(crate) fn new(laser: LaserModel) -> Self {
        let directions = (0..laser.beams)
            .map(|i| {
                let (s, c) = sin_cos(laser.robot_from_laser.heading + laser.bearing(i));
                Point2::new(c, s)
            })
            .collect();
        Self { laser, directions }
    }

    /// Follows a scanner that differs from the announced one.
    pub(crate) fn adopt(&mut self, laser: &LaserModel) {
        if self.laser != *laser {
            *self = Self::new(*laser);
        }
    }

    /// Puts the ends of up to `count` evenly spaced beams that met something into `ends`, robot frame, metres.
    /// `turn` moves the choice on by one beam, so that successive updates see different beams and do
    /// not repeat each other's errors. Returns how many beams were looked at.
    pub(crate) fn select(&self, ranges: &[f32], count: usize, turn: u64, ends: &mut Vec<Point2>) -> usize {
        ends.clear();
        let available = ranges.len().min(self.directions.len());
        let used = count.min(available);
        if used == 0 {
            return 0;
        }
        let offset = (turn % (available / used) as u64) as usize;
        let origin = self.laser.robot_from_laser.position();
        for k in 0..used {
            let i = k * available / used + offset;
            let range = f64::from(ranges[i]);
            if range > 0.0 && range < self.laser.range_max - 1e-6 {
                let d = self.directions[i];
                ends.push(Point2::new(origin.x + range * d.x, origin.y + range * d.y));
            }
        }
        used
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beams_that_meet_nothing_are_left_out_and_all_beams_get_their_turn() {
        let laser = LaserModel::default();
        let beams = BeamDirections::new(laser);
        let mut ranges = vec![5.0_f32; 181];
        let mut ends = Vec::new();
        assert_eq!(beams.select(&ranges, 30, 0, &mut ends), 30);
        assert!(ends.is_empty());
        // Straight ahead is beam 90 = 3 * 30 + 0: k = 15, 15 * 181 / 30 = 90, offset 0.
        ranges[90] = 2.0;
        beams.select(&ranges, 30, 6, &mut ends);
        assert_eq!(ends.len(), 1);
        assert!((ends[0].x - 2.0).abs() < 1e-9 && ends[0].y.abs() < 1e-9);
        ranges.fill(f32::NAN);
        beams.select(&ranges, 30, 0, &mut ends);
        assert!(ends.is_empty());
    }
}
