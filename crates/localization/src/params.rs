//! Parameters of the localiser.

use serde::{Deserialize, Serialize};

/// How the beams of one scan are combined into a particle's weight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LaserLikelihood {
    /// ROS `likelihood_field`: the factor 1 + sum of cubes. Blunt and not a probability; kept for
    /// comparison.
    Plain,
    /// ROS `likelihood_field_prob`: the product over beams, without beams that people block.
    Prob,
}

/// Everything the filter can be told. The defaults follow ROS 1 `amcl` where nothing else is said.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LocalizerParams {
    /// Least number of particles. ROS has 100; 300 keep the sampling error of a variance near 8 %.
    pub particles_min: usize,
    /// Greatest number of particles, and the number at the start. Bounds memory and the time of one update.
    pub particles_max: usize,
    /// KLD-sampling's bound on the Kullback-Leibler distance to the true belief, dimensionless. Nav2's 0.05.
    pub kld_err: f64,
    /// Upper quantile of the standard normal for the probability that the bound holds: 2.326 for 0.99.
    /// (ROS takes 0.99 itself for the quantile, which is a probability of 0.84.)
    pub kld_z: f64,
    /// Side of a histogram bin, metres.
    pub bin_position: f64,
    /// Width of a histogram bin, radians.
    pub bin_heading: f64,
    /// Distance travelled that calls for a filter update, metres.
    pub update_min_d: f64,
    /// Angle turned that calls for a filter update, radians.
    pub update_min_a: f64,
    /// Longest time between filter updates, moving or not, seconds (D7).
    pub update_max_interval: f64,
    /// Resample when the effective sample size is below this share of the particles. ROS resamples at
    /// every second update regardless, which throws variety away when the weights are even.
    pub resample_ess: f64,
    /// Resampling happens at most at every n-th filter update.
    pub resample_interval: u32,
    /// Standard deviation added to every resampled copy's position, metres, so that copies of one particle
    /// do not stay one hypothesis (roughening, Gordon et al. 1993).
    pub roughening_position: f64,
    /// The same for the heading, radians.
    pub roughening_heading: f64,
    /// Number of beams used, evenly spaced over the scan; the offset moves on at each update.
    pub beams: usize,
    /// How beams are combined.
    pub model: LaserLikelihood,
    /// Standard deviation of a beam's end around the mapped obstacle, metres. Far above a range's own noise:
    /// it also stands for the map's errors, and a wide peak is what few particles can find. On a map as
    /// good as the laser 0.05 with `temper` 0.2 errs a third less in a crowd.
    pub sigma_hit: f64,
    /// Share of beams that end on mapped obstacles.
    pub z_hit: f64,
    /// Share of beams that end anywhere.
    pub z_rand: f64,
    /// Distance to an obstacle beyond which all distances are alike, and that of ends off the map, metres.
    pub max_distance: f64,
    /// A pose agrees with a beam whose end lies within this distance of a mapped obstacle, metres. Used
    /// for skipping beams and for the scan's fit.
    pub agreement_distance: f64,
    /// What is seen at most this wide may be a person, metres: the width of one with arms and bags.
    pub person_width: f64,
    /// How likely a narrow thing is a person, against one that the map shows where it should be: the odds
    /// of meeting people (1 in a crowd) by the density of ranges to them (1 / `range_max`) over that of
    /// ranges to mapped surfaces (1 / (sigma_hit sqrt(2 pi))), which is 0.1 (prob model).
    pub person_likelihood: f64,
    /// Likelihood of a beam that gets through what the map shows as an obstacle, against one that need not:
    /// the map or the pose is a little wrong, or glass. Used while the belief is ambiguous (prob model).
    pub through_likelihood: f64,
    /// Exponent of a scan's likelihood. Beams and successive scans share the errors of map and model,
    /// so their plain product is not what a scan is worth. Chosen so that the mean normalised
    /// estimation error squared (3 for an honest filter) of simulated drives on a real map is near 2
    /// without people and 3.4 with four beams in ten blocked (D9); at 1 the latter is 4.2. It belongs to
    /// `sigma_hit` and `beams`: what counts is `beams * temper / sigma_hit^2`.
    pub temper: f64,
    /// Scans from one place repeat the same errors, so together they are worth one scan: what is left of
    /// `temper` there is used up by each of them and restored by motion. Each is worth at least this
    /// share, so that a robot at rest still sees people walk off.
    pub rest_temper: f64,
    /// The exponent is lowered further where the effective sample size would fall below this share of
    /// the particles, so that a sharp scan cannot leave a broad belief with one particle.
    pub temper_ess: f64,
    /// Decay rate per update of the long-term mean of the scan's fit (augmented MCL).
    pub recovery_alpha_slow: f64,
    /// Decay rate per update of the short-term mean.
    pub recovery_alpha_fast: f64,
    /// Random poses are a share `1 - gain * fast / slow` of the particles: with 1.1, none while the
    /// short-term fit is above 91 % of the long-term one.
    pub recovery_gain: f64,
    /// Greatest share of random poses.
    pub recovery_share_max: f64,
    /// Scans of which less than this share of the beams tells people from walls neither raise nor settle a
    /// doubt.
    pub recovery_evidence_min: f64,
    /// The estimate must have been in doubt for this many seconds ...
    pub recovery_local_seconds: f64,
    /// ... and this many metres travelled before poses around it are drawn,
    pub recovery_local_metres: f64,
    /// and this many seconds ...
    pub recovery_global_seconds: f64,
    /// ... and metres before poses all over the map are. People stand in the way far more often than
    /// somebody carries the robot.
    pub recovery_global_metres: f64,
    /// A cluster that is not within reach of the estimate becomes the estimate after it has been the
    /// heaviest for this many scans ...
    pub takeover_scans: u32,
    /// ... and this many metres travelled.
    pub takeover_metres: f64,
    /// Least number of particles while random poses are drawn.
    pub recovery_particles: usize,
    /// Each random pose is the best of this many by its fit to the scan (sensor resetting).
    pub recovery_tournament: u32,
    /// Both means start at least here: a start at the wrong place must not pass for normal, and a broad
    /// one has a few scans' time to converge.
    pub recovery_expected_fit: f64,
    /// Standard deviation of position at the start on each axis, metres.
    pub start_sigma_position: f64,
    /// Standard deviation of heading at the start, radians.
    pub start_sigma_heading: f64,
    /// The belief has converged when its worst position deviation is at most this, metres ...
    pub converged_sigma: f64,
    /// ... and at most this share of the weight lies outside the heaviest cluster.
    pub converged_outside: f64,
}

