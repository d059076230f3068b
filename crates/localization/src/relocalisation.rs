//! When and where other places are looked for, and how a search that takes many ticks ends in places of today.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::OccupancyGrid;

use crate::branch_and_bound::{Limits, PoseSearch, Pyramid, Region};
use crate::likelihood_field::LikelihoodField;
use crate::params::LocalizerParams;
use crate::scan::{Scan, Selection};
use crate::weighting::log_likelihood;

/// Beams that a search looks at: with few, chance fits everywhere.
const BEAMS: usize = 60;
/// Beams that have to meet something for a search to tell anything.
const ENDS_MIN: usize = 15;
/// Steps of a search per second of the robot's clock: some milliseconds of each tick of 0.1 s.
const STEPS_PER_SECOND: f64 = 150_000.0;
/// Of a longer time without a scan no more is made up for, seconds.
const SECONDS_MAX: f64 = 2.0;
/// Steps of a search in all.
const STEPS_MAX: usize = 3_000_000;
/// Poses that a search looks for, before they are compared with the whole scan.
const FOUND_MAX: usize = 64;
/// Poses that fit less well than the best by this share of all that a scan can tell are not looked for.
const BEHIND: f64 = 0.12;
/// Poses less likely than the best by more than this factor are left out, as a logarithm.
const LESS_LIKELY: f64 = 15.0;
/// A search begins no earlier than so far after the one before, metres.
const AFTER_M: f64 = 1.0;
/// When lost, one begins after so long at the latest, seconds.
const LOST_AFTER_S: f64 = 2.0;
/// Without any doubt one begins after so far, metres ...
const BACKGROUND_M: f64 = 20.0;
/// ... and so long, seconds.
const BACKGROUND_S: f64 = 60.0;
/// Odds of a place found where the estimate is in doubt, as a logarithm.
const ODDS_IN_DOUBT: f64 = -3.0;
/// And where the robot is probably not at the estimate.
const ODDS_WHEN_LOST: f64 = 0.0;
/// And where it is not in doubt.
const ODDS_WITHOUT_DOUBT: f64 = -7.0;
/// Deviations of the start that a search around the estimate reaches.
const REACH: f64 = 3.0;
/// Deviations of the start that each metre in doubt adds to it, as a share.
const WIDENING: f64 = 0.5;

/// A search under way.
pub(crate) struct Relocalisation {
    search: PoseSearch,
    seen: Selection,
    /// Odometry at its scan.
    odometry: Pose2,
    odds: f64,
    is_everywhere: bool,
}

/// Places found, as of the scan that was searched for.
pub(crate) struct Found {
    /// The likeliest first.
    pub(crate) poses: Vec<Pose2>,
    pub(crate) odometry: Pose2,
    pub(crate) odds: f64,
    /// Whether all of the map was searched.
    pub(crate) is_everywhere: bool,
}

/// When to search next.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SearchPlan {
    /// Since the last search began.
    metres: f64,
    /// Since then.
    seconds: f64,
    /// Whether the last search was around the estimate.
    was_near: bool,
}

/// Where to search, and the odds of what is found there, as a logarithm.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wish {
    pub(crate) region: Region,
    pub(crate) odds: f64,
}

impl Wish {
    /// Without an estimate.
    pub(crate) const ANYWHERE: Self = Self { region: Region::Everywhere, odds: 0.0 };
}

impl SearchPlan {
    pub(crate) fn pass(&mut self, metres: f64, seconds: f64) {
        self.metres += metres;
        self.seconds += seconds;
    }

    /// What to search for now, if anything. Where the estimate has been in doubt for so many metres, it is in turns
    /// around it and everywhere: odometry goes on being right while an estimate goes wrong, and a person may have
    /// carried the robot.
    pub(crate) fn next(
        &mut self,
        doubted_metres: Option<f64>,
        is_lost: bool,
        pose: Pose2,
        params: &LocalizerParams,
    ) -> Option<Wish> {
        let Some(doubted_metres) = doubted_metres else {
            self.was_near = false;
            let is_due = self.metres >= BACKGROUND_M && self.seconds >= BACKGROUND_S;
            return is_due.then(|| self.begin(Wish { region: Region::Everywhere, odds: ODDS_WITHOUT_DOUBT }));
        };
        if self.metres < AFTER_M && !(is_lost && self.seconds >= LOST_AFTER_S) {
            return None;
        }
        // A robot that has just got lost may have been carried.
        self.was_near = !self.was_near && !is_lost;
        let width = REACH * (1.0 + WIDENING * doubted_metres);
        let near = Region::Around {
            pose,
            metres: width * params.start_sigma_position,
            radians: REACH * params.start_sigma_heading,
        };
        let region = if self.was_near { near } else { Region::Everywhere };
        let odds = if is_lost { ODDS_WHEN_LOST } else { ODDS_IN_DOUBT };
        Some(self.begin(Wish { region, odds }))
    }

    fn begin(&mut self, wish: Wish) -> Wish {
        self.metres = 0.0;
        self.seconds = 0.0;
        wish
    }
}

impl Relocalisation {
    /// Begins a search for where `scan` was taken. None if it shows too little.
    pub(crate) fn begin(
        scan: &Scan<'_>,
        odometry: Pose2,
        wish: Wish,
        resolution: f64,
        params: &LocalizerParams,
    ) -> Option<Self> {
        let Wish { region, odds } = wish;
        let seen = Selection::of(scan, 0, &LocalizerParams { beams: BEAMS, ..params.clone() });
        let ends: &[Point2] = &seen.ends;
        let limits = Limits { wanted: FOUND_MAX, behind: BEHIND, steps: STEPS_MAX };
        let search = PoseSearch::new(ends, resolution, region, limits);
        let is_everywhere = matches!(region, Region::Everywhere);
        (ends.len() >= ENDS_MIN).then_some(Self { search, seen, odometry, odds, is_everywhere })
    }

    /// Goes on as `seconds` have passed on the robot's clock. Whether the search has ended.
    pub(crate) fn advance(&mut self, pyramid: &Pyramid, grid: &OccupancyGrid, seconds: f64) -> bool {
        let steps = STEPS_PER_SECOND * seconds.clamp(0.0, SECONDS_MAX);
        self.search.advance(pyramid, grid, steps as usize)
    }

    /// What it has found, compared with the whole scan.
    pub(crate) fn found(self, field: &LikelihoodField, params: &LocalizerParams) -> Found {
        let Self { search, seen, odometry, odds, is_everywhere } = self;
        let mut scored: Vec<(f64, Pose2)> = search
            .found()
            .into_iter()
            .filter_map(|pose| {
                let at = field.pose(pose.x, pose.y, pose.heading);
                let log = log_likelihood(field, &seen, at, f32::NEG_INFINITY, params)?;
                Some((params.temper * f64::from(log) * params.beams as f64 / BEAMS as f64, pose))
            })
            .collect();
        scored.sort_by(|a, b| b.0.total_cmp(&a.0));
        let least = scored.first().map_or(0.0, |best| best.0 - LESS_LIKELY);
        let poses = scored.into_iter().take_while(|(log, _)| *log >= least).map(|(_, pose)| pose).collect();
        Found { poses, odometry, odds, is_everywhere }
    }
}
