//! Where people will be: constant velocity with a growing Gaussian (A20).

crate::parameters! {
    /// Parameters of the forecast.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct ForecastParams {
        /// Standard deviation of a person's position now, metres, on each axis.
        pub sigma_position: f64 [0.0, 10.0, "m", "a person known less well than that is not known"] = 0.1,
        /// Standard deviation of a person's velocity, m/s, on each axis.
        pub sigma_velocity: f64 [0.0, 10.0, "m/s", "no person runs faster"] = 0.15,
    }
}

impl ForecastParams {
    /// Variance of a person's position after `t` seconds on each axis, m2.
    pub fn variance(&self, t: f64) -> f64 {
        let spread = self.sigma_velocity * t;
        self.sigma_position * self.sigma_position + spread * spread
    }
}
