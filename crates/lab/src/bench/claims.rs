//! `bench --check FILE`: claims that were written down before the runs, judged by the runs.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Context;
use serde::{Deserialize, Serialize};

use super::comparison::{Comparison, Paired};
use super::measure::Measure;
use super::row::Tally;
use crate::plural::count;
use crate::statistics::least_p;

/// A file of claims.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Claims {
    claim: Vec<Claim>,
}

/// One claim about `planner`. A claim with too few runs, or none, does not hold.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
enum Claim {
    /// At least this share of the runs reach the goal without a collision.
    Success { planner: String, at_least: f64 },
    /// At least as many runs reach the goal without a collision as another planner's; as every other planner's if none is
    /// named.
    AsOften { planner: String, than: Option<String> },
    /// The mean of a measure lies within bounds.
    Bound {
        planner: String,
        measure: String,
        at_most: Option<f64>,
        at_least: Option<f64>,
        /// The bounds are multiples of the best planner's mean.
        #[serde(default)]
        of_best: bool,
        /// In at least so many scenarios; in all if left out.
        scenarios: Option<usize>,
    },
    /// The mean of a measure is better than that of every other planner.
    Best {
        planner: String,
        measure: String,
        /// As good as the best of the others is enough.
        #[serde(default)]
        or_tied: bool,
        scenarios: Option<usize>,
    },
    /// The measure is better than another planner's over all scenarios, paired: Holm's p over all such claims of the
    /// file is below `p`.
    Better {
        planner: String,
        than: String,
        measure: String,
        #[serde(default = "significant")]
        p: f64,
    },
}

fn significant() -> f64 {
    0.01
}

/// What has become of a claim.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Judged {
    /// In words.
    pub(crate) claim: String,
    /// The label of the measure that it is about.
    pub(crate) about: String,
    pub(crate) holds: bool,
    /// Whether it could not hold, because there are too few units for any test.
    pub(crate) too_few: bool,
    /// The figures that decide.
    pub(crate) found: String,
}

impl Judged {
    /// In words, for people.
    pub(crate) fn verdict(&self) -> &'static str {
        match (self.holds, self.too_few) {
            (true, _) => "holds",
            (false, true) => "cannot be shown",
            (false, false) => "does not hold",
        }
    }
}

impl Claims {
    /// Reads a file and checks every name in it against the planners that will be run.
    pub(crate) fn read(path: &Path, planners: &[String], scenarios: usize) -> anyhow::Result<Self> {
        let named = || path.display().to_string();
        let text = std::fs::read_to_string(path).with_context(named)?;
        let claims: Self = toml::from_str(&text).with_context(named)?;
        for (index, claim) in claims.claim.iter().enumerate() {
            claim
                .check(planners, scenarios)
                .with_context(|| format!("{}: claim {}", path.display(), index + 1))?;
        }
        Ok(claims)
    }

    /// Every claim in turn. Each planner should have `repeats` runs in each scenario.
    pub(crate) fn judge(&self, comparison: &Comparison<'_>, repeats: u32) -> Vec<Judged> {
        let judge = Judge { comparison, runs: comparison.scenarios.len() * repeats as usize };
        let mut tests: Vec<Option<Paired>> = self.claim.iter().map(|claim| judge.test(claim)).collect();
        Paired::correct(tests.iter_mut().flatten());
        let judged = |(claim, test): (&Claim, Option<Paired>)| Judged {
            about: claim.about().to_owned(),
            ..judge.claim(claim, test)
        };
        self.claim.iter().zip(tests).map(judged).collect()
    }
}

impl Claim {
    /// The label of the measure that it is about.
    fn about(&self) -> &str {
        match self {
            Self::Success { .. } | Self::AsOften { .. } => Measure::Success.label(),
            Self::Bound { measure, .. } | Self::Best { measure, .. } | Self::Better { measure, .. } => {
                label(measure)
            }
        }
    }

