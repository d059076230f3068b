//! A cycle in words.

use std::collections::BTreeMap;

use curionav_schemas::words::{say, say_all};
use curionav_schemas::{Action, CommandReason, CycleReport, Evaluated, TermReport};

/// What happened and why, one line per thought.
pub(super) fn words(report: &CycleReport) -> String {
    let mut lines = vec![headline(report), certainty(report), field(report)];
    lines.extend(driven(report));
    lines.extend(margin(report));
    lines.extend(shares(report));
    lines.extend(report.terms.iter().filter(|term| term.active).map(|term| wishes(report, term)));
    lines.extend(report.terms.iter().filter(|term| !term.active).map(idle));
    lines.extend(what_if(report));
    lines.push(match report.decision.degraded.as_slice() {
        [] => "Nothing was degraded.".to_owned(),
        degraded => format!("Degraded: {}.", say_all("degradation", degraded)),
    });
    lines.join("\n")
}

/// A candidate as people and the table call it: by its identifier.
pub(super) fn name(report: &CycleReport, index: u32) -> String {
    report.candidates.id.get(index as usize).map_or("none".to_owned(), u32::to_string)
}

fn headline(report: &CycleReport) -> String {
    let decision = &report.decision;
    let action = match (decision.action, report.chosen) {
        (Action::Follow, Some(chosen)) => format!("follow candidate {}", name(report, chosen)),
        (Action::Follow, None) => "follow".to_owned(),
        (Action::Hold, _) => "go on along the previous trajectory".to_owned(),
        (Action::Stop, _) => "stop".to_owned(),
    };
    format!(
        "Robot {}, cycle {} at {:.1} s: {action} ({}).",
        report.robot,
        report.seq,
        decision.stamp,
        say("reason", &decision.reason)
    )
}

fn certainty(report: &CycleReport) -> String {
    let decision = &report.decision;
    let sure = if decision.uncertain { "is not sure" } else { "is sure" };
    format!(
        "It {sure} enough of where it is (uncertainty {:.3}); {} people are near.",
        decision.uncertainty,
        report.scene.people.id.len()
    )
}

/// How many candidates there were and what became of them: rejections are counted by their code.
fn field(report: &CycleReport) -> String {
    let mut counts: BTreeMap<&'static str, usize> = BTreeMap::new();
    for rejected in &report.rejected {
        *counts.entry((&rejected.why).into()).or_default() += 1;
    }
    let left = report.candidates.count as usize - report.rejected.len();
    let rejected: String =
        counts.iter().map(|(code, count)| format!("; {count} {}", say("rejections", code))).collect();
    format!("Of {} candidates {left} were left to compare{rejected}.", report.candidates.count)
}

/// What became of the decisions before, unless the driver has just followed them.
fn driven(report: &CycleReport) -> Option<String> {
    let driven = report.driven.as_ref().filter(|driven| driven.reason != CommandReason::Tracking)?;
    let since = report.scene.stamp - driven.since;
    Some(format!("For {since:.1} s the driver has done this: {}.", say("command_reason", &driven.reason)))
}

fn margin(report: &CycleReport) -> Option<String> {
    let chosen = report.chosen?;
    let total = report.total_of(chosen as usize)?;
    Some(match (report.runner_up, report.margin) {
        (Some(second), Some(margin)) => {
            let why = if margin < 0.0 { ": it costs less, but it is slow or a change of course" } else { "" };
            format!(
                "It costs {total:.4}. Candidate {} would have been next, {:.4} {}{why}.",
                name(report, second),
                margin.abs(),
                if margin < 0.0 { "cheaper" } else { "more expensive" }
            )
        }
        _ => format!("It costs {total:.4}. No other candidate could have been followed."),
    })
}

/// What each term makes of the chosen one's cost.
fn shares(report: &CycleReport) -> Option<String> {
    let chosen = report.chosen? as usize;
    let parts: Vec<String> = (report.terms.iter())
        .filter_map(|term| Some(format!("{} {:.4}", term.term, term.cost_of(chosen)?)))
        .collect();
    (!parts.is_empty()).then(|| format!("Its cost is {}.", parts.join(" + ")))
}

