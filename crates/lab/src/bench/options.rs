//! What to compare, and where to keep what comes out.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::{Args, Subcommand};
use curionav_deployment::package::Perception;
use serde::{Deserialize, Serialize};

/// Run planners over scenarios many times and compare them with each other and with the paper.
///
/// Every planner runs in every scenario with every seed, in lockstep, on several processes. A finished run is kept in
/// DIR/journal.jsonl at once: after an interruption the same command goes on where it was. A run counts as finished
/// while its scenario, map, planner and this program are what they were.
/// results.csv is the same, byte for byte, whatever --jobs; what depends on the clock is in timings.csv.
///
/// A planner of one's own is a program that is told what the robot knows and answers what it is to do, such as a
/// function with `@curionav.planner("mine")` in mine.py: `curionav bench rooms --planners curionav,mine.py:policy`.
/// Each worker starts its own. What it does not answer in time, or answers wrongly, costs its own run alone and is
/// counted in results.csv. docs/own-planner.md has the protocol for other languages.
///
/// At the end `python3 -m curionav.report DIR` writes summary.json and report.html and judges the claims;
/// CURIONAV_PYTHON names another interpreter. Without the package (`pip install './python[report]'`) there are the
/// tables alone, and --check is refused.
///
/// On several machines, each runs one part: `curionav bench dense --shard 3/8 --out shard-3`. Then
/// `curionav bench merge shard-* --out all` writes the results, byte for byte those of one machine.
///
/// Exit status: 0 every run took place, however it ended, and every claim of --check holds; 1 a run could not take
/// place, a claim does not hold or cannot be judged, or interrupted; 2 bad input; 3 the worker processes cannot be
/// started.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Options {
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
    #[command(flatten)]
    pub(crate) what: What,
    /// Run only the K-th of N parts of the runs, for `merge`.
    #[arg(long, value_name = "K/N")]
    pub(crate) shard: Option<Shard>,
    /// Runs at the same time. Default: one per core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub(crate) jobs: Option<u16>,
    #[command(flatten)]
    pub(crate) results: Results,
}

/// What else `bench` can do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Write the results of runs that `--shard` has spread over several machines. Nothing is run.
    ///
    /// Exit status: as of `bench`; 2 if a shard is missing, unfinished, or of other runs than the rest.
    Merge {
        /// Directories of all shards.
        #[arg(required = true, value_name = "DIR")]
        shards: Vec<PathBuf>,
        #[command(flatten)]
        results: Results,
    },
}

/// Which runs there are.
#[derive(Debug, Clone, PartialEq, Args, Serialize, Deserialize)]
pub(crate) struct What {
    /// Suite of scenarios: a folder below scenarios/, or any folder with scenario files.
    #[arg(value_name = "SUITE", default_value = "paper", conflicts_with = "scenarios")]
    pub(crate) suite: String,
    /// Planners: built-in profiles, profile files (.toml) or folders of them such as scenarios/tuned, and planners of
    /// one's own: a name in a Python file (mine.py:policy) or a program (./planner). Separated by commas. Default: all
    /// built-in ones.
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    pub(crate) planners: Vec<String>,
    /// Scenario files in place of a suite, as a pattern with * and ?, or several files.
    #[arg(long, value_name = "GLOB", num_args = 1..)]
    pub(crate) scenarios: Vec<String>,
    /// How people are known in every scenario: truth, robot-frame (the truth as seen from the robot), tracked (by the
    /// service tracker, from the laser) or tracked-all-round (the same with a laser that sees all around). Default: as
    /// each scenario says.
    #[arg(long, value_name = "HOW")]
    pub(crate) perception: Option<Perception>,
    /// Runs of each planner in each scenario, with consecutive seeds.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) repeats: u32,
    /// First seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) first_seed: u64,
}

impl What {
    /// Patterns of the scenario files.
    pub(crate) fn patterns(&self) -> Vec<String> {
        if !self.scenarios.is_empty() {
            return self.scenarios.clone();
        }
        let below = Path::new("scenarios").join(&self.suite);
        let folder = if below.is_dir() { below } else { PathBuf::from(&self.suite) };
        vec![folder.join("*.toml").to_string_lossy().into_owned()]
    }
}

/// Where results go, and what is asked of them.
#[derive(Debug, Args)]
pub(crate) struct Results {
    /// Directory of the tables, the journal, the traces and the report.
    #[arg(long, value_name = "DIR", default_value = "out/bench")]
    pub(crate) out: PathBuf,
    /// Files of claims to be judged by the runs (.toml), such as scenarios/claims/paper.toml, separated by commas. They
    /// are read before the first run, and the exit status says whether all claims hold.
    #[arg(long, value_name = "FILES", value_delimiter = ',')]
    pub(crate) check: Vec<PathBuf>,
    /// Keep finished runs of another build of this program, e.g. to render the report anew.
    #[arg(long)]
    pub(crate) any_build: bool,
}

/// One of several equal parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Shard {
    /// From 1 on.
    pub(crate) index: usize,
    pub(crate) count: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index, count)) if index >= 1 && index <= count => Ok(Self { index, count }),
            _ => Err("give K/N with K from 1 to N, such as 3/8".to_owned()),
        }
    }
}
