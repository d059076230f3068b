//! `summary.json`: every figure of the report, for scripts.

use serde_json::{Map, Value, json};

use super::findings::Findings;
use super::measure::Measure;
use super::published::published;
use super::row::Tally;

/// The figures; keys of measures are those of `curionav run --json`, TCM and TD are fractions.
pub(super) fn summary(bench: &Findings<'_>) -> Value {
    let comparison = &bench.comparison;
    let missing: Vec<Value> = (bench.missing.iter())
        .map(|m| json!({"scenario": m.job.scenario, "planner": m.job.planner, "seed": m.job.seed, "reason": m.reason}))
        .collect();
    json!({
        "planners": comparison.planners,
        "scenarios": comparison.scenarios,
        "places": comparison.places,
        "first_seed": bench.first_seed,
        "perception": bench.perception,
        "repeats": bench.repeats,
        "programs": bench.programs,
        "missing": missing,
        "claims": bench.claims,
        "cells": cells(bench),
        "tests": tests(bench),
        "order": orders(bench),
        "timing": timing(bench),
    })
}

fn cells(bench: &Findings<'_>) -> Vec<Value> {
    let comparison = &bench.comparison;
    let mut cells = Vec::new();
    for (s, scenario) in comparison.scenarios.iter().enumerate() {
        for (p, planner) in comparison.planners.iter().enumerate() {
            let mut measures = Map::new();
            for measure in Measure::ALL {
                let Some(spread) = comparison.spread(measure, s, p) else { continue };
                let mut value = json!(spread);
                if let Some(theirs) = published(measure, planner, scenario) {
                    value["paper"] = json!({"mean": theirs.mean, "sd": theirs.sd});
                }
                value["best"] = json!(comparison.is_best(measure, s, p));
                measures.insert(measure.key().into(), value);
            }
            let tally = Tally::of(comparison.runs(s, p));
            cells
                .push(json!({"scenario": scenario, "planner": planner, "runs": tally, "measures": measures}));
        }
    }
    cells
}

/// Every two planners, in each scenario and over all.
fn tests(bench: &Findings<'_>) -> Vec<Value> {
    let comparison = &bench.comparison;
    let mut tests = Vec::new();
    for measure in Measure::ALL {
        for (a, first) in comparison.planners.iter().enumerate() {
            for (b, second) in comparison.planners.iter().enumerate().skip(a + 1) {
                for s in std::iter::once(None).chain((0..comparison.scenarios.len()).map(Some)) {
                    let Some(paired) = comparison.paired(measure, a, b, s) else { continue };
                    let scenario = s.map(|s| &comparison.scenarios[s]);
                    tests.push(json!({
                        "measure": measure.key(), "scenario": scenario, "a": first, "b": second, "a_minus_b": paired
                    }));
                }
            }
        }
    }
    tests
}

fn orders(bench: &Findings<'_>) -> Vec<Value> {
    let mut orders = Vec::new();
    for measure in Measure::PAPER {
        for (s, scenario) in bench.comparison.scenarios.iter().enumerate() {
            let order = bench.comparison.order(measure, s);
            if order.pairs > 0 {
                orders
                    .push(json!({"measure": measure.key(), "scenario": scenario, "as_in_the_paper": order}));
            }
        }
    }
    orders
}

fn timing(bench: &Findings<'_>) -> Value {
    let planners = bench.comparison.planners.iter().enumerate();
    let factors: Map<String, Value> =
        planners.filter_map(|(p, name)| Some((name.clone(), json!(bench.real_time_factor(p)?)))).collect();
    json!({"clock_s": bench.clock.as_secs_f64(), "workers": bench.workers, "real_time_factor": factors})
}
