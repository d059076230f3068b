//! What the doctor finds, and how it says so.

use std::fmt::{Display, Formatter};

use comfy_table::Table;
use serde::Serialize;

use crate::connect::ConnectOptions;

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Verdict {
    /// It works: bytes have crossed it.
    #[default]
    Proven,
    /// Worth knowing; nothing is missing.
    Note,
    Missing,
}

#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct Finding {
    /// What it links, or what it belongs to.
    pub(crate) link: String,
    pub(crate) verdict: Verdict,
    pub(crate) detail: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) fix: Option<String>,
    /// Median of a handful of questions, ms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) round_trip_ms: Option<f64>,
    /// Bytes that came back, or were heard.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) bytes: Option<u64>,
    /// How far the clock at the other end is ahead, ms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) clock_offset_ms: Option<f64>,
}

impl Finding {
    pub(crate) fn proven(link: impl Into<String>, detail: impl Into<String>) -> Self {
        Self { link: link.into(), detail: detail.into(), ..Self::default() }
    }

    pub(crate) fn note(link: impl Into<String>, detail: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { verdict: Verdict::Note, fix: Some(fix.into()), ..Self::proven(link, detail) }
    }

    pub(crate) fn missing(
        link: impl Into<String>,
        detail: impl Into<String>,
        fix: impl Into<String>,
    ) -> Self {
        Self { verdict: Verdict::Missing, ..Self::note(link, detail, fix) }
    }
}

#[derive(Debug, Serialize)]
pub(crate) struct Report {
    pub(crate) ok: bool,
    endpoint: String,
    namespace: Option<String>,
    findings: Vec<Finding>,
    conclusion: String,
}

impl Report {
    pub(crate) fn new(at: &ConnectOptions, findings: Vec<Finding>) -> Self {
        let missing: Vec<&str> =
            findings.iter().filter(|f| f.verdict == Verdict::Missing).map(|f| f.link.as_str()).collect();
        let proven = findings.iter().filter(|f| f.verdict == Verdict::Proven).count();
        let conclusion = match missing.len() {
            0 => format!("all well; links proven: {proven}"),
            1 => format!("1 thing is missing: {}", missing[0]),
            n => format!("{n} things are missing: {}", missing.join("; ")),
        };
        let ok = missing.is_empty();
        Self { ok, endpoint: at.place(), namespace: at.namespace.clone(), findings, conclusion }
    }
}

/// A table, what to do, and the conclusion on the last line.
impl Display for Report {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let mut table = Table::new();
        table.load_style(comfy_table::presets::NOTHING);
        for finding in &self.findings {
            let verdict = match finding.verdict {
                Verdict::Proven => "ok",
                Verdict::Note => "note",
                Verdict::Missing => "MISSING",
            };
            table.add_row([verdict, &finding.link, &finding.detail]);
        }
        writeln!(f, "{table}")?;
        let fixes: String = self
            .findings
            .iter()
            .filter_map(|found| Some(format!("  {}: {}\n", found.link, found.fix.as_ref()?)))
            .collect();
        if !fixes.is_empty() {
            write!(f, "\nwhat to do:\n{fixes}")?;
        }
        write!(f, "\n{}", self.conclusion)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_line_is_the_conclusion_and_every_fix_is_said() {
        let at = ConnectOptions { connect: Some("tcp/localhost:7447".into()), ..ConnectOptions::default() };
        let findings = vec![
            Finding::proven("router", "there"),
            Finding::note("mission of r1", "none yet", "set one"),
            Finding::missing("cpc", "is not there", "start it: curionav cpc"),
        ];
        let report = Report::new(&at, findings.clone());
        let words = report.to_string();
        assert_eq!(words.lines().last(), Some("1 thing is missing: cpc"));
        assert!(words.contains("cpc: start it: curionav cpc") && words.contains("mission of r1: set one"));
        assert!(!report.ok);
        let report = Report::new(&at, findings[..2].to_vec());
        assert!(report.ok && report.to_string().ends_with("all well; links proven: 1"));
    }
}
