//! A scenario file with everything it names, ready to be sent.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, bail};
use curionav_crowdsim::Scenario;
use curionav_crowdsim::scenario::{PeopleFrame, PeopleSource};
use curionav_datasets::locate;
use curionav_own_planner::{Attended, Source};
use curionav_planning::occupancy::{MapSurvey, MapYaml, OccupancyGrid};
use curionav_planning::parameters::field_line;
use curionav_planning::profile::Profile;
use curionav_runtime::convert;
use curionav_schemas::{Clock, InjectRequest, Reject, Validate, words};
use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantArray};

use crate::built_in::{self, BuiltIn};
use crate::files::{MapFiles, bytes, text as text_of};

/// What may differ from the scenario file.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// A built-in profile's name, a profile file, or a planner of one's own.
    pub planner: Option<String>,
    /// The profile of that planner, if it has been read.
    pub profile: Option<Profile>,
    /// Seed of everything random.
    pub seed: Option<u64>,
    /// Search trees of each cycle, in place of the profile's.
    pub trees: Option<u32>,
    /// How people are known.
    pub perception: Option<Perception>,
}

/// How people are known, whatever the scenario says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Perception {
    /// Without error, on the map.
    Truth,
    /// Without error, as seen from the robot: they are as far off on the map as the robot's belief.
    RobotFrame,
    /// By the service `tracker`, from the laser alone.
    Tracked,
    /// By the service `tracker`, from a laser that sees all around, its beams as far apart as those of the scenario's.
    TrackedAllRound,
}

impl FromStr for Perception {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::VARIANTS.iter().find(|one| <&str>::from(**one) == text);
        found.copied().ok_or_else(|| "give truth, robot-frame, tracked or tracked-all-round".to_owned())
    }
}

impl Perception {
    fn apply(self, scenario: &mut Scenario) {
        let perception = &mut scenario.perception;
        (perception.source, perception.frame) = match self {
            Self::Truth => (PeopleSource::Truth, PeopleFrame::Map),
            Self::RobotFrame => (PeopleSource::Truth, PeopleFrame::Robot),
            Self::Tracked | Self::TrackedAllRound => (PeopleSource::Tracker, perception.frame),
        };
        if self == Self::TrackedAllRound {
            scenario.laser = scenario.laser.all_round();
        }
    }
}

/// A scenario read from disk.
pub struct Package {
    /// As it is in the file, but for the names of files, which are those they are sent under.
    pub scenario: Scenario,
    /// What the simulator is sent.
    pub request: InjectRequest,
    path: PathBuf,
    text: String,
    /// What the map's description says, and under what name its image is sent.
    yaml: MapYaml,
    image_name: String,
    /// The true map, if the scenario has one of its own.
    truth: Option<MapFiles>,
}

impl Package {
    /// One line about a field of this scenario, with its line in the file where it stands there.
    pub(crate) fn fault(&self, field: Option<&str>, problem: &str) -> anyhow::Error {
        anyhow::anyhow!("{}: {problem}", place(&self.path, &self.text, field))
    }

    /// What the map holds, and what is odd about it.
    ///
    /// # Errors
    /// Its image cannot be read.
    pub fn survey(&self) -> anyhow::Result<MapSurvey> {
        let image = self.request.files.get(&self.image_name).map_or(&[][..], |image| image.as_slice());
        MapSurvey::new(&self.yaml, image).map_err(|e| self.fault(Some("map.file"), &e.to_string()))
    }

    /// The walls that are really there, where they are not those of the map.
    ///
    /// # Errors
    /// The file of the true map is no map.
    pub fn truth(&self) -> anyhow::Result<Option<OccupancyGrid>> {
        let Some(truth) = &self.truth else { return Ok(None) };
        let grid = truth.grid().map_err(|e| self.fault(Some("world.file"), &format!("{e:#}")))?;
        Ok(Some(grid))
    }

    /// Why a simulator does not take this scenario, on one line.
    pub fn refusal(&self, reject: &Reject) -> anyhow::Error {
        self.fault(reject.field.as_deref(), &words::say("refusal", &reject.why))
    }
}

/// Where in a scenario file something is wrong: `FILE: line N: FIELD`.
fn place(path: &Path, text: &str, field: Option<&str>) -> String {
    let line = field.and_then(|f| field_line(text, f)).map_or(String::new(), |n| format!(": line {n}"));
    let field = field.map_or(String::new(), |f| format!(": {f}"));
    format!("{}{line}{field}", path.display())
}

