//! What has to be run: every planner in every scenario with every seed.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use curionav_crowdsim::Scenario;
use curionav_crowdsim::scenario::Motion;
use curionav_own_planner::Check;
use curionav_planning::profile::Profile;
use curionav_runtime::fields::Fields;
use curionav_schemas::{Clock, Message, OccupancyGrid, hex};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::own_planner::OwnPlanners;
use crate::paper::PUBLISHED;
use curionav_deployment::files;
use curionav_deployment::package::{self, Choice, Package, Perception};

/// One run, as a worker is asked for it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Job {
    /// Digest of all that decides the run but the program; see [`key`].
    pub(crate) key: String,
    pub(crate) scenario_file: PathBuf,
    /// A built-in profile or a profile file.
    pub(crate) planner_source: String,
    pub(crate) scenario: String,
    /// The planner's name in the results.
    pub(crate) planner: String,
    pub(crate) seed: u64,
    /// How people are known, unless as the scenario says.
    pub(crate) perception: Option<Perception>,
    /// Where the whole trace shall be kept, if it shall.
    pub(crate) trace: Option<PathBuf>,
}

#[derive(Debug, Serialize)]
pub(crate) struct Planner {
    /// A built-in profile or a profile file.
    pub(crate) source: String,
    /// Its name in the results: that of the built-in profile, of the file without its ending, or what a planner of
    /// one's own calls itself.
    pub(crate) name: String,
    /// What checks what a planner of one's own proposes: `arbiter` or `driver`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) check: Option<Check>,
    /// The profile of a planner of one's own.
    #[serde(skip)]
    pub(crate) profile: Option<Profile>,
}

impl Planner {
    /// That of a profile.
    fn of_profile(source: String, name: String) -> Self {
        Self { source, name, check: None, profile: None }
    }
}

#[derive(Debug)]
pub(crate) struct Scene {
    pub(crate) file: PathBuf,
    pub(crate) scenario: Scenario,
    pub(crate) map: OccupancyGrid,
    /// `Thr'` of the first planner, m2 + rad2.
    pub(crate) threshold: f64,
    /// For each cell of `map`: whether it is free and no landmark is within the laser's range.
    pub(crate) bare: Vec<bool>,
    /// [planner] digest of scenario, map, recordings and profile.
    digests: Vec<String>,
}

impl Scene {
    pub(crate) fn name(&self) -> &str {
        &self.scenario.name
    }

    pub(crate) fn people(&self) -> usize {
        self.scenario.walkers.len() + self.scenario.people_drawn() + self.scenario.recorded.len()
    }

    /// What moves the people, in words.
    pub(crate) fn motion(&self) -> String {
        let people = &self.scenario.people;
        let drawn = self.people() > self.scenario.recorded.len();
        let law = match people.motion {
            Motion::Scripted => "script",
            Motion::Hrvo => "HRVO",
            Motion::SocialForce => "social forces",
        };
        let filmed = (!self.scenario.recorded.is_empty()).then_some("filmed");
        drawn.then_some(law).into_iter().chain(filmed).collect::<Vec<_>>().join(", ")
    }

    /// People per square metre of free floor.
    pub(crate) fn density(&self) -> f64 {
        let free = self.map.cells.iter().filter(|cell| **cell == 0).count();
        self.people() as f64 / (free as f64 * self.map.resolution * self.map.resolution)
    }
}

/// Planners and scenarios, all of them checked: every pair of them can run.
#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) planners: Vec<Planner>,
    pub(crate) scenes: Vec<Scene>,
    /// How people are known, unless as the scenarios say.
    pub(crate) perception: Option<Perception>,
}

impl Plan {
    /// Reads and checks everything. Errors name file, line and field.
    pub(crate) fn read(
        planners: &[String],
        scenarios: &[String],
        perception: Option<Perception>,
    ) -> anyhow::Result<Self> {
        let planners = named_planners(planners)?;
        let mut scenes = Vec::new();
        for file in files(scenarios).context("--scenarios")? {
            scenes.push(scene(&file, &planners, perception)?);
        }
        // The paper's order, then by name.
        let place = |name: &str| PUBLISHED.iter().position(|p| p.name == name).unwrap_or(usize::MAX);
        scenes.sort_by_key(|s| (place(s.name()), s.name().to_owned()));
        if let Some([a, b]) = scenes.array_windows().find(|[a, b]| a.name() == b.name()) {
            let first = a.file.display();
            let second = b.file.display();
            let name = a.name();
            bail!("{first} and {second} are both called `{name}`; results need different names");
        }
        Ok(Self { planners, scenes, perception })
    }

    /// Every run, scenario by scenario, so that a worker prepares each map once. The whole trace of the runs with
    /// the first seed is kept in `traces`, if given.
    pub(crate) fn jobs(&self, first_seed: u64, repeats: u32, traces: Option<&Path>) -> Vec<Job> {
        let mut jobs = Vec::new();
        for scene in &self.scenes {
            for (planner, digest) in self.planners.iter().zip(&scene.digests) {
                for seed in (0..u64::from(repeats)).map(|i| first_seed.saturating_add(i)) {
                    let keeps = traces.filter(|_| seed == first_seed);
                    let key = key(digest, seed);
                    jobs.push(Job {
                        trace: keeps.map(|folder| folder.join(format!("{key}.cbor"))),
                        key,
                        scenario_file: scene.file.clone(),
                        planner_source: planner.source.clone(),
                        scenario: scene.name().to_owned(),
                        planner: planner.name.clone(),
                        seed,
                        perception: self.perception,
                    });
                }
            }
        }
        jobs
    }
}

