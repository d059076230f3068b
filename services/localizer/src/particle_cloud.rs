//! The particles for those who look on: now and then, and never in the way of the belief.

use curionav_planning::geometry::Pose2;
use curionav_schemas::Particles;
use curionav_schemas::limits::MAX_PARTICLES;

/// Seconds of the robot's clock from one look to the next: a cloud that is carried along with the belief between
/// looks seems to flow.
const PERIOD: f64 = 0.5;
/// A tick that comes a little early is in time, seconds.
const ROUNDING: f64 = 1e-6;

/// When particles were shown last.
#[derive(Debug, Default)]
pub(crate) struct Rate {
    shown: Option<f64>,
}

impl Rate {
    /// Whether they are to be shown at `stamp`. A clock that steps back begins anew.
    pub(crate) fn is_due(&mut self, stamp: f64) -> bool {
        let waited = self.shown.map_or(f64::INFINITY, |shown| stamp - shown);
        let due = !(0.0..PERIOD - ROUNDING).contains(&waited);
        if due {
            self.shown = Some(stamp);
        }
        due
    }
}

/// The message of some particles. Of more than a message may hold, every second, third, ... is taken.
pub(crate) fn particles(
    all: impl ExactSizeIterator<Item = (Pose2, f64)>,
    tick: u64,
    stamp: f64,
) -> Particles {
    let stride = all.len().div_ceil(MAX_PARTICLES).max(1);
    let mut x = Vec::new();
    let mut y = Vec::new();
    let mut heading = Vec::new();
    let mut weight = Vec::new();
    for (pose, share) in all.step_by(stride) {
        x.push(pose.x as f32);
        y.push(pose.y as f32);
        heading.push(pose.heading as f32);
        weight.push(share as f32);
    }
    Particles { tick, stamp, x: x.into(), y: y.into(), heading: heading.into(), weight: weight.into() }
}

#[cfg(test)]
mod tests {
    use curionav_schemas::Message;

    use super::*;

    #[test]
    fn they_are_shown_twice_a_second_of_the_robots_clock() {
        let mut rate = Rate::default();
        let due = |rate: &mut Rate, stamps: &[f64]| -> Vec<f64> {
            stamps.iter().copied().filter(|stamp| rate.is_due(*stamp)).collect()
        };
        let ticks: Vec<f64> = (0..12).map(|tick| 0.1 * f64::from(tick)).collect();
        assert_eq!(due(&mut rate, &ticks), [ticks[0], ticks[5], ticks[10]]);
        // After a gap at once; a new run begins anew.
        assert_eq!(due(&mut rate, &[7.3, 7.7, 7.8]), [7.3, 7.8]);
        assert_eq!(due(&mut rate, &[0.0, 0.1, 0.5]), [0.0, 0.5]);
    }

    #[test]
    fn whatever_their_number_the_message_is_a_valid_one() {
        for count in [0, 1, 700, MAX_PARTICLES, MAX_PARTICLES + 1, 100_000] {
            let all = (0..count).map(|i| (Pose2::new(i as f64, -1.0, 0.5), 1.0 / count as f64));
            let made = particles(all, 3, 0.3);
            let read = Particles::decode(&made.encode(), Some(Particles::ENCODING)).unwrap();
            assert_eq!(read, made);
            assert!(read.x.len() >= count.min(MAX_PARTICLES / 2), "{count}: {}", read.x.len());
        }
    }
}
