//! What operators count and measure of commands.

use std::sync::{Arc, Mutex};
use std::time::Instant;

use curionav_runtime::locked::locked;
use curionav_runtime::metrics::{Metrics, Tally};
use curionav_runtime::robot_limits::{Base, RobotLimits};
use curionav_schemas::{CommandReason, Mission, MissionState};
use tokio::sync::watch;

/// What commands are made from, by stream, and when each was taken, seconds of the robot's clock.
pub(crate) type Stamps = [(&'static str, Option<f64>); 4];

/// How old each stream is at `now` of the robot's clock.
fn ages(stamps: &Stamps, now: f64) -> Vec<(String, f64)> {
    let age =
        |(stream, stamp): &(&str, Option<f64>)| Some(((*stream).to_owned(), (now - (*stamp)?).max(0.0)));
    stamps.iter().filter_map(age).collect()
}

/// The stamps of a command, when it was given by either clock, and how fast the robot's clock goes.
type Last = (Stamps, f64, Instant, f64);

/// Counts since the start.
#[derive(Debug)]
pub(crate) struct CommandCounts {
    commands: Tally,
    last: Arc<Mutex<Option<Last>>>,
}

impl CommandCounts {
    pub(crate) fn new() -> Self {
        Self { commands: Tally::new(&["reason"]), last: Arc::default() }
    }

    /// One more command.
    pub(crate) fn command(&self, reason: CommandReason) {
        self.commands.add(&[reason.code()]);
    }

    /// What the newest command was made from at `now` of the robot's clock, of which `time_scale` seconds pass in a
    /// second.
    pub(crate) fn tick(&self, stamps: Stamps, now: f64, time_scale: f64) {
        *locked(&self.last) = Some((stamps, now, Instant::now(), time_scale));
    }

    pub(crate) fn register(
        &self,
        metrics: &mut Metrics,
        missions: watch::Receiver<Option<Arc<Mission>>>,
        base: &Base,
    ) {
        if let Base::Real(own) = base {
            let RobotLimits { v_max, a_max, omega_max, alpha_max, v_reverse, radius, .. } = *own;
            let limits = [
                ("v_max", v_max),
                ("a_max", a_max),
                ("omega_max", omega_max),
                ("alpha_max", alpha_max),
                ("v_reverse", v_reverse),
                ("radius", radius),
            ];
            let help = "The robot's own limits, which no mission can widen";
            metrics.gauges("limit", help, "limit", move || {
                limits.map(|(name, value)| (name.to_owned(), value)).into()
            });
        }
        metrics.tally("commands", "Commands to the base, by what they do", &self.commands);
        let last = Arc::clone(&self.last);
        let help = "Age of what the base is driven by, by the robot's clock; it grows while nothing comes";
        metrics.gauges("input_age_seconds", help, "stream", move || {
            let last = *locked(&last);
            last.map_or_else(Vec::new, |(stamps, then, at, time_scale)| {
                ages(&stamps, then + at.elapsed().as_secs_f64() * time_scale)
            })
        });
        let of = missions.clone();
        metrics.gauge("mission_revision", "Revision of the mission; 0 without one", move || {
            of.borrow().as_ref().map_or(0.0, |mission| mission.revision as f64)
        });
        metrics.gauge("mission_running", "1 while the robot is to drive", move || {
            f64::from(missions.borrow().as_ref().is_some_and(|m| m.state == MissionState::Running))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_not_come_has_no_age_and_what_comes_early_is_not_older_than_now() {
        let stamps = [("odom", Some(10.0)), ("scan", Some(9.75)), ("belief", None), ("decision", Some(10.5))];
        assert_eq!(
            ages(&stamps, 10.25),
            [("odom".into(), 0.25), ("scan".into(), 0.5), ("decision".into(), 0.0)]
        );
    }
}
