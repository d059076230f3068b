//! What to compare, and where to keep what comes out.

use std::path::PathBuf;

use clap::Args;

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
pub struct Options {
    /// Planners: built-in profiles or profile files (.toml), separated by commas. Default: all built-in ones.
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    pub(crate) planners: Vec<String>,
    /// Scenario files, as a pattern with * and ?, or several files.
    #[arg(long, value_name = "GLOB", num_args = 1.., default_value = "scenarios/paper/*.toml")]
    pub(crate) scenarios: Vec<String>,
    /// Runs of each planner in each scenario, with consecutive seeds.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) repeats: u32,
    /// First seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) first_seed: u64,
    /// Runs at the same time. Default: one per core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub(crate) jobs: Option<u16>,
    /// Directory of results.csv, timings.csv, summary.json, report.html and the journal.
    #[arg(long, value_name = "DIR", default_value = "out/bench")]
    pub(crate) out: PathBuf,
    /// Keep finished runs of another build of this program, e.g. to render the report anew.
    #[arg(long)]
    pub(crate) any_build: bool,
}