/// Which candidate a term alone would have chosen.
fn wishes(report: &CycleReport, term: &TermReport) -> String {
    let by = match term.evaluated {
        Evaluated::Pool => "by its pool",
        Evaluated::Local => "in the arbiter",
        Evaluated::None => "by nothing",
    };
    let missing = match report.candidates.count as usize - term.scored.len() {
        0 => String::new(),
        count => format!(", {count} not at all"),
    };
    let wish = match term.alone {
        Some(alone) if report.chosen == Some(alone) => "alone would have chosen the same".to_owned(),
        Some(alone) => format!("alone would have chosen candidate {}", name(report, alone)),
        None => "has no say".to_owned(),
    };
    format!("- {} (weight {}, scale {}; scored {by}{missing}) {wish}.", term.term, term.weight, term.scale)
}

fn idle(term: &TermReport) -> String {
    format!(
        "- {} (weight {}, scale {}) did not count: its condition did not hold.",
        term.term, term.weight, term.scale
    )
}

/// What other weights would have led to.
fn what_if(report: &CycleReport) -> Vec<String> {
    let Some(chosen) = report.chosen else { return Vec::new() };
    let active: Vec<&TermReport> = report.terms.iter().filter(|term| term.active).collect();
    let mut lines = Vec::new();
    let mut same = Vec::new();
    for term in active {
        let TermReport { term: name_of, weight, .. } = term;
        for (how, other, taken) in [
            ("doubled", weight * 2.0, term.doubled),
            ("halved", weight / 2.0, term.halved),
            ("set to zero", 0.0, term.without),
        ] {
            match taken {
                Some(taken) if taken != chosen => lines.push(format!(
                    "With the weight of {name_of} {how} ({weight} to {other}) it would have taken candidate {}.",
                    name(report, taken)
                )),
                Some(_) => same.push(format!("{name_of} {how}")),
                None => {}
            }
        }
    }
    if !same.is_empty() {
        lines.push(format!("It would have taken the same with the weight of {}.", same.join(", ")));
    }
    lines
}

#[cfg(test)]
mod tests {
    use curionav_testing::golden;

    use super::*;

    #[test]
    fn what_the_driver_does_is_said_unless_it_follows() {
        let mut report = golden::explained_cycle_report();
        assert!(!words(&report).contains("driver"));
        report.driven.as_mut().unwrap().reason = CommandReason::TooClose;
        // From 3.6 s to 4.2 s.
        let line = "For 0.6 s the driver has done this: braking: something is too close.";
        assert!(words(&report).lines().any(|found| found == line), "{}", words(&report));
    }

    #[test]
    fn words_say_what_the_report_says() {
        let text = words(&golden::explained_cycle_report());
        for line in [
            "Robot r1, cycle 14 at 4.2 s: follow candidate 9 (least cost).",
            "Of 3 candidates 2 were left to compare; 1 lack a score.",
            "It costs 0.8800. Candidate 12 would have been next, 0.0400 more expensive.",
            "Its cost is cnc 0.1400 + cpc 0.7400.",
            "- cnc (weight 1, scale 0.5; scored by its pool) alone would have chosen candidate 12.",
            "- cpc (weight 1, scale 0.5; scored in the arbiter, 1 not at all) alone would have chosen the same.",
            "- distance (weight 1, scale 0.5) did not count: its condition did not hold.",
            "With the weight of cnc doubled (1 to 2) it would have taken candidate 12.",
            "With the weight of cpc set to zero (1 to 0) it would have taken candidate 12.",
            "It would have taken the same with the weight of cnc halved, cnc set to zero, cpc doubled.",
            "Degraded: `cpc` was evaluated by the arbiter.",
        ] {
            assert!(text.lines().any(|found| found == line), "lacks `{line}`:\n{text}");
        }
    }
}
