//! A search for settings that cost less, on seeds that no report uses.

mod objective;
mod search;
mod space;

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use curionav_runtime::exit::{Exit, SUCCESS};
use sha2::{Digest, Sha256};

use crate::bench::execution::Execution;
use crate::bench::measure::Measure;
use crate::bench::plan::{self, Plan};
use crate::bench::row::Row;
use crate::bench::statistics::mean;
use crate::csv_row::csv_row;
use crate::out_folder::{folder, write};
use crate::plural::count;
use search::Trial;
use space::{Setting, Space};

/// What to search, and where to keep what comes out.
#[derive(Debug, Clone)]
pub struct Options {
    /// File that names the base and the parameters.
    pub space: PathBuf,
    /// Scenario files, as patterns with `*` and `?`.
    pub scenarios: Vec<String>,
    /// Settings to sample.
    pub settings: u32,
    /// Seeds that a setting is run with in each scenario before it can win.
    pub repeats: u32,
    /// Times that every parameter is moved up and down.
    pub rounds: u32,
    /// First seed of the runs.
    pub first_seed: u64,
    /// Seed of the sample.
    pub search_seed: u64,
    /// Runs at the same time; one per core if absent.
    pub jobs: Option<u16>,
    /// Directory of results and journal.
    pub out: PathBuf,
}

/// Searches, writes the best settings and all that were tried, prints the best, and gives the exit status.
///
/// # Errors
/// Bad input if the space or the scenarios cannot be used; failed if a run could not take place or interrupted.
pub async fn tune(options: Options) -> Result<u8, Exit> {
    let space = Space::read(&options.space).map_err(Exit::bad_input)?;
    // Checked before the first run, not after an hour.
    Plan::read(&["curiosity".into()], &options.scenarios).map_err(Exit::bad_input)?;
    let folder = folder(&options.out, "settings").map_err(Exit::bad_input)?;
    let execution = Execution::open(&options.out, options.jobs, false)?;
    let mut runs = Runs { space: &space, options: &options, folder, execution, tried: Vec::new() };
    let profile = results(&mut runs).await.map_err(|e| e.downcast::<Exit>().unwrap_or_else(Exit::failed))?;
    #[expect(clippy::print_stdout, reason = "what the command is for")]
    {
        println!("{profile}");
    }
    Ok(SUCCESS)
}

/// Searches and writes the results; gives the best setting as a profile.
async fn results(runs: &mut Runs<'_>) -> anyhow::Result<String> {
    let (space, options) = (runs.space, runs.options);
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
        "# Found by `curionav tune`: cost {cost:.4}, of the base {base_cost:.4}, over {} with seeds {} to {last}.\n",
        options.scenarios.join(" "),
        options.first_seed
    );
    for (parameter, value) in space.parameters.iter().zip(space.values(&best)?) {
        profile += &format!("# {} = {value}\n", parameter.path);
    }
    profile += &toml::to_string(&best.profile)?;
    write(&options.out.join("best.toml"), &profile)?;
    write(&options.out.join("tune.csv"), &runs.table()?)?;
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

/// A setting and what came out of it.
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
        let plan = Plan::read(&sources, &self.options.scenarios)?;
        let jobs = plan.jobs(self.options.first_seed, repeats, None);
        let missing = self.execution.finish(&jobs).await?;
        if let Some(first) = missing.first() {
            let (lost, all, reason) = (missing.len(), jobs.len(), &first.reason);
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
        eprintln!("{what} with {}: least cost {least:.4}", count(repeats as usize, "seed"));
        Ok(costs)
    }
}

impl Runs<'_> {
    /// Every setting that was tried, in the order of the search.
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
    let path = folder.join(format!("{}.toml", &plan::hex(&Sha256::digest(&text))[..16]));
    if !path.is_file() {
        write(&path, &text)?;
    }
    Ok(path)
}
