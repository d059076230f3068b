//! Every number of a scenario, a planner profile and the localiser's parameters has a range, and whatever lies in
//! all ranges runs to its end.
//!
//! The numbers are found in the files themselves, so a new field is tested without being listed here. Each is set,
//! alone, to 0, -1, 1e-12, 1e12, NaN, infinity and both ends of its range. The value is either refused with line
//! and field, or a short run with it ends in time and in little memory.
//!
//! The short form takes the runs to workers that live on. `CURIONAV_EVERY_NUMBER=long` starts the program anew for
//! each, and prints what each took:
//! `CURIONAV_EVERY_NUMBER=long cargo test --release --test all every_number -- --nocapture`.

mod cells;
mod room;
mod runs;

use curionav_crowdsim::{Recording, Scenario, World};
use curionav_localization::LocalizerParams;
use curionav_planning::parameters::{FieldError, Ranged, read};
use curionav_planning::profile::Profile;
use curionav_planning::terms;
use curionav_tracking_people::TrackerParams;
use serde::Serializer as _;
use serde_json::ser::PrettyFormatter;

use crate::end_to_end::program::{curionav, root};
use cells::{Cell, assert_complete, assert_names, cells};
use runs::Run;
pub(crate) use runs::children;

/// What became of the values of one kind of document.
#[derive(Default)]
struct Tally {
    fields: usize,
    refused: usize,
    accepted: Vec<Cell>,
}

/// Reads every cell of a complete document; what is refused must be refused for the right reason.
fn sift<T: Ranged + serde::de::DeserializeOwned>(document: &toml::Table) -> Tally {
    let mut tally = Tally { fields: cells::numbers(document).len(), ..Tally::default() };
    for cell in cells(document, T::FIELDS) {
        let text = toml::to_string(&cell.document).unwrap();
        match read::<T>(&text) {
            Ok(_) => {
                assert!(cell.value.is_finite(), "{} takes {}", cell.path, cell.value);
                tally.accepted.push(cell);
            }
            Err(error) => {
                assert_names(&error, &text, &cell.path, cell.value);
                tally.refused += 1;
            }
        }
    }
    tally
}

/// The fault of a text, if it has one.
fn fault_of<T>(read: impl Fn(&str) -> Result<T, FieldError>) -> impl Fn(&str) -> Option<FieldError> {
    move |text| read(text).err()
}

/// The scenario of a cell; its people walk by the law that the cell's number belongs to.
fn moved_by_its_law(cell: &Cell) -> toml::Table {
    let mut scenario = cell.document.clone();
    if cell.path.starts_with("people.social_force.") {
        scenario["people"]["motion"] = "social-force".into();
    }
    scenario
}

#[test]
fn the_reference_page_of_the_scenario_is_up_to_date() {
    let made = curionav(&["scenario", "reference"]);
    let committed = std::fs::read_to_string(root().join("docs/scenario.md")).unwrap();
    let mend = "run `curionav scenario reference > docs/scenario.md`";
    assert!(String::from_utf8(made.stdout).unwrap() == committed, "docs/scenario.md is out of date: {mend}");
}

#[test]
fn the_profiles_that_python_carries_are_the_built_in_ones() {
    // In the order in which errors list them: the paper's first.
    let mut text = Vec::new();
    let mut json = serde_json::Serializer::with_formatter(&mut text, PrettyFormatter::with_indent(b" "));
    json.collect_map(Profile::names().map(|name| (name, Profile::builtin(name).unwrap()))).unwrap();
    text.push(b'\n');
    let carried = "python/src/curionav/profiles.json";
    if std::fs::read(root().join(carried)).unwrap() != text {
        let made = std::env::temp_dir().join("curionav-profiles.json");
        std::fs::write(&made, text).unwrap();
        panic!("{carried} is out of date: run `cp {} {carried}`", made.display());
    }
}

