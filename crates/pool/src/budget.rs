//! How long a stage of a cycle may take, and how its time is split.

use std::time::Duration;

use curionav_schemas::limits::MAX_BUDGET_MS;
use curionav_schemas::{Clock, Mission};

/// No stage of a cycle takes longer.
const LONGEST: Duration = Duration::from_millis(MAX_BUDGET_MS as u64);

/// The time of one stage. The pool has the first half of it: a question unanswered after a quarter, and after longer
/// than is usual, is late and may go to another replica as well, and at half the arbiter computes what is missing in
/// process.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    start: Duration,
    total: Duration,
    /// How the robot's time passes.
    pub clock: Clock,
}

impl Budget {
    /// Of a stage that begins `now`. In lockstep a slow machine must never change a decision, so the budget
    /// only catches what hangs. In real time the two stages of a cycle have four fifths of its period.
    pub fn of_stage(now: Duration, mission: &Mission) -> Self {
        let total = match mission.order.clock {
            Clock::Lockstep => LONGEST,
            Clock::Realtime => {
                let period =
                    mission.order.tick_s * f64::from(mission.order.plan_every) / mission.order.time_scale;
                Duration::from_secs_f64(0.4 * period).min(LONGEST)
            }
        };
        Self { start: now, total, clock: mission.order.clock }
    }

    /// From `now` until `share` of the budget is over.
    pub fn until(&self, share: f64, now: Duration) -> Duration {
        (self.start + self.total.mul_f64(share)).saturating_sub(now)
    }

    /// Whether all of it is over.
    pub fn is_over(&self, now: Duration) -> bool {
        self.until(1.0, now).is_zero()
    }

    /// What a replica may spend of the time its answer is waited for, as it travels with a question: the
    /// rest is for the way.
    pub fn ms(timeout: Duration) -> u32 {
        (timeout.as_millis() * 4 / 5).clamp(1, u128::from(MAX_BUDGET_MS)) as u32
    }
}
