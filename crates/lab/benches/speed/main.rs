//! What the parts of a cycle cost, as ratios to the time of a plain loop that is taken in the same run: `cargo speed`.
//! CONTRIBUTING.md says how to read it.
//!
//! The harness is our own: those that are maintained time a function alone, while here every figure is a ratio to a
//! reference that meets the same noise, and is compared with a committed ratio instead of with the last run.

#![expect(clippy::print_stdout, reason = "a benchmark prints its figures")]

mod baseline;
mod case;
mod cycle;
mod depot;
mod generation;
mod hall;
mod localization;
mod mission;
mod peers;
mod preparation;
mod reference;
mod simulation;
mod terms;
mod tracking;
mod wire;

use std::process::ExitCode;

use clap::Parser;
use comfy_table::{CellAlignment, Table};

use baseline::Baseline;
use case::{Case, Sample};
use reference::Reference;

/// How often a case that seems to be slower than before is measured again: most of them met other work.
const SECOND_LOOKS: usize = 2;

/// Times each part of a cycle; r is the time of a plain loop in the same run.
#[derive(Parser)]
struct Options {
    /// Only cases whose names begin with one of these.
    only: Vec<String>,
    /// Fail if a case takes more than a tenth longer than in the baseline.
    #[arg(long)]
    check: bool,
    /// Make what is measured the baseline.
    #[arg(long, conflicts_with = "check")]
    write: bool,
    /// Do each case N times and time nothing: put a profiler in front.
    #[arg(long, value_name = "N", conflicts_with_all = ["check", "write"])]
    times: Option<usize>,
    /// Cargo says so to every benchmark.
    #[arg(long, hide = true)]
    bench: bool,
}

/// How the names of a theme's cases begin, and what makes them.
type Theme = (&'static [&'static str], fn() -> anyhow::Result<Vec<Case>>);

const THEMES: [Theme; 9] = [
    (&["term/"], terms::cases),
    (&["generate/"], generation::cases),
    (&["rrt-star/"], depot::cases),
    (&["prepare/"], preparation::cases),
    (&["localize/"], localization::cases),
    (&["track/"], tracking::cases),
    (&["simulate/"], simulation::cases),
    (&["encode/", "decode/"], wire::cases),
    (&["cycle/"], cycle::cases),
];

fn main() -> anyhow::Result<ExitCode> {
    let options = Options::parse();
    let mut reference = Reference::new();
    reference::check(&mut reference)?;
    let baseline = Baseline::read()?;
    let is_asked =
        |name: &str| options.only.is_empty() || options.only.iter().any(|o| name.starts_with(o.as_str()));
    let mut rows = Vec::new();
    let mut found = false;
    for (theme, cases) in THEMES {
        // Making the cases takes time as well.
        if !theme.iter().any(|t| is_asked(t) || options.only.iter().any(|asked| asked.starts_with(t))) {
            continue;
        }
        for mut case in cases()?.into_iter().filter(|case| is_asked(&case.name)) {
            found = true;
            if let Some(times) = options.times {
                case.run(times);
                continue;
            }
            let mut measured = case.measure(&mut reference);
            for _ in 0..SECOND_LOOKS {
                if baseline.is_worse(&case.name, reference.ratio(measured.time)) {
                    measured = measured.or(case.measure(&mut reference));
                }
            }
            rows.push((case.name, measured));
        }
    }
    anyhow::ensure!(found, "no case has a name that begins so; without a name all are measured");
    if options.times.is_some() {
        return Ok(ExitCode::SUCCESS);
    }
    let ratio = |measured: &Sample| reference.ratio(measured.time);
    println!("{}\nr = {:.3} ms", table(&rows, &baseline, ratio), 1e3 * reference.least.as_secs_f64());
    let is_worse = |(name, measured): &&(String, Sample)| baseline.is_worse(name, ratio(measured));
    let worse: Vec<&str> = rows.iter().filter(is_worse).map(|row| row.0.as_str()).collect();
    if !worse.is_empty() {
        println!("slower than the baseline by more than a tenth: {}", worse.join(", "));
    }
    if options.write {
        baseline.write(rows.iter().map(|(name, measured)| (name.clone(), ratio(measured))))?;
    }
    Ok(ExitCode::from(u8::from(options.check && !worse.is_empty())))
}

fn table(rows: &[(String, Sample)], baseline: &Baseline, ratio: impl Fn(&Sample) -> f64) -> Table {
    let mut table = Table::new();
    let header = ["case", "ms", "in r", "baseline", "change", "peer", "note"];
    table.load_style(comfy_table::presets::UTF8_BORDERS_ONLY).set_header(header);
    for (name, measured) in rows {
        let ratio = ratio(measured);
        let before = baseline.of(name);
        table.add_row([
            name.clone(),
            format!("{:.4}", 1e3 * measured.time.as_secs_f64()),
            format!("{ratio:.4}"),
            before.map_or_else(String::new, |before| format!("{before:.4}")),
            before.map_or_else(String::new, |before| format!("{:+.0} %", 100.0 * (ratio / before - 1.0))),
            peers::of(name).map_or_else(String::new, |(peer, who)| format!("{:.1} x {who}", peer / ratio)),
            measured.note.clone(),
        ]);
    }
    for column in 1..5 {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}
