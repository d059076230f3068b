//! Where people will be: constant velocity with a growing Gaussian (A20).

use crate::parameters;

use crate::geometry::Point2;
use crate::scene::People;

parameters! {
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

/// Constant-velocity forecast of all people in the scene.
#[derive(Debug, Clone)]
pub struct PedestrianForecast<'a> {
    people: &'a People,
    params: ForecastParams,
}

impl<'a> PedestrianForecast<'a> {
    /// Forecast `people` from now on.
    pub fn new(people: &'a People, params: ForecastParams) -> Self {
        Self { people, params }
    }

    /// The people it is about.
    pub fn people(&self) -> &'a People {
        self.people
    }

    /// Mean position of person `i` after `t` seconds, metres.
    pub fn position(&self, i: usize, t: f64) -> Point2 {
        Point2::new(self.people.x[i] + self.people.vx[i] * t, self.people.y[i] + self.people.vy[i] * t)
    }

    /// Variance of that position on each axis, m2.
    pub fn variance(&self, t: f64) -> f64 {
        self.params.variance(t)
    }
}
