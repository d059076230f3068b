//! How long a stage of a cycle may take, and how its time is split.

use std::time::Duration;

use curionav_schemas::limits::MAX_BUDGET_MS;
use curionav_schemas::{Clock, Mission};

/// No stage of a cycle takes longer.
const LONGEST: Duration = Duration::from_millis(MAX_BUDGET_MS as u64);
/// Share of the time between two cycles that both stages have in real time: the rest is for deciding, and for what the
/// machine does besides.
const STAGES: f64 = 0.8;
/// Evaluation still has this share of it if it usually takes less: what is unusual needs time as well.
const LEAST: f64 = 0.25;
/// And generation this one: what it does not take is evaluation's. Generators with too much to do refuse at once; if
/// that counted as needing little time, robots would give them less and less, and each another share.
const LEAST_OF_GENERATION: f64 = 0.5;

/// The time of one stage. The pool has the first half of it: a question unanswered after a quarter is late and may go
/// to another replica as well, and at half the arbiter computes what is missing in process.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    start: Duration,
    total: Duration,
    /// How the robot's time passes.
    pub clock: Clock,
}

impl Budget {
    /// Of generation, for a cycle that begins `now`.
    pub fn of_generation(now: Duration, mission: &Mission, stages: &StageTimes) -> Self {
        Self::new(now, mission, |both| both.mul_f64(stages.share_of_generation()))
    }

    /// Of evaluation, which begins `now` in a cycle that began at `began`: what generation has left of the time for
    /// both.
    pub fn of_evaluation(began: Duration, now: Duration, mission: &Mission) -> Self {
        Self::new(now, mission, |both| (began + both).saturating_sub(now).max(both.mul_f64(LEAST)))
    }

    /// In lockstep a slow machine must never change a decision, so a budget only catches what hangs.
    fn new(start: Duration, mission: &Mission, share: impl Fn(Duration) -> Duration) -> Self {
        let order = &mission.order;
        let total = match order.clock {
            Clock::Lockstep => LONGEST,
            Clock::Realtime => {
                let period = order.tick_s * f64::from(order.plan_every) / order.time_scale;
                share(Duration::from_secs_f64(STAGES * period)).min(LONGEST)
            }
        };
        Self { start, total, clock: order.clock }
    }

    /// From `now` until `share` of the budget is over.
    pub fn until(&self, share: f64, now: Duration) -> Duration {
        (self.start + self.total.mul_f64(share)).saturating_sub(now)
    }

    /// The share of it that is over.
    pub fn spent(&self, now: Duration) -> f64 {
        now.saturating_sub(self.start).as_secs_f64() / self.total.as_secs_f64()
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

/// A stage that takes longer than this share of its times is unusual.
const USUAL: f64 = 0.95;
/// By this share the usual time grows with every time that is longer than it.
const STEP: f64 = 0.1;

/// Time within which `USUAL` of a stage's times have been, as far as is known; zero until there has been one.
#[derive(Debug, Clone, Copy, Default)]
struct Usual(f64);

impl Usual {
    /// Another time. The estimate settles where longer times lift it as much as the others lower it, at the quantile
    /// `USUAL`; a time that is more than twice as long is no noise, and lifts it at once.
    fn took(&mut self, time: Duration) {
        let time = time.as_secs_f64();
        self.0 *= if time > self.0 { 1.0 + STEP } else { 1.0 - STEP * (1.0 - USUAL) / USUAL };
        self.0 = self.0.max(time / 2.0);
    }

    fn time(&self) -> Duration {
        Duration::from_secs_f64(self.0)
    }
}

/// What the stages of a cycle usually take, whatever the machine.
#[derive(Debug, Clone, Copy, Default)]
pub struct StageTimes {
    generation: Usual,
    evaluation: Usual,
}

impl StageTimes {
    /// A cycle's stages have taken so long.
    pub fn took(&mut self, generation: Duration, evaluation: Duration) {
        self.generation.took(generation);
        self.evaluation.took(evaluation);
    }

    /// The share of the time of both stages that generation has: at least a half, and more if it usually takes more.
    fn share_of_generation(&self) -> f64 {
        let generation = self.generation.time();
        let evaluation = self.evaluation.time();
        let both = (generation + evaluation).as_secs_f64();
        let usual = if both > 0.0 { generation.as_secs_f64() / both } else { 0.0 };
        usual.clamp(LEAST_OF_GENERATION, 1.0 - LEAST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_stage_has_the_share_that_it_usually_takes() {
        let share = |generation: u32, evaluation: u32| {
            let mut stages = StageTimes::default();
            (0..100).for_each(|_| stages.took(generation * MS, evaluation * MS));
            stages.share_of_generation()
        };
        assert_eq!(StageTimes::default().share_of_generation(), 0.5);
        assert!((share(10, 10) - 0.5).abs() < 0.01);
        assert!((share(14, 7) - 2.0 / 3.0).abs() < 0.01, "{}", share(14, 7));
        assert_eq!((share(100, 1), share(1, 100)), (1.0 - LEAST, LEAST_OF_GENERATION));
    }

    #[test]
    fn evaluation_has_what_generation_has_left() {
        let mut mission = curionav_testing::golden::mission();
        (mission.order.clock, mission.order.time_scale) = (Clock::Realtime, 1.0);
        (mission.order.tick_s, mission.order.plan_every) = (0.1, 1);
        let began = Duration::from_secs(3);
        // 100 ms between two cycles, 80 of them for both stages.
        let generation = Budget::of_generation(began, &mission, &StageTimes::default());
        assert_eq!(generation.until(1.0, began), 40 * MS);
        let evaluation =
            |after: Duration| Budget::of_evaluation(began, began + after, &mission).until(1.0, began + after);
        assert_eq!(
            (evaluation(10 * MS), evaluation(40 * MS), evaluation(75 * MS)),
            (70 * MS, 40 * MS, 20 * MS)
        );
        assert!((generation.spent(began + 10 * MS) - 0.25).abs() < 1e-9);
        assert!(generation.is_over(began + 40 * MS) && !generation.is_over(began + 39 * MS));
    }
}
