//! `curionav bench`: planners compared over many runs; and `curionav worker`, a process that it hands runs to.

use std::path::PathBuf;

use clap::Args;
use curionav_lab::bench;
use curionav_runtime::exit::Exit;

/// Run planners over scenarios many times and compare them with each other and with the paper.
///
/// Every planner runs in every scenario with every seed, in lockstep, on several processes. A finished run is kept in
/// DIR/journal.jsonl at once: after an interruption the same command goes on where it was. A run counts as finished
/// while its scenario, map, planner and this program are what they were.
/// results.csv is the same, byte for byte, whatever --jobs; what depends on the clock is in timings.csv.
///
/// Exit status: 0 every run took place, however it ended; 1 a run could not take place, or interrupted;
/// 2 bad input; 3 the worker processes cannot be started.
#[derive(Debug, Args)]
pub(crate) struct BenchOptions {
    /// Planners: built-in profiles or profile files (.toml), separated by commas. Default: all built-in ones.
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    planners: Vec<String>,
    /// Scenario files, as a pattern with * and ?, or several files.
    #[arg(long, value_name = "GLOB", num_args = 1.., default_value = "scenarios/paper/*.toml")]
    scenarios: Vec<String>,
    /// Runs of each planner in each scenario, with consecutive seeds.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeats: u32,
    /// First seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    first_seed: u64,
    /// Runs at the same time. Default: one per core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    jobs: Option<u16>,
    /// Directory of results.csv, timings.csv, summary.json, report.html and the journal.
    #[arg(long, value_name = "DIR", default_value = "out/bench")]
    out: PathBuf,
    /// Keep finished runs of another build of this program, e.g. to render the report anew.
    #[arg(long)]
    any_build: bool,
}

pub(crate) async fn run(options: BenchOptions) -> Result<u8, Exit> {
    let BenchOptions { planners, scenarios, repeats, first_seed, jobs, out, any_build } = options;
    bench::bench(bench::Options { planners, scenarios, repeats, first_seed, jobs, out, any_build }).await
}

/// Take runs from standard input and answer each with a row (started by `bench` and `tune`).
#[derive(Debug, Args)]
pub(crate) struct WorkerOptions {
    /// Digest of the program, as it shall be in every row.
    #[arg(long)]
    program: String,
}

pub(crate) async fn worker(options: WorkerOptions) -> Result<u8, Exit> {
    bench::worker(&options.program).await
}
