//! How far the estimate can be trusted: whether the scans fit the map, and how likely the robot is somewhere else.

use nalgebra::{Matrix3, Vector3};

use curionav_planning::geometry::{Pose2, wrap_angle};
use curionav_planning::numerics::exp;

/// Whether a robot may act on the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Confidence {
    /// The scans fit the map where the estimate is, and hardly any weight lies elsewhere.
    #[default]
    Sure,
    /// The robot may be elsewhere, or the map explains little of what the laser sees.
    Doubtful,
    /// The robot is probably elsewhere, or there is no estimate yet.
    Lost,
}

/// The fit of scans is averaged over so many seconds.
const MEAN_OVER_S: f64 = 0.8;
/// While the mean fit is at least this share of what is usual, it says nothing.
const USUAL_FIT: f64 = 0.82;
/// A mean fit of this share of what is usual, or less, is that of any place.
const FIT_OF_ANY_PLACE: f64 = 0.35;
/// Below this mean fit nothing is sure, whatever is usual on this map.
const POOR_FIT: f64 = 0.7;
/// Doubts begin above this probability of being elsewhere.
const DOUBTED_ABOVE: f64 = 0.05;
/// Above it the robot is lost.
const LOST_ABOVE: f64 = 0.8;
/// Where a search has found no better place, the robot is elsewhere with this probability at most.
const AFTER_SEARCH: f64 = 0.25;
/// A level is left at this share of the limit by which it was entered, so that it does not flicker.
const RELEASED_AT: f64 = 0.6;
/// The mean fit that ends a doubt about the map.
const GOOD_FIT: f64 = 0.75;

/// Follows the fit of scans over time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Trust {
    mean_fit: f64,
    elsewhere: f64,
    /// Whether all of the map has been searched since scans stopped fitting.
    has_searched: bool,
    confidence: Confidence,
}

impl Default for Trust {
    fn default() -> Self {
        Self { mean_fit: 1.0, elsewhere: 0.0, has_searched: false, confidence: Confidence::Sure }
    }
}

impl Trust {
    /// Takes in the fit of a scan, so many seconds after the last. `evidence` is the share of its beams that tells
    /// walls from people, `usual` the long-term mean of the fit.
    pub(crate) fn observe(&mut self, fit: f64, evidence: f64, seconds: f64, usual: f64) {
        let weight = (1.0 - exp(-seconds / MEAN_OVER_S)) * evidence;
        self.mean_fit += weight * (fit - self.mean_fit);
        let share = self.mean_fit / usual.max(f64::MIN_POSITIVE);
        self.elsewhere = ((USUAL_FIT - share) / (USUAL_FIT - FIT_OF_ANY_PLACE)).clamp(0.0, 1.0);
        self.has_searched &= self.elsewhere > 0.0;
    }

    /// All of the map has been searched for places that explain the scans. Those that may are followed from now on.
    pub(crate) fn has_searched_everywhere(&mut self) {
        self.has_searched = self.elsewhere > 0.0;
    }

    /// Whether scans have stopped fitting, and nothing has been searched since.
    pub(crate) fn awaits_search(&self) -> bool {
        self.elsewhere > 0.0 && !self.has_searched
    }

    /// The probability that the robot is at a place that is not followed, as the fit tells it. After a search it is the
    /// map that may be wrong.
    pub(crate) fn elsewhere(&self) -> f64 {
        if self.has_searched { self.elsewhere.min(AFTER_SEARCH) } else { self.elsewhere }
    }

    /// Sets the level by the probability that the robot is not where the estimate is.
    pub(crate) fn judge(&mut self, outside: f64) -> Confidence {
        let lost_above = self.limit(Confidence::Lost, LOST_ABOVE);
        let doubted_above = self.limit(Confidence::Doubtful, DOUBTED_ABOVE);
        let fit_needed = if self.confidence >= Confidence::Doubtful { GOOD_FIT } else { POOR_FIT };
        self.confidence = if outside > lost_above {
            Confidence::Lost
        } else if outside > doubted_above || self.mean_fit < fit_needed {
            Confidence::Doubtful
        } else {
            Confidence::Sure
        };
        self.confidence
    }

    /// The limit above which a level begins, or below which it ends.
    fn limit(&self, level: Confidence, begins_above: f64) -> f64 {
        if self.confidence >= level { RELEASED_AT * begins_above } else { begins_above }
    }
}

/// Where more weight than this lies outside the estimate, the covariance that is told is that of all places.
pub(crate) const MIXED_ABOVE: f64 = 0.05;

