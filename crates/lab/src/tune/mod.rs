//! A search for settings that cost less, on seeds that no report uses.

mod objective;
mod search;
mod space;

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::print::{note, print};
use curionav_schemas::hex;
use sha2::{Digest, Sha256};

use crate::bench::execution::Execution;
use crate::bench::measure::Measure;
use crate::bench::plan::Plan;
use crate::bench::row::Row;
use crate::plural::count;
use crate::statistics::mean;
use curionav_deployment::csv_row::csv_row;
use curionav_deployment::files;
use search::Trial;
use space::{Setting, Space};

/// Search for better planner settings, on seeds that no report uses.
///
/// Searches the settings of a planner that cost least, and prints the best one as a profile: all that differs from the
/// default.
///
/// The cost of a run is 25 TD + 4 RMSE/m + 12 TCM + Length/40 m + Time/45 s + max(0, 3.6 m - MD)/3 m +
/// max(0, 0.3 m - gap)/0.3 m, about 1 each for the paper's planner, and 20 if it did not reach the goal and 20 if it
/// collided; of a setting, the mean over all scenarios and seeds, the same ones for every setting. `[objective]` in
/// SPACE.toml changes the weights.
///
/// First the base and a quasi-random sample of settings run with one seed, the best third of them with three
/// times as many, and so on up to --repeats. Then the best one's parameters are moved one by one, ever less far.
///
/// SPACE.toml: `base = "curiosity"` (a profile, or a profile file), and for each parameter a table
/// `[[parameters]]` with `path = "terms.cnc.weight"` and either `low`, `high` and perhaps `scale = "log"`, or
/// `values = [...]`.
///
/// Exit status: 0 done; 1 a run could not take place, or interrupted (the same command goes on); 2 bad input.
#[derive(Debug, Args)]
pub struct Options {
    /// What to search.
    #[arg(value_name = "SPACE.toml")]
    space: PathBuf,
    /// Scenario files, as a pattern with * and ?, or several files.
    #[arg(long, value_name = "GLOB", num_args = 1.., default_value = "scenarios/training/*.toml")]
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

/// Searches, writes the best settings and all that were tried, prints the best, and gives the exit status.
///
/// # Errors
/// Bad input if the space or the scenarios cannot be used; failed if a run could not take place or interrupted.
pub async fn tune(options: Options) -> Result<u8, Exit> {
    let space = Space::read(&options.space).map_err(Exit::bad_input)?;
    // Checked before the first run, not after an hour.
    Plan::read(&["curiosity".into()], &options.scenarios, None).map_err(Exit::bad_input)?;
    let folder = options.out.join("settings");
    files::writable_folder(&folder).context("--out").map_err(Exit::bad_input)?;
    let execution = Execution::open(&options.out, options.jobs, false)?;
    let mut runs = Runs { space: &space, options: &options, folder, execution, tried: Vec::new() };
    let profile = results(&mut runs).await.map_err(|e| e.downcast::<Exit>().unwrap_or_else(Exit::failed))?;
    print(profile)?;
    Ok(SUCCESS)
}

async fn results(runs: &mut Runs<'_>) -> anyhow::Result<String> {
    let space = runs.space;
    let options = runs.options;
    let base = space.base()?;
    let mut settings = vec![base.clone()];
    settings.extend(space.sample(options.settings, options.search_seed)?);
    let mut best = search::halving(runs, settings, options.repeats).await?;
    // The base may have been unlucky with few seeds; and readers of the result want to know what was gained.
    let base_cost = runs.costs(std::slice::from_ref(&base), options.repeats).await?[0];
    if base_cost <= best.1 {
        best = (base, base_cost);
    }
    let (best, cost) = search::descent(runs, space, best, options.repeats, options.rounds).await?;
    let last = options.first_seed + u64::from(options.repeats) - 1;
    let mut profile = format!(
        "# Found by `curionav tune {} --settings {} --repeats {} --rounds {}`:\n# cost {cost:.4}, of the base \
         {base_cost:.4}, over {} with seeds {} to {last}.\n",
        options.space.display(),
        options.settings,
        options.repeats,
        options.rounds,
        options.scenarios.join(" "),
        options.first_seed
    );
    for (parameter, value) in space.parameters.iter().zip(space.values(&best)?) {
        profile += &format!("# {} = {value}\n", parameter.path);
    }
    profile += &toml::to_string(&best.profile.differences()?)?;
    files::write(&options.out.join("best.toml"), &profile)?;
    files::write(&options.out.join("tune.csv"), runs.table()?)?;
    Ok(profile)
}

/// Runs settings, as planners that differ in their profile files.
struct Runs<'a> {
    space: &'a Space,
    options: &'a Options,
    folder: PathBuf,
    execution: Execution,
    tried: Vec<Tried>,
}

