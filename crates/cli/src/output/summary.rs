//! The JSON object of a run, which people script against.

use curionav_schemas::{Contact, Cycles, Measures, Outcome, RunResult};
use serde::Serialize;
use std::collections::BTreeMap;

/// A run without its trace; the keys and their order are stable.
#[derive(Debug, Serialize)]
struct Summary<'a> {
    scenario: &'a str,
    planner: &'a str,
    seed: u64,
    outcome: Outcome,
    #[serde(with = "EveryMeasure")]
    metrics: Measures,
    cycles: &'a Cycles,
    real_time_factor: f64,
    decisions_sha256: &'a str,
    /// Only in the file, never on standard output; so is the next.
    #[serde(skip_serializing_if = "Option::is_none")]
    contacts: Option<&'a [Contact]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    social: Option<&'a BTreeMap<String, f64>>,
}

/// [`Measures`] with every key present: one without a value is null rather than left out.
#[derive(Serialize)]
#[serde(remote = "Measures")]
struct EveryMeasure {
    rmse_m: f64,
    tcm: f64,
    nm: Option<u32>,
    tce_s: Option<f64>,
    td: f64,
    md_m: Option<f64>,
    td_in_view: Option<f64>,
    md_in_view_m: Option<f64>,
    nt: u32,
    vel_mps: f64,
    length_m: f64,
    time_s: f64,
    collisions: u32,
    clearance_min_m: f64,
}

fn summary(result: &RunResult) -> Summary<'_> {
    Summary {
        scenario: &result.scenario,
        planner: &result.planner,
        seed: result.seed,
        outcome: result.outcome,
        metrics: result.measures.clone(),
        cycles: &result.cycles,
        real_time_factor: result.real_time_factor,
        decisions_sha256: &result.decisions_sha256,
        contacts: None,
        social: None,
    }
}

/// The summary of `result` as one line, its keys in the documented order.
pub(crate) fn json(result: &RunResult) -> serde_json::Result<String> {
    serde_json::to_string(&summary(result))
}

/// The text of `metrics.json`: the summary with the collisions one by one and the measures of social navigation.
pub(super) fn for_file(result: &RunResult) -> serde_json::Result<String> {
    serde_json::to_string_pretty(&Summary {
        contacts: Some(&result.contacts),
        social: Some(&result.social),
        ..summary(result)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    #[test]
    fn the_object_is_exactly_the_documented_one() {
        let text = json(&golden::run_result()).unwrap();
        assert_eq!(
            text,
            concat!(
                r#"{"scenario":"two-people","planner":"paper","seed":17,"outcome":"reached","#,
                r#""metrics":{"rmse_m":0.12,"tcm":0.05,"nm":1,"tce_s":1.5,"td":0.02,"md_m":1.3,"#,
                r#""td_in_view":0.01,"md_in_view_m":1.4,"nt":2,"vel_mps":0.76,"#,
                r#""length_m":19.1,"time_s":25.0,"collisions":0,"clearance_min_m":0.4},"#,
                r#""cycles":{"count":83,"skipped":2,"late":1,"first_choice":70,"#,
                r#""other_choice":{"least_cost_free":10,"none_free":3},"degraded":1,"degraded_by":{"cut_short":1,"#,
                r#""evaluated_locally":1},"p50_ms":8.5,"p99_ms":21.0,"max_ms":30.5},"#,
                r#""real_time_factor":24.0,"decisions_sha256":"#,
                r#""00112233445566778899aabbccddeeff00112233445566778899aabbccddeeff"}"#,
            )
        );
    }

    #[test]
    fn the_distance_to_people_is_null_and_not_missing_if_there_are_none() {
        let mut result = golden::run_result();
        result.measures.md_m = None;
        assert!(json(&result).unwrap().contains("\"md_m\":null"));
    }
}
