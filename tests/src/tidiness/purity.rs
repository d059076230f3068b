//! Pure crates: no I/O, no clock, no threads, no global randomness, and no transcendental function whose
//! last bit depends on the machine.

use super::source::{self, paths_below, production_code, words};
use super::tree::assert_none;

const PURE: [&str; 6] = [
    "crates/planning",
    "crates/localization",
    "crates/tracking-people",
    "crates/crowdsim",
    "crates/picture",
    "crates/ros2",
];

/// What of `std` reaches outside the program or differs from run to run.
const IMPURE_STD: [&str; 6] = ["env", "fs", "net", "os", "process", "thread"];

/// Names of clocks and of randomness without a seed.
const IMPURE_NAMES: [&str; 8] =
    ["Instant", "OsRng", "RandomState", "SysRng", "SystemTime", "ThreadRng", "from_os_rng", "thread_rng"];

/// Methods of `f64` that the system's mathematics library computes, and the fused multiplication, which
/// only some processors have. `curionav_planning::numerics` has replacements (D18). `sqrt`, `abs` and
/// rounding are exact everywhere, and `powi` multiplies.
const UNREPEATABLE: [&str; 27] = [
    "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cbrt", "cos", "cosh", "exp", "exp2",
    "exp_m1", "hypot", "ln", "ln_1p", "log", "log10", "log2", "mul_add", "powf", "sin", "sin_cos", "sinh",
    "tan", "tanh", "to_polar",
];

/// (file, method, why it may be there). Empty: nothing in the pure crates needs an exception.
const ALLOWED: [(&str, &str, &str); 0] = [];

fn check(offences_of: impl Fn(&str) -> Vec<(usize, String)>) -> Vec<String> {
    let mut offences = Vec::new();
    for directory in PURE {
        let files = production_code(directory);
        assert!(files.len() > 5, "{directory}: found only {} files", files.len());
        for (path, code) in files {
            let found = offences_of(&code).into_iter();
            let found = found.filter(|(_, what)| !ALLOWED.iter().any(|a| a.0 == path && a.1 == what));
            offences.extend(found.map(|(at, what)| format!("{path}:{}: {what}", source::line(&code, at))));
        }
    }
    offences
}

fn impure(code: &str) -> Vec<(usize, String)> {
    let std = paths_below(code, "std").into_iter().filter(|(_, path)| {
        let first = path.split("::").next().unwrap_or(path);
        IMPURE_STD.contains(&first) || path.ends_with('*') && first != "f64"
    });
    let names = words(code).into_iter().filter(|(_, word)| IMPURE_NAMES.contains(word));
    let rand = paths_below(code, "rand").into_iter().filter(|(_, path)| path == "rng" || path == "random");
    let mut found: Vec<(usize, String)> = std.map(|(at, path)| (at, format!("std::{path}"))).collect();
    found.extend(names.map(|(at, word)| (at, word.to_owned())));
    found.extend(rand.map(|(at, path)| (at, format!("rand::{path}"))));
    found
}

/// Calls `x.sin()` and names `f64::sin`; `numerics::exp` and `libm::exp` are the way to do it.
fn unrepeatable(code: &str) -> Vec<(usize, String)> {
    let of_float = words(code).into_iter().filter(|(at, word)| {
        let before = code[..*at].trim_end();
        let called = code[at + word.len()..].trim_start().starts_with(['(', ':']);
        let method = before.ends_with('.') && !before.ends_with("..") && called;
        let by_type = ["f64::", "f32::", "<f64>::", "<f32>::"].iter().any(|t| before.ends_with(t));
        UNREPEATABLE.contains(word) && (method || by_type)
    });
    of_float.map(|(at, word)| (at, word.to_owned())).collect()
}

#[test]
fn pure_crates_touch_nothing_outside_themselves() {
    assert_none("time, files, threads and seeds are arguments of a pure crate:", &check(impure));
}

#[test]
fn pure_crates_compute_the_same_bits_everywhere() {
    assert_none("use curionav_planning::numerics instead of:", &check(unrepeatable));
}

#[test]
fn the_checks_see_what_they_look_for() {
    let found = |f: fn(&str) -> Vec<(usize, String)>, code: &str| -> Vec<String> {
        f(&source::without_tests(&source::blank_literals(code))).into_iter().map(|o| o.1).collect()
    };
    assert_eq!(found(impure, "use std::{collections::BTreeMap, fs};"), ["std::fs"]);
    assert_eq!(found(impure, "use std::time::{Duration, Instant};"), ["Instant"]);
    assert_eq!(found(impure, "let r = rand::rng(); // std::fs"), ["rand::rng"]);
    assert_eq!(found(impure, "let s = \"std::fs\";\n#[cfg(test)]\nmod t { use std::fs; }"), [""; 0]);
    assert_eq!(found(unrepeatable, "a.sin() + (b).exp() + f64::hypot(a, b) + c\n  .powf(2.0)").len(), 4);
    assert_eq!(
        found(unrepeatable, "numerics::exp(a) + libm::sin(b) + c.sqrt() + d.exp + self.tan_limit()"),
        [""; 0]
    );
}