#[test]
fn the_terms_that_python_leaves_to_us_are_the_built_in_ones() {
    let file = "python/src/curionav/evaluation.py";
    let source = std::fs::read_to_string(root().join(file)).unwrap();
    let list = source.split_once("BUILT_IN = frozenset(").unwrap().1.split_once(')').unwrap().0;
    let names: Vec<&str> = list.split('"').skip(1).step_by(2).collect();
    assert_eq!(names, terms::NAMES, "BUILT_IN of {file}");
}

#[test]
fn every_number_is_refused_by_name_or_runs_to_its_end() {
    let room = room::Room::new();
    let scenario: toml::Table = room::SCENARIO.parse().unwrap();
    assert_complete(&scenario, &fault_of(Scenario::from_toml));
    let mut runs = Vec::new();
    let mut fields = 0;
    let mut refused = 0;

    let tally = sift::<Scenario>(&scenario);
    (fields, refused) = (fields + tally.fields, refused + tally.refused);
    for cell in tally.accepted {
        // What needs the map to be found out is found out here as it is before a run.
        let parsed = Scenario::from_toml(&toml::to_string(&cell.document).unwrap()).unwrap();
        let recordings =
            vec![Recording::parse(room::RECORDING, parsed.recorded[0].format, parsed.recorded[0].fps)];
        let recordings = recordings.into_iter().collect::<Result<Vec<_>, _>>();
        let world = recordings.map(|r| World::new(&parsed, room.map.clone(), r, 1));
        match world {
            Ok(Ok(_)) => runs.push(Run::new("curiosity", &cell, moved_by_its_law(&cell))),
            Ok(Err(error)) => {
                assert!(!error.field.is_empty() && !error.mend.is_empty(), "{} = {}", cell.path, cell.value);
                refused += 1;
            }
            Err(_) => refused += 1,
        }
    }

    let localizer = toml::Table::try_from(LocalizerParams::default()).unwrap();
    let tally = sift::<LocalizerParams>(&localizer);
    (fields, refused) = (fields + tally.fields, refused + tally.refused);
    runs.extend(tally.accepted.iter().map(|cell| Run::within("localizer", "curiosity", cell, &scenario)));

    let tracker = toml::Table::try_from(TrackerParams::default()).unwrap();
    let tally = sift::<TrackerParams>(&tracker);
    (fields, refused) = (fields + tally.fields, refused + tally.refused);
    let mut tracked = scenario.clone();
    tracked["perception"]["source"] = "tracker".into();
    runs.extend(tally.accepted.iter().map(|cell| Run::within("tracker", "curiosity", cell, &tracked)));

    for (planner, prefixes) in [
        ("curiosity", &[""][..]),
        ("risk-rrt", &["risk.", "forecast.", "generation.risk_rrt.", "terms."]),
        ("bi-risk-rrt", &["generation.bi_risk_rrt.", "generation.risk_rrt."]),
        ("human-space", &["human_space."]),
        ("risk-aware", &["generation.tree.informative"]),
        ("transient-goal", &["generation.transient_goal."]),
        ("mppi", &["generation.mppi."]),
        ("dwa", &["generation.dwa."]),
        ("hrvo-robot", &["generation.hrvo_robot."]),
    ] {
        let profile = toml::Table::try_from(Profile::builtin(planner).unwrap()).unwrap();
        assert_complete(&profile, &fault_of(Profile::from_toml));
        let mut tally = sift::<Profile>(&profile);
        tally.accepted.retain(|cell| prefixes.iter().any(|prefix| cell.path.starts_with(prefix)));
        if planner == "curiosity" {
            (fields, refused) = (fields + tally.fields, refused + tally.refused);
        }
        runs.extend(tally.accepted.iter().map(|cell| Run::within("profile", planner, cell, &scenario)));
    }
    println!("{fields} numbers: {refused} values refused by name, {} to be run", runs.len());
    assert!(fields > cells::declared(Profile::FIELDS) && refused > 5 * fields / 2 && runs.len() > fields);

    if std::env::var_os("CURIONAV_EVERY_NUMBER").is_some_and(|form| form == "long") {
        runs::one_by_one(&room, &runs);
    } else {
        runs::with_workers(&room, &runs);
    }
}
