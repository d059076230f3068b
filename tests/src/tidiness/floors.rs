//! Which crate may import which: `docs/architecture.md`, "Floors".

use std::collections::BTreeSet;

use super::imports::Import;
use super::source::{blank_literals, paths_below};
use super::tree::{assert_none, files, files_of, text};

/// The library of simulated truth: no planner may see it.
const TRUTH: &str = "curionav-crowdsim";

/// What tests share; what is built for users must not need it.
const TESTING: &str = "curionav-testing";

/// What a crate may import of this project, by its directory; `None` for a crate without a floor.
fn allowed(directory: &str) -> Option<Vec<&'static str>> {
    const PLANNING: &str = "curionav-planning";
    const SCHEMAS: &str = "curionav-schemas";
    const SECURITY: &str = "curionav-security";
    const MISSION: &str = "curionav-mission";
    const ROBOT: &str = "curionav-robot";
    const IN_PROCESS: &str = "curionav-in-process";
    const RUNTIME: &str = "curionav-runtime";
    const POOL: &str = "curionav-pool";
    const LOCALIZATION: &str = "curionav-localization";
    const TRACKING: &str = "curionav-tracking-people";
    const ROS2: &str = "curionav-ros2";
    const OWN_PLANNER: &str = "curionav-own-planner";
    Some(match directory {
        "schemas" | "crates/datasets" | "crates/ros2" => vec![],
        "tests/support" => vec!["curionav-datasets", SCHEMAS],
        "crates/planning" => vec![TESTING],
        "crates/localization" | "crates/crowdsim" | "crates/tracking-people" => vec![PLANNING, TESTING],
        "crates/picture" => vec![PLANNING, SCHEMAS, TESTING],
        "crates/security" => vec![SCHEMAS],
        "crates/own-planner" => vec![PLANNING, SCHEMAS],
        "crates/mission" => vec![PLANNING, SCHEMAS, TESTING],
        "crates/robot" => vec![PLANNING, SCHEMAS, MISSION, LOCALIZATION, TRACKING, TESTING],
        "crates/in-process" => {
            vec![PLANNING, SCHEMAS, MISSION, LOCALIZATION, TRACKING, ROBOT, TRUTH, TESTING]
        }
        "crates/runtime" => vec![PLANNING, SCHEMAS, MISSION, SECURITY, TESTING],
        // It imports from its own floor: an exception that docs/architecture.md names.
        "crates/pool" => vec![PLANNING, SCHEMAS, RUNTIME, OWN_PLANNER, TESTING],
        "services/simulator" => {
            vec![PLANNING, SCHEMAS, RUNTIME, POOL, LOCALIZATION, TRACKING, IN_PROCESS, TRUTH, TESTING]
        }
        "services/ros2-gateway" => {
            vec![PLANNING, SCHEMAS, RUNTIME, LOCALIZATION, TRACKING, ROS2, TESTING]
        }
        _ if directory.starts_with("services/") => {
            vec![PLANNING, SCHEMAS, RUNTIME, POOL, LOCALIZATION, TRACKING, ROBOT, TESTING]
        }
        "crates/deployment" => [services(), vec![IN_PROCESS, TRUTH]].concat(),
        "crates/recording" => services(),
        "crates/lab" => {
            [services(), vec!["curionav-deployment", "curionav-picture", IN_PROCESS, TRUTH]].concat()
        }
        "python/native" => {
            vec![PLANNING, SCHEMAS, MISSION, LOCALIZATION, TRACKING, ROBOT, IN_PROCESS, TRUTH]
        }
        "crates/cli" | "tests" => ours(),
        _ => return None,
    })
}

/// Every service and every package below them but pictures and truth.
fn services() -> Vec<&'static str> {
    let above = [
        "curionav-deployment",
        "curionav-in-process",
        "curionav-lab",
        "curionav-recording",
        "curionav-picture",
        TRUTH,
    ];
    ours().into_iter().filter(|name| !above.contains(name)).collect()
}

/// Every package that may be imported from the top floor.
fn ours() -> Vec<&'static str> {
    vec![
        "curionav-arbiter",
        "curionav-cpc-evaluator",
        TRUTH,
        "curionav-datasets",
        "curionav-deployment",
        "curionav-driver",
        "curionav-cnc-evaluator",
        "curionav-in-process",
        "curionav-lab",
        "curionav-localization",
        "curionav-localizer",
        "curionav-mission",
        "curionav-own-planner",
        "curionav-people-tracker",
        "curionav-picture",
        "curionav-planning",
        "curionav-pool",
        "curionav-recording",
        "curionav-robot",
        "curionav-ros2",
        "curionav-ros2-gateway",
        "curionav-runtime",
        "curionav-schemas",
        "curionav-security",
        "curionav-simulator",
        TESTING,
        "curionav-tracking-people",
        "curionav-trajectory-generator",
    ]
}