struct Tried {
    setting: Setting,
    repeats: u32,
    cost: f64,
    rows: Vec<Row>,
}

impl Trial for Runs<'_> {
    async fn costs(&mut self, settings: &[Setting], repeats: u32) -> anyhow::Result<Vec<f64>> {
        let files: Vec<PathBuf> =
            settings.iter().map(|s| written(&self.folder, s)).collect::<Result<_, _>>()?;
        let mut sources: Vec<String> = files.iter().map(|file| file.to_string_lossy().into_owned()).collect();
        let wanted = sources.clone();
        // Two places of the cube can be the same profile.
        sources.sort();
        sources.dedup();
        let plan = Plan::read(&sources, &self.options.scenarios, None)?;
        let jobs = plan.jobs(self.options.first_seed, repeats, None);
        let missing = self.execution.finish(&jobs).await?;
        if let Some(first) = missing.first() {
            let lost = missing.len();
            let all = jobs.len();
            let reason = &first.reason;
            bail!("{lost} of {all} runs did not take place, the first because: {reason}");
        }
        let mut costs = Vec::new();
        for (setting, source) in settings.iter().zip(&wanted) {
            let own = jobs.iter().filter(|job| job.planner_source == *source);
            let rows: Vec<Row> = own.filter_map(|job| self.execution.row(job)).cloned().collect();
            let each: Vec<f64> = rows.iter().map(|row| self.space.objective.cost(row)).collect();
            let cost = mean(&each).context("a setting without runs")?;
            costs.push(cost);
            if !self.tried.iter().any(|t| t.repeats == repeats && t.setting.profile == setting.profile) {
                self.tried.push(Tried { setting: setting.clone(), repeats, cost, rows });
            }
        }
        let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
        let what = count(settings.len(), "setting");
        note(format_args!("{what} with {}: least cost {least:.4}", count(repeats as usize, "seed")));
        Ok(costs)
    }
}

impl Runs<'_> {
    fn table(&self) -> anyhow::Result<String> {
        let paths = self.space.parameters.iter().map(|p| p.path.as_str());
        let measures = Measure::ALL.map(Measure::key);
        let mut text =
            csv_row(["origin", "seeds", "cost", "success"].into_iter().chain(paths).chain(measures));
        for Tried { setting, repeats, cost, rows } in &self.tried {
            let success = rows.iter().filter(|row| row.is_success()).count() as f64 / rows.len() as f64;
            let labels =
                [setting.origin.clone(), repeats.to_string(), format!("{cost:.6}"), format!("{success:.4}")];
            let means = Measure::ALL.map(|measure| {
                let values: Vec<f64> = rows.iter().filter_map(|row| measure.of(row)).collect();
                mean(&values).map_or_else(String::new, |m| format!("{m:.6}"))
            });
            text += &csv_row(labels.into_iter().chain(self.space.values(setting)?).chain(means));
        }
        Ok(text)
    }
}

/// The setting's profile as a file, named by what is in it.
fn written(folder: &Path, setting: &Setting) -> anyhow::Result<PathBuf> {
    let text = toml::to_string(&setting.profile)?;
    let path = folder.join(format!("{}.toml", &hex(&Sha256::digest(&text))[..16]));
    if !path.is_file() {
        files::write(&path, text)?;
    }
    Ok(path)
}
