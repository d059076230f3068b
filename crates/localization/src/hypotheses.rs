//! Other places where the robot may be: each is followed by a small filter of its own, and judged against the estimate
//! by scans that had no part in finding it.
//!
//! Random poses that fit one scan by chance used to be mixed into the belief (augmented MCL). Where a map explains real
//! scans badly, they took over tracks that were right. Here a place takes over when it has explained the scans along a
//! stretch of way better than the estimate has (multi-hypothesis localisation, Jensfelt and Kristensen, 2001).

use curionav_planning::geometry::{Pose2, wrap_angle};
use curionav_planning::motion::OdometryNoise;
use curionav_planning::numerics::exp;
use curionav_planning::random::{Rng, uniform};
use curionav_planning::sensor::LaserModel;
use nalgebra::{Matrix3, Vector3};

use crate::clusters::moments;
use crate::likelihood_field::LikelihoodField;
use crate::params::LocalizerParams;
use crate::particles::{Motion, Particles};
use crate::resampling::roughened;
use crate::scan::{Scan, Selection};
use crate::weighting::{log_likelihood, weigh};

/// Particles of one hypothesis.
pub(crate) const PARTICLES: usize = 100;
/// Hypotheses at once.
const HYPOTHESES_MAX: usize = 32;
/// Deviation of a pose that a search has found, metres.
const FOUND_SIGMA_M: f64 = 0.15;
/// And of its heading, radians.
const FOUND_SIGMA_RAD: f64 = 0.05;
/// Beams by which places are compared: all of a scan would say little more.
const JUDGED_BEAMS: usize = 90;
/// Along each metre a place gains or loses at most so much, as a logarithm of odds: scans along a way share the errors
/// of the map, so that it counts how far one place is better rather than by how much.
const TELLS_PER_METRE: f64 = 1.0;
/// It gains that if it is better by this share of all that a scan can tell.
const BETTER: f64 = 1.0 / 30.0;
/// Where the estimate explains so little more of a scan than the place does, as a share, it is not the map that errs.
const FAR_BETTER: f64 = 0.3;
/// Each share beyond adds so much along a metre.
const FAR_BETTER_TELLS: f64 = 8.0;
/// What was told counts for about so long a way, metres.
const REMEMBERED_M: f64 = 20.0;
/// Below these odds, as a logarithm, a place is given up.
const GIVEN_UP: f64 = -8.0;
/// Above them it takes over.
const TAKES_OVER: f64 = 6.0;

/// Poses nearer than this are one place, metres and radians.
const SAME_M: f64 = 0.4;
/// See [`SAME_M`].
const SAME_RAD: f64 = 0.25;

/// One place where the robot may be.
#[derive(Debug, Clone)]
pub(crate) struct Hypothesis {
    pub(crate) particles: Particles,
    pub(crate) pose: Pose2,
    pub(crate) covariance: Matrix3<f64>,
    /// Logarithm of its odds against the estimate.
    odds: f64,
    scans: u32,
    metres: f64,
}

/// The places besides that of the estimate.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hypotheses {
    all: Vec<Hypothesis>,
}

/// What one filter update knows.
pub(crate) struct Observation<'a> {
    pub(crate) field: &'a LikelihoodField,
    pub(crate) scan: &'a Scan<'a>,
    pub(crate) seen: &'a Selection,
    /// With which share of a scan's likelihood particles are weighed.
    pub(crate) exponent: f64,
    pub(crate) params: &'a LocalizerParams,
}

/// Compares places by one scan.
struct Judge<'a> {
    field: &'a LikelihoodField,
    seen: Selection,
    params: &'a LocalizerParams,
    /// Difference in log-likelihood between a pose that explains all beams and one that explains none.
    span: f64,
}

impl<'a> Judge<'a> {
    fn of(observation: &Observation<'a>) -> Self {
        let params = observation.params;
        let many = LocalizerParams { beams: JUDGED_BEAMS, ..params.clone() };
        let seen = Selection::of(observation.scan, 0, &many);
        let span = seen.ends.len() as f64 * observation.field.span();
        Self { field: observation.field, seen, params, span }
    }

    fn log_likelihood(&self, pose: Pose2) -> f64 {
        let at = self.field.pose(pose.x, pose.y, pose.heading);
        let log = log_likelihood(self.field, &self.seen, at, f32::NEG_INFINITY, self.params);
        log.map_or(f64::MIN, f64::from)
    }

    /// What the scan tells for `pose` against a place of this log-likelihood, per metre of the way.
    fn told(&self, pose: Pose2, other: f64) -> f64 {
        let better = (self.log_likelihood(pose) - other) / self.span.max(1.0);
        let beyond = (better - FAR_BETTER).max(0.0);
        TELLS_PER_METRE * (better / BETTER).clamp(-1.0, 1.0) + FAR_BETTER_TELLS * beyond
    }
}

