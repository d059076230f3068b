//! The files of datasets, and the list of what was skipped.
//!
//! A test that cannot run where it is says so with [`skip`] and returns. `tests/run` names a file in
//! `CURIONAV_SKIPPED`, to which each skipped test adds a line, and prints that file at its end.

use std::fs::OpenOptions;
use std::io::Write;
use std::panic::Location;
use std::path::{Path, PathBuf};

/// The path of the file `NAME/FILE` of a dataset. Nothing where it is missing, after that has been noted.
///
/// # Panics
///
/// Where it is missing and `CURIONAV_REQUIRE_DATA` is 1.
#[must_use]
#[track_caller]
pub fn reference_data(file: &str) -> Option<PathBuf> {
    found(file, std::env::var_os("CURIONAV_REQUIRE_DATA").is_some_and(|value| value == "1"))
}

/// As [`reference_data`], for datasets that `CURIONAV_REQUIRE_DATA` does not ask for.
#[must_use]
#[track_caller]
pub fn downloaded_data(file: &str) -> Option<PathBuf> {
    found(file, false)
}

#[track_caller]
fn found(file: &str, is_required: bool) -> Option<PathBuf> {
    match curionav_datasets::locate(&format!("dataset:{file}"), Path::new("")) {
        Ok(path) => Some(path),
        Err(missing) => {
            assert!(!is_required, "CURIONAV_REQUIRE_DATA is 1, but {missing}");
            skip(&missing.to_string());
            None
        }
    }
}

/// Notes that the calling test does not run, and why.
///
/// # Panics
///
/// If the file that `CURIONAV_SKIPPED` names cannot be written.
#[track_caller]
#[expect(clippy::expect_used, clippy::print_stdout, reason = "this is called by tests alone")]
pub fn skip(reason: &str) {
    let line = format!("{}: {}\n", Location::caller(), reason.replace('\n', " "));
    print!("skipped: {line}");
    if let Some(file) = std::env::var_os("CURIONAV_SKIPPED") {
        let opened = OpenOptions::new().create(true).append(true).open(&file);
        // One write per line: tests of several processes write at the same time.
        opened.and_then(|mut file| file.write_all(line.as_bytes())).expect("CURIONAV_SKIPPED can be written");
    }
}
