//! No file imports, directly or through others, from a file that imports from it; nor does a crate.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::floors;
use super::imports::{Crate, Import};
use super::tree::{assert_none, files};

/// Circles, each as the shortest way around it, until every file that is part of one has been named.
fn circles(imports: &BTreeSet<Import>) -> Vec<Vec<&Import>> {
    let mut leaving: BTreeMap<&str, Vec<&Import>> = BTreeMap::new();
    for import in imports {
        leaving.entry(&import.from).or_default().push(import);
    }
    let mut found: Vec<Vec<&Import>> = Vec::new();
    let mut seen = BTreeSet::new();
    for start in leaving.keys() {
        if seen.contains(start) {
            continue;
        }
        if let Some(circle) = shortest_way_back(start, &leaving) {
            seen.extend(circle.iter().map(|import| import.from.as_str()));
            found.push(circle);
        }
    }
    found
}

fn shortest_way_back<'a>(start: &str, leaving: &BTreeMap<&str, Vec<&'a Import>>) -> Option<Vec<&'a Import>> {
    let mut arrived: BTreeMap<&str, &Import> = BTreeMap::new();
    let mut pending = VecDeque::from([start]);
    while let Some(at) = pending.pop_front() {
        for import in leaving.get(at).into_iter().flatten() {
            if arrived.contains_key(import.to.as_str()) {
                continue;
            }
            arrived.insert(&import.to, import);
            if import.to == start {
                let mut circle = vec![*import];
                while circle[circle.len() - 1].from != start {
                    circle.push(arrived[circle[circle.len() - 1].from.as_str()]);
                }
                circle.reverse();
                return Some(circle);
            }
            pending.push_back(&import.to);
        }
    }
    None
}

fn shown(circle: &[&Import]) -> String {
    let step = |import: &&Import| format!("{} names {} of {}", import.from, import.path, import.to);
    circle.iter().map(step).collect::<Vec<_>>().join("\n    ")
}

#[test]
fn no_file_imports_from_a_file_that_imports_from_it() {
    let is_root = |f: &String| f.ends_with("/src/lib.rs") || f.ends_with("/src/main.rs");
    let roots: Vec<String> = files().into_iter().filter(is_root).collect();
    assert!(roots.len() > 10, "found only {} crates", roots.len());
    let mut offences = Vec::new();
    for root in roots {
        offences.extend(circles(&Crate::read(&root).imports()).iter().map(|circle| shown(circle)));
    }
    assert_none("move what both sides need into a file of its own:", &offences);
}

#[test]
fn no_crate_imports_from_a_crate_that_imports_from_it() {
    let imports = floors::imports_between_crates();
    assert!(imports.len() > 20, "found only {} imports", imports.len());
    let offences: Vec<String> = circles(&imports).iter().map(|circle| shown(circle)).collect();
    assert_none("crates that import each other:", &offences);
}

#[test]
fn a_circle_is_reported_once_and_by_its_shortest_way() {
    let import = |from: &str, to: &str| Import { from: from.into(), to: to.into(), path: "x".into() };
    let imports = [("a", "b"), ("b", "c"), ("c", "d"), ("c", "a"), ("d", "a"), ("e", "a"), ("d", "f")];
    let imports: BTreeSet<Import> = imports.map(|(from, to)| import(from, to)).into();
    let found = circles(&imports);
    let ways: Vec<Vec<&str>> = found.iter().map(|c| c.iter().map(|i| i.from.as_str()).collect()).collect();
    assert_eq!(ways, [vec!["a", "b", "c"], vec!["d", "a", "b", "c"]]);
}
