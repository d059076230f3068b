//! From the last velocity down to zero, as hard as the base brakes: a step to zero makes a base lurch, and its load
//! tip.

use std::time::Duration;

use curionav_planning::geometry::Twist;
use curionav_runtime::robot_limits::RobotLimits;

/// The way down from one velocity. The default stands.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Ramp {
    from: Twist,
    /// Seconds until it stands.
    seconds: f64,
}

impl Ramp {
    /// From this velocity with the base's own brakes.
    pub(crate) fn new(from: Twist, limits: &RobotLimits) -> Self {
        let seconds = (from.v.abs() / limits.a_max).max(from.omega.abs() / limits.alpha_max);
        Self { from, seconds }
    }

    /// How long it takes.
    pub(crate) fn duration(&self) -> Duration {
        Duration::try_from_secs_f64(self.seconds).unwrap_or_default()
    }

    /// The velocity after so long: on the same curve, ever slower.
    pub(crate) fn after(&self, time: Duration) -> Twist {
        let left = if self.seconds > 0.0 { (1.0 - time.as_secs_f64() / self.seconds).max(0.0) } else { 0.0 };
        Twist { v: self.from.v * left, omega: self.from.omega * left }
    }
}

/// What a base that has been paused for so long lets through of a command: no more than it would drive if it had braked
/// from its greatest speed since, so that the driver has time to brake by itself.
pub(crate) fn held_back(command: Twist, paused: Option<Duration>, limits: &RobotLimits) -> Twist {
    let Some(paused) = paused else { return command };
    let ramp = Ramp::new(Twist { v: limits.v_max, omega: 0.0 }, limits);
    if paused >= ramp.duration() {
        return Twist::default();
    }
    let most = ramp.after(paused).v;
    Twist { v: command.v.clamp(-most, most), ..command }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_paused_base_lets_less_and_less_through() {
        let limits: RobotLimits = toml::from_str(
            "v_max = 1.0\na_max = 0.5\nomega_max = 1.0\nalpha_max = 1.0\nradius = 0.3\ntick_s = 0.1",
        )
        .unwrap();
        let driven = Twist { v: 0.8, omega: 0.3 };
        let held = |seconds: f64| held_back(driven, Some(Duration::from_secs_f64(seconds)), &limits);
        assert_eq!(held_back(driven, None, &limits), driven);
        assert_eq!(held(0.2), driven);
        assert!((held(1.0).v - 0.5).abs() < 1e-12);
        assert_eq!(held(2.0), Twist::default());
        let back = Twist { v: -0.8, omega: 0.0 };
        assert!((held_back(back, Some(Duration::from_secs(1)), &limits).v + 0.5).abs() < 1e-12);
    }

    #[test]
    fn it_brakes_on_the_same_curve_as_hard_as_the_base_can() {
        let limits: RobotLimits = toml::from_str(
            "v_max = 0.8\na_max = 0.5\nomega_max = 1.0\nalpha_max = 1.0\nradius = 0.3\ntick_s = 0.1",
        )
        .unwrap();
        let ramp = Ramp::new(Twist { v: 0.4, omega: 0.2 }, &limits);
        assert_eq!(ramp.duration(), Duration::from_millis(800));
        let halfway = ramp.after(Duration::from_millis(400));
        assert!((halfway.v - 0.2).abs() < 1e-12 && (halfway.omega - 0.1).abs() < 1e-12);
        assert_eq!(ramp.after(Duration::from_secs(1)), Twist::default());
        // Turning on the spot takes as long as its own brakes do.
        let turn = Ramp::new(Twist { v: 0.0, omega: 1.0 }, &limits);
        assert_eq!(turn.duration(), Duration::from_secs(1));
        assert_eq!(Ramp::default().after(Duration::ZERO), Twist::default());
    }
}
