//! The settings that are searched: a box over some fields of a profile, and points of it.

use std::path::Path;

use anyhow::{Context, bail};
use curionav_planning::profile::Profile;
use curionav_planning::random::{rng, uniform};
use serde::Deserialize;

use super::objective::Objective;
use curionav_deployment::package::read_profile;
use curionav_runtime::config::read_toml;

/// Most parameters: beyond, a search with some hundred settings finds nothing.
const PARAMETERS_MOST: usize = 16;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SpaceFile {
    base: String,
    #[serde(default)]
    objective: Objective,
    parameters: Vec<ParameterEntry>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterEntry {
    path: String,
    low: Option<f64>,
    high: Option<f64>,
    #[serde(default)]
    scale: Scale,
    values: Option<Vec<toml::Value>>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Scale {
    #[default]
    Linear,
    Log,
}

#[derive(Debug, Clone, PartialEq)]
enum Domain {
    Between { low: f64, high: f64, scale: Scale, is_whole: bool },
    Among(Vec<toml::Value>),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parameter {
    /// Dotted, as in a profile file.
    pub(crate) path: String,
    domain: Domain,
}

#[derive(Debug)]
pub(crate) struct Space {
    pub(crate) base: Profile,
    pub(crate) objective: Objective,
    pub(crate) parameters: Vec<Parameter>,
}

/// One point: a profile, and where it is in the unit cube of the parameters.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Setting {
    pub(crate) profile: Profile,
    pub(crate) place: Vec<f64>,
    /// Where it comes from, for the table.
    pub(crate) origin: String,
}

impl Space {
    /// Reads the file and checks that the ends of every parameter make a profile. Errors name file and field.
    pub(crate) fn read(path: &Path) -> anyhow::Result<Self> {
        let file = read_toml(path)?;
        Self::new(file, path.parent().unwrap_or(Path::new(""))).with_context(|| path.display().to_string())
    }

    fn new(file: SpaceFile, folder: &Path) -> anyhow::Result<Self> {
        let base = base(&file.base, folder).context("base")?;
        if file.parameters.is_empty() || file.parameters.len() > PARAMETERS_MOST {
            bail!("parameters: must be 1 to {PARAMETERS_MOST}, found {}", file.parameters.len());
        }
        let table = toml::Table::try_from(&base)?;
        let mut space = Self { base, objective: file.objective, parameters: Vec::new() };
        for entry in file.parameters {
            let path = entry.path.clone();
            let parameter = parameter(entry, &table).with_context(|| format!("parameters: `{path}`"))?;
            for place in parameter.extremes() {
                changed(&space.base, &parameter, place).with_context(|| format!("parameters: `{path}`"))?;
            }
            space.parameters.push(parameter);
        }
        Ok(space)
    }

    pub(crate) fn base(&self) -> anyhow::Result<Setting> {
        let table = toml::Table::try_from(&self.base)?;
        let place = self.parameters.iter().map(|p| p.place(at(&table, &p.path))).collect();
        Ok(Setting { profile: self.base.clone(), place, origin: "base".into() })
    }

    /// `count` points spread evenly: Halton's sequence, shifted as a whole by `seed`.
    pub(crate) fn sample(&self, count: u32, seed: u64) -> anyhow::Result<Vec<Setting>> {
        let mut rng = rng(seed, 0);
        let shifts: Vec<f64> = self.parameters.iter().map(|_| uniform(&mut rng)).collect();
        let point = |index: u32| -> anyhow::Result<Setting> {
            let mut setting = self.base()?;
            for (i, shift) in shifts.iter().enumerate() {
                let place = (radical_inverse(index, PRIMES[i]) + shift).fract();
                setting = self.moved(&setting, i, place)?;
            }
            Ok(Setting { origin: format!("sample {index}"), ..setting })
        };
        (1..=count).map(point).collect()
    }

    /// `setting` with one parameter at another place, 0 to 1.
    pub(crate) fn moved(&self, setting: &Setting, index: usize, place: f64) -> anyhow::Result<Setting> {
        let parameter = &self.parameters[index];
        let mut moved = setting.clone();
        moved.profile = changed(&setting.profile, parameter, place)?;
        moved.place[index] = place;
        moved.origin = format!("{} {:+.3}", parameter.path, place - setting.place[index]);
        Ok(moved)
    }

    /// The values of a setting's parameters, as they are written in a profile.
    pub(crate) fn values(&self, setting: &Setting) -> anyhow::Result<Vec<String>> {
        let table = toml::Table::try_from(&setting.profile)?;
        let value = |p: &Parameter| at(&table, &p.path).map_or_else(String::new, ToString::to_string);
        Ok(self.parameters.iter().map(value).collect())
    }
}

/// One base for each parameter.
const PRIMES: [u32; PARAMETERS_MOST] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53];

/// The digits of `index` mirrored at the point (van der Corput).
fn radical_inverse(mut index: u32, base: u32) -> f64 {
    let mut value = 0.0;
    let mut weight = 1.0 / f64::from(base);
    while index > 0 {
        value += weight * f64::from(index % base);
        weight /= f64::from(base);
        index /= base;
    }
    value
}

/// A built-in profile, or a file beside the space's.
fn base(name: &str, folder: &Path) -> anyhow::Result<Profile> {
    let beside = || folder.join(name).to_string_lossy().into_owned();
    read_profile(&Profile::builtin(name).map_or_else(beside, |_| name.to_owned()))
}

fn parameter(entry: ParameterEntry, profile: &toml::Table) -> anyhow::Result<Parameter> {
    let found = at(profile, &entry.path).context("is not a field of the base profile")?;
    let domain = match (entry.low, entry.high, entry.values) {
        (Some(low), Some(high), None) => {
            if !found.is_integer() && !found.is_float() {
                bail!("is not a number; give `values`");
            }
            let is_log = entry.scale == Scale::Log;
            if !(low.is_finite() && high.is_finite() && low < high) || (is_log && low <= 0.0) {
                bail!("needs low < high, and low > 0 on a log scale");
            }
            Domain::Between { low, high, scale: entry.scale, is_whole: found.is_integer() }
        }
        (None, None, Some(values)) if values.len() >= 2 => Domain::Among(values),
        _ => bail!("needs either `low` and `high`, or `values` with two or more"),
    };
    Ok(Parameter { path: entry.path, domain })
}

impl Parameter {
    fn value(&self, place: f64) -> toml::Value {
        let place = place.clamp(0.0, 1.0);
        match &self.domain {
            Domain::Among(values) => {
                values[((place * values.len() as f64) as usize).min(values.len() - 1)].clone()
            }
            Domain::Between { low, high, scale, is_whole } => {
                let value = match scale {
                    Scale::Linear => low + place * (high - low),
                    Scale::Log => low * (high / low).powf(place),
                };
                // Four digits are enough for a setting, and people read them.
                if *is_whole {
                    toml::Value::Integer(value.round() as i64)
                } else {
                    toml::Value::Float(four_digits(value))
                }
            }
        }
    }

    /// Places that show whether every value is allowed: both ends, or all of a list.
    fn extremes(&self) -> Vec<f64> {
        match &self.domain {
            Domain::Between { .. } => vec![0.0, 1.0],
            Domain::Among(values) => {
                (0..values.len()).map(|k| (k as f64 + 0.5) / values.len() as f64).collect()
            }
        }
    }

    /// Where a value is between the ends; the middle for what is not in the list.
    fn place(&self, value: Option<&toml::Value>) -> f64 {
        match &self.domain {
            Domain::Among(values) => values
                .iter()
                .position(|v| Some(v) == value)
                .map_or(0.5, |index| (index as f64 + 0.5) / values.len() as f64),
            Domain::Between { low, high, scale, .. } => {
                let number = value.and_then(|v| v.as_float().or_else(|| v.as_integer().map(|i| i as f64)));
                let place = match (number, scale) {
                    (None, _) => 0.5,
                    (Some(v), Scale::Linear) => (v - low) / (high - low),
                    (Some(v), Scale::Log) => (v.max(*low) / low).ln() / (high / low).ln(),
                };
                place.clamp(0.0, 1.0)
            }
        }
    }

    /// The least step, as a part of the unit length, that changes the value.
    pub(crate) fn least_step(&self) -> f64 {
        match &self.domain {
            Domain::Among(values) => 1.0 / values.len() as f64,
            Domain::Between { low, high, is_whole: true, scale: Scale::Linear } => 1.0 / (high - low),
            Domain::Between { .. } => 0.0,
        }
    }
}

fn four_digits(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

fn at<'a>(table: &'a toml::Table, path: &str) -> Option<&'a toml::Value> {
    let mut keys = path.split('.');
    let mut value = table.get(keys.next()?)?;
    for key in keys {
        value = value.as_table()?.get(key)?;
    }
    Some(value)
}

