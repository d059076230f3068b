//! What the project promises of its planner, judged by the runs.

use std::time::Duration;

use serde::Serialize;
use strum::IntoStaticStr;

use super::comparison::{Comparison, Paired};
use super::measure::Measure;
use super::row::Tally;

/// The planner that is judged, its two ablations, and the planners without curiosity for landmarks.
const OURS: &str = "curiosity";
const WITHOUT_CNC: &str = "cpc-only";
const WITHOUT_CPC: &str = "cnc-only";
const BLIND: [&str; 4] = ["cnc-only", "distance-only", "risk-rrt", "bi-risk-rrt"];
const SCENARIOS: usize = 13;
/// A difference counts below this p.
pub(crate) const SIGNIFICANT: f64 = 0.01;
/// Fewer pairs cannot have such a p, whatever they say: 2 / 2^8 is the first below it.
const PAIRS_LEAST: usize = 8;
const TD_MOST: f64 = 0.041;
const TCM_MOST: f64 = 0.15;
const VEL_LEAST: f64 = 0.87;
const LENGTH_MOST: f64 = 1.2;
const TIME_MOST: Duration = Duration::from_secs(20 * 60);

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, IntoStaticStr)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "lowercase")]
pub(crate) enum Verdict {
    Pass,
    Miss,
    /// Runs it needs are not there.
    #[strum(serialize = "not judged")]
    NotJudged,
}

impl Verdict {
    pub(crate) fn word(self) -> &'static str {
        self.into()
    }
}

#[derive(Debug, Serialize)]
pub(crate) struct Criterion {
    pub(crate) promise: String,
    pub(crate) verdict: Verdict,
    pub(crate) found: String,
}

impl Criterion {
    /// `is_kept` is none if that cannot be judged.
    fn new(promise: &str, is_kept: Option<bool>, found: impl Into<String>) -> Self {
        let verdict = match is_kept {
            Some(true) => Verdict::Pass,
            Some(false) => Verdict::Miss,
            None => Verdict::NotJudged,
        };
        Self { promise: promise.to_owned(), verdict, found: found.into() }
    }
}

/// Every promise in turn. `clock` is what the runs took on the clock, with all workers busy.
pub(crate) fn criteria(comparison: &Comparison<'_>, clock: Duration) -> Vec<Criterion> {
    let Some(ours) = comparison.planner(OURS) else {
        return vec![Criterion::new(&format!("everything is promised of `{OURS}`"), None, "it was not run")];
    };
    let judge = Judge { comparison, ours };
    let most = format!("TD at most {:.1} % in each scenario", 100.0 * TD_MOST);
    let mut all = vec![
        judge.success(),
        judge.best("TD is the lowest of all planners", Measure::Td, 12, |td| td),
        judge.bound(&most, Measure::Td, |td| td <= TD_MOST, false),
        judge.best("MD is the highest of all planners", Measure::Md, 12, |md| md),
        judge.best("NT, rounded as in the paper, is the lowest or tied", Measure::Nt, 13, f64::round),
    ];
    for (measure, name) in [(Measure::Rmse, "RMSE"), (Measure::Tcm, "TCM")] {
        for planner in [OURS, WITHOUT_CNC] {
            all.extend(BLIND.map(|other| judge.better(measure, name, planner, other)));
        }
        all.push(judge.nowhere_worse(measure, name));
    }
    let most = format!("TCM at most {:.0} % in each scenario", 100.0 * TCM_MOST);
    let least = format!("Vel at least {VEL_LEAST} m/s in each scenario");
    let longest = format!("Length at most {LENGTH_MOST} times the shortest planner's in each scenario");
    all.extend([
        judge.in_order(
            "RMSE of `curiosity` is nowhere above that of a planner without CPC (the paper: 13 of 13)",
            Measure::Rmse,
            13,
            |ours, _, other| ours <= other,
        ),
        judge.in_order(
            "TCM of `curiosity` and of `cpc-only` is below that of every planner without CPC (the paper: 11 of 13)",
            Measure::Tcm,
            11,
            |ours, ablation, other| ours < other && ablation < other,
        ),
        judge.count("NM, rounded as in the paper, is 0", 12, |s| {
            Some(comparison.mean(Measure::Nm, s, ours)?.round() == 0.0)
        }),
        judge.bound(&most, Measure::Tcm, |tcm| tcm <= TCM_MOST, false),
        judge.bound(&least, Measure::Vel, |vel| vel >= VEL_LEAST, false),
        judge.bound(&longest, Measure::Length, |share| share <= LENGTH_MOST, true),
        judge.better(Measure::Rmse, "ablation: RMSE", OURS, WITHOUT_CPC),
        judge.better(Measure::Td, "ablation: TD", OURS, WITHOUT_CNC),
        judge.whole_table(clock),
    ]);
    all
}

struct Judge<'a> {
    comparison: &'a Comparison<'a>,
    ours: usize,
}