impl Default for LocalizerParams {
    fn default() -> Self {
        Self {
            particles_min: 300,
            particles_max: 5000,
            kld_err: 0.05,
            kld_z: 2.326_347_874_040_841,
            bin_position: 0.5,
            bin_heading: 10.0_f64.to_radians(),
            update_min_d: 0.2,
            update_min_a: std::f64::consts::PI / 6.0,
            update_max_interval: 1.0,
            resample_ess: 0.5,
            resample_interval: 1,
            roughening_position: 0.005,
            roughening_heading: 0.002,
            beams: 30,
            model: LaserLikelihood::Prob,
            sigma_hit: 0.2,
            z_hit: 0.95,
            z_rand: 0.05,
            max_distance: 2.0,
            agreement_distance: 0.3,
            person_width: 0.8,
            person_likelihood: 0.1,
            through_likelihood: 0.05,
            temper: 0.6,
            rest_temper: 0.02,
            temper_ess: 0.1,
            recovery_alpha_slow: 0.001,
            recovery_alpha_fast: 0.1,
            recovery_gain: 1.1,
            recovery_share_max: 0.3,
            recovery_evidence_min: 0.1,
            recovery_local_seconds: 2.0,
            recovery_local_metres: 1.0,
            recovery_global_seconds: 10.0,
            recovery_global_metres: 5.0,
            takeover_scans: 4,
            takeover_metres: 1.0,
            recovery_particles: 1000,
            recovery_tournament: 32,
            recovery_expected_fit: 0.8,
            start_sigma_position: 0.5,
            start_sigma_heading: std::f64::consts::PI / 12.0,
            converged_sigma: 0.3,
            converged_outside: 0.1,
        }
    }
}

/// A parameter outside its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("localizer: `{name}` must be {range}, found {found}")]
pub struct ParamsError {
    /// The field.
    pub name: &'static str,
    /// What it may be.
    pub range: &'static str,
    /// What it is.
    pub found: f64,
}

