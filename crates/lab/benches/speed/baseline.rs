//! The committed ratios, to which those of a run are compared.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;

/// A ratio above that of the baseline by more than this share is a regression.
pub(crate) const TOLERATED: f64 = 0.1;

const HEAD: &str = "\
# Times in r, which benches/speed/reference.rs defines, from `cargo speed --write` on a machine without other work.
# `cargo speed --check` fails when a case takes more than a tenth longer. Commit new figures with what changed them.
";

/// Ratios by the name of the case.
pub(crate) struct Baseline(BTreeMap<String, f64>);

fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("speed-baseline.txt")
}

impl Baseline {
    /// The committed one.
    pub(crate) fn read() -> anyhow::Result<Self> {
        let path = file();
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let lines = text.lines().filter(|line| !line.starts_with('#'));
        let entry = |line: &str| {
            let (name, ratio) = line.split_once(' ').context("a line is a name and a ratio")?;
            Ok((name.to_owned(), ratio.trim().parse().with_context(|| line.to_owned())?))
        };
        Ok(Self(lines.map(entry).collect::<anyhow::Result<_>>()?))
    }

    /// The ratio that a case had.
    pub(crate) fn of(&self, name: &str) -> Option<f64> {
        self.0.get(name).copied()
    }

    /// Whether `ratio` is worse than what the case had, by more than noise.
    pub(crate) fn is_worse(&self, name: &str, ratio: f64) -> bool {
        self.of(name).is_some_and(|before| ratio > before * (1.0 + TOLERATED))
    }

    /// Takes the place of the committed one, except for cases that were not measured.
    pub(crate) fn write(mut self, ratios: impl Iterator<Item = (String, f64)>) -> anyhow::Result<()> {
        self.0.extend(ratios);
        let mut text = String::from(HEAD);
        for (name, ratio) in &self.0 {
            writeln!(text, "{name} {ratio:.6}")?;
        }
        std::fs::write(file(), text).with_context(|| file().display().to_string())
    }
}
