//! The Python package that analyses what was run.

use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Output};

use anyhow::{Context, bail, ensure};

/// Names the interpreter.
const VARIABLE: &str = "CURIONAV_PYTHON";
const MODULE: &str = "curionav.report";

/// An interpreter that has the package.
pub(super) struct Python(OsString);

impl Python {
    /// The error says how to get the package.
    pub(super) fn find() -> anyhow::Result<Self> {
        let python = Self(std::env::var_os(VARIABLE).unwrap_or_else(|| "python3".into()));
        let tried = Command::new(&python.0).args(["-c", "import curionav.report.page"]).output();
        let why = match tried {
            Ok(tried) if tried.status.success() => return Ok(python),
            Ok(tried) => last_line(&tried),
            Err(error) => error.to_string(),
        };
        let named = python.0.to_string_lossy();
        bail!(
            "{named} has no {MODULE} ({why}): `{named} -m pip install './python[report]'` installs it, and {VARIABLE} \
             names another interpreter"
        )
    }

    /// Whether the claims that `bench.json` names can be judged.
    pub(super) fn check_claims(&self, out: &Path) -> anyhow::Result<()> {
        let checked = self.module(out).arg("--check-only").output().context(MODULE)?;
        ensure!(checked.status.success(), "{}", last_line(&checked).trim_start_matches("error: "));
        Ok(())
    }

    /// Writes the report, prints the verdicts and gives whether every claim holds.
    pub(super) fn report(&self, out: &Path) -> anyhow::Result<bool> {
        let status = self.module(out).status().context(MODULE)?;
        match status.code() {
            Some(0) => Ok(true),
            Some(1) => Ok(false),
            _ => bail!("{MODULE} ended with {status}"),
        }
    }

    fn module(&self, out: &Path) -> Command {
        let mut command = Command::new(&self.0);
        command.args(["-m", MODULE]).arg(out);
        command
    }
}

fn last_line(output: &Output) -> String {
    let said = String::from_utf8_lossy(&output.stderr);
    said.lines().last().map_or_else(|| output.status.to_string(), str::to_owned)
}
