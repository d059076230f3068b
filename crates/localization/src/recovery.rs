//! When and where to look for a lost robot: augmented MCL (Gutmann and Fox, 2002; Probabilistic
//! Robotics, table 8.3) on the scan's fit, near the estimate first.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::{Cell, OccupancyGrid};
use curionav_planning::random::{Rng, uniform};

use crate::likelihood_field::LikelihoodField;
use crate::params::LocalizerParams;
use crate::scan::Selection;
use crate::weighting::log_likelihood;

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

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Search {
    /// Nowhere: the estimate stands, or has not been in doubt for long.
    Nowhere,
    /// Around the estimate, this many start deviations of position wide, one of heading: odometry goes on
    /// being right while an estimate goes wrong, so the robot is not far.
    Around(f64),
    /// All over the map: a person has carried the robot.
    Everywhere,
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
        if self.share(params) > 0.0 {
            // A pause between scans is one doubt, not a long one.
            self.doubted_seconds += seconds.clamp(0.0, params.update_max_interval);
            self.doubted_metres += metres;
        } else {
            self.doubted_seconds = 0.0;
            self.doubted_metres = 0.0;
        }
    }

    /// Share of particles to draw anew while searching.
    pub(crate) fn share(&self, params: &LocalizerParams) -> f64 {
        let Some((fast, slow)) = self.means.filter(|(_, slow)| *slow > 0.0) else { return 0.0 };
        (1.0 - params.recovery_gain * fast / slow).clamp(0.0, params.recovery_share_max)
    }

    pub(crate) fn search(&self, params: &LocalizerParams) -> Search {
        if self.has_doubted(params.recovery_global_seconds, params.recovery_global_metres) {
            Search::Everywhere
        } else if self.has_doubted(params.recovery_local_seconds, params.recovery_local_metres) {
            Search::Around(1.0 + WIDENING * self.doubted_metres)
        } else {
            Search::Nowhere
        }
    }

    fn has_doubted(&self, seconds: f64, metres: f64) -> bool {
        self.doubted_seconds >= seconds && self.doubted_metres >= metres
    }
}

/// Start deviations that each metre in doubt adds to the search around the estimate.
const WIDENING: f64 = 0.5;

/// The free cells of a map, to draw poses from.
pub(crate) struct FreeSpace {
    cells: Vec<u32>,
}

impl FreeSpace {
    pub(crate) fn new(grid: &OccupancyGrid) -> Self {
        let all = 0..(grid.width() * grid.height()) as u32;
        Self { cells: all.filter(|i| grid.cell(*i as usize) == Cell::Free).collect() }
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

/// The likeliest of `tournament` poses by the scan (sensor resetting, Lenser and Veloso, 2000): a blind draw on
/// a large map almost never lands near enough to be found by the next scan.
pub(crate) fn draw_fitting(
    field: &LikelihoodField,
    seen: &Selection,
    params: &LocalizerParams,
    mut draw: impl FnMut() -> Pose2,
) -> Pose2 {
    let mut best = (f32::NEG_INFINITY, Pose2::default());
    for _ in 0..params.recovery_tournament {
        let pose = draw();
        let at = field.pose(pose.x, pose.y, pose.heading);
        if let Some(score) = log_likelihood(field, seen, at, best.0, params) {
            best = (score, pose);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doubt(fit: f64, scans: usize, recovery: &mut Recovery) -> Search {
        let params = LocalizerParams::default();
        (0..scans).for_each(|_| recovery.observe(fit, 1.0, 0.2, 0.2, &params));
        recovery.search(&params)
    }

    #[test]
    fn one_odd_scan_is_nothing_a_lasting_doubt_looks_near_and_only_a_long_one_everywhere() {
        let mut r = Recovery::default();
        assert_eq!(doubt(0.97, 100, &mut r), Search::Nowhere);
        assert_eq!(doubt(0.3, 1, &mut r), Search::Nowhere);
        assert!(matches!(doubt(0.5, 20, &mut r), Search::Around(_)));
        assert_eq!(doubt(0.5, 60, &mut r), Search::Everywhere);
        assert_eq!(doubt(0.97, 40, &mut r), Search::Nowhere);
    }

    #[test]
    fn a_start_at_the_wrong_place_does_not_pass_for_normal() {
        let mut r = Recovery::default();
        assert_eq!(doubt(0.3, 1, &mut r), Search::Nowhere);
        assert!(matches!(doubt(0.3, 15, &mut r), Search::Around(_)));
    }

    #[test]
    fn scans_of_which_people_explain_nearly_all_and_standing_still_raise_no_doubt() {
        let params = LocalizerParams::default();
        let (mut crowded, mut standing) = (Recovery::default(), Recovery::default());
        for _ in 0..500 {
            crowded.observe(0.0, 0.05, 0.2, 0.2, &params);
            standing.observe(0.0, 1.0, 0.0, 1.0, &params);
        }
        assert_eq!(crowded.search(&params), Search::Nowhere);
        assert_eq!(standing.search(&params), Search::Nowhere);
    }
}