    fn check(&self, planners: &[String], scenarios: usize) -> anyhow::Result<()> {
        let known = |name: &String| -> anyhow::Result<()> {
            let all = planners.join(", ");
            anyhow::ensure!(planners.contains(name), "the planner `{name}` is not run; it is one of {all}");
            Ok(())
        };
        let measured = |key: &String| {
            let all = Measure::ALL.map(Measure::key).join(", ");
            measure(key).map(drop).with_context(|| format!("`{key}` is no measure; it is one of {all}"))
        };
        let possible = |wanted: &Option<usize>| -> anyhow::Result<()> {
            let enough = wanted.is_none_or(|wanted| (1..=scenarios).contains(&wanted));
            anyhow::ensure!(
                enough,
                "`scenarios` must be 1 to {scenarios}, the number of scenarios that are run"
            );
            Ok(())
        };
        match self {
            Self::Success { planner, at_least } => {
                anyhow::ensure!((0.0..=1.0).contains(at_least), "`at_least` is a share of the runs, 0 to 1");
                known(planner)
            }
            Self::AsOften { planner, than } => {
                known(planner).and_then(|()| than.as_ref().map_or(Ok(()), known))
            }
            Self::Bound { planner, measure, at_most, at_least, scenarios, .. } => {
                anyhow::ensure!(
                    at_most.is_some() || at_least.is_some(),
                    "give `at_most`, `at_least` or both"
                );
                known(planner).and_then(|()| measured(measure)).and_then(|()| possible(scenarios))
            }
            Self::Best { planner, measure, scenarios, .. } => {
                known(planner).and_then(|()| measured(measure)).and_then(|()| possible(scenarios))
            }
            Self::Better { planner, than, measure, p } => {
                anyhow::ensure!((0.0..1.0).contains(p), "`p` is a probability below 1");
                known(planner).and_then(|()| known(than)).and_then(|()| measured(measure))
            }
        }
    }
}

fn measure(key: &str) -> Option<Measure> {
    Measure::ALL.into_iter().find(|measure| measure.key() == key)
}

struct Judge<'a> {
    comparison: &'a Comparison<'a>,
    /// Those that each planner should have.
    runs: usize,
}

