//! What the doctor finds, and how it says so.

use comfy_table::Table;
use serde::Serialize;

/// What became of one link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Verdict {
    /// It works: bytes have crossed it.
    Proven,
    /// Worth knowing; nothing is missing.
    Note,
    /// It does not work.
    Missing,
}

/// One link.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Finding {
    /// Between whom, or of whom.
    pub(crate) link: String,
    pub(crate) verdict: Verdict,
    /// What was seen.
    pub(crate) detail: String,
    /// What to do about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) fix: Option<String>,
    /// Median of a handful of questions, ms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) round_trip_ms: Option<f64>,
    /// That came back, or were heard.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) bytes: Option<u64>,
    /// How far the other's clock is ahead, ms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) clock_offset_ms: Option<f64>,
}

impl Finding {
    fn new(
        link: impl Into<String>,
        verdict: Verdict,
        detail: impl Into<String>,
        fix: Option<String>,
    ) -> Self {
        Self {
            link: link.into(),
            verdict,
            detail: detail.into(),
            fix,
            round_trip_ms: None,
            bytes: None,
            clock_offset_ms: None,
        }
    }

    pub(crate) fn proven(link: impl Into<String>, detail: impl Into<String>) -> Self {
        Self::new(link, Verdict::Proven, detail, None)
    }

    pub(crate) fn note(link: impl Into<String>, detail: impl Into<String>, fix: impl Into<String>) -> Self {
        Self::new(link, Verdict::Note, detail, Some(fix.into()))
    }

    pub(crate) fn missing(
        link: impl Into<String>,
        detail: impl Into<String>,
        fix: impl Into<String>,
    ) -> Self {
        Self::new(link, Verdict::Missing, detail, Some(fix.into()))
    }
}

/// Everything found.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    /// Whether nothing is missing.
    pub(crate) ok: bool,
    endpoint: String,
    namespace: Option<String>,
    findings: Vec<Finding>,
    conclusion: String,
}

impl Report {
    pub(crate) fn new(endpoint: &str, namespace: Option<&str>, findings: Vec<Finding>) -> Self {
        let links = |verdict| findings.iter().filter(move |f| f.verdict == verdict);
        let missing: Vec<&str> = links(Verdict::Missing).map(|f| f.link.as_str()).collect();
        let conclusion = match missing.len() {
            0 => format!("all well; links proven: {}", links(Verdict::Proven).count()),
            1 => format!("1 thing is missing: {}", missing[0]),
            n => format!("{n} things are missing: {}", missing.join("; ")),
        };
        let ok = missing.is_empty();
        Self {
            ok,
            endpoint: endpoint.to_owned(),
            namespace: namespace.map(str::to_owned),
            findings,
            conclusion,
        }
    }

    /// For a person: a table, what to do, and the conclusion on the last line.
    pub(crate) fn words(&self) -> String {
        let mut table = Table::new();
        table.load_style(comfy_table::presets::NOTHING);
        let mut fixes = String::new();
        for finding in &self.findings {
            let verdict = match finding.verdict {
                Verdict::Proven => "ok",
                Verdict::Note => "note",
                Verdict::Missing => "MISSING",
            };
            table.add_row([verdict, &finding.link, &finding.detail]);
            if let Some(fix) = &finding.fix {
                fixes += &format!("  {}: {fix}\n", finding.link);
            }
        }
        let fixes = if fixes.is_empty() { fixes } else { format!("\nwhat to do:\n{fixes}") };
        format!("{table}\n{fixes}\n{}", self.conclusion)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_line_is_the_conclusion_and_every_fix_is_said() {
        let findings = vec![
            Finding::proven("router", "there"),
            Finding::note("mission of r1", "none yet", "set one"),
            Finding::missing("cpc", "nobody", "start it: curionav cpc"),
        ];
        let report = Report::new("tcp/localhost:7447", None, findings.clone());
        let words = report.words();
        assert_eq!(words.lines().last(), Some("1 thing is missing: cpc"));
        assert!(words.contains("cpc: start it: curionav cpc") && words.contains("mission of r1: set one"));
        assert!(!report.ok);
        let report = Report::new("tcp/localhost:7447", None, findings[..2].to_vec());
        assert!(report.ok && report.words().ends_with("all well; links proven: 1"));
    }
}
