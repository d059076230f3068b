//! `curionav tune`: a search for better settings.

use std::path::PathBuf;

use clap::Args;
use curionav_lab::tune;
use curionav_runtime::exit::Exit;

/// Search for better planner settings, on seeds that no report uses.
///
/// Searches the settings of a planner that cost least, and prints the best one as a profile.
///
/// The cost of a run is 25 TD + 4 RMSE/m + 12 TCM + Length/40 m + Time/45 s + max(0, 3.6 m - MD)/3 m +
/// max(0, 0.3 m - gap)/0.3 m, about 1 each for the paper's planner, and 20 if it did not reach the goal and 20 if it
/// collided; of a setting, the mean over all scenarios and seeds, the same ones for every setting. [objective] in
/// SPACE.toml changes the weights.
///
/// First the base and a quasi-random sample of settings run with one seed, the best third of them with three
/// times as many, and so on up to --repeats. Then the best one's parameters are moved one by one, ever less far.
///
/// SPACE.toml: `base = "curiosity"` (a profile, or a profile file), and for each parameter a table
/// [[parameters]] with `path = "terms.cnc.weight"` and either `low`, `high` and perhaps `scale = "log"`, or
/// `values = [...]`.
///
/// Exit status: 0 done; 1 a run could not take place, or interrupted (the same command goes on); 2 bad input.
#[derive(Debug, Args)]
pub(crate) struct TuneOptions {
    /// What to search.
    #[arg(value_name = "SPACE.toml")]
    space: PathBuf,
    /// Scenario files, as a pattern with * and ?, or several files.
    #[arg(long, value_name = "GLOB", num_args = 1.., default_value = "scenarios/paper/*.toml")]
    scenarios: Vec<String>,
    /// Settings to sample.
    #[arg(long, value_name = "N", default_value_t = 26, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    settings: u32,
    /// Seeds a setting is run with in each scenario before it can win.
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeats: u32,
    /// Times every parameter is moved up and down.
    #[arg(long, value_name = "N", default_value_t = 2)]
    rounds: u32,
    /// First seed of the runs, at least 1000: the ones below are for reports.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1000..))]
    first_seed: u64,
    /// Seed of the sample.
    #[arg(long, value_name = "N", default_value_t = 1)]
    search_seed: u64,
    /// Runs at the same time. Default: one per core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    jobs: Option<u16>,
    /// Directory of best.toml, tune.csv, the settings and the journal.
    #[arg(long, value_name = "DIR", default_value = "out/tune")]
    out: PathBuf,
}

pub(crate) async fn run(options: TuneOptions) -> Result<u8, Exit> {
    let TuneOptions { space, scenarios, settings, repeats, rounds, first_seed, search_seed, jobs, out } =
        options;
    let options =
        tune::Options { space, scenarios, settings, repeats, rounds, first_seed, search_seed, jobs, out };
    tune::tune(options).await
}
