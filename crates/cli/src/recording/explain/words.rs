//! A cycle in words: each line is a sentence of the family `explanation` of the table of words.

use std::collections::BTreeMap;

use curionav_schemas::limits::UNSEEN_PERSON;
use curionav_schemas::words::{knows, say, say_all};
use curionav_schemas::{CommandReason, CycleReport, TermReport};
use serde_json::{Value, json};

pub(super) fn words(report: &CycleReport) -> String {
    let mut lines = decided(report);
    lines.extend(costs(report));
    let (active, idle): (Vec<&TermReport>, _) = report.terms.iter().partition(|term| term.active);
    for term in &active {
        lines.push(wish(report, term));
        lines.extend(meaning(report, term));
    }
    lines.extend(
        idle.iter().map(|term| {
            line("idle", json!({ "term": term.term, "weight": term.weight, "scale": term.scale }))
        }),
    );
    lines.extend(what_if(report, &active));
    lines.push(match report.decision.degraded.as_slice() {
        [] => line("healthy", json!({})),
        degraded => line("degraded", json!({ "degraded": say_all("degradation", degraded) })),
    });
    lines.join("\n")
}

/// The sentence `code` with its parameters.
fn line(code: &str, mut parameters: Value) -> String {
    parameters["code"] = code.into();
    say("explanation", &parameters)
}

/// A candidate as people and the table call it: by its identifier.
pub(super) fn name(report: &CycleReport, index: u32) -> String {
    report.candidates.id.get(index as usize).map_or("none".to_owned(), u32::to_string)
}

fn decided(report: &CycleReport) -> Vec<String> {
    let CycleReport { robot, seq, decision, scene, rejected, .. } = report;
    let count = report.candidates.count as usize;
    let candidate = report.chosen.map(|chosen| name(report, chosen));
    let mut codes: BTreeMap<&'static str, usize> = BTreeMap::new();
    for rejected in rejected {
        *codes.entry((&rejected.why).into()).or_default() += 1;
    }
    let rejections: String =
        codes.iter().map(|(code, count)| format!("; {count} {}", say("rejections", code))).collect();
    let unseen = unseen_away(report);
    let people = scene.people.id.len() - usize::from(unseen.is_some());
    let mut lines = vec![
        line(
            &say("action", &decision.action),
            json!({ "robot": robot, "cycle": seq, "stamp": decision.stamp, "candidate": candidate,
                "reason": decision.reason }),
        ),
        line(
            if decision.uncertain { "unsure" } else { "sure" },
            json!({ "uncertainty": decision.uncertainty, "people": people }),
        ),
        line("compared", json!({ "count": count, "left": count - rejected.len(), "rejected": rejections })),
    ];
    if let Some(distance) = unseen {
        lines.push(line("unseen", json!({ "person": UNSEEN_PERSON, "distance": distance })));
    }
    if let Some(obstacles) = &report.obstacles {
        let places = obstacles.x.iter().zip(obstacles.y.iter()).map(|(x, y)| (f64::from(*x), f64::from(*y)));
        let away = places.map(|(x, y)| (x - scene.belief.x).hypot(y - scene.belief.y));
        let code = if obstacles.close_ways { "closed" } else { "obstacles" };
        lines.push(line(code, json!({ "distance": away.fold(f64::INFINITY, f64::min) })));
    }
    if scene.in_place_s >= IN_PLACE_S {
        lines.push(line("in_place", json!({ "time": scene.in_place_s })));
    }
    if scene.impatient {
        lines.push(line("impatient", json!({})));
    }
    // That it has just followed them need not be said.
    if let Some(driven) = report.driven.as_ref().filter(|driven| driven.reason != CommandReason::Tracking) {
        let time = scene.stamp - driven.since;
        lines.push(line("driven", json!({ "time": time, "command_reason": driven.reason })));
    }
    lines
}

/// Seconds in one place from which on that is said.
const IN_PLACE_S: f64 = 1.0;

/// Metres to what only the driver sees, if the scene has it.
fn unseen_away(report: &CycleReport) -> Option<f64> {
    let people = &report.scene.people;
    let belief = &report.scene.belief;
    let at = people.id.iter().position(|id| *id == UNSEEN_PERSON)?;
    Some((people.x[at] - belief.x).hypot(people.y[at] - belief.y))
}

/// What the term's raw cost of the chosen candidate says, if the table has words for the term.
fn meaning(report: &CycleReport, term: &TermReport) -> Option<String> {
    let raw = term.raw_of(report.chosen? as usize).filter(|_| knows("term_meaning", &term.term))?;
    let mean = raw / f64::from(report.candidates.steps.max(1));
    let meaning = json!({ "code": term.term, "mean": mean, "percent": 100.0 * raw });
    Some(line("meaning", json!({ "term_meaning": meaning })))
}