impl Hypothesis {
    pub(crate) fn found_at(pose: Pose2, odds: f64, random: &mut Rng) -> Self {
        let position = FOUND_SIGMA_M * FOUND_SIGMA_M;
        let heading = FOUND_SIGMA_RAD * FOUND_SIGMA_RAD;
        let covariance = Matrix3::from_diagonal(&Vector3::new(position, position, heading));
        let particles = Particles::draw_gaussian(PARTICLES, pose, &covariance, random);
        Self { particles, pose, covariance, odds, scans: 0, metres: 0.0 }
    }

    /// The estimate as one place among others.
    pub(crate) fn of_estimate(particles: Particles, pose: Pose2, covariance: Matrix3<f64>) -> Self {
        Self { particles, pose, covariance, odds: 0.0, scans: 0, metres: 0.0 }
    }

    fn weigh(&mut self, observation: &Observation<'_>) {
        let Observation { field, seen, exponent, params, .. } = *observation;
        weigh(&mut self.particles, field, seen, exponent, false, params);
    }

    /// Draws a new set where the weights have become uneven.
    fn resample(&mut self, params: &LocalizerParams, random: &mut Rng) {
        let n = self.particles.len();
        if self.particles.effective_size() >= params.resample_ess * n as f64 {
            return;
        }
        let start = uniform(random);
        self.particles = roughened(&self.particles, n, start, params, random);
    }
}

impl Hypotheses {
    /// Adds places that a search has found, with these odds against the estimate, as a logarithm. Those that are
    /// already known by `is_known` or here are left out.
    pub(crate) fn add(
        &mut self,
        found: &[Pose2],
        odds: f64,
        is_known: impl Fn(Pose2) -> bool,
        random: &mut Rng,
    ) {
        for &pose in found {
            let is_here = self.all.iter().any(|other| is_near(other.pose, pose));
            if self.all.len() < HYPOTHESES_MAX && !is_here && !is_known(pose) {
                self.all.push(Hypothesis::found_at(pose, odds, random));
            }
        }
    }

    pub(crate) fn clear(&mut self) {
        self.all.clear();
    }

    /// Moves all as odometry says.
    pub(crate) fn advance(&mut self, motion: &Motion, noise: &OdometryNoise, random: &mut Rng) {
        for hypothesis in &mut self.all {
            hypothesis.particles.advance(motion, noise, random);
            hypothesis.pose = hypothesis.pose.compose(motion.displacement);
        }
    }

    /// Judges all by a scan after so many metres against the estimate, and gives up those that explain it badly or are
    /// the place of the estimate. Returns the one that takes over.
    pub(crate) fn judge(
        &mut self,
        observation: &Observation<'_>,
        estimate: Pose2,
        metres: f64,
        random: &mut Rng,
    ) -> Option<Hypothesis> {
        if self.all.is_empty() {
            return None;
        }
        let params = observation.params;
        let judge = Judge::of(observation);
        let kept = exp(-metres / REMEMBERED_M);
        let own = judge.log_likelihood(estimate);
        for hypothesis in &mut self.all {
            let told = metres.min(1.0) * judge.told(hypothesis.pose, own);
            hypothesis.odds = kept * hypothesis.odds + told;
            hypothesis.scans += 1;
            hypothesis.metres += metres;
            hypothesis.weigh(observation);
            if let Some((pose, covariance)) = moments(&hypothesis.particles, |_| true) {
                hypothesis.pose = pose;
                hypothesis.covariance = covariance;
            }
            hypothesis.resample(params, random);
        }
        self.all.retain(|it| it.odds > GIVEN_UP && !is_near(it.pose, estimate));
        self.all.sort_by(|a, b| b.odds.total_cmp(&a.odds));
        let mut places: Vec<Pose2> = Vec::new();
        self.all.retain(|it| {
            let is_new = !places.iter().any(|place| is_near(*place, it.pose));
            places.push(it.pose);
            is_new
        });
        let wins = self.all.first().is_some_and(|best| {
            best.odds >= TAKES_OVER
                && best.scans >= params.takeover_scans
                && best.metres >= params.takeover_metres
        });
        wins.then(|| self.all.remove(0))
    }

    /// `winner` has become the estimate, and `former`, the one before, is a place like the others.
    pub(crate) fn succeed(&mut self, winner: &Hypothesis, mut former: Hypothesis) {
        for other in &mut self.all {
            other.odds -= winner.odds;
        }
        former.odds = -winner.odds;
        former.scans = winner.scans;
        former.metres = winner.metres;
        if former.odds > GIVEN_UP {
            self.all.push(former);
        }
    }

    /// The likeliest of these places.
    pub(crate) fn best(&self) -> Option<&Hypothesis> {
        self.all.iter().max_by(|a, b| a.odds.total_cmp(&b.odds))
    }

    /// The probability that the robot is at the likeliest of these places, and not where the estimate is. Most others
    /// fit one scan by chance.
    pub(crate) fn share(&self) -> f64 {
        let odds = self.best().map_or(0.0, |best| exp(best.odds.min(TAKES_OVER)));
        odds / (1.0 + odds)
    }
}

