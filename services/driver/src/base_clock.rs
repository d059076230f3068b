//! Whether the base's clock goes as the driver's own does, and whether its odometry is of a base that can drive so.
//!
//! Every age that the driver checks is by the base's clock: a clock that crawls would make everything young.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use curionav_planning::geometry::wrap_angle;
use curionav_planning::motion::RobotModel;
use curionav_schemas::Odometry;

/// How far back samples are compared with.
const WINDOW: Duration = Duration::from_secs(2);
/// A sample is compared with those that are at least so much older: two ticks of the slowest usual base.
const APART: Duration = Duration::from_millis(150);
/// How much later a sample may come than the least delayed of the window, seconds: more is a slow link or a slow clock.
const LATE: f64 = 0.15;
/// How much earlier, seconds: no link brings anything before its time.
const EARLY: f64 = 0.1;
/// How much farther odometry may say that the base has moved than it can, by its limits: a factor, and metres or
/// radians for wheels that slip and stamps that are rounded.
const BEYOND: (f64, f64) = (2.0, 0.3);

/// Offsets between the two clocks over the recent past: pure, with the time as an argument.
#[derive(Debug, Default)]
pub struct BaseClock {
    /// When a sample came, and its stamp minus that time, seconds.
    offsets: VecDeque<(Instant, f64)>,
    origin: Option<Instant>,
}

impl BaseClock {
    /// Takes note of a sample with this stamp; whether the base's clock has gone as it should, as far as is known.
    pub fn heard(&mut self, stamp: f64, now: Instant) -> bool {
        let origin = *self.origin.get_or_insert(now);
        let offset = stamp - now.saturating_duration_since(origin).as_secs_f64();
        while self.offsets.front().is_some_and(|(then, _)| now.saturating_duration_since(*then) > WINDOW) {
            self.offsets.pop_front();
        }
        let older = self.offsets.iter().take_while(|(then, _)| now.saturating_duration_since(*then) >= APART);
        let least_delayed = older.map(|(_, offset)| *offset).max_by(f64::total_cmp);
        self.offsets.push_back((now, offset));
        least_delayed.is_none_or(|least| (-LATE..=EARLY).contains(&(offset - least)))
    }

    /// Forgets the past: the base has started over.
    pub fn clear(&mut self) {
        self.offsets.clear();
    }
}

/// Whether a base with these limits can have moved so between two samples of its odometry.
pub fn is_motion(before: &Odometry, after: &Odometry, robot: &RobotModel) -> bool {
    let (factor, slack) = BEYOND;
    let seconds = (after.stamp - before.stamp).max(0.0);
    let moved = (after.x - before.x).hypot(after.y - before.y);
    let turned = wrap_angle(after.heading - before.heading).abs();
    moved <= factor * robot.v_max * seconds + slack && turned <= factor * robot.omega_max * seconds + slack
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    const TICK: f64 = 0.1;

    /// Seconds after which a clock that goes `rate` times as fast as it should is noticed, from when it does; its ticks
    /// come at its own pace, or at the right one if it is only stamps that are wrong.
    fn noticed(rate: f64, own_pace: bool) -> Option<f64> {
        let mut clock = BaseClock::default();
        let start = Instant::now();
        let mut stamp = 0.0;
        let mut time = 0.0;
        for tick in 0..100 {
            let rate = if tick < 30 { 1.0 } else { rate };
            stamp += if own_pace { TICK } else { TICK * rate };
            time += if own_pace { TICK / rate } else { TICK };
            if !clock.heard(stamp, start + Duration::from_secs_f64(time)) {
                return Some(time - 30.0 * TICK);
            }
        }
        None
    }

    #[test]
    fn a_clock_that_stands_crawls_or_runs_is_noticed_within_half_a_second() {
        for rate in [0.0, 0.1, 0.5, 2.0, 10.0] {
            let after = noticed(rate, false).expect("it is noticed");
            assert!((0.0..=0.5).contains(&after), "{rate} times as fast: after {after:.2} s");
        }
        for rate in [0.5, 2.0, 10.0] {
            let after = noticed(rate, true).expect("it is noticed");
            assert!((0.0..=0.5).contains(&after), "{rate} times as fast, ticks too: after {after:.2} s");
        }
        assert_eq!(noticed(1.0, true), None);
        assert_eq!(noticed(1.01, false), None, "a clock that drifts is none that is wrong");
    }

    #[test]
    fn jumps_are_noticed_at_once_and_are_over_after_a_while() {
        for jump in [-3.0, -0.3, 0.3, 3.0] {
            let mut clock = BaseClock::default();
            let start = Instant::now();
            let wrong: Vec<u32> = (0..100)
                .filter(|tick| {
                    let time = TICK * f64::from(*tick);
                    let stamp = time + if *tick < 30 { 0.0 } else { jump };
                    !clock.heard(stamp, start + Duration::from_secs_f64(time))
                })
                .collect();
            assert_eq!(wrong.first(), Some(&30), "{jump} s");
            assert!(*wrong.last().unwrap() <= 52, "{jump} s: {wrong:?}");
        }
    }

    #[test]
    fn a_link_with_jitter_is_no_clock_that_is_wrong() {
        let mut clock = BaseClock::default();
        let start = Instant::now();
        for tick in 0..600_u32 {
            let delay = f64::from(tick * 7919 % 100) * 1.4e-3;
            let time = TICK * f64::from(tick);
            assert!(clock.heard(time, start + Duration::from_secs_f64(time + delay)), "tick {tick}");
        }
    }

    #[test]
    fn odometry_that_no_base_can_drive_is_noticed() {
        let robot = RobotModel::default();
        let before = Odometry { stamp: 10.0, x: 1.0, y: 1.0, heading: 3.1, ..golden::odometry() };
        let after = |x: f64, heading: f64| Odometry { stamp: 10.1, x, heading, ..before.clone() };
        assert!(is_motion(&before, &after(1.1, -3.1), &robot));
        assert!(!is_motion(&before, &after(6.0, 3.1), &robot));
        assert!(!is_motion(&before, &after(1.0, 1.5), &robot));
        // After a second without a word it may be a metre on.
        assert!(is_motion(&before, &Odometry { stamp: 11.0, ..after(2.0, 3.1) }, &robot));
    }
}
