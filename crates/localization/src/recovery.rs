//! When a robot seems lost: the short- and long-term means of augmented MCL (Gutmann and Fox, 2002; Probabilistic
//! Robotics, table 8.3), of the scan's fit.

use std::f64::consts::PI;

use nalgebra::{Matrix2, Matrix3, Vector2};

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::{Cell, OccupancyGrid};
use curionav_planning::random::{Rng, uniform};

use crate::params::LocalizerParams;

/// Short- and long-term means of the scan's fit ([`crate::Health::scan_fit`]), and how long the former
/// has been too low. (The textbook averages raw likelihoods, which for a product of beams differ by orders
/// of magnitude from place to place and fall in every crowd, so that random poses would be drawn just
/// where they are most likely to win.)
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Recovery {
    means: Option<(f64, f64)>,
    doubted_seconds: f64,
    doubted_metres: f64,
}

impl Recovery {
    /// Takes in the fit of one scan. `evidence` in 0..1 is the share of its beams that count; `metres` and
    /// `seconds` have passed since the last.
    pub(crate) fn observe(
        &mut self,
        fit: f64,
        evidence: f64,
        metres: f64,
        seconds: f64,
        params: &LocalizerParams,
    ) {
        if evidence < params.recovery_evidence_min {
            return;
        }
        let first = fit.max(params.recovery_expected_fit);
        let (fast, slow) = self.means.unwrap_or((first, first));
        self.means = Some((
            fast + params.recovery_alpha_fast * evidence * (fit - fast),
            slow + params.recovery_alpha_slow * evidence * (fit - slow),
        ));
        if self.doubts(params) {
            // A pause between scans is one doubt, not a long one.
            self.doubted_seconds += seconds.clamp(0.0, params.update_max_interval);
            self.doubted_metres += metres;
        } else {
            self.doubted_seconds = 0.0;
            self.doubted_metres = 0.0;
        }
    }

    /// The long-term mean of the fit; 1 before the first scan that tells anything.
    pub(crate) fn usual_fit(&self) -> f64 {
        self.means.map_or(1.0, |(_, slow)| slow)
    }

    /// Whether the latest scans fit clearly worse than those before.
    fn doubts(&self, params: &LocalizerParams) -> bool {
        self.means.is_some_and(|(fast, slow)| params.recovery_gain * fast < slow)
    }

    /// How far the robot has driven in a doubt that has lasted, metres.
    pub(crate) fn doubted_metres(&self, params: &LocalizerParams) -> Option<f64> {
        let lasts = self.doubted_seconds >= params.recovery_seconds;
        (lasts && self.doubted_metres >= params.recovery_metres).then_some(self.doubted_metres)
    }
}

/// The free cells of a map, to draw poses from.
pub(crate) struct FreeSpace {
    cells: Vec<u32>,
    centre: Point2,
    /// Of a position on them, (x, y), square metres.
    covariance: Matrix2<f64>,
}

impl FreeSpace {
    pub(crate) fn new(grid: &OccupancyGrid) -> Self {
        let all = 0..(grid.width() * grid.height()) as u32;
        let cells: Vec<u32> = all.filter(|i| grid.cell(*i as usize) == Cell::Free).collect();
        let count = cells.len().max(1) as f64;
        let mut sum = Vector2::zeros();
        let mut squares = Matrix2::zeros();
        for &cell in &cells {
            let p =
                Vector2::new(f64::from(cell % grid.width() as u32), f64::from(cell / grid.width() as u32));
            sum += p;
            squares += p * p.transpose();
        }
        let mean = sum / count;
        let resolution = grid.resolution();
        let centre = Point2::new((mean.x + 0.5) * resolution, (mean.y + 0.5) * resolution);
        let (sin, cos) = sin_cos(grid.origin().heading);
        let map_from_grid = Matrix2::new(cos, -sin, sin, cos) * resolution;
        let spread = squares / count - mean * mean.transpose();
        Self {
            cells,
            centre: grid.origin().transform(centre),
            covariance: map_from_grid * spread * map_from_grid.transpose(),
        }
    }

    /// Mean and covariance of a belief that the robot may be anywhere, with any heading.
    pub(crate) fn anywhere(&self) -> (Pose2, Matrix3<f64>) {
        let mut covariance = Matrix3::zeros();
        covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&self.covariance);
        covariance[(2, 2)] = PI * PI / 3.0;
        (Pose2::new(self.centre.x, self.centre.y, 0.0), covariance)
    }

    /// A pose uniform over the free cells, any heading; the grid's origin if no cell is free.
    pub(crate) fn draw(&self, grid: &OccupancyGrid, random: &mut Rng) -> Pose2 {
        let pick = uniform(random) * self.cells.len() as f64;
        let u = uniform(random);
        let v = uniform(random);
        let turn = uniform(random);
        let heading = std::f64::consts::TAU * (turn - 0.5);
        let Some(&cell) = self.cells.get(pick as usize) else {
            return Pose2 { heading, ..grid.origin() };
        };
        let column = cell as usize % grid.width();
        let row = cell as usize / grid.width();
        let p = Point2::new((column as f64 + u) * grid.resolution(), (row as f64 + v) * grid.resolution());
        let p = grid.origin().transform(p);
        Pose2::new(p.x, p.y, heading)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doubted(fit: f64, scans: usize, recovery: &mut Recovery) -> Option<f64> {
        let params = LocalizerParams::default();
        (0..scans).for_each(|_| recovery.observe(fit, 1.0, 0.2, 0.2, &params));
        recovery.doubted_metres(&params)
    }

    #[test]
    fn one_odd_scan_is_nothing_and_a_contradiction_that_lasts_is_a_doubt() {
        let mut r = Recovery::default();
        assert_eq!(doubted(0.97, 100, &mut r), None);
        assert_eq!(doubted(0.3, 1, &mut r), None);
        assert!(doubted(0.5, 20, &mut r).is_some_and(|metres| (1.0..5.0).contains(&metres)));
        assert_eq!(doubted(0.97, 40, &mut r), None);
    }

    #[test]
    fn a_start_at_the_wrong_place_does_not_pass_for_normal() {
        let mut r = Recovery::default();
        assert_eq!(doubted(0.3, 1, &mut r), None);
        assert!(doubted(0.3, 15, &mut r).is_some());
    }

    #[test]
    fn scans_of_which_people_explain_nearly_all_and_standing_still_raise_no_doubt() {
        let params = LocalizerParams::default();
        let mut crowded = Recovery::default();
        let mut standing = Recovery::default();
        for _ in 0..500 {
            crowded.observe(0.0, 0.05, 0.2, 0.2, &params);
            standing.observe(0.0, 1.0, 0.0, 1.0, &params);
        }
        assert_eq!(crowded.doubted_metres(&params), None);
        assert_eq!(standing.doubted_metres(&params), None);
    }
}
