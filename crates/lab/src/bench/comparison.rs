//! What the rows mean: spreads, paired differences, who is best, whose order is the paper's.

use std::collections::BTreeMap;
use std::ops::Add;

use serde::Serialize;
use sha2::{Digest, Sha256};

use super::measure::Measure;
use super::published::published;
use super::row::Row;
use crate::statistics::{
    cluster_interval, holm, mean, mean_interval, median, signed_rank, standard_deviation,
};

/// A measure over the runs of one planner in one scenario.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Spread {
    /// Runs in which the measure has a value.
    pub(crate) runs: usize,
    pub(crate) mean: f64,
    /// What a few lost runs do not rule.
    pub(crate) median: f64,
    pub(crate) sd: f64,
    /// 95 % bootstrap interval of the mean.
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// One planner against another in the same scenarios with the same seeds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Paired {
    /// Runs of both.
    pub(crate) pairs: usize,
    /// How many units the test takes for independent.
    pub(crate) units: usize,
    /// How many of these are not zero: the test has nothing else to go by.
    pub(crate) nonzero: usize,
    /// What they are.
    pub(crate) unit: Unit,
    /// Scenarios in which the two differ on average.
    pub(crate) differ: usize,
    /// How many of these differ in the direction of `difference`.
    pub(crate) agree: usize,
    /// Mean over places of the mean over their scenarios of the first minus the second.
    pub(crate) difference: f64,
    /// Its 95 % bootstrap interval.
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Of the two-sided signed-rank test of the units.
    pub(crate) p: f64,
    /// Of the same test of the runs: it says whether other seeds in these scenarios would show the same, and nothing of
    /// other places.
    pub(crate) p_of_runs: f64,
}

impl Paired {
    /// Corrects both p values of these tests for their number.
    pub(crate) fn correct<'t>(tests: impl Iterator<Item = &'t mut Self>) {
        let mut tests: Vec<&mut Self> = tests.collect();
        let corrected = |p: fn(&Self) -> f64| holm(&tests.iter().map(|test| p(test)).collect::<Vec<_>>());
        let (of_units, of_runs) = (corrected(|test| test.p), corrected(|test| test.p_of_runs));
        for (test, (p, p_of_runs)) in tests.iter_mut().zip(of_units.into_iter().zip(of_runs)) {
            (test.p, test.p_of_runs) = (p, p_of_runs);
        }
    }
}

/// What a test takes for independent: places, the scenarios of the only place, or the runs of the only scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, strum::IntoStaticStr)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub(crate) enum Unit {
    Place,
    Scenario,
    Run,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Order {
    pub(crate) agree: usize,
    /// Pairs that the paper tells apart and whose means are equal here.
    pub(crate) tied: usize,
    /// Pairs that the paper tells apart.
    pub(crate) pairs: usize,
}

impl Order {
    /// Pairs whose means differ in the paper and here.
    pub(crate) fn apart(&self) -> usize {
        self.pairs - self.tied
    }
}

impl Add for Order {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            agree: self.agree + other.agree,
            tied: self.tied + other.tied,
            pairs: self.pairs + other.pairs,
        }
    }
}

/// All rows by scenario and planner; both are named by their place in the lists.
pub(crate) struct Comparison<'a> {
    pub(crate) planners: Vec<String>,
    pub(crate) scenarios: Vec<String>,
    /// [scenario] number of the place that its map shows.
    pub(crate) places: Vec<usize>,
    /// [scenario][planner] by seed.
    rows: Vec<Vec<BTreeMap<u64, &'a Row>>>,
    spreads: BTreeMap<(Measure, usize, usize), Spread>,
}

impl<'a> Comparison<'a> {
    /// `places` are those of the scenarios, by number from 0 on.
    pub(crate) fn new(
        planners: Vec<String>,
        scenarios: Vec<String>,
        places: Vec<usize>,
        all: &[&'a Row],
    ) -> Self {
        let mut rows = vec![vec![BTreeMap::new(); planners.len()]; scenarios.len()];
        for row in all {
            let scenario = scenarios.iter().position(|s| *s == row.scenario);
            let planner = planners.iter().position(|p| *p == row.planner);
            if let (Some(scenario), Some(planner)) = (scenario, planner) {
                rows[scenario][planner].insert(row.seed, *row);
            }
        }
        let mut comparison = Self { planners, scenarios, places, rows, spreads: BTreeMap::new() };
        for measure in Measure::ALL {
            for scenario in 0..comparison.scenarios.len() {
                for planner in 0..comparison.planners.len() {
                    if let Some(spread) = comparison.measured(measure, scenario, planner) {
                        comparison.spreads.insert((measure, scenario, planner), spread);
                    }
                }
            }
        }
        comparison
    }

    pub(crate) fn planner(&self, name: &str) -> Option<usize> {
        self.planners.iter().position(|p| p == name)
    }

    /// The runs of one planner in one scenario, by seed.
    pub(crate) fn runs(&self, scenario: usize, planner: usize) -> impl Iterator<Item = &'a Row> {
        self.rows[scenario][planner].values().copied()
    }