impl Judge<'_> {
    /// The test behind a claim, if it rests on one.
    fn test(&self, claim: &Claim) -> Option<Paired> {
        let Claim::Better { planner, than, measure: key, .. } = claim else { return None };
        let (a, b) = (self.comparison.planner(planner)?, self.comparison.planner(than)?);
        self.comparison.paired(measure(key)?, a, b, None)
    }

    fn claim(&self, claim: &Claim, test: Option<Paired>) -> Judged {
        match claim {
            Claim::Success { planner, at_least } => self.success(planner, *at_least),
            Claim::AsOften { planner, than } => self.as_often(planner, than.as_deref()),
            Claim::Bound { planner, measure: key, at_most, at_least, of_best, scenarios } => {
                let (low, high) = (at_least.unwrap_or(f64::NEG_INFINITY), at_most.unwrap_or(f64::INFINITY));
                let shown = |value: f64| match (measure(key), of_best) {
                    (Some(measure), false) => measure.show_with_unit(value),
                    _ => format!("{value:.2} times the best planner's"),
                };
                let mut says = format!("{} of `{planner}` is", label(key));
                if let Some(least) = at_least {
                    let _ = write!(says, " at least {}", shown(*least));
                }
                if let Some(most) = at_most {
                    let also = if at_least.is_some() { " and" } else { "" };
                    let _ = write!(says, "{also} at most {}", shown(*most));
                }
                self.in_scenarios(planner, says, *scenarios, |scenario, own| {
                    let value = self.value(key, scenario, own)?;
                    let best = self.others(key, scenario, own).into_iter().chain([value]);
                    let value = if *of_best { value / self.best(key, best)? } else { value };
                    Some(((low..=high).contains(&value), shown(value)))
                })
            }
            Claim::Best { planner, measure: key, or_tied, scenarios } => {
                let tied = if *or_tied { " or as good as the best" } else { "" };
                let says =
                    format!("{} of `{planner}` is better than every other planner's{tied}", label(key));
                let best_by = |key: &str, scenario, own| {
                    let (value, prefers) = (self.value(key, scenario, own)?, measure(key)?);
                    let best = self.best(key, self.others(key, scenario, own).into_iter())?;
                    let holds = prefers.prefers(value, best) || (*or_tied && value == best);
                    let shown = |value: f64| prefers.show_with_unit(value);
                    let rivals = (0..self.comparison.planners.len())
                        .filter(|p| *p != own && self.value(key, scenario, *p) == Some(best));
                    let rivals: Vec<String> =
                        rivals.map(|p| format!("`{}`", self.comparison.planners[p])).collect();
                    let tie = if value == best { ", a tie" } else { "" };
                    Some((
                        holds,
                        format!("{} against {} of {}{tie}", shown(value), shown(best), rivals.join(", ")),
                    ))
                };
                let judged = |key: &str| {
                    self.in_scenarios(planner, says.clone(), *scenarios, |s, own| best_by(key, s, own))
                };
                let mut best = judged(key);
                if measure(key) == Some(Measure::Td) {
                    let seconds = judged(Measure::TdSeconds.key());
                    best.found += &format!("; by the seconds {}", seconds.found);
                }
                best
            }
            Claim::Better { planner, than, measure: key, p } => self.better([planner, than], key, *p, test),
        }
    }

    fn success(&self, planner: &str, at_least: f64) -> Judged {
        let runs = self.comparison.planner(planner).map(|own| Tally::of(self.comparison.all_runs(own)));
        let Tally { runs, success, contacts, .. } = runs.unwrap_or_default();
        let share = format!("{:.1} % of the runs", 100.0 * at_least);
        Judged {
            claim: format!("`{planner}` reaches the goal without a collision in at least {share}"),
            // A run that did not take place is none that succeeded.
            holds: self.runs > 0 && success as f64 >= at_least * self.runs as f64,
            found: format!("{success} of {}, {runs} took place, {contacts} collisions", self.runs),
            ..Judged::default()
        }
    }

    fn as_often(&self, planner: &str, than: Option<&str>) -> Judged {
        let tally = |name: &str| {
            let planner = self.comparison.planner(name).filter(|_| self.runs > 0);
            planner.map(|p| Tally::of(self.comparison.all_runs(p))).filter(|tally| tally.runs == self.runs)
        };
        let others: Vec<&str> = match than {
            Some(than) => vec![than],
            None => {
                self.comparison.planners.iter().map(String::as_str).filter(|name| *name != planner).collect()
            }
        };
        let of = than.map_or("any other planner".to_owned(), |than| format!("`{than}`"));
        let claim = format!("`{planner}` reaches the goal without a collision as often as {of}");
        let tallies: Option<Vec<Tally>> = others.iter().copied().map(tally).collect();
        let (Some(own), Some(tallies)) = (tally(planner), tallies.filter(|tallies| !tallies.is_empty()))
        else {
            return Judged { claim, found: "runs are missing".into(), ..Judged::default() };
        };
        let mut best = (0, "");
        for (tally, name) in tallies.iter().zip(others) {
            best = if tally.success > best.0 { (tally.success, name) } else { best };
        }
        let against =
            if best.1.is_empty() { "none".to_owned() } else { format!("{} of `{}`", best.0, best.1) };
        let found = format!("{} of {} runs, against {against}", own.success, own.runs);
        Judged { claim, holds: own.success >= best.0, found, ..Judged::default() }
    }

    /// Judges each scenario; one without runs, or without a value, does not hold.
    fn in_scenarios(
        &self,
        planner: &str,
        says: String,
        wanted: Option<usize>,
        holds: impl Fn(usize, usize) -> Option<(bool, String)>,
    ) -> Judged {
        let names = &self.comparison.scenarios;
        let wanted = wanted.unwrap_or(names.len());
        let mut not = Vec::new();
        for (scenario, name) in names.iter().enumerate() {
            let judged = self.comparison.planner(planner).and_then(|own| holds(scenario, own));
            match judged {
                Some((true, _)) => {}
                Some((false, found)) => not.push(format!("{name}: {found}")),
                None => not.push(format!("{name}: no value")),
            }
        }
        let good = names.len() - not.len();
        let but = if not.is_empty() { String::new() } else { format!("; not {}", not.join("; ")) };
        Judged {
            claim: format!("{says}, in at least {wanted} of {}", count(names.len(), "scenario")),
            holds: wanted > 0 && good >= wanted,
            found: format!("in {good}{but}"),
            ..Judged::default()
        }
    }

    fn better(&self, [planner, than]: [&str; 2], key: &str, p: f64, test: Option<Paired>) -> Judged {
        let claim = format!("{} of `{planner}` is better than that of `{than}`, p < {p}", label(key));
        let (Some(paired), Some(measure)) = (test, measure(key)) else {
            return Judged { claim, found: "no pair of runs".into(), ..Judged::default() };
        };
        let is_share = measure == Measure::Td;
        let seconds = is_share.then(|| self.in_seconds([planner, than])).flatten().unwrap_or_default();
        let [difference, bounds] = shown_difference(measure, &paired);
        let missing = self.runs.saturating_sub(paired.pairs);
        let without = if missing == 0 { String::new() } else { format!(", {missing} pairs without a value") };
        let (unit, least): (&str, f64) = (paired.unit.into(), least_p(paired.units));
        let units = count(paired.units, unit);
        let too_few = if least < p { String::new() } else { format!(", which can give no p below {least}") };
        Judged {
            claim,
            holds: measure.prefers(paired.difference, 0.0) && paired.p < p,
            too_few: least >= p,
            found: format!(
                "{difference} on average, {bounds}; so in {} of {} that differ; {} by Holm of {units}{too_few}; {} of the runs in these{without}{seconds}",
                paired.agree,
                count(paired.differ, "scenario"),
                shown_p(paired.p),
                shown_p(paired.p_of_runs),
            ),
            ..Judged::default()
        }
    }

    /// The difference in seconds beside that of a share of the run, which is smaller where a run takes longer.
    fn in_seconds(&self, [planner, than]: [&str; 2]) -> Option<String> {
        let (a, b) = (self.comparison.planner(planner)?, self.comparison.planner(than)?);
        let paired = self.comparison.paired(Measure::TdSeconds, a, b, None)?;
        Some(format!("; in seconds {}", shown_difference(Measure::TdSeconds, &paired).join(", ")))
    }

    fn value(&self, key: &str, scenario: usize, planner: usize) -> Option<f64> {
        self.comparison.mean(measure(key)?, scenario, planner)
    }

    fn others(&self, key: &str, scenario: usize, own: usize) -> Vec<f64> {
        let others = (0..self.comparison.planners.len()).filter(|other| *other != own);
        others.filter_map(|other| self.value(key, scenario, other)).collect()
    }

    fn best(&self, key: &str, values: impl Iterator<Item = f64>) -> Option<f64> {
        let measure = measure(key)?;
        values.reduce(|a, b| if measure.prefers(b, a) { b } else { a })
    }
}

fn label(key: &str) -> &str {
    measure(key).map_or(key, |measure| measure.label())
}

/// A difference with its sign and unit, and its interval.
fn shown_difference(measure: Measure, paired: &Paired) -> [String; 2] {
    let sign = if paired.difference > 0.0 { "+" } else { "" };
    let bounds = format!("{} to {}", measure.show(paired.low), measure.show(paired.high));
    [format!("{sign}{}", measure.show_with_unit(paired.difference)), bounds]
}

pub(crate) fn shown_p(p: f64) -> String {
    if p < 1e-4 { "p < 0.0001".into() } else { format!("p = {p:.4}") }
}

#[cfg(test)]
mod tests;
