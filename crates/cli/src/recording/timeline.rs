//! When a message was sent, on one line of time for all missions of a robot.

/// A stamp this much older than the newest belongs to a clock that was started anew, seconds.
const RESTART: f64 = 1.0;

/// Robot time laid out along wall time: within a mission distances are those of the robot's clock, so that a run that
/// was simulated faster than real plays at its own pace; each new mission begins where the one before has ended or
/// now, whichever is later.
#[derive(Debug, Default)]
pub(super) struct Timeline {
    /// Nanoseconds since 1970 at stamp 0, and the newest stamp.
    anchor: Option<(u64, f64)>,
    /// The latest time given out, nanoseconds.
    latest: u64,
}

impl Timeline {
    /// The latest time given out, nanoseconds since 1970; 0 if none was.
    pub(super) fn latest(&self) -> u64 {
        self.latest
    }

    /// The time of a message, nanoseconds since 1970: of its stamp, or of the newest one if it has none. `now` is
    /// wall time.
    pub(super) fn time(&mut self, stamp: Option<f64>, now: u64) -> u64 {
        let Some(stamp) = stamp else {
            return if self.latest == 0 { now } else { self.latest };
        };
        let nanoseconds = |seconds: f64| (seconds.max(0.0) * 1e9) as u64;
        let (start, newest) = match self.anchor {
            Some((start, newest)) if stamp > newest - RESTART => (start, newest.max(stamp)),
            _ => (now.max(self.latest).saturating_sub(nanoseconds(stamp)), stamp),
        };
        self.anchor = Some((start, newest));
        let time = start + nanoseconds(stamp);
        self.latest = self.latest.max(time);
        time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 1_000_000_000;

    #[test]
    fn a_mission_keeps_its_pace_and_the_next_one_follows_it() {
        let mut timeline = Timeline::default();
        let now = 1_000 * SECOND;
        assert_eq!(timeline.time(None, now), now);
        assert_eq!(timeline.time(Some(0.0), now), now);
        // Simulated in no time at all.
        assert_eq!(timeline.time(Some(20.0), now), now + 20 * SECOND);
        // What is a little late stays where it belongs; what has no stamp comes last.
        assert_eq!(timeline.time(Some(19.5), now), now + 39 * SECOND / 2);
        assert_eq!(timeline.time(None, now), now + 20 * SECOND);
        // Another mission, whose clock begins anew.
        assert_eq!(timeline.time(Some(0.5), now + SECOND), now + 20 * SECOND);
        assert_eq!(timeline.time(Some(1.5), now + SECOND), now + 21 * SECOND);
        // And one long after.
        assert_eq!(timeline.time(Some(0.0), now + 100 * SECOND), now + 100 * SECOND);
    }
}