    pub(crate) fn all_runs(&self, planner: usize) -> impl Iterator<Item = &'a Row> {
        (0..self.scenarios.len()).flat_map(move |scenario| self.runs(scenario, planner))
    }

    pub(crate) fn count_runs(&self) -> usize {
        self.rows.iter().flatten().map(BTreeMap::len).sum()
    }

    /// Nothing where no run has a value.
    pub(crate) fn spread(&self, measure: Measure, scenario: usize, planner: usize) -> Option<&Spread> {
        self.spreads.get(&(measure, scenario, planner))
    }

    pub(crate) fn mean(&self, measure: Measure, scenario: usize, planner: usize) -> Option<f64> {
        self.spread(measure, scenario, planner).map(|spread| spread.mean)
    }

    fn measured(&self, measure: Measure, scenario: usize, planner: usize) -> Option<Spread> {
        let values: Vec<f64> = self.runs(scenario, planner).filter_map(|row| measure.of(row)).collect();
        let seed = seed(&[measure.key(), &self.scenarios[scenario], &self.planners[planner]]);
        let (low, high) = mean_interval(&values, seed)?;
        Some(Spread {
            runs: values.len(),
            mean: mean(&values)?,
            median: median(&values)?,
            sd: standard_deviation(&values)?,
            low,
            high,
        })
    }

    /// How many places the scenarios are in.
    pub(crate) fn count_places(&self) -> usize {
        self.places.iter().max().map_or(0, |last| last + 1)
    }

    /// Planner `a` minus planner `b`, in one scenario or over all; nothing without a pair. Over several places these are
    /// the unit: runs in one place have its walls in common, whatever scenario they are of.
    pub(crate) fn paired(
        &self,
        measure: Measure,
        a: usize,
        b: usize,
        scenario: Option<usize>,
    ) -> Option<Paired> {
        // The same resamples, whichever of the two is named first.
        if self.planners[a] > self.planners[b] {
            let other = self.paired(measure, b, a, scenario)?;
            let Paired { difference, low, high, .. } = other;
            return Some(Paired { difference: -difference, low: -high, high: -low, ..other });
        }
        let all = 0..self.scenarios.len();
        let mut differences = vec![Vec::new(); self.scenarios.len()];
        for s in all.filter(|s| scenario.is_none_or(|wanted| wanted == *s)) {
            for (seed, row) in &self.rows[s][a] {
                let other = self.rows[s][b].get(seed).and_then(|other| measure.of(other));
                if let (Some(value), Some(other)) = (measure.of(row), other) {
                    differences[s].push(settled(value - other));
                }
            }
        }
        let place = scenario.map_or("", |s| &self.scenarios[s]);
        let seed = seed(&[measure.key(), place, &self.planners[a], &self.planners[b]]);
        let runs = differences.concat();
        let average = |values: &[f64]| mean(values).map(settled);
        let scenes: Vec<f64> = differences.iter().filter_map(|of_scene| average(of_scene)).collect();
        let mut by_place = vec![Vec::new(); self.count_places()];
        for (of_scene, place) in differences.into_iter().zip(&self.places) {
            by_place[*place].push(of_scene);
        }
        let of_place = |scenes: &Vec<Vec<f64>>| {
            average(&scenes.iter().filter_map(|of_scene| average(of_scene)).collect::<Vec<_>>())
        };
        let means: Vec<f64> = by_place.iter().filter_map(of_place).collect();
        let (unit, units) = match (means.len(), scenes.len()) {
            (2.., _) => (Unit::Place, &means),
            (_, 2..) => (Unit::Scenario, &scenes),
            _ => (Unit::Run, &runs),
        };
        let (difference, p, p_of_runs) = (mean(&means)?, signed_rank(units)?, signed_rank(&runs)?);
        let (low, high) = cluster_interval(&by_place, seed)?;
        let differ = scenes.iter().filter(|of_scene| **of_scene != 0.0).count();
        let agree = scenes.iter().filter(|of_scene| **of_scene * difference > 0.0).count();
        let nonzero = units.iter().filter(|of_unit| **of_unit != 0.0).count();
        let (pairs, units) = (runs.len(), units.len());
        Some(Paired { pairs, units, nonzero, unit, differ, agree, difference, low, high, p, p_of_runs })
    }

    /// Whether no other mean is better; several may share it. A planner that was not once sure of its place has not been
    /// unsure again the least: where some of its runs have no NM or TCE, it has none here.
    pub(crate) fn is_best(&self, measure: Measure, scenario: usize, planner: usize) -> bool {
        let comparable = |p: usize| {
            let spread = self.spread(measure, scenario, p)?;
            let is_whole = spread.runs == self.runs(scenario, p).count();
            (is_whole || !matches!(measure, Measure::Nm | Measure::Tce)).then_some(spread.mean)
        };
        let Some(own) = comparable(planner) else { return false };
        let others = (0..self.planners.len()).filter_map(comparable);
        !others.into_iter().any(|other| measure.prefers(other, own))
    }

    /// Of the pairs of planners that the paper tells apart in this scenario, how many are in its order here.
    pub(crate) fn order(&self, measure: Measure, scenario: usize) -> Order {
        let both: Vec<(f64, f64)> = (0..self.planners.len())
            .filter_map(|p| {
                let theirs = published(measure, &self.planners[p], &self.scenarios[scenario])?;
                Some((theirs.mean, self.mean(measure, scenario, p)?))
            })
            .collect();
        let mut order = Order::default();
        for (i, (theirs, ours)) in both.iter().enumerate() {
            for (their_other, our_other) in &both[i + 1..] {
                if theirs != their_other {
                    let gap = settled(ours - our_other);
                    let agree = gap * (theirs - their_other) > 0.0;
                    order = order + Order { agree: agree.into(), tied: (gap == 0.0).into(), pairs: 1 };
                }
            }
        }
        order
    }
}