impl LocalizerParams {
    /// Most particles a filter may have: bounds the memory a configuration can ask for.
    pub const PARTICLES_LIMIT: usize = 100_000;
    /// Most beams an update may use.
    pub const BEAMS_LIMIT: usize = 400;

    /// The first field that is out of its range, if any.
    pub fn check(&self) -> Result<(), ParamsError> {
        let within = |name, range, found: f64, least: f64, most: f64| {
            if (least..=most).contains(&found) { Ok(()) } else { Err(ParamsError { name, range, found }) }
        };
        let count =
            |name, n: usize, most: usize| within(name, "at least 1 and bounded", n as f64, 1.0, most as f64);
        let share = |name, x: f64| within(name, "from 0 to 1", x, 0.0, 1.0);
        let positive = |name, x: f64| within(name, "positive and finite", x, f64::MIN_POSITIVE, f64::MAX);
        let at_least_zero = |name, x: f64| within(name, "at least 0 and finite", x, 0.0, f64::MAX);

        count("particles_max", self.particles_max, Self::PARTICLES_LIMIT)?;
        count("particles_min", self.particles_min, self.particles_max)?;
        count("recovery_particles", self.recovery_particles, Self::PARTICLES_LIMIT)?;
        count("beams", self.beams, Self::BEAMS_LIMIT)?;
        count("resample_interval", self.resample_interval as usize, u32::MAX as usize)?;
        count("recovery_tournament", self.recovery_tournament as usize, 1000)?;
        positive("kld_err", self.kld_err)?;
        positive("bin_position", self.bin_position)?;
        within("bin_heading", "from 0.001 to pi/2", self.bin_heading, 0.001, std::f64::consts::FRAC_PI_2)?;
        positive("update_max_interval", self.update_max_interval)?;
        positive("sigma_hit", self.sigma_hit)?;
        positive("z_hit", self.z_hit)?;
        positive("z_rand", self.z_rand)?;
        positive("max_distance", self.max_distance)?;
        positive("update_min_d", self.update_min_d)?;
        positive("update_min_a", self.update_min_a)?;
        positive("temper", self.temper)?;
        within("person_likelihood", "above 0, at most 1", self.person_likelihood, 1e-9, 1.0)?;
        within("through_likelihood", "above 0, at most 1", self.through_likelihood, 1e-9, 1.0)?;
        at_least_zero("person_width", self.person_width)?;
        at_least_zero("kld_z", self.kld_z)?;
        at_least_zero("agreement_distance", self.agreement_distance)?;
        at_least_zero("roughening_position", self.roughening_position)?;
        at_least_zero("roughening_heading", self.roughening_heading)?;
        at_least_zero("recovery_gain", self.recovery_gain)?;
        at_least_zero("recovery_local_seconds", self.recovery_local_seconds)?;
        at_least_zero("recovery_local_metres", self.recovery_local_metres)?;
        at_least_zero("recovery_global_seconds", self.recovery_global_seconds)?;
        at_least_zero("recovery_global_metres", self.recovery_global_metres)?;
        at_least_zero("takeover_metres", self.takeover_metres)?;
        at_least_zero("start_sigma_position", self.start_sigma_position)?;
        at_least_zero("start_sigma_heading", self.start_sigma_heading)?;
        at_least_zero("converged_sigma", self.converged_sigma)?;
        share("resample_ess", self.resample_ess)?;
        share("rest_temper", self.rest_temper)?;
        share("temper_ess", self.temper_ess)?;
        share("recovery_evidence_min", self.recovery_evidence_min)?;
        share("recovery_alpha_slow", self.recovery_alpha_slow)?;
        share("recovery_alpha_fast", self.recovery_alpha_fast)?;
        share("recovery_share_max", self.recovery_share_max)?;
        share("recovery_expected_fit", self.recovery_expected_fit)?;
        share("converged_outside", self.converged_outside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_in_range_and_a_wrong_field_is_named() {
        assert_eq!(LocalizerParams::default().check(), Ok(()));
        let inverted = LocalizerParams { particles_min: 10, particles_max: 5, ..Default::default() };
        assert_eq!(inverted.check().unwrap_err().name, "particles_min");
        let not_a_number = LocalizerParams { temper: f64::NAN, ..Default::default() };
        assert_eq!(not_a_number.check().unwrap_err().name, "temper");
    }
}
