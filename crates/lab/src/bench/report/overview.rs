//! What was run, what of it was promised, how the runs ended.

use super::super::acceptance::Verdict;
use super::super::findings::Findings;
use super::super::tally::Tally;
use super::html::{escaped, planner, prose, table, td, th};
use crate::plural::count;

pub(super) fn heading(bench: &Findings<'_>, title: &str) -> String {
    let (first, last) = (bench.first_seed, bench.first_seed + u64::from(bench.repeats) - 1);
    let seeds = if first == last { format!("seed {first}") } else { format!("seeds {first} to {last}") };
    let mut text = format!("<h1>curionav bench</h1>\n<p>{}, {seeds}. ", escaped(title));
    text += &format!(
        "Program {} (version {}). Planners: {}.</p>\n",
        escaped(&bench.programs.join(", ")),
        env!("CARGO_PKG_VERSION"),
        escaped(&bench.comparison.planners.join(", "))
    );
    if !bench.missing.is_empty() {
        let lines: String = (bench.missing.iter())
            .map(|m| {
                let what =
                    format!("{}, {}, seed {}: {}", m.job.scenario, m.job.planner, m.job.seed, m.reason);
                format!("<li>{}</li>", escaped(&what))
            })
            .collect();
        text += &format!(
            "<p class=\"miss\"><b>{} runs did not take place:</b></p><ul>{lines}</ul>\n",
            bench.missing.len()
        );
    }
    text
}

pub(super) fn acceptance(bench: &Findings<'_>) -> String {
    let rows: Vec<String> = (bench.criteria.iter())
        .map(|c| {
            let (class, word) = match c.verdict {
                Verdict::Pass => ("pass", "pass"),
                Verdict::Miss => ("miss", "miss"),
                Verdict::NotJudged => ("not-judged", "not judged"),
            };
            td("words", &prose(&c.promise))
                + &td(&format!("{class} verdict"), word)
                + &td("words", &escaped(&c.found))
        })
        .collect();
    let counts = |verdict| bench.criteria.iter().filter(|c| c.verdict == verdict).count();
    let head = "<th class=\"words\">promise</th><th>verdict</th><th class=\"words\">found</th>".to_owned();
    format!(
        "<h2>What was promised</h2>\n<p>{} kept, {} missed, {} not judged. A promise about 13 scenarios is held to the same share of fewer.</p>\n{}",
        counts(Verdict::Pass),
        counts(Verdict::Miss),
        counts(Verdict::NotJudged),
        table("", &[head], &rows)
    )
}

pub(super) fn outcomes(bench: &Findings<'_>) -> String {
    let comparison = &bench.comparison;
    let head: String = [
        "planner",
        "runs",
        "reached, no collision",
        "reached",
        "timeout",
        "lost",
        "runs with collisions",
        "collisions",
        "degraded runs",
        "real-time factor",
    ]
    .iter()
    .map(|name| th(name))
    .collect();
    let rows: Vec<String> = (comparison.planners.iter().enumerate())
        .map(|(p, name)| {
            let t = Tally::of(comparison.all_runs(p));
            let counts = [
                t.runs,
                t.success,
                t.reached,
                t.timeouts,
                t.lost,
                t.collided,
                t.contacts as usize,
                t.degraded,
            ];
            let counts: String = counts.iter().map(|n| td("", &n.to_string())).collect();
            let factor = bench.real_time_factor(p).map_or_else(String::new, |f| format!("{f:.1}"));
            td("", &planner(name, p)) + &counts + &td("", &factor)
        })
        .collect();
    format!(
        "<h2>How the runs ended</h2>\n{}<p class=\"notes\">Real-time factor: simulated over clock seconds of a run, mean, \
         {} at a time. All runs: {:.1} minutes on the clock.</p>\n",
        table("", &[head], &rows),
        count(bench.workers, "run"),
        bench.clock.as_secs_f64() / 60.0
    )
}