/// A difference without the rounding of its subtraction or of a sum, so that what is equal is zero, and ties are ties.
fn settled(difference: f64) -> f64 {
    (difference * 1e9).round() / 1e9
}

/// The seed of a bootstrap: its own for each question, the same in every report.
fn seed(words: &[&str]) -> u64 {
    let digest = Sha256::digest(words.join("\n"));
    digest.iter().take(8).fold(0, |seed, byte| seed << 8 | u64::from(*byte))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::super::row::tests::row;
    use super::*;

    /// Two planners, ten seeds, TD as given by (planner, seed).
    pub(crate) fn rows(scenario: &str, planners: &[&str], td: impl Fn(usize, u64) -> f64) -> Vec<Row> {
        let mut rows = Vec::new();
        for (index, planner) in planners.iter().enumerate() {
            for seed in 1..=10 {
                let mut one = row(scenario, planner, seed);
                one.measures.td = td(index, seed);
                rows.push(one);
            }
        }
        rows
    }

    pub(crate) fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn pairs_share_scenario_and_seed() {
        // The first is better by 0.01 in every pair, though the seeds differ by far more.
        let mut rows = rows("x", &["a", "b"], |p, seed| 0.05 * seed as f64 + 0.01 * p as f64);
        rows.retain(|r| r.planner == "a" || r.seed > 1);
        let all: Vec<&Row> = rows.iter().collect();
        let comparison = Comparison::new(names(&["a", "b"]), names(&["x"]), vec![0], &all);
        let paired = comparison.paired(Measure::Td, 0, 1, None).unwrap();
        assert_eq!(paired.pairs, 9);
        assert!((paired.difference + 0.01).abs() < 1e-9 && paired.p < 0.01, "{paired:?}");
        assert!(comparison.paired(Measure::Td, 0, 1, Some(0)).is_some());
        let spread = comparison.spread(Measure::Td, 0, 0).unwrap();
        assert!((spread.mean - 0.275).abs() < 1e-12 && spread.low < spread.mean && spread.mean < spread.high);
    }

    #[test]
    fn scenes_in_one_place_are_one_sample_of_places() {
        // Nine scenes of one hall in which the first is better by 0.3, and one of another in which it is worse by 0.1.
        let scenes: Vec<String> = (0..10).map(|scene| format!("s{scene}")).collect();
        let of = |scene: &String| {
            let difference = if scene == "s9" { -0.1 } else { 0.3 };
            rows(scene, &["a", "b"], move |p, _| difference * p as f64 + 0.5)
        };
        let rows: Vec<Row> = scenes.iter().flat_map(of).collect();
        let all: Vec<&Row> = rows.iter().collect();
        let paired = |places: [usize; 10]| {
            let comparison = Comparison::new(names(&["a", "b"]), scenes.clone(), places.to_vec(), &all);
            comparison.paired(Measure::Td, 0, 1, None).unwrap()
        };
        let apart = paired([0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
        assert!((apart.units, apart.unit) == (10, Unit::Place) && apart.p < 0.01, "{apart:?}");
        // (0.3 - 0.1) / 2 = 0.1 in two places, which agree on nothing.
        let halls = paired([0, 0, 0, 0, 0, 0, 0, 0, 0, 1]);
        assert!(
            (halls.difference + 0.1).abs() < 1e-12 && halls.low < -0.29 && halls.high > 0.09,
            "{halls:?}"
        );
        assert_eq!((halls.units, halls.p, halls.agree, halls.differ), (2, 1.0, 9, 10));
        // In a single place scenes are what there is.
        let one = paired([0; 10]);
        assert_eq!((one.units, one.unit), (10, Unit::Scenario));
    }

    #[test]
    fn rounding_is_no_difference_and_the_other_way_round_has_the_same_bounds() {
        // 0.1 + 0.2 is not 0.3 to the last bit: zeros and ties would be neither.
        let by = [0.0, 0.1 + 0.2 - 0.3, 0.0, 0.1, -0.1, 0.3 - 0.2, 0.0, 0.0, 0.0, 0.0];
        let rows = rows("x", &["a", "b"], |p, seed| if p == 0 { 0.5 + by[seed as usize - 1] } else { 0.5 });
        let all: Vec<&Row> = rows.iter().collect();
        let comparison = Comparison::new(names(&["a", "b"]), names(&["x"]), vec![0], &all);
        let [there, back] =
            [(0, 1), (1, 0)].map(|(a, b)| comparison.paired(Measure::Td, a, b, None).unwrap());
        // Ranks 2, 2 and 2, one of them against: both tails of two or more of three.
        assert_eq!((there.nonzero, there.units, there.p), (3, 10, 1.0), "{there:?}");
        assert_eq!((there.low, there.high, there.difference), (-back.high, -back.low, -back.difference));
    }

    #[test]
    fn success_is_compared_as_other_measures_are() {
        let mut rows = rows("x", &["a", "b"], |_, _| 0.0);
        rows.iter_mut().filter(|row| row.planner == "b" && row.seed > 4).for_each(|row| {
            row.outcome = curionav_schemas::Outcome::Timeout;
        });
        let all: Vec<&Row> = rows.iter().collect();
        let comparison = Comparison::new(names(&["a", "b"]), names(&["x"]), vec![0], &all);
        let paired = comparison.paired(Measure::Success, 0, 1, None).unwrap();
        // Six of ten seeds differ, all in one direction: 2 / 2^6.
        assert_eq!((paired.difference, paired.p, paired.pairs), (0.6, 0.03125, 10));
        assert!(Measure::Success.prefers(1.0, 0.4));
    }

    #[test]
    fn a_run_that_did_not_arrive_has_no_length_but_counts_otherwise() {
        let mut rows = rows("x", &["a"], |_, _| 0.0);
        rows[0].outcome = curionav_schemas::Outcome::Timeout;
        let all: Vec<&Row> = rows.iter().collect();
        let comparison = Comparison::new(names(&["a"]), names(&["x"]), vec![0], &all);
        assert_eq!(comparison.spread(Measure::Length, 0, 0).unwrap().runs, 9);
        assert_eq!(comparison.spread(Measure::Td, 0, 0).unwrap().runs, 10);
    }

    #[test]
    fn the_order_is_compared_where_the_paper_has_one() {
        // Env1 S1 prints TD 0, 2.28, 6.78 % for these; here the last two are swapped.
        let planners = ["curiosity", "cpc-only", "cnc-only"];
        let rows = rows("env1-s1", &planners, |p, _| [0.0, 0.3, 0.2][p]);
        let all: Vec<&Row> = rows.iter().collect();
        let comparison = Comparison::new(names(&planners), names(&["env1-s1"]), vec![0], &all);
        assert_eq!(comparison.order(Measure::Td, 0), Order { agree: 2, tied: 0, pairs: 3 });
        assert!(comparison.is_best(Measure::Td, 0, 0) && !comparison.is_best(Measure::Td, 0, 2));
        assert!((0..3).all(|p| comparison.is_best(Measure::Rmse, 0, p)), "all tied");
    }
}
