//! The committed scenarios, embedded.

use std::time::Instant;

use curionav_planning::profile::Profile;

use super::program::{curionav, in_real_time, root, run, turn};

const PAPER: &str = "scenarios/paper/env4-s2.toml";
const QUICK: &str = "scenarios/quickstart.toml";

#[test]
fn the_paper_scenario_is_reached_without_collision() {
    let _turn = turn();
    for seed in ["1", "2"] {
        let begin = Instant::now();
        let (json, status) = run(PAPER, &["--seed", seed]);
        assert_eq!(
            (json.outcome.as_str(), json.metrics.collisions, status),
            ("reached", 0, 0),
            "seed {seed}: {json:?}"
        );
        assert_eq!((json.scenario.as_str(), json.planner.as_str()), ("env4-s2", "curiosity"));
        let c = &json.cycles;
        assert_eq!((c.skipped, c.late, c.degraded), (0, 0, 0));
        assert!(c.degraded_by.is_empty(), "{json:?}");
        // A cycle every 0.3 s, the first at once.
        let expected = (json.metrics.time_s / 0.3).floor() as u64 + 1;
        assert_eq!(json.cycles.count, expected, "{json:?}");
        let m = &json.metrics;
        assert!(
            (m.vel_mps - m.length_m / m.time_s).abs() < 0.02 && m.md_m.is_some() && m.clearance_min_m > 0.0
        );
        assert!((0.0..=1.0).contains(&m.td) && (0.0..=1.0).contains(&m.tcm) && m.rmse_m < 0.5);
        assert!(m.td_in_view <= m.td && m.md_in_view_m >= m.md_m, "{json:?}");
        assert!(json.cycles.p50_ms <= json.cycles.p99_ms && json.cycles.p99_ms <= json.cycles.max_ms);
        // What it says of its speed cannot be less than what was measured around it.
        assert!(json.real_time_factor >= json.metrics.time_s / begin.elapsed().as_secs_f64(), "{json:?}");
        assert!(
            m.nm.unwrap_or(0) + m.nt < 100
                && m.tce_s.is_none_or(|s| s < m.time_s)
                && json.seed.to_string() == seed
        );
    }
}

#[test]
fn every_planner_has_its_candidates_from_its_generator_and_its_costs_from_its_evaluators() {
    let _turn = turn();
    for planner in Profile::names() {
        let (json, _) = run(QUICK, &["--planner", planner]);
        assert!(json.cycles.count > 10 && json.cycles.degraded_by.is_empty(), "{planner}: {json:?}");
        assert!(json.cycles.first_choice > 0, "{planner}: {json:?}");
        let others: u64 = json.cycles.other_choice.values().sum();
        assert_eq!(json.cycles.first_choice + others, json.cycles.count, "{planner}: {json:?}");
    }
}

#[test]
fn the_same_seed_decides_the_same_and_another_seed_otherwise() {
    let _turn = turn();
    let sha = |seed| run(QUICK, &["--seed", seed]).0.decisions_sha256;
    let first = sha("3");
    assert_eq!(first, sha("3"));
    assert_ne!(first, sha("4"));
}

#[test]
fn the_built_in_scenario_is_the_file_and_is_copied_as_it_is() {
    let _turn = turn();
    let (built_in, of_file) = (run("quickstart", &[]).0, run(QUICK, &[]).0);
    assert_eq!(built_in.decisions_sha256, of_file.decisions_sha256);
    let directory = tempfile::tempdir().unwrap();
    let copied = curionav(&["scenario", "copy", directory.path().to_str().unwrap()]);
    assert!(copied.status.success(), "{copied:?}");
    for name in ["quickstart.toml", "maps/quickstart.yaml", "maps/quickstart.pgm"] {
        let read = |folder: &std::path::Path| std::fs::read(folder.join(name)).unwrap();
        assert!(read(directory.path()) == read(&root().join("scenarios")), "{name}");
    }
}

#[test]
fn a_profile_file_decides_as_the_built_in_profile_of_the_same_text() {
    let _turn = turn();
    // It has fewer terms than the default profile.
    let sha = |planner| run(QUICK, &["--seed", "1003", "--planner", planner]).0.decisions_sha256;
    assert_eq!(sha("distance-only"), sha("crates/planning/profiles/distance-only.toml"));
}

#[test]
fn a_run_leaves_its_picture_and_data() {
    let _turn = turn();
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("deep/er");
    let (json, _) = run(QUICK, &["--out", out.to_str().unwrap()]);
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let metrics: serde_json::Value = serde_json::from_str(&read("metrics.json")).unwrap();
    assert_eq!(metrics["decisions_sha256"], json.decisions_sha256);
    assert_eq!(read("cycles.csv").lines().count() as u64, json.cycles.count + 1);
    // One row a tick of 0.1 s, the first at 0, and a header.
    assert_eq!(read("trajectory.csv").lines().count(), (json.metrics.time_s / 0.1).round() as usize + 2);
    assert!(read("run.svg").trim_end().ends_with("</svg>"));
}

#[test]
fn the_pictures_in_the_docs_are_of_the_committed_scenarios() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().to_str().unwrap();
    let names = ["env1-s2", "env2-s2", "env3-s2", "env4-s2"];
    let files = names.map(|name| format!("scenarios/paper/{name}.toml"));
    let output =
        curionav(&[&["scenario", "draw", "--out", out], &files.each_ref().map(String::as_str)[..]].concat());
    assert!(output.status.success(), "{output:?}");
    for name in names {
        let drawn = std::fs::read_to_string(directory.path().join(name).with_extension("svg")).unwrap();
        assert!(drawn.contains("<polyline") && drawn.contains(name), "{name} is no picture");
        let kept = std::fs::read_to_string(root().join(format!("docs/images/{name}.svg"))).unwrap();
        assert!(drawn == kept, "docs/images/{name}.svg: draw it anew with `curionav scenario draw`");
    }
}

#[test]
fn a_table_for_people_and_json_for_programs() {
    let _turn = turn();
    let output = curionav(&["run", QUICK]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("REACHED") && !text.trim_start().starts_with('{'), "{text}");
    assert!(curionav(&["--help"]).status.success() && curionav(&["run", "--help"]).status.success());
}

#[test]
fn real_time_keeps_the_pace() {
    let _turn = turn();
    in_real_time(|speed| {
        let (mut json, status) = run(PAPER, &["--speed", &(4.0 * speed).to_string()]);
        assert_eq!((json.outcome.as_str(), status), ("reached", 0), "{json:?}");
        json.real_time_factor /= 4.0;
        let keeps = (json.real_time_factor / speed - 1.0).abs() < 0.1;
        (json, keeps)
    });
}
