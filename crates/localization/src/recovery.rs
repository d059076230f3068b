//! When and where to look for a lost robot: augmented MCL (Gutmann and Fox, 2002; Probabilistic
//! Robotics, table 8.3) on the scan's fit.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::{Cell, OccupancyGrid};
use curionav_planning::random::{Rng, uniform};

use crate::likelihood_field::LikelihoodField;
use crate::params::LocalizerParams;

/// Short- and long-term means of the scan's fit ([`crate::Health::scan_fit`]). (The textbook averages
/// raw likelihoods, which for a product of beams differ by orders of magnitude from place to place and
/// fall in every crowd, so that random poses would be drawn just where they are most likely to win.)
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Recovery {
    means: Option<(f64, f64)>,
}

impl Recovery {
    /// Takes in the fit of one scan; `evidence` in 0..1 is the share of its beams that count.
    pub(crate) fn observe(&mut self, fit: f64, evidence: f64, params: &LocalizerParams) {
        let first = fit.max(params.recovery_expected_fit);
        let (fast, slow) = self.means.unwrap_or((first, first));
        self.means = Some((
            fast + params.recovery_alpha_fast * evidence * (fit - fast),
            slow + params.recovery_alpha_slow * evidence * (fit - slow),
        ));
    }

    /// Share of particles to draw at random.
    pub(crate) fn share(&self, params: &LocalizerParams) -> f64 {
        match self.means {
            Some((fast, slow)) if slow > 0.0 => {
                (1.0 - params.recovery_gain * fast / slow).clamp(0.0, params.recovery_share_max)
            }
            _ => 0.0,
        }
    }
}

/// The free cells of a map, to draw poses from.
pub(crate) struct FreeSpace {
    cells: Vec<u32>,
}

impl FreeSpace {
    pub(crate) fn new(grid: &OccupancyGrid) -> Self {
        let free = |&i: &u32| grid.cell(i as usize) == Cell::Free;
        Self { cells: (0..(grid.width() * grid.height()) as u32).filter(free).collect() }
    }

    /// A pose uniform over the free cells, any heading; the grid's origin if no cell is free.
    pub(crate) fn draw(&self, grid: &OccupancyGrid, random: &mut Rng) -> Pose2 {
        let pick = uniform(random) * self.cells.len() as f64;
        let (u, v, turn) = (uniform(random), uniform(random), uniform(random));
        let heading = std::f64::consts::TAU * (turn - 0.5);
        let Some(&cell) = self.cells.get(pick as usize) else {
            return Pose2 { heading, ..grid.origin() };
        };
        let (column, row) = (cell as usize % grid.width(), cell as usize / grid.width());
        let p = Point2::new((column as f64 + u) * grid.resolution(), (row as f64 + v) * grid.resolution());
        let p = grid.origin().transform(p);
        Pose2::new(p.x, p.y, heading)
    }

    /// The best by likelihood of `tournament` uniform poses (sensor resetting, Lenser and Veloso, 2000): a
    /// blind draw on a large map almost never lands near enough to be found by the next scan.
    pub(crate) fn draw_fitting(
        &self,
        grid: &OccupancyGrid,
        field: &LikelihoodField,
        ends: &[Point2],
        tournament: u32,
        random: &mut Rng,
    ) -> Pose2 {
        let mut best = (f32::NEG_INFINITY, Pose2::default());
        for _ in 0..tournament {
            let pose = self.draw(grid, random);
            let at = field.pose(pose.x, pose.y, pose.heading);
            let score = ends.iter().map(|e| field.score(at, e.x as f32, e.y as f32)).sum::<f32>();
            if score > best.0 {
                best = (score, pose);
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lasting_loss_of_fit_calls_for_random_poses_and_one_odd_scan_does_not() {
        let params = LocalizerParams::default();
        let mut r = Recovery::default();
        for _ in 0..100 {
            r.observe(0.97, 1.0, &params);
        }
        r.observe(0.3, 1.0, &params);
        assert_eq!(r.share(&params), 0.0);
        for _ in 0..40 {
            r.observe(0.5, 1.0, &params);
        }
        assert!(r.share(&params) > 0.2);
    }

    #[test]
    fn a_start_at_the_wrong_place_does_not_pass_for_normal() {
        let params = LocalizerParams::default();
        let mut r = Recovery::default();
        r.observe(0.3, 1.0, &params);
        assert_eq!(r.share(&params), 0.0);
        for _ in 0..5 {
            r.observe(0.3, 1.0, &params);
        }
        assert!(r.share(&params) > 0.0);
    }
}
