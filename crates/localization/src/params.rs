//! Parameters of the localiser.

use curionav_planning::parameters::{FieldError, Range};
use nalgebra::{Matrix3, Vector3};

curionav_planning::parameters! {
    /// How the beams of one scan are combined into a particle's weight.
    pub enum LaserLikelihood {
        /// ROS `likelihood_field`: the factor 1 + sum of cubes. Blunt and not a probability; kept for
        /// comparison.
        Plain,
        /// ROS `likelihood_field_prob`: the product over beams, without beams that people block.
        Prob,
    }
}

curionav_planning::parameters! {
    /// Everything the filter can be told. The defaults follow ROS 1 `amcl` where nothing else is said.
    pub struct LocalizerParams {
        /// Least number of particles. ROS has 100; 300 keep the sampling error of a variance near 8 %.
        pub particles_min: usize [1.0, 100_000.0, "particles", "each takes part in every update"] = 300,
        /// Greatest number of particles, and the number at the start. Bounds memory and the time of one update.
        pub particles_max: usize
            [1.0, 100_000.0, "particles", "each takes memory and takes part in every update"] = 5000,
        /// KLD-sampling's bound on the Kullback-Leibler distance to the true belief, dimensionless. Nav2's 0.05.
        pub kld_err: f64 [1e-4, 10.0, "", "the number of particles grows with its reciprocal"] = 0.05,
        /// Upper quantile of the standard normal for the probability that the bound holds: 2.326 for 0.99.
        /// (ROS takes 0.99 itself for the quantile, which is a probability of 0.84.)
        pub kld_z: f64 [0.0, 10.0, "standard deviations", "ten are certainty"] = 2.326_347_874_040_841,
        /// Side of a histogram bin, metres.
        pub bin_position: f64 [0.001, 100.0, "m", "every particle has its own bin below, all have one above"] = 0.5,
        /// Width of a histogram bin, radians.
        pub bin_heading: f64 [
            0.001, 1.6, "rad", "every particle has its own bin below, and a turn has four at least"
        ] = 10.0_f64.to_radians(),
        /// Distance travelled that calls for a filter update, metres.
        pub update_min_d: f64 [1e-6, 100.0, "m", "a filter that updates more rarely does not localise"] = 0.2,
        /// Angle turned that calls for a filter update, radians.
        pub update_min_a: f64
            [1e-6, 100.0, "rad", "a filter that updates more rarely does not localise"] = std::f64::consts::PI / 6.0,
        /// Longest time between filter updates, moving or not, seconds (D7).
        pub update_max_interval: f64
            [0.001, 1000.0, "s", "a filter that updates more rarely does not localise"] = 1.0,
        /// Resample when the effective sample size is below this share of the particles. ROS resamples at
        /// every second update regardless, which throws variety away when the weights are even.
        pub resample_ess: f64 [in Range::SHARE] = 0.5,
        /// Resampling happens at most at every n-th filter update.
        pub resample_interval: u32 [1.0, 1e6, "updates", "a filter that resamples more rarely does not"] = 1,
        /// Standard deviation added to every resampled copy's position, metres, so that copies of one particle
        /// do not stay one hypothesis (roughening, Gordon et al. 1993).
        pub roughening_position: f64 [0.0, 10.0, "m", "more throws away what scans have told"] = 0.005,
        /// The same for the heading, radians.
        pub roughening_heading: f64 [0.0, 10.0, "rad", "more throws away what scans have told"] = 0.002,
        /// Number of beams used, evenly spaced over the scan; the offset moves on at each update.
        pub beams: usize [1.0, 400.0, "beams", "each is looked up for every particle"] = 30,
        /// How beams are combined.
        pub model: LaserLikelihood [words] = LaserLikelihood::Prob,
        /// Standard deviation of a beam's end around the mapped obstacle, metres. Far above a range's own noise:
        /// it also stands for the map's errors, and a wide peak is what few particles can find. On a map as
        /// good as the laser 0.05 with `temper` 0.2 errs a third less in a crowd.
        pub sigma_hit: f64
            [0.001, 10.0, "m", "no laser is better than a millimetre, and beyond 10 m a range says nothing"] = 0.2,
        /// Whether the pose that is told is the one around the estimate at which the newest scan fits the map best, to
        /// a centimetre where walls are in sight. The covariance stays that of the particles.
        pub refine: bool = true,
        /// Share of beams that end on mapped obstacles.
        pub z_hit: f64 [1e-6, 1.0, "", "it is a share, and at none no scan says anything"] = 0.95,
        /// Share of beams that end anywhere.
        pub z_rand: f64 [1e-6, 1.0, "", "it is a share, and at none one stray beam rules a pose out"] = 0.05,
        /// Distance to an obstacle beyond which all distances are alike, and that of ends off the map, metres.
        pub max_distance: f64 [0.01, 100.0, "m", "the field of distances ends there"] = 2.0,
        /// A pose agrees with a beam whose end lies within this distance of a mapped obstacle, metres. Used
        /// for skipping beams and for the scan's fit.
        pub agreement_distance: f64 [0.0, 100.0, "m", "farther away nothing agrees"] = 0.3,
        /// What is seen at most this wide may be a person, metres: the width of one with arms and bags.
        pub person_width: f64 [0.0, 10.0, "m", "no person is wider"] = 0.8,
        /// How likely a narrow thing is a person, against one that the map shows where it should be: the odds
        /// of meeting people (1 in a crowd) by the density of ranges to them (1 / `range_max`) over that of
        /// ranges to mapped surfaces (1 / (sigma_hit sqrt(2 pi))), which is 0.1 (prob model).
        pub person_likelihood: f64 [1e-9, 1.0, "", "at none one person in the way rules a pose out"] = 0.1,
        /// Likelihood of a beam that gets through what the map shows as an obstacle, against one that need not:
        /// the map or the pose is a little wrong, or glass. Used while the belief is ambiguous (prob model).
        pub through_likelihood: f64 [1e-9, 1.0, "", "at none one beam through glass rules a pose out"] = 0.05,
        /// Exponent of a scan's likelihood. Beams and successive scans share the errors of map and model,
        /// so their plain product is not what a scan is worth. Chosen so that the mean normalised
        /// estimation error squared (3 for an honest filter) of simulated drives on a real map is near 2
        /// without people and 3.4 with four beams in ten blocked (D9); at 1 the latter is 4.2. It belongs to
        /// `sigma_hit` and `beams`: what counts is `beams * temper / sigma_hit^2`.
        pub temper: f64
            [1e-6, 10.0, "", "at none scans say nothing, and beyond 10 they say what they do not know"] = 0.6,
        /// Scans from one place repeat the same errors, so together they are worth one scan: what is left of
        /// `temper` there is used up by each of them and restored by motion. Each is worth at least this
        /// share, so that a robot at rest still sees people walk off.
        pub rest_temper: f64 [in Range::SHARE] = 0.02,
        /// The exponent is lowered further where the effective sample size would fall below this share of
        /// the particles, so that a sharp scan cannot leave a broad belief with one particle.
        pub temper_ess: f64 [in Range::SHARE] = 0.1,
        /// Decay rate per update of the long-term mean of the scan's fit (augmented MCL).
        pub recovery_alpha_slow: f64 [in Range::SHARE] = 0.001,
        /// Decay rate per update of the short-term mean.
        pub recovery_alpha_fast: f64 [in Range::SHARE] = 0.1,
        /// The estimate is in doubt while the short-term mean times this is below the long-term one: with 1.1, while
        /// the short-term fit is below 91 % of the long-term one.
        pub recovery_gain: f64 [0.0, 100.0, "", "beyond, nothing raises a doubt"] = 1.1,
        /// Scans of which less than this share of the beams tells people from walls neither raise nor settle a
        /// doubt.
        pub recovery_evidence_min: f64 [in Range::SHARE] = 0.1,
        /// Other places are looked for once the estimate has been in doubt for this many seconds ...
        pub recovery_seconds: f64 [0.0, 1e6, "s", "no run lasts longer"] = 2.0,
        /// ... and this many metres travelled.
        pub recovery_metres: f64 [0.0, 1e6, "m", "no robot drives farther in a run"] = 1.0,
        /// A cluster that is not within reach of the estimate becomes the estimate after it has been the
        /// heaviest for this many scans ...
        pub takeover_scans: u32 [0.0, 1e6, "scans", "no run has more"] = 4,
        /// ... and this many metres travelled.
        pub takeover_metres: f64 [0.0, 1e6, "m", "no robot drives farther in a run"] = 1.0,
        /// Both means start at least here: a start at the wrong place must not pass for normal, and a broad
        /// one has a few scans' time to converge.
        pub recovery_expected_fit: f64 [in Range::SHARE] = 0.8,
        /// Standard deviation of position at the start on each axis, metres.
        pub start_sigma_position: f64 [0.0, 100.0, "m", "a filter spread wider has nothing to start from"] = 0.5,
        /// Standard deviation of heading at the start, radians.
        pub start_sigma_heading: f64 [0.0, 10.0, "rad", "a turn is all there is"] = std::f64::consts::PI / 12.0,
        /// The belief has converged when its worst position deviation is at most this, metres ...
        pub converged_sigma: f64 [0.0, 100.0, "m", "more is no convergence"] = 0.3,
        /// ... and at most this share of the weight lies outside the heaviest cluster.
        pub converged_outside: f64 [in Range::SHARE] = 0.1,
    } check Self::bounds_agree
}

impl LocalizerParams {
    /// The covariance that they state for a start: (x, y, heading), m2 and rad2.
    pub fn start_covariance(&self) -> Matrix3<f64> {
        let position = self.start_sigma_position * self.start_sigma_position;
        let heading = self.start_sigma_heading * self.start_sigma_heading;
        Matrix3::from_diagonal(&Vector3::new(position, position, heading))
    }

    fn bounds_agree(&self) -> Result<(), FieldError> {
        if self.particles_min <= self.particles_max {
            return Ok(());
        }
        let problem = format!("is {}, more than particles_max", self.particles_min);
        Err(FieldError::new("particles_min", problem, format!("give at most {}", self.particles_max)))
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::parameters::Ranged;

    use super::*;

    #[test]
    fn the_defaults_are_in_range_and_a_wrong_field_is_named() {
        assert_eq!(LocalizerParams::default().check(), Ok(()));
        let inverted = LocalizerParams { particles_min: 10, particles_max: 5, ..Default::default() };
        assert_eq!(inverted.check().unwrap_err().field, "particles_min");
        let not_a_number = LocalizerParams { temper: f64::NAN, ..Default::default() };
        assert_eq!(not_a_number.check().unwrap_err().field, "temper");
    }
}
