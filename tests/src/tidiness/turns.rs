//! Which tests run one at a time.

use super::tree::{assert_none, files_of, text};

/// They have a run of their own, or only name it.
const APART: [&str; 3] = ["network::", "ros2::", "tidiness::"];

#[test]
fn what_takes_a_turn_is_in_the_group_of_the_wall_clock() {
    let settings = text("tests/nextest.toml").unwrap();
    let mut offences = Vec::new();
    for file in files_of("rs") {
        let Some(path) = file.strip_prefix("tests/src/").and_then(|path| path.strip_suffix(".rs")) else {
            continue;
        };
        let module = path.replace('/', "::");
        let is_apart = APART.iter().any(|apart| module.starts_with(apart));
        let is_listed = settings.contains(&format!("test(/^{module}::/)"));
        if !is_apart && !is_listed && text(&file).unwrap().contains("= turn();") {
            offences.push(file);
        }
    }
    assert_none("tests/nextest.toml does not list:", &offences);
}