/// `profile` with one field at a place between the ends of its parameter.
fn changed(profile: &Profile, parameter: &Parameter, place: f64) -> anyhow::Result<Profile> {
    Ok(profile.with_overrides(&only(&parameter.path, parameter.value(place)))?)
}

/// A profile file with nothing but one field.
fn only(path: &str, value: toml::Value) -> toml::Table {
    let mut keys = path.rsplit('.');
    let last = keys.next().unwrap_or_default();
    let table = toml::Table::from_iter([(last.to_owned(), value)]);
    keys.fold(table, |table, key| toml::Table::from_iter([(key.to_owned(), toml::Value::Table(table))]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "base = \"curiosity\"\n[[parameters]]\npath = \"terms.cnc.weight\"\nlow = 0.1\nhigh = 10.0\nscale = \"log\"\n\
        [[parameters]]\npath = \"steps\"\nlow = 10\nhigh = 16\n[[parameters]]\npath = \"normalisation\"\nvalues = [\"fixed\", \"min-max\"]\n";

    fn space(text: &str) -> anyhow::Result<Space> {
        Space::new(toml::from_str(text)?, Path::new(""))
    }

    #[test]
    fn a_place_becomes_a_value_of_its_field() {
        let space = space(TEXT).unwrap();
        let base = space.base().unwrap();
        // The geometric mean of 0.1 and 10; half way from 10 to 16; the first of two.
        let middle = (0..3).try_fold(base.clone(), |s, i| space.moved(&s, i, [0.5, 0.5, 0.2][i])).unwrap();
        assert_eq!(space.values(&middle).unwrap(), ["1.0", "13", "\"fixed\""]);
        assert_eq!(middle.profile.terms["cnc"].weight, 1.0);
        // A base with weight 1 and 13 steps is there too.
        assert!((base.place[1] - 0.5).abs() < 1e-12 && base.place[2] == 0.25, "{:?}", base.place);
    }

    #[test]
    fn a_sample_is_spread_and_repeats() {
        let space = space(TEXT).unwrap();
        let sample = space.sample(16, 3).unwrap();
        assert_eq!(sample, space.sample(16, 3).unwrap());
        assert_ne!(sample, space.sample(16, 4).unwrap());
        // Base 2: every eighth holds two of sixteen.
        for eighth in 0..8 {
            let within = |s: &&Setting| (s.place[0] * 8.0) as usize == eighth;
            assert!((1..=3).contains(&sample.iter().filter(within).count()));
        }
    }

    #[test]
    fn each_tuned_profile_is_the_built_in_one_but_for_what_its_space_searches() {
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios"));
        // The settings of `curionav` were not found by the tuner.
        for name in Profile::names().filter(|name| *name != "curionav") {
            let space = Space::read(&folder.join(format!("tuning/{name}.toml"))).unwrap();
            let tuned = folder.join(format!("tuned/{name}.toml")).to_string_lossy().into_owned();
            let tuned = read_profile(&tuned).unwrap();
            let [builtin, found] = [&space.base, &tuned].map(|p| toml::Table::try_from(p).unwrap());
            let mut reset = tuned.clone();
            for Parameter { path, domain } in &space.parameters {
                let Domain::Between { low, high, .. } = domain else { panic!("{path}") };
                let value = at(&found, path).unwrap();
                let value = value.as_float().unwrap_or_else(|| value.as_integer().unwrap() as f64);
                assert!((0.999 * low..=1.001 * high).contains(&value), "{name}: {path} = {value}");
                reset = reset.with_overrides(&only(path, at(&builtin, path).unwrap().clone())).unwrap();
            }
            assert_eq!(reset, space.base, "{name}");
        }
    }

    #[test]
    fn a_mistake_is_named() {
        let wrong = |from: &str, to: &str| format!("{:#}", space(&TEXT.replace(from, to)).unwrap_err());
        assert!(wrong("terms.cnc.weight", "terms.abc.weight").contains("`terms.abc.weight`: is not a field"));
        assert!(wrong("low = 0.1", "low = 0.0").contains("low > 0 on a log scale"));
        assert!(wrong("low = 10\n", "").contains("`steps`: needs either"));
        assert!(wrong("low = 10\n", "low = 0\n").contains("steps: is 0; give 1 to 200 states"));
        assert!(
            wrong("\"min-max\"]", "\"min-max\", \"other\", \"fixed\"]").contains("unknown variant `other`")
        );
        assert!(wrong("\"curiosity\"", "\"other\"").contains("unknown planner `other`"));
        assert!(wrong("base", "bass").contains("bass"));
    }
}