impl Judge<'_> {
    fn success(&self) -> Criterion {
        let runs = Tally::of(self.comparison.all_runs(self.ours));
        let is_kept = runs.reached == runs.runs && runs.contacts == 0;
        let found = format!("reached {} of {}, {} collisions", runs.reached, runs.runs, runs.contacts);
        Criterion::new("every run reaches the goal, without a collision", Some(is_kept), found)
    }

    fn whole_table(&self, clock: Duration) -> Criterion {
        let minutes = TIME_MOST.as_secs() / 60;
        let promise = format!("6 planners, 13 scenarios, 10 seeds in at most {minutes} minutes on 2 cores");
        let runs = self.comparison.count_runs();
        let found = format!("{runs} runs in {:.1} minutes", clock.as_secs_f64() / 60.0);
        Criterion::new(&promise, (runs >= 6 * SCENARIOS * 10).then_some(clock <= TIME_MOST), found)
    }

    /// `holds(scenario)` in at least `of_thirteen` of thirteen scenarios, or all but as many of fewer.
    fn count(&self, promise: &str, of_thirteen: usize, holds: impl Fn(usize) -> Option<bool>) -> Criterion {
        let names = &self.comparison.scenarios;
        let judged: Vec<(&str, bool)> =
            names.iter().enumerate().filter_map(|(s, name)| Some((name.as_str(), holds(s)?))).collect();
        let needed = (judged.len() * of_thirteen).div_ceil(SCENARIOS);
        let not: Vec<&str> = judged.iter().filter(|(_, holds)| !holds).map(|(name, _)| *name).collect();
        let good = judged.len() - not.len();
        let but = if not.is_empty() { String::new() } else { format!("; not in {}", not.join(", ")) };
        let promise = format!("{promise}, in at least {needed} of {} scenarios", judged.len());
        if judged.is_empty() {
            return Criterion::new(&promise, None, "no runs");
        }
        Criterion::new(&promise, Some(good >= needed), format!("{good} of {}{but}", judged.len()))
    }

    /// No other planner's mean is better, after `rounded`.
    fn best(
        &self,
        promise: &str,
        measure: Measure,
        of_thirteen: usize,
        rounded: fn(f64) -> f64,
    ) -> Criterion {
        let value = |s: usize, p: usize| self.comparison.mean(measure, s, p).map(rounded);
        self.count(promise, of_thirteen, |s| {
            let own = value(s, self.ours)?;
            let mut all = (0..self.comparison.planners.len()).filter_map(|p| value(s, p));
            Some(!all.any(|other| measure.prefers(other, own)))
        })
    }

    /// A bound on the mean in each scenario, or on its ratio to the best planner's.
    fn bound(&self, promise: &str, measure: Measure, holds: fn(f64) -> bool, is_ratio: bool) -> Criterion {
        let mut worst: Option<(f64, &str)> = None;
        let mut is_kept = true;
        for (s, name) in self.comparison.scenarios.iter().enumerate() {
            let Some(mut own) = self.comparison.mean(measure, s, self.ours) else { continue };
            if is_ratio {
                let planners = 0..self.comparison.planners.len();
                let all = planners.filter_map(|p| self.comparison.mean(measure, s, p));
                own /= all.fold(f64::INFINITY, f64::min);
            }
            is_kept &= holds(own);
            let is_worse = |(w, _): &(f64, &str)| if is_ratio { own > *w } else { measure.prefers(*w, own) };
            if worst.as_ref().is_none_or(is_worse) {
                worst = Some((own, name));
            }
        }
        let Some((value, name)) = worst else { return Criterion::new(promise, None, "no runs") };
        let value = if is_ratio { format!("{value:.2} times") } else { measure.show_with_unit(value) };
        Criterion::new(promise, Some(is_kept), format!("worst {value} in {name}"))
    }

    fn paired(&self, measure: Measure, a: &str, b: &str, scenario: Option<usize>) -> Option<Paired> {
        let (a, b) = (self.comparison.planner(a)?, self.comparison.planner(b)?);
        self.comparison.paired(measure, a, b, scenario)
    }

    fn better(&self, measure: Measure, name: &str, planner: &str, other: &str) -> Criterion {
        let promise = format!(
            "{name} of `{planner}` is better than that of `{other}`, all runs paired, p < {SIGNIFICANT}"
        );
        let Some(paired) = self.paired(measure, planner, other, None) else {
            return Criterion::new(&promise, None, "not both were run");
        };
        let sign = if paired.difference > 0.0 { "+" } else { "" };
        let difference = measure.show_with_unit(paired.difference);
        let p = shown_p(paired.p);
        let found = format!("{sign}{difference} on average, {p}, {} pairs", paired.pairs);
        if paired.pairs < PAIRS_LEAST {
            return Criterion::new(&promise, None, format!("{found}: too few to tell"));
        }
        let is_better = measure.prefers(paired.difference, 0.0) && paired.p < SIGNIFICANT;
        Criterion::new(&promise, Some(is_better), found)
    }

    fn nowhere_worse(&self, measure: Measure, name: &str) -> Criterion {
        let promise = format!(
            "{name} of `{OURS}` and `{WITHOUT_CNC}` is significantly worse than that of a planner without CPC nowhere \
             (p < {SIGNIFICANT} in a scenario)"
        );
        let mut tests = 0;
        let mut worse = Vec::new();
        for (planner, other) in [OURS, WITHOUT_CNC].into_iter().flat_map(|a| BLIND.map(|b| (a, b))) {
            for (s, scenario) in self.comparison.scenarios.iter().enumerate() {
                let paired = self.paired(measure, planner, other, Some(s));
                let Some(paired) = paired.filter(|paired| paired.pairs >= PAIRS_LEAST) else { continue };
                tests += 1;
                if measure.prefers(0.0, paired.difference) && paired.p < SIGNIFICANT {
                    worse.push(format!("{planner} than {other} in {scenario}"));
                }
            }
        }
        let found = match (tests, worse.len()) {
            (0, _) => return Criterion::new(&promise, None, "too few runs to compare with"),
            (_, 0) => format!("none of {tests}"),
            (_, count) => format!("{count} of {tests}: {}", worse.join("; ")),
        };
        Criterion::new(&promise, Some(worse.is_empty()), found)
    }

    /// `holds(ours, the ablation with CPC, another)` for every planner without CPC.
    fn in_order(
        &self,
        promise: &str,
        measure: Measure,
        of_thirteen: usize,
        holds: fn(f64, f64, f64) -> bool,
    ) -> Criterion {
        let others: Vec<usize> = BLIND.iter().filter_map(|name| self.comparison.planner(name)).collect();
        let Some(ablation) = self.comparison.planner(WITHOUT_CNC).filter(|_| !others.is_empty()) else {
            return Criterion::new(promise, None, "planners to compare with were not run");
        };
        self.count(promise, of_thirteen, |s| {
            let mean = |planner| self.comparison.mean(measure, s, planner);
            let (own, ablation) = (mean(self.ours)?, mean(ablation)?);
            Some(others.iter().filter_map(|o| mean(*o)).all(|other| holds(own, ablation, other)))
        })
    }
}