/// (directory, names of all packages it depends on, for building, running or testing) of each crate.
fn crates() -> Vec<(String, Vec<String>)> {
    // Workspaces of their own, which import nothing or are imported by nothing here.
    let is_ours = |f: &String| !f.starts_with("schemas/fuzz/") && !f.starts_with("tests/ros2/");
    let manifests = files().into_iter().filter(|f| f.ends_with("/Cargo.toml") && is_ours(f));
    manifests
        .map(|path| {
            let manifest: toml::Table = text(&path).unwrap().parse().unwrap();
            let mut names = Vec::new();
            collect(&manifest, &mut names);
            (path.trim_end_matches("/Cargo.toml").to_owned(), names)
        })
        .collect()
}

fn collect(table: &toml::Table, names: &mut Vec<String>) {
    for (key, value) in table {
        let Some(entries) = value.as_table() else { continue };
        match key.as_str() {
            "dependencies" | "dev-dependencies" | "build-dependencies" => {
                // A renamed dependency is still the same package.
                let package = |v: &toml::Value| Some(v.get("package")?.as_str()?.to_owned());
                names.extend(entries.iter().map(|(name, v)| package(v).unwrap_or_else(|| name.clone())));
            }
            "target" => entries.values().filter_map(|v| v.as_table()).for_each(|t| collect(t, names)),
            _ => {}
        }
    }
}

/// Every import of a crate of this project into another, by their packages.
pub(super) fn imports_between_crates() -> BTreeSet<Import> {
    let package = |directory: &str| {
        let manifest: toml::Table = text(&format!("{directory}/Cargo.toml")).unwrap().parse().unwrap();
        manifest["package"]["name"].as_str().unwrap().to_owned()
    };
    let imports = crates().into_iter().flat_map(|(directory, names)| {
        let from = package(&directory);
        let ours = names.into_iter().filter(|name| name.starts_with("curionav"));
        ours.map(move |to| Import { from: from.clone(), path: to.clone(), to }).collect::<Vec<_>>()
    });
    imports.collect()
}

#[test]
fn no_crate_imports_from_its_own_floor_or_above() {
    let mut offences = Vec::new();
    for (directory, names) in crates() {
        let Some(allowed) = allowed(&directory) else {
            offences.push(format!("{directory} has no floor; give it one here and in docs/architecture.md"));
            continue;
        };
        let imported = names.iter().filter(|n| n.starts_with("curionav") && !allowed.contains(&n.as_str()));
        offences.extend(imported.map(|name| format!("{directory} imports {name}")));
    }
    assert_none("a crate imports only from the floors below it:", &offences);
}

#[test]
fn only_those_who_make_or_judge_the_truth_can_see_it() {
    let seers: Vec<String> =
        crates().into_iter().filter(|(_, names)| names.iter().any(|n| n == TRUTH)).map(|c| c.0).collect();
    assert_eq!(
        seers,
        [
            "crates/deployment",
            "crates/in-process",
            "crates/lab",
            "python/native",
            "services/simulator",
            "tests"
        ]
    );
}

#[test]
fn pure_crates_and_schemas_build_and_test_without_zenoh() {
    let pure = [
        "schemas",
        "crates/planning",
        "crates/localization",
        "crates/crowdsim",
        "crates/tracking-people",
        "crates/picture",
        "crates/ros2",
        "crates/mission",
        "crates/robot",
        "crates/in-process",
        "python/native",
    ];
    let networked = ["zenoh", "tokio", "async-std", "smol", "mio"];
    let mut offences = Vec::new();
    for (directory, names) in crates().into_iter().filter(|c| pure.contains(&c.0.as_str())) {
        let found = names
            .iter()
            .filter(|n| networked.iter().any(|w| n.as_str() == *w || n.starts_with(&format!("{w}-"))));
        offences.extend(found.map(|name| format!("{directory} depends on {name}")));
    }
    assert_none("a pure crate knows no network and no runtime:", &offences);
}

#[test]
fn localization_and_crowdsim_use_the_vocabulary_of_planning_not_its_decisions() {
    let mut offences = Vec::new();
    // A test may compare what is decided with what then happens; the crates themselves may not.
    let ours =
        |f: &String| f.starts_with("crates/localization/src/") || f.starts_with("crates/crowdsim/src/");
    for path in files_of("rs").into_iter().filter(ours) {
        let code = blank_literals(&text(&path).unwrap());
        let decisions = paths_below(&code, "curionav_planning").into_iter().filter(|(_, p)| {
            let first = p.split("::").next().unwrap_or(p);
            ["generation", "evaluation", "arbitration", "*"].contains(&first)
        });
        offences.extend(decisions.map(|(_, p)| format!("{path} names curionav_planning::{p}")));
    }
    assert_none("only geometry, occupancy, motion and the like are shared:", &offences);
}
