//! The files of the project, found by walking: `git` is not everywhere the tests run.

use std::path::{Path, PathBuf};

/// Directories that tools make and that are not committed, and code of others, which keeps its own style.
const MADE_BY_TOOLS: [&str; 11] = [
    ".git",
    ".idea",
    ".mypy_cache",
    ".pytest_cache",
    ".venv",
    ".vscode",
    "__pycache__",
    "node_modules",
    "out",
    "target",
    "third-party",
];

/// The project's root.
pub(super) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Whether a tool made this file or directory.
pub(super) fn is_made(name: &str) -> bool {
    MADE_BY_TOOLS.contains(&name) || name.ends_with(".egg-info")
}

/// Every file below the root as a path with `/` from the root, in order.
pub(super) fn files() -> Vec<String> {
    let mut found = Vec::new();
    walk(&root(), "", &mut found);
    found.sort();
    found
}

fn walk(directory: &Path, prefix: &str, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(directory).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        if is_made(&name) {
            continue;
        }
        let path = if prefix.is_empty() { name } else { format!("{prefix}/{name}") };
        // Links are not followed: what they lead to is not ours.
        if entry.file_type().unwrap().is_dir() {
            walk(&entry.path(), &path, found);
        } else {
            found.push(path);
        }
    }
}

/// The files whose name ends in `.{extension}`.
pub(super) fn files_of(extension: &str) -> Vec<String> {
    let ending = format!(".{extension}");
    files().into_iter().filter(|f| f.ends_with(&ending)).collect()
}

/// A file as text; none if it is not UTF-8.
pub(super) fn text(path: &str) -> Option<String> {
    String::from_utf8(std::fs::read(root().join(path)).unwrap()).ok()
}

/// Fails with every offence on a line of its own.
pub(super) fn assert_none(rule: &str, offences: &[String]) {
    assert!(offences.is_empty(), "{rule}\n  {}", offences.join("\n  "));
}