fn costs(report: &CycleReport) -> Vec<String> {
    let Some(chosen) = report.chosen else { return Vec::new() };
    let mut lines = Vec::new();
    if let Some(total) = report.total_of(chosen as usize) {
        let (code, next, margin) = match (report.runner_up, report.margin) {
            (Some(next), Some(margin)) if margin < 0.0 => ("passed_over", Some(next), -margin),
            (Some(next), Some(margin)) => ("next", Some(next), margin),
            _ => ("only", None, 0.0),
        };
        let candidate = next.map(|next| name(report, next));
        lines.push(line(code, json!({ "total": total, "candidate": candidate, "margin": margin })));
    }
    let shares: Vec<String> = report
        .terms
        .iter()
        .filter_map(|term| Some(format!("{} {:.4}", term.term, term.cost_of(chosen as usize)?)))
        .collect();
    if !shares.is_empty() {
        lines.push(line("shares", json!({ "shares": shares.join(" + ") })));
    }
    lines
}

fn wish(report: &CycleReport, term: &TermReport) -> String {
    let missing = match report.candidates.count as usize - term.scored.len() {
        0 => String::new(),
        count => format!(", {count} not at all"),
    };
    let wish = term.alone.map(|alone| match report.chosen {
        Some(chosen) if chosen == alone => "the same".to_owned(),
        _ => format!("candidate {}", name(report, alone)),
    });
    let code = if wish.is_some() { "wish" } else { "no_wish" };
    let TermReport { term, weight, scale, evaluated, .. } = term;
    line(
        code,
        json!({ "term": term, "weight": weight, "scale": scale, "evaluated": evaluated, "missing": missing,
            "wish": wish }),
    )
}

fn what_if(report: &CycleReport, active: &[&TermReport]) -> Vec<String> {
    let Some(chosen) = report.chosen else { return Vec::new() };
    let mut lines = Vec::new();
    let mut same = Vec::new();
    for TermReport { term, weight, doubled, halved, without, .. } in active {
        for (change, other, taken) in [
            ("doubled", weight * 2.0, doubled),
            ("halved", weight / 2.0, halved),
            ("set to zero", 0.0, without),
        ] {
            match taken {
                Some(taken) if *taken != chosen => {
                    let candidate = name(report, *taken);
                    lines.push(line(
                        "otherwise",
                        json!({ "term": term, "change": change, "weight": weight, "other": other,
                            "candidate": candidate }),
                    ));
                }
                Some(_) => same.push(format!("{term} {change}")),
                None => {}
            }
        }
    }
    if !same.is_empty() {
        lines.push(line("same", json!({ "changes": same })));
    }
    lines
}

#[cfg(test)]
mod tests {
    use curionav_testing::golden;

    use curionav_schemas::Rejection;

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
    fn what_is_special_about_this_projects_planner_is_said_in_words() {
        let mut report = golden::explained_cycle_report();
        report.rejected[0].why = Rejection::HitsPerson { person: UNSEEN_PERSON, after_s: 1.26 };
        report.scene.in_place_s = 4.04;
        report.scene.impatient = true;
        let people = &mut report.scene.people;
        let near = people.id.len();
        let (x, y) = (report.scene.belief.x, report.scene.belief.y);
        people.id = people.id.iter().copied().chain([UNSEEN_PERSON]).collect::<Vec<_>>().into();
        people.x = people.x.iter().copied().chain([x + 0.3]).collect::<Vec<_>>().into();
        people.y = people.y.iter().copied().chain([y + 0.4]).collect::<Vec<_>>().into();
        let chosen = report.chosen.unwrap() as usize;
        for (term, raw) in report.terms.iter_mut().zip([0.032, 3.0]) {
            let at = term.scored.iter().position(|scored| *scored as usize == chosen).unwrap();
            let mut all = term.raw.to_vec();
            all[at] = raw;
            term.raw = all.into();
        }
        report.terms[0].term = "collision-risk".to_owned();
        report.terms[1].term = "information-to-go".to_owned();
        let text = words(&report);
        let mean = 3.0 / f64::from(report.candidates.steps);
        for line in [
            format!("({:.3}); {near} people are near.", report.decision.uncertainty)
                .replace('(', "(uncertainty "),
            "It also keeps clear of something unseen that the driver braked for, 0.5 m away.".to_owned(),
            "For a while, terms with `gives_way` count".to_owned(),
            "It has stayed in one place for 4.0 s.".to_owned(),
            "  Of the chosen candidate it says that the robot touches a person with a chance of 3.2 %."
                .to_owned(),
            format!("  Of the chosen candidate it says that the way beyond it counts {mean:.2} m longer,"),
        ] {
            assert!(text.contains(&line), "lacks `{line}`:\n{text}");
        }
        assert!(!text.contains("4294967295"), "{text}");
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
