//! The extension module of the Python package is a workspace of its own, and still built as the program is: runs of
//! both have the same decisions, and a user waits no longer than need be.

use std::collections::{BTreeMap, BTreeSet};

use super::tree::{assert_none, text};

const MODULE: &str = "python/native";

fn table(path: &str) -> toml::Table {
    text(path).unwrap().parse().unwrap()
}

/// The versions of each package of a lock file.
fn locked(path: &str) -> BTreeMap<String, BTreeSet<String>> {
    let mut versions: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for package in table(path)["package"].as_array().unwrap() {
        let [name, version] = ["name", "version"].map(|key| package[key].as_str().unwrap().to_owned());
        versions.entry(name).or_default().insert(version);
    }
    versions
}

#[test]
fn it_links_the_versions_of_crates_that_the_program_links() {
    let program = locked("Cargo.lock");
    let mut offences = Vec::new();
    for (name, versions) in locked(&format!("{MODULE}/Cargo.lock")) {
        if let Some(expected) = program.get(&name).filter(|expected| !versions.is_subset(expected)) {
            offences.push(format!("{name} {versions:?}, where the program has {expected:?}"));
        }
    }
    let mend = "cp Cargo.lock python/native && cargo tree --manifest-path python/native/Cargo.toml:";
    assert_none(mend, &offences);
}

#[test]
fn it_is_optimised_as_the_program_is() {
    let [program, module] =
        ["Cargo.toml", "python/native/Cargo.toml"].map(|path| table(path)["profile"].clone());
    let linked = locked(&format!("{MODULE}/Cargo.lock"));
    let mut expected = program;
    expected.as_table_mut().unwrap().remove("bench");
    let packages = expected["release"]["package"].as_table_mut().unwrap();
    packages.retain(|package, _| linked.contains_key(package));
    assert_eq!(module, expected, "the profiles of {MODULE}/Cargo.toml, and those of Cargo.toml");
}

#[test]
fn it_has_the_edition_and_version_of_the_workspace() {
    let package = &table(&format!("{MODULE}/Cargo.toml"))["package"];
    for (key, value) in table("Cargo.toml")["workspace"]["package"].as_table().unwrap() {
        assert_eq!(package.get(key), Some(value), "{key} of {MODULE}/Cargo.toml");
    }
}
