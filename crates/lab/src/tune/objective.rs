//! What a run costs: the one number that tuning makes small.

use serde::Deserialize;

use crate::bench::row::Row;

/// Weights of the weighted sum.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Objective {
    /// Of the share of time closer to people than comfortable: 4 % cost 1, the most the paper's planner needed.
    pub(crate) td: f64,
    /// Of the least distance to a person, per metre short of [`MD_ENOUGH`].
    pub(crate) md_m: f64,
    /// Of the least gap to anything, walls included, per metre short of [`GAP_ENOUGH`]: a robot that keeps away from
    /// people must not scrape along walls instead.
    pub(crate) gap_m: f64,
    /// Of the localisation error, per metre: 0.25 m cost 1, the paper's mean.
    pub(crate) rmse_m: f64,
    /// Of the share of time until localisation converged: 8 % cost 1, the paper's mean.
    pub(crate) tcm: f64,
    /// Of the way, per metre: 40 m cost 1.
    pub(crate) length_m: f64,
    /// Of the time, per second: 45 s cost 1.
    pub(crate) time_s: f64,
    /// Of a run that did not reach the goal: more than all else together.
    pub(crate) not_reached: f64,
    pub(crate) collision: f64,
}

/// Beyond it people do not mind: where public space begins (Hall, 1966), metres.
const MD_ENOUGH: f64 = 3.6;

/// A robot's radius: beyond it a wall is no matter, metres.
const GAP_ENOUGH: f64 = 0.3;

impl Default for Objective {
    fn default() -> Self {
        Self {
            td: 25.0,
            md_m: 1.0 / 3.0,
            gap_m: 1.0 / 0.3,
            rmse_m: 4.0,
            tcm: 12.0,
            length_m: 1.0 / 40.0,
            time_s: 1.0 / 45.0,
            not_reached: 20.0,
            collision: 20.0,
        }
    }
}

impl Objective {
    pub(crate) fn cost(&self, row: &Row) -> f64 {
        let m = &row.measures;
        let penalty = |is_due: bool, cost: f64| if is_due { cost } else { 0.0 };
        self.td * m.td
            + self.md_m * (MD_ENOUGH - m.md_m.unwrap_or(MD_ENOUGH)).max(0.0)
            + self.gap_m * (GAP_ENOUGH - m.clearance_min_m).max(0.0)
            + self.rmse_m * m.rmse_m
            + self.tcm * m.tcm
            + self.length_m * m.length_m
            + self.time_s * m.time_s
            + penalty(!row.is_reached(), self.not_reached)
            + penalty(m.collisions > 0, self.collision)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::row::tests::row;
    use curionav_schemas::Outcome;

    #[test]
    fn a_run_costs_what_the_help_says_and_failing_costs_more_than_anything() {
        let mut run = row("a", "b", 1000);
        // TD 0.02, MD 1.3 m, RMSE 0.12 m, TCM 0.05, 19.1 m, 25 s.
        let expected = 25.0 * 0.02 + 2.3 / 3.0 + 4.0 * 0.12 + 12.0 * 0.05 + 19.1 / 40.0 + 25.0 / 45.0;
        let objective = Objective::default();
        assert!((objective.cost(&run) - expected).abs() < 1e-12);
        // Distance beyond 3.6 m, or no person there, is worth no more than 3.6 m.
        run.measures.md_m = Some(5.0);
        let far = objective.cost(&run);
        assert!((far - (expected - 2.3 / 3.0)).abs() < 1e-12);
        run.measures.md_m = None;
        assert_eq!(objective.cost(&run), far);
        run.measures.md_m = Some(1.3);
        run.measures.clearance_min_m = 0.15;
        assert!((objective.cost(&run) - expected - 0.5).abs() < 1e-12);
        run.measures.clearance_min_m = 0.5;
        run.measures.collisions = 3;
        assert!((objective.cost(&run) - expected - 20.0).abs() < 1e-12);
        run.outcome = Outcome::Lost;
        assert!((objective.cost(&run) - expected - 40.0).abs() < 1e-12);
    }
}