fn named_planners(sources: &[String]) -> anyhow::Result<Vec<Planner>> {
    let all: Vec<String> = Profile::names().map(String::from).collect();
    let mut planners: Vec<Planner> = Vec::new();
    let mut named = Vec::new();
    for source in if sources.is_empty() { &all } else { sources } {
        let path = Path::new(source);
        if path.is_dir() { named.extend(profiles(path)?) } else { named.push(source.clone()) }
    }
    let mut own = OwnPlanners::new();
    for source in &named {
        if let Some(profile) = own.profile(source).context("--planners")? {
            let check = if profile.collision.final_check { Check::Arbiter } else { Check::Driver };
            if planners.iter().any(|p| p.name == profile.name) {
                bail!("--planners: `{}` is there twice", profile.name);
            }
            planners.push(Planner {
                source: source.clone(),
                name: profile.name.clone(),
                check: Some(check),
                profile: Some(profile),
            });
            continue;
        }
        let stem = Path::new(source).file_stem().filter(|_| Profile::builtin(source).is_none());
        let name = stem.map_or_else(|| source.clone(), |stem| stem.to_string_lossy().into());
        if planners.iter().any(|p| p.name == name) {
            bail!("--planners: `{name}` is there twice");
        }
        planners.push(Planner::of_profile(source.clone(), name));
    }
    Ok(planners)
}

/// The profile files in a folder: those named as built-in ones in their order, then the others by name.
fn profiles(folder: &Path) -> anyhow::Result<Vec<String>> {
    let mut files = files(&[folder.join("*.toml").to_string_lossy().into_owned()]).context("--planners")?;
    let place = |file: &Path| Profile::names().position(|name| file.file_stem() == Some(name.as_ref()));
    files.sort_by_key(|file| place(file).unwrap_or(usize::MAX));
    Ok(files.into_iter().map(|file| file.to_string_lossy().into_owned()).collect())
}

/// The files that the patterns name, each once.
fn files(patterns: &[String]) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for pattern in patterns {
        let found = glob::glob(pattern).with_context(|| format!("`{pattern}`"))?;
        let found: Vec<PathBuf> = found.collect::<Result<_, _>>()?;
        ensure!(!found.is_empty(), "no file is called `{pattern}`");
        files.extend(found);
    }
    files.sort();
    files.dedup();
    Ok(files)
}

fn scene(file: &Path, planners: &[Planner], perception: Option<Perception>) -> anyhow::Result<Scene> {
    let mut digests = Vec::new();
    let mut first = None;
    let fields = Fields::of_maps([]);
    for planner in planners {
        let profile = planner.profile.clone();
        let choice =
            Choice { planner: Some(planner.source.clone()), profile, perception, ..Choice::default() };
        let package = package::read(file, &choice, Clock::Lockstep, 1.0)?;
        let prepared = curionav_in_process::prepare(&package.request, "robot", &fields)
            .map_err(|reject| package.refusal(&reject))?;
        digests.push(digest(&package));
        first.get_or_insert((package, prepared));
    }
    let (package, prepared) = first.context("--planners: none is given")?;
    Ok(Scene {
        file: file.to_owned(),
        scenario: package.scenario,
        bare: prepared.bare(),
        map: prepared.map,
        threshold: prepared.profile.uncertainty.threshold,
        digests,
    })
}

/// Digest of scenario, map, recordings and profile: of all that decides a run but seed and program.
pub(crate) fn digest(package: &Package) -> String {
    hex(&Sha256::digest(package.request.encode()))
}

pub(crate) fn key(digest: &str, seed: u64) -> String {
    hex(&Sha256::digest(format!("{digest} {seed}")))[..32].to_owned()
}

pub(crate) fn program_digest() -> anyhow::Result<String> {
    let path = std::env::current_exe().context("cannot find this program's file")?;
    Ok(hex(&Sha256::digest(files::bytes(&path)?))[..16].to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curionav_alone_has_margins_a_forecast_an_arrival_and_patience_of_its_own() {
        let tuned = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/tuned");
        let sources = profiles(Path::new(tuned)).unwrap().into_iter().map(|file| {
            let text = std::fs::read_to_string(&file).unwrap();
            (file, Profile::from_toml(&text).unwrap())
        });
        let builtin = Profile::names().map(|name| (name.to_owned(), Profile::builtin(name).unwrap()));
        let all: Vec<(String, Profile)> = builtin.chain(sources).collect();
        let papers = Profile::default();
        for (source, profile) in &all {
            assert_eq!(profile.collision == papers.collision, profile.name != "curionav", "{source}");
            assert_eq!(profile.goal == papers.goal, profile.name != "curionav", "{source}");
            assert_eq!(profile.patience == papers.patience, profile.name != "curionav", "{source}");
            assert_eq!(profile.forecast == papers.forecast, profile.name != "curionav", "{source}");
            assert_eq!((profile.hold, profile.dt), (papers.hold, papers.dt), "{source}");
        }
        assert_eq!(all.len(), 25);
    }

    #[test]
    fn a_folder_of_profiles_stands_for_its_planners_the_built_in_ones_first() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["mine", "dwa", "curiosity", "a"] {
            std::fs::write(folder.path().join(name).with_extension("toml"), "").unwrap();
        }
        let source = folder.path().to_string_lossy().into_owned();
        let names = |sources: &[String]| -> Vec<String> {
            named_planners(sources).unwrap().into_iter().map(|planner| planner.name).collect()
        };
        assert_eq!(names(std::slice::from_ref(&source)), ["curiosity", "dwa", "a", "mine"]);
        assert_eq!(names(&["mppi".into(), source.clone()]), ["mppi", "curiosity", "dwa", "a", "mine"]);
        let twice = named_planners(&["dwa".into(), source]).unwrap_err().to_string();
        assert!(twice.contains("`dwa` is there twice"), "{twice}");
    }
}
