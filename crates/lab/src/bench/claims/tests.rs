use super::super::comparison::tests::{names, rows};
use super::super::row::Row;
use super::*;

const PLANNERS: [&str; 3] = ["curiosity", "cpc-only", "cnc-only"];

fn judged(text: &str, rows: &[Row]) -> Vec<Judged> {
    let claims: Claims = toml::from_str(text).unwrap();
    let scenarios = ["env1-s1", "env1-s2"];
    claims.claim.iter().for_each(|claim| claim.check(&names(&PLANNERS), 2).unwrap());
    let all: Vec<&Row> = rows.iter().collect();
    claims.judge(&Comparison::new(names(&PLANNERS), names(&scenarios), vec![0, 1], &all), 10)
}

/// Rows in two scenarios; TD by planner and seed.
fn both(td: impl Fn(usize, u64) -> f64 + Copy) -> Vec<Row> {
    ["env1-s1", "env1-s2"].iter().flat_map(|scenario| rows(scenario, &PLANNERS, td)).collect()
}

fn holds(text: &str, rows: &[Row]) -> bool {
    judged(text, rows)[0].holds
}

#[test]
fn each_kind_of_claim_is_judged_by_its_figures() {
    let good = both(|p, seed| 0.1 * p as f64 + 0.001 * seed as f64);
    let bad = both(|p, _| 0.3 - 0.1 * p as f64);
    let best = "[[claim]]\nkind = \"best\"\nplanner = \"curiosity\"\nmeasure = \"td\"";
    assert!(holds(best, &good) && !holds(best, &bad));
    let bound = "[[claim]]\nkind = \"bound\"\nplanner = \"curiosity\"\nmeasure = \"td\"\nat_most = 0.041";
    assert!(holds(bound, &good) && !holds(bound, &bad));
    assert_eq!(judged(bound, &bad)[0].found, "in 0; not env1-s1: 30.00 %; env1-s2: 30.00 %");
    let near =
        "[[claim]]\nkind = \"bound\"\nplanner = \"cpc-only\"\nmeasure = \"td\"\nof_best = true\nat_most = ";
    assert!(holds(&format!("{near}25.0"), &good) && !holds(&format!("{near}1.0"), &good));
    let success = "[[claim]]\nkind = \"success\"\nplanner = \"curiosity\"\nat_least = 1.0";
    assert!(holds(success, &good));
    let mut hit = good.clone();
    hit[0].measures.collisions = 2;
    assert!(!holds(success, &hit));
    let often = "[[claim]]\nkind = \"as-often\"\nplanner = \"curiosity\"\n";
    let than = |other: &str| format!("{often}than = \"{other}\"");
    assert!(holds(often, &good) && !holds(often, &hit) && !holds(&than("cnc-only"), &hit));
    assert_eq!(judged(&than("cpc-only"), &hit)[0].found, "19 of 20 runs, against 20 of `cpc-only`");
    assert!(holds(&often.replace("curiosity", "cpc-only"), &hit));
}

#[test]
fn a_tie_is_no_win_unless_the_claim_says_so() {
    let tied = both(|_, seed| 0.001 * seed as f64);
    let best = "[[claim]]\nkind = \"best\"\nplanner = \"curiosity\"\nmeasure = \"td\"\n";
    assert!(!holds(best, &tied));
    assert!(holds(&format!("{best}or_tied = true"), &tied));
    let better =
        "[[claim]]\nkind = \"better\"\nplanner = \"curiosity\"\nthan = \"cpc-only\"\nmeasure = \"td\"";
    assert!(!holds(better, &tied));
}

#[test]
fn runs_that_are_missing_make_a_claim_fail() {
    let good = both(|p, seed| 0.1 * p as f64 + 0.001 * seed as f64);
    let fewer: Vec<Row> = good.iter().filter(|row| row.scenario == "env1-s1").cloned().collect();
    for (claim, rest) in [
        ("success", "at_least = 1.0"),
        ("as-often", ""),
        ("bound", "measure = \"td\"\nat_most = 0.041"),
        ("best", "measure = \"td\""),
    ] {
        let text = format!("[[claim]]\nkind = \"{claim}\"\nplanner = \"curiosity\"\n{rest}");
        assert!(holds(&text, &good) && !holds(&text, &fewer) && !holds(&text, &[]), "{claim}");
    }
    let better = "[[claim]]\nkind = \"better\"\nplanner = \"curiosity\"\nthan = \"cpc-only\"\nmeasure = \"td\"\np = 0.5";
    assert_eq!(judged(better, &[])[0].found, "no pair of runs");
}

