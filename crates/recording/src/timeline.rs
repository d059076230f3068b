//! When a message was sent, on one line of time for all missions of a robot.

use curionav_schemas::{Clock, Mission};

/// A message that comes this much later than others of its stamp belongs to a clock that was started anew, seconds
/// of wall time.
const RESTART: f64 = 1.0;

/// Robot time laid out along wall time: within a run distances are those of the robot's clock, so that one that was
/// simulated faster than real plays at its own pace; each new run begins where the one before has ended or now,
/// whichever is later.
#[derive(Debug)]
pub(super) struct Timeline {
    /// The run, and whether the robot has been let go in it: what comes late of the run before comes earlier.
    part: Option<(u64, bool)>,
    /// How much older than the newest a stamp may be, seconds of the robot's clock.
    late: f64,
    /// Nanoseconds since 1970 at stamp 0, and the newest stamp.
    anchor: Option<(u64, f64)>,
    /// The latest time given out, nanoseconds since 1970; 0 if none was.
    pub(super) latest: u64,
}

impl Default for Timeline {
    fn default() -> Self {
        Self { part: None, late: RESTART, anchor: None, latest: 0 }
    }
}

impl Timeline {
    /// Takes note of the mission whose messages follow; `now` is wall time, nanoseconds since 1970. The first messages
    /// of a run may come a moment before the mission that lets the robot go: with them the run has begun.
    pub(super) fn follow(&mut self, mission: &Mission, now: u64) {
        self.late = match mission.order.clock {
            Clock::Realtime => RESTART * mission.order.time_scale.max(1.0),
            // As fast as the machine allows: any robot time may pass while a message is under way.
            Clock::Lockstep => f64::INFINITY,
        };
        let part = Some((mission.run, mission.has_run));
        if self.part != part {
            let is_let_go = self.part == Some((mission.run, false));
            self.anchor = self.anchor.filter(|(start, newest)| {
                is_let_go && *newest < RESTART && start + nanoseconds(RESTART) > now
            });
            self.part = part;
        }
    }

    /// The time of a message, nanoseconds since 1970: of its stamp, or of the newest one if it has none. `now` is
    /// wall time.
    pub(super) fn time(&mut self, stamp: Option<f64>, now: u64) -> u64 {
        let Some(stamp) = stamp else {
            return if self.latest == 0 { now } else { self.latest };
        };
        let (start, newest) = match self.anchor {
            Some((start, newest)) if stamp > newest - self.late => (start, newest.max(stamp)),
            _ => (now.max(self.latest).saturating_sub(nanoseconds(stamp)), stamp),
        };
        self.anchor = Some((start, newest));
        let time = start.saturating_add(nanoseconds(stamp));
        self.latest = self.latest.max(time);
        time
    }
}

fn nanoseconds(seconds: f64) -> u64 {
    (seconds.max(0.0) * 1e9) as u64
}

#[cfg(test)]
mod tests {
    use curionav_testing::golden;

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

    #[test]
    fn a_run_keeps_its_pace_however_fast_it_is_and_however_late_its_reports() {
        for (clock, time_scale) in [(Clock::Realtime, 50.0), (Clock::Lockstep, 1.0)] {
            let mut timeline = Timeline::default();
            let mut mission = golden::mission();
            (mission.order.clock, mission.order.time_scale) = (clock, time_scale);
            let mut now = 1_000 * SECOND;
            for (run, start) in [(1, 1_000), (2, 1_040)] {
                (mission.run, mission.has_run) = (run, false);
                timeline.follow(&mission, now);
                if run > 1 {
                    // The last word about the run before.
                    timeline.time(Some(39.0), now);
                }
                mission.has_run = true;
                for tick in 0..=400 {
                    // The driver says it again and again.
                    timeline.follow(&mission, now);
                    let stamp = 0.1 * f64::from(tick);
                    let time = timeline.time(Some(stamp), now);
                    assert!((time as f64 * 1e-9 - f64::from(start) - stamp).abs() < 1e-3, "{run} {tick}");
                    // A report, 0.1 s of wall time late.
                    let late = timeline.time(Some((stamp - 5.0).max(0.0)), now);
                    assert!(late <= time, "{run} {tick}");
                    now += SECOND / 500;
                }
            }
        }
    }

    #[test]
    fn what_overtakes_the_mission_that_lets_the_robot_go_belongs_to_the_run() {
        let (mut timeline, mut mission, now) = (Timeline::default(), golden::mission(), 1_000 * SECOND);
        mission.has_run = false;
        timeline.follow(&mission, now);
        let scan = timeline.time(Some(0.0), now);
        mission.has_run = true;
        timeline.follow(&mission, now + SECOND / 200);
        assert_eq!(timeline.time(Some(0.1), now + SECOND / 100), scan + SECOND / 10);
    }
}
