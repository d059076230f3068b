//! How the robot is, for operators.

use std::time::Instant;

use curionav_ros2::messages::{DiagnosticStatus, KeyValue};
use curionav_schemas::{CommandReason, Confidence, Mission, words};

use crate::problem::{Problem, ProblemKind};

/// Weight of the newest of the times between messages in their mean.
const WEIGHT: f64 = 0.1;
/// Messages before the mean says anything.
const SETTLED: u32 = 20;
/// A message that comes so many times later than it should is worth saying.
const LATE: f64 = 1.5;

/// How often something comes.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Rate {
    last: Option<Instant>,
    mean: f64,
    count: u32,
}

impl Rate {
    /// It has come.
    pub(crate) fn heard(&mut self, now: Instant) {
        if let Some(last) = self.last.replace(now) {
            let took = now.saturating_duration_since(last).as_secs_f64();
            let weight = if self.count == 0 { 1.0 } else { WEIGHT };
            self.mean += weight * (took - self.mean);
            self.count = self.count.saturating_add(1);
        }
    }

    /// What is wrong with how often it comes, if it should come every `period` seconds.
    pub(crate) fn fault(&self, period: f64) -> Option<String> {
        let is_late = self.count >= SETTLED && self.mean > LATE * period;
        is_late.then(|| format!("it comes every {:.2} s, and not every {period} s", self.mean))
    }
}

/// Levels of a status.
const WELL: u8 = 0;
const WARNING: u8 = 1;

fn value(key: &str, value: impl ToString) -> KeyValue {
    KeyValue { key: key.to_owned(), value: value.to_string() }
}

/// The status of `robot`: its problems, how the mission stands, which driver drives, and whether the robot is
/// localised.
pub(crate) fn status(
    robot: &str,
    problems: &[Problem],
    mission: Option<&Mission>,
    driver: Option<&str>,
    is_localized: bool,
) -> Vec<DiagnosticStatus> {
    let sentences: Vec<String> = problems.iter().map(Problem::sentence).collect();
    let message = sentences.first().cloned().unwrap_or_else(|| "all well".into());
    let state = mission.map_or("none", |mission| mission.state.name());
    let mut values = vec![
        value("mission", state),
        value("driver", driver.unwrap_or("none")),
        value("localized", is_localized),
    ];
    values.extend(
        sentences.iter().enumerate().map(|(i, sentence)| value(&format!("problem {}", i + 1), sentence)),
    );
    values.truncate(curionav_ros2::limits::VALUES);
    vec![DiagnosticStatus {
        level: if problems.is_empty() { WELL } else { WARNING },
        name: format!("curionav: {robot}"),
        message,
        hardware_id: robot.to_owned(),
        values,
    }]
}

/// That the localizer is not sure where the robot is, if it is not.
pub(crate) fn unsure(confidence: Confidence) -> Option<Problem> {
    if confidence == Confidence::Sure {
        return None;
    }
    Some(Problem::new(ProblemKind::Unsure, "localizer", words::say("confidence", &confidence)))
}

/// Why the driver stops the robot, if it does so for want of something: a stop that is meant is no problem.
pub(crate) fn stopped(reason: CommandReason) -> Option<Problem> {
    use CommandReason::{Arrived, MissionNotRunning, Paused, ToldToStop};
    let is_meant = matches!(reason, Arrived | MissionNotRunning | Paused | ToldToStop);
    // That the laser is blind is said of the laser.
    let stops = !reason.follows() && !is_meant && !reason.is_blind();
    stops.then(|| Problem::new(ProblemKind::Stopped, "driver", words::say("command_reason", &reason)))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn odometry_that_comes_too_rarely_is_said() {
        let (mut rate, start) = (Rate::default(), Instant::now());
        (0..=20).for_each(|k| rate.heard(start + Duration::from_millis(200 * k)));
        assert_eq!(rate.fault(0.1).as_deref(), Some("it comes every 0.20 s, and not every 0.1 s"));
        assert_eq!(rate.fault(0.2), None);
    }

    #[test]
    fn a_status_says_its_first_problem_and_lists_all() {
        let problem = |topic: &str| Problem::new(ProblemKind::SecondPublisher, topic, "/teleop");
        let status = status("r1", &[problem("/cmd_vel"), problem("/tf")], None, Some("a"), true);
        assert_eq!(
            (status[0].level, status[0].message.as_str()),
            (WARNING, "/cmd_vel is also published by /teleop")
        );
        assert_eq!(status[0].values.len(), 5);
        assert_eq!(super::status("r1", &[], None, None, false)[0].message, "all well");
    }
}