pub(crate) fn shown_p(p: f64) -> String {
    if p < 1e-4 { "p < 0.0001".into() } else { format!("p = {p:.4}") }
}

#[cfg(test)]
mod tests {
    use super::super::comparison::tests::{names, rows};
    use super::super::row::Row;
    use super::*;

    fn verdict(rows: &[Row], start: &str) -> (Verdict, String) {
        let planners = names(&["curiosity", "cpc-only", "cnc-only"]);
        let all: Vec<&Row> = rows.iter().collect();
        let comparison = Comparison::new(planners, names(&["env1-s1"]), &all);
        let all = criteria(&comparison, Duration::from_secs(60));
        let found = all.into_iter().find(|c| c.promise.starts_with(start)).unwrap();
        (found.verdict, found.found)
    }

    #[test]
    fn each_promise_is_judged_by_its_figures() {
        let planners = ["curiosity", "cpc-only", "cnc-only"];
        let good = rows("env1-s1", &planners, |p, seed| 0.1 * p as f64 + 0.001 * seed as f64);
        assert_eq!(
            verdict(&good, "every run reaches"),
            (Verdict::Pass, "reached 10 of 10, 0 collisions".into())
        );
        assert_eq!(verdict(&good, "TD is the lowest").0, Verdict::Pass);
        assert_eq!(verdict(&good, "ablation: TD").0, Verdict::Pass);
        // All localise the same.
        assert_eq!(verdict(&good, "ablation: RMSE").0, Verdict::Miss);
        assert_eq!(
            verdict(&good, "RMSE of `curiosity` is better than that of `risk-rrt`").0,
            Verdict::NotJudged
        );
        assert_eq!(verdict(&good, "6 planners").0, Verdict::NotJudged);

        let mut bad = rows("env1-s1", &planners, |p, _| 0.3 - 0.1 * p as f64);
        bad[0].measures.collisions = 2;
        assert_eq!(
            verdict(&bad, "every run reaches"),
            (Verdict::Miss, "reached 10 of 10, 2 collisions".into())
        );
        assert_eq!(verdict(&bad, "TD is the lowest"), (Verdict::Miss, "0 of 1; not in env1-s1".into()));
        assert_eq!(verdict(&bad, "TD at most 4.1 %"), (Verdict::Miss, "worst 30.00 % in env1-s1".into()));
        assert_eq!(
            verdict(&bad, "Length at most 1.2"),
            (Verdict::Pass, "worst 1.00 times in env1-s1".into())
        );
    }

    #[test]
    fn without_the_planner_nothing_is_judged() {
        let comparison = Comparison::new(names(&["x"]), names(&["y"]), &[]);
        assert_eq!(criteria(&comparison, Duration::ZERO)[0].verdict, Verdict::NotJudged);
    }
}