#[test]
fn places_are_the_units_and_every_test_of_the_file_counts() {
    let good = both(|p, seed| 0.1 * p as f64 + 0.001 * seed as f64);
    let better = |p: f64| {
        let claim = "kind = \"better\"\nplanner = \"curiosity\"\nthan = \"cpc-only\"\nmeasure = \"td\"";
        format!("[[claim]]\n{claim}\np = {p}\n")
    };
    // Two places can have no p below 0.5, however many runs each has.
    assert!(!holds(&better(0.01), &good) && holds(&better(0.6), &good));
    // Two tests: 2 * 0.5.
    let two = judged(&better(0.6).repeat(2), &good);
    assert!(
        two.iter().all(|judged| !judged.holds && judged.found.contains("p = 1.0000 by Holm of 2 places")),
        "{two:?}"
    );
    let few = "so in 2 of 2 scenarios that differ; p = 0.5000 by Holm of 2 places, which can give no p below 0.5; p < 0.0001 of the runs in these; in seconds \u{2212}2.50 s, \u{2212}2.50 to \u{2212}2.50";
    let found = &judged(&better(0.01), &good)[0].found;
    assert!(found.ends_with(few), "{found}");
}

#[test]
fn a_claim_about_a_share_of_the_run_has_the_seconds_beside_it() {
    // A third as much of a run that takes ten times as long.
    let mut slow = both(|p, _| [0.1, 0.3, 0.5][p]);
    slow.iter_mut().filter(|row| row.planner == "curiosity").for_each(|row| row.measures.time_s = 100.0);
    slow.iter_mut().filter(|row| row.planner != "curiosity").for_each(|row| row.measures.time_s = 10.0);
    let of = "planner = \"curiosity\"\nmeasure = \"td\"";
    let better = judged(&format!("[[claim]]\nkind = \"better\"\nthan = \"cpc-only\"\n{of}"), &slow);
    assert!(better[0].found.ends_with("; in seconds +7.00 s, 7.00 to 7.00"), "{better:?}");
    let best = judged(&format!("[[claim]]\nkind = \"best\"\n{of}"), &slow);
    assert!(best[0].holds, "{best:?}");
    assert_eq!(
        best[0].found,
        "in 2; by the seconds in 0; not env1-s1: 10.00 s against 3.00 s of `cpc-only`; env1-s2: \
         10.00 s against 3.00 s of `cpc-only`"
    );
}

#[test]
fn a_name_that_is_not_there_is_refused_before_anything_is_run() {
    let check = |text: &str| {
        let claims: Claims = toml::from_str(text).map_err(|e| e.to_string())?;
        claims.claim[0].check(&names(&PLANNERS), 13).map_err(|e| e.to_string())
    };
    let refused = |text: &str, words: &str| {
        let error = check(text).unwrap_err();
        assert!(error.contains(words), "{error}");
    };
    refused("[[claim]]\nkind = \"success\"\nplanner = \"x\"\nat_least = 1.0", "`x` is not run");
    refused("[[claim]]\nkind = \"success\"\nplanner = \"cnc-only\"\nat_least = 90", "0 to 1");
    refused("[[claim]]\nkind = \"best\"\nplanner = \"cnc-only\"\nmeasure = \"tdd\"", "`tdd` is no measure");
    refused("[[claim]]\nkind = \"bound\"\nplanner = \"cnc-only\"\nmeasure = \"td\"", "`at_most`");
    refused(
        "[[claim]]\nkind = \"best\"\nplanner = \"cnc-only\"\nmeasure = \"td\"\nscenarios = 14",
        "1 to 13",
    );
    refused("[[claim]]\nkind = \"won\"\nplanner = \"cnc-only\"", "unknown variant");
}
