//! What the documents point at is there.

use super::tree::{assert_none, files_of, root, text};

/// Folders whose contents documents name from the root.
const FOLDERS: [&str; 8] =
    ["crates/", "deploy/", "docs/", "python/", "scenarios/", "schemas/", "services/", "tests/"];

#[test]
fn every_link_of_a_document_leads_somewhere() {
    let mut offences = Vec::new();
    for path in files_of("md") {
        let folder = path.rsplit_once('/').map_or("", |p| p.0);
        let text = text(&path).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let target = link.split('#').next().unwrap_or(link);
            let elsewhere =
                target.is_empty() || target.contains("://") || target.contains(char::is_whitespace);
            if !elsewhere && !root().join(folder).join(target).exists() {
                offences.push(format!("{path}: {link}"));
            }
        }
    }
    assert_none("links that lead nowhere:", &offences);
}

#[test]
fn every_path_of_a_document_exists() {
    let mut offences = Vec::new();
    for path in files_of("md") {
        let text = text(&path).unwrap();
        // Between backticks, whole: `crates/planning/src/lib.rs`, not `services/*` or `docs/{name}.md`.
        for quoted in text.split('`').skip(1).step_by(2) {
            let is_path = FOLDERS.iter().any(|f| quoted.starts_with(f))
                && quoted.bytes().all(|b| b.is_ascii_alphanumeric() || b"/._-".contains(&b));
            if is_path && !root().join(quoted).exists() {
                offences.push(format!("{path}: {quoted}"));
            }
        }
    }
    assert_none("paths that are not there:", &offences);
}