/// Reads the scenario and its files, or takes the built-in scenario of this name. Errors name file, line and field.
pub fn read(path: &Path, choice: &Choice, clock: Clock, time_scale: f64) -> anyhow::Result<Package> {
    let built_in = built_in::find(path);
    let text = match built_in {
        Some(built_in) => built_in.scenario.to_owned(),
        None => text_of(path).with_context(built_in::hint)?,
    };
    let mut scenario = Scenario::from_toml(&text).with_context(|| path.display().to_string())?;
    if let Some(perception) = choice.perception {
        perception.apply(&mut scenario);
    }
    let mut sent = Sent { path, text: &text, files: BTreeMap::new() };
    let map = sent.map("map.file", &mut scenario.map.file, built_in)?;
    let image_name = base_name(&map.image_path)?;
    for (field, name) in [("map.keepout", &mut scenario.map.keepout), ("map.speed", &mut scenario.map.speed)]
    {
        name.as_mut().map(|name| sent.map(field, name, None)).transpose()?;
    }
    let truth = scenario.world.file.as_mut().map(|name| sent.map("world.file", name, None)).transpose()?;
    for (i, recorded) in scenario.recorded.iter_mut().enumerate() {
        sent.recording(i, &mut recorded.file)?;
    }
    let files = sent.files;
    let chosen = choice.planner.as_deref().unwrap_or(&scenario.planner.profile);
    let mut profile = choice.profile.clone().map_or_else(|| read_profile(chosen), Ok)?;
    // What is sent is the whole profile, so that the simulator needs to know none.
    if let Some(overrides) = scenario.profile.take() {
        profile = profile
            .with_overrides(&overrides)
            .map_err(|e| e.below("profile").located_in(&text))
            .with_context(|| path.display().to_string())?;
    }
    profile.trees = choice.trees.unwrap_or(profile.trees);
    let request = InjectRequest {
        scenario: convert::to_value(&scenario).map_err(anyhow::Error::from)?,
        files: files.into_iter().map(|(name, content)| (name, content.into())).collect(),
        profile: convert::to_value(&profile).map_err(anyhow::Error::from)?,
        seed: choice.seed,
        clock,
        time_scale,
    };
    let package =
        Package { scenario, request, path: path.to_owned(), text, yaml: map.yaml, image_name, truth };
    // What cannot be sent is refused here as well, so that what is fine for `check` can be run.
    package.request.validate().map_err(|reject| package.refusal(&reject))?;
    Ok(package)
}

/// What is sent with a scenario.
struct Sent<'a> {
    /// Of the scenario.
    path: &'a Path,
    text: &'a str,
    /// By the names that they are sent under.
    files: BTreeMap<String, Vec<u8>>,
}

impl Sent<'_> {
    fn located(&self, field: &str, file: &str) -> anyhow::Result<PathBuf> {
        let directory = self.path.parent().unwrap_or(Path::new(""));
        locate(file, directory).map_err(|e| anyhow::anyhow!("{}: {e}", self.at(field)))
    }

    fn at(&self, field: &str) -> String {
        place(self.path, self.text, Some(field))
    }

    /// Adds the map that `name`, the value of `field`, describes. `name` becomes what it is sent under. The image is
    /// found by what its description calls it, so it cannot have another name.
    fn map(
        &mut self,
        field: &str,
        name: &mut String,
        built_in: Option<&BuiltIn>,
    ) -> anyhow::Result<MapFiles> {
        let path = self.located(field, name)?;
        let read = match built_in {
            Some(built_in) => MapFiles::of(&path, built_in.yaml.to_vec(), |_| Ok(built_in.image.to_vec())),
            None => MapFiles::read(&path),
        };
        let map = read.with_context(|| self.at(field))?;
        let image_name = base_name(&map.image_path)?;
        if self.files.get(&image_name).is_some_and(|other| *other != map.image) {
            bail!(
                "{}: the image `{image_name}` has the name of another file of the scenario; rename one of them",
                self.at(field)
            );
        }
        self.files.insert(image_name, map.image.clone());
        *name = self.free_name(field, &base_name(&path)?, &map.yaml_bytes);
        self.files.insert(name.clone(), map.yaml_bytes.clone());
        Ok(map)
    }

    /// Adds recording number `index`; `name` becomes what it is sent under.
    fn recording(&mut self, index: usize, name: &mut String) -> anyhow::Result<()> {
        let field = format!("recorded[{index}].file");
        let path = self.located(&field, name)?;
        let content = bytes(&path).with_context(|| self.at(&field))?;
        *name = self.free_name(&index.to_string(), &base_name(&path)?, &content);
        self.files.insert(name.clone(), content);
        Ok(())
    }

    /// The name, with another before it if it is taken by other content.
    fn free_name(&self, before: &str, name: &str, content: &[u8]) -> String {
        let is_taken = self.files.get(name).is_some_and(|other| other != content);
        if is_taken { format!("{before}-{name}") } else { name.to_owned() }
    }
}

/// A planner by a built-in profile's name or a profile file. A planner of one's own is started and asked.
pub fn read_profile(name: &str) -> anyhow::Result<Profile> {
    if let Some(profile) = Profile::builtin(name) {
        return Ok(profile);
    }
    if let Some(source) = Source::parse(name)? {
        let attended = Attended::start(source)?;
        return attended.description().profile(attended.source());
    }
    let path = PathBuf::from(name);
    if path.extension().is_none_or(|e| e != "toml") {
        let known: Vec<&str> = Profile::names().collect();
        bail!(
            "unknown planner `{name}`; use one of {}, a .toml file, FILE.py:NAME or ./PROGRAM",
            known.join(", ")
        );
    }
    let text = text_of(&path)?;
    Profile::from_toml(&text).with_context(|| path.display().to_string())
}

fn base_name(path: &Path) -> anyhow::Result<String> {
    let name = path.file_name().with_context(|| format!("{} is not a file", path.display()))?;
    Ok(name.to_string_lossy().into_owned())
}