/// Where the robot may be besides the place of the estimate.
#[derive(Debug, Default)]
pub(crate) struct Elsewhere {
    places: Vec<Place>,
}

/// One place, or many, that a robot may be at.
#[derive(Debug)]
struct Place {
    weight: f64,
    pose: Pose2,
    covariance: Matrix3<f64>,
}

impl Elsewhere {
    pub(crate) fn clear(&mut self) {
        self.places.clear();
    }

    /// Adds a belief of this weight, by its mean and covariance.
    pub(crate) fn add(&mut self, weight: f64, (pose, covariance): (Pose2, Matrix3<f64>)) {
        self.places.push(Place { weight, pose, covariance });
    }

    /// The second moment of the estimate, which has the weight `own`, and of all other places about its pose, (x, y,
    /// heading): m2, m rad, rad2. Without other places it is the covariance of the estimate.
    pub(crate) fn covariance_about(&self, estimate: (Pose2, Matrix3<f64>), own: f64) -> Matrix3<f64> {
        let (pose, covariance) = estimate;
        if self.places.is_empty() {
            return covariance;
        }
        let total: f64 = own + self.places.iter().map(|place| place.weight).sum::<f64>();
        let mut spread = covariance * (own / total);
        for place in &self.places {
            let turned = wrap_angle(place.pose.heading - pose.heading);
            let off = Vector3::new(place.pose.x - pose.x, place.pose.y - pose.y, turned);
            spread += (place.covariance + off * off.transpose()) * (place.weight / total);
        }
        spread
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(trust: &mut Trust, fit: f64, scans: usize) -> Confidence {
        let mut confidence = Confidence::Sure;
        for _ in 0..scans {
            trust.observe(fit, 1.0, 0.2, 0.95);
            confidence = trust.judge(trust.elsewhere());
        }
        confidence
    }

    #[test]
    fn scans_that_stop_fitting_make_it_doubtful_and_then_lost_within_two_seconds() {
        let mut trust = Trust::default();
        assert_eq!(after(&mut trust, 0.95, 50), Confidence::Sure);
        assert_eq!(after(&mut trust, 0.3, 2), Confidence::Doubtful);
        assert_eq!(after(&mut trust, 0.3, 8), Confidence::Lost);
        assert_eq!(after(&mut trust, 0.95, 4), Confidence::Doubtful);
        assert_eq!(after(&mut trust, 0.95, 20), Confidence::Sure);
    }

    #[test]
    fn a_map_that_explains_little_is_doubtful_and_not_lost() {
        let mut trust = Trust::default();
        for _ in 0..50 {
            trust.observe(0.6, 1.0, 0.2, 0.6);
        }
        assert_eq!((trust.elsewhere(), trust.judge(0.0)), (0.0, Confidence::Doubtful));
    }

    #[test]
    fn after_a_search_it_may_be_the_map_that_is_wrong() {
        let mut trust = Trust::default();
        assert_eq!(after(&mut trust, 0.3, 20), Confidence::Lost);
        assert!(trust.awaits_search());
        trust.has_searched_everywhere();
        assert_eq!((after(&mut trust, 0.3, 5), trust.awaits_search()), (Confidence::Doubtful, false));
        assert_eq!(after(&mut trust, 0.95, 20), Confidence::Sure);
        assert_eq!(after(&mut trust, 0.3, 20), Confidence::Lost);
    }

    #[test]
    fn a_crowd_tells_nothing() {
        let mut trust = Trust::default();
        for _ in 0..50 {
            trust.observe(0.0, 0.0, 0.2, 0.95);
        }
        assert_eq!(trust.judge(trust.elsewhere()), Confidence::Sure);
    }

    #[test]
    fn the_spread_of_two_places_is_their_distance() {
        let mut elsewhere = Elsewhere::default();
        let near = (Pose2::new(1.0, 0.0, 3.0), Matrix3::identity());
        assert_eq!(elsewhere.covariance_about(near, 3.0), near.1);
        elsewhere.add(1.0, (Pose2::new(5.0, 0.0, -3.0), Matrix3::zeros()));
        let spread = elsewhere.covariance_about(near, 3.0);
        let turned = std::f64::consts::TAU - 6.0;
        // 3/4 of 1, and 1/4 of 4 m squared, of the short way round squared, and of both.
        assert!((spread[(0, 0)] - 4.75).abs() < 1e-12 && (spread[(1, 1)] - 0.75).abs() < 1e-12);
        assert!((spread[(2, 2)] - (0.75 + 0.25 * turned * turned)).abs() < 1e-12);
        assert!((spread[(0, 2)] - turned).abs() < 1e-12, "{spread}");
    }
}
