//! Where things are, what they are called, how long they are, and what no file may say.

use super::tree::{assert_none, files, files_of, is_made, root, text};

/// Everything that may be at the root.
const ROOT: [&str; 21] = [
    ".cargo",
    ".ci",
    ".github",
    ".gitignore",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "Cargo.lock",
    "Cargo.toml",
    "LICENSE",
    "README.md",
    "SECURITY.md",
    "clippy.toml",
    "crates",
    "deny.toml",
    "deploy",
    "docs",
    "python",
    "rustfmt.toml",
    "scenarios",
    "schemas",
    "services",
];

/// The longest a Rust file may be, and the greatest median, lines.
const LINES_MAX: usize = 500;
const LINES_MEDIAN: usize = 160;

/// Names that say nothing about what is inside.
const NAMELESS: [&str; 7] = ["common", "data", "helpers", "info", "manager", "types", "utils"];

#[test]
fn nothing_is_at_the_root_that_the_architecture_does_not_list() {
    let mut offences = Vec::new();
    for entry in std::fs::read_dir(root()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if !ROOT.contains(&name.as_str()) && name != "tests" && !is_made(&name) {
            offences.push(name);
        }
    }
    assert_none("not in the tree of docs/architecture.md:", &offences);
}

#[test]
fn rust_files_are_short() {
    let mut lengths: Vec<(usize, String)> =
        files_of("rs").into_iter().map(|f| (text(&f).unwrap().lines().count(), f)).collect();
    lengths.sort();
    let long: Vec<String> =
        lengths.iter().filter(|l| l.0 > LINES_MAX).map(|(n, f)| format!("{f}: {n} lines")).collect();
    assert_none("one algorithm, one file; longer than 500 lines:", &long);
    let (median, file) = &lengths[lengths.len() / 2];
    assert!(*median <= LINES_MEDIAN, "the median file, {file}, has {median} lines, more than {LINES_MEDIAN}");
}

#[test]
fn files_are_named_by_what_is_in_them() {
    let nameless = |path: &String| {
        let name = path.rsplit('/').next().unwrap_or(path);
        let stem = name.strip_suffix(".rs").or_else(|| name.strip_suffix(".py"));
        stem.is_some_and(|s| NAMELESS.contains(&s))
    };
    let offences: Vec<String> = files().into_iter().filter(nameless).collect();
    assert_none("say what is inside:", &offences);
}

#[test]
fn no_file_names_a_machine_or_a_registry() {
    // Put together here, so that this file does not say them.
    let directory = |name: &str| format!("/{name}/");
    let mut unwanted: Vec<String> = ["work", "farm", "root", "home", "tmp"].map(directory).to_vec();
    unwanted.extend(
        [("crates", "io"), ("pypi", "org"), ("npmjs", "org"), ("npmjs", "com")]
            .map(|(a, b)| format!("{a}.{b}")),
    );
    unwanted.push(["static", "rust-lang"].join("."));
    let mut offences = Vec::new();
    for path in files().into_iter().filter(|f| !f.ends_with(".lock")) {
        let Some(text) = text(&path) else { continue };
        for (number, line) in text.lines().enumerate() {
            let found = unwanted.iter().filter(|u| line.contains(u.as_str()));
            offences.extend(found.map(|u| format!("{path}:{}: {u}", number + 1)));
        }
    }
    assert_none("the project is at home everywhere:", &offences);
}