/// A turn by one radian shows as much that is new as so many metres of way, to a laser that sees nothing beside itself.
const SHOWN_PER_RADIAN: f64 = 1.0;

/// How much way a motion is worth for telling places apart, metres: it shows what the laser has not seen from here.
pub(crate) fn shown(motion: &Motion, laser: &LaserModel) -> f64 {
    let unseen = 1.0 - laser.fov / std::f64::consts::TAU;
    motion.travel.max(SHOWN_PER_RADIAN * unseen * motion.turn)
}

/// Whether two poses are one place.
pub(crate) fn is_near(a: Pose2, b: Pose2) -> bool {
    let turned = wrap_angle(a.heading - b.heading).abs();
    a.position().distance(b.position()) <= SAME_M && turned <= SAME_RAD
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::Surfaces;
    use curionav_planning::occupancy::{OccupancyGrid, RayCaster, StaticMap};
    use curionav_planning::random::rng;
    use curionav_planning::sensor::LaserModel;

    /// Two rooms of 6 m x 5 m side by side that differ by a block in the right one.
    fn map() -> StaticMap {
        let cell = |i: usize| {
            let column = i % 121;
            let row = i / 121;
            let is_wall = column.is_multiple_of(60) || row == 0 || row == 50;
            let is_block = (80..105).contains(&column) && (30..50).contains(&row);
            if is_wall || is_block { 100 } else { 0 }
        };
        let cells = (0..121 * 51).map(cell).collect();
        StaticMap::new(OccupancyGrid::new(121, 51, 0.1, Pose2::default(), cells).unwrap())
    }

    fn laser() -> LaserModel {
        LaserModel { range_max: 8.0, ..LaserModel::default() }
    }

    /// What a laser sees from `pose`.
    fn ranges(map: &StaticMap, pose: Pose2) -> Vec<f32> {
        let rays = RayCaster::new(map);
        let range = |beam: u32| {
            let (sin, cos) = curionav_planning::numerics::sin_cos(pose.heading + laser().bearing(beam));
            let from = map.grid.grid_from_map(pose.position());
            rays.range(from, (cos, sin), 80.0).map_or(8.0, |cells| 0.1 * cells as f32)
        };
        (0..laser().beams).map(range).collect()
    }

    /// Drives to and fro in one room, with a place in the other. The place that has taken over, after how many metres.
    fn driven(truth: f64, estimate: f64, place: f64) -> (Hypotheses, Option<f64>) {
        let map = map();
        let params = LocalizerParams::default();
        let field = LikelihoodField::new(&Surfaces::new(&map), 8.0, &params);
        let mut random = rng(1, 0);
        let mut hypotheses = Hypotheses::default();
        let at = |x: f64, k: u32| Pose2::new(x + 1.5 + 0.2 * f64::from(k % 10), 1.5, 0.0);
        hypotheses.add(&[at(place, 0)], 0.0, |_| false, &mut random);
        for k in 0..100 {
            let ranges = ranges(&map, at(truth, k));
            let scan = Scan { ranges: &ranges, laser: laser() };
            let seen = Selection::of(&scan, k.into(), &params);
            let observation =
                Observation { field: &field, scan: &scan, seen: &seen, exponent: 0.6, params: &params };
            let winner = hypotheses.judge(&observation, at(estimate, k), 0.2, &mut random);
            if winner.is_some() {
                return (hypotheses, Some(0.2 * f64::from(k + 1)));
            }
            let step = at(0.0, k).relative(at(0.0, k + 1));
            let motion = Motion {
                displacement: step,
                travel: step.position().distance(Default::default()),
                turn: 0.0,
            };
            hypotheses.advance(&motion, &OdometryNoise::default(), &mut random);
        }
        (hypotheses, None)
    }

    #[test]
    fn a_place_that_explains_the_scans_better_takes_over_and_no_other_does() {
        let (_, after) = driven(6.0, 0.0, 6.0);
        assert!(after.is_some_and(|metres| (1.0..15.0).contains(&metres)), "{after:?}");
        let (left, after) = driven(0.0, 0.0, 6.0);
        assert!(after.is_none() && left.share() < 0.01, "{after:?} {}", left.share());
    }

    #[test]
    fn the_place_of_the_estimate_is_no_other_place() {
        let (left, after) = driven(0.0, 0.0, 0.1);
        assert!(after.is_none() && left.share() == 0.0);
    }

    #[test]
    fn who_was_the_estimate_is_a_place_with_the_odds_turned_round() {
        let mut random = rng(1, 0);
        let mut hypotheses = Hypotheses::default();
        hypotheses.add(&[Pose2::new(5.0, 0.0, 0.0)], -2.0, |_| false, &mut random);
        let winner = Hypothesis::found_at(Pose2::default(), 6.5, &mut random);
        let former = Hypothesis::found_at(Pose2::new(9.0, 0.0, 0.0), 0.0, &mut random);
        hypotheses.succeed(&winner, former);
        let odds: Vec<f64> = hypotheses.all.iter().map(|it| it.odds).collect();
        assert_eq!(odds, [-8.5, -6.5]);
    }
}
