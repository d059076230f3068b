//! Where people will be: constant velocity (A20), and how far from there they may be.

mod regions;

pub use regions::{HORIZONS, REGION, region_radius};

crate::parameters! {
    /// How far from where they are expected people may be.
    #[derive(Default)]
    #[non_exhaustive]
    pub enum Spread {
        /// All alike, as `sigma_position` and `sigma_velocity` say.
        #[default]
        Even,
        /// As far as filmed people were who walked as fast. Risk-RRT takes all people alike nevertheless.
        Measured,
    }
}

crate::parameters! {
    /// Parameters of the forecast.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct ForecastParams {
        /// Standard deviation of a person's position now, metres, on each axis.
        pub sigma_position: f64 [0.0, 10.0, "m", "a person known less well than that is not known"] = 0.1,
        /// Standard deviation of a person's velocity, m/s, on each axis.
        pub sigma_velocity: f64 [0.0, 10.0, "m/s", "no person runs faster"] = 0.15,
        /// How far from where they are expected people may be.
        pub spread: Spread [words] = Spread::Even,
    }
}

/// Standard deviations of a Gaussian of two axes within which it is with probability [`REGION`]: (-2 ln 0.1)^(1/2).
const REGION_SIGMAS: f64 = 2.145_966_026_289_347;

impl ForecastParams {
    /// Variance of any person's position after `t` seconds on each axis, m2.
    pub fn variance(&self, t: f64) -> f64 {
        let spread = self.sigma_velocity * t;
        self.sigma_position * self.sigma_position + spread * spread
    }

    /// Variance of the position of one who walks at `speed` m/s now, after `t` seconds on each axis, m2.
    pub fn variance_at(&self, speed: f64, t: f64) -> f64 {
        match self.spread {
            Spread::Even => self.variance(t),
            Spread::Measured => {
                let sigma = region_radius(speed, t) / REGION_SIGMAS;
                sigma * sigma
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measured_people_are_in_the_region_as_often_as_the_gaussian_says() {
        let forecast = ForecastParams { spread: Spread::Measured, ..ForecastParams::default() };
        // The mass of a Gaussian within a radius r is 1 - exp(-r^2 / (2 variance)).
        for speed in [0.0, 0.5, 1.0, 1.6] {
            for t in [0.4, 1.0, 2.2, 4.0] {
                let radius = region_radius(speed, t);
                let held =
                    1.0 - crate::numerics::exp(-0.5 * radius * radius / forecast.variance_at(speed, t));
                assert!((held - REGION).abs() < 1e-12, "{held}");
            }
        }
        let even = ForecastParams::default();
        assert_eq!(even.variance_at(1.3, 2.0).to_bits(), even.variance(2.0).to_bits());
    }
}
