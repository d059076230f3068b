//! What a planner of one's own says of itself, and the profile that is made of it.

use std::collections::BTreeMap;
use std::time::Duration;

use anyhow::{Context, bail, ensure};
use curionav_planning::generation::own::PREFIX;
use curionav_planning::profile::{Profile, Term};
use curionav_schemas::keys::check_id;
use serde::{Deserialize, Serialize};

use crate::source::Source;

/// What checks what such a planner proposes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Check {
    /// The arbiter, as it checks what built-in generators offer; then the driver.
    #[default]
    Arbiter,
    /// The driver alone, which brakes for what the laser sees.
    Driver,
}

impl Check {
    /// The word for it in tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Arbiter => "arbiter",
            Self::Driver => "driver",
        }
    }
}

/// What a planner answers to `hello`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Its name in results.
    pub name: String,
    /// What checks what it proposes.
    #[serde(default)]
    pub check: Check,
    /// The built-in profile whose terms choose among its candidates. Without one its first choice is taken that passes
    /// the check.
    #[serde(default)]
    pub profile: Option<String>,
    /// Whether it is told the newest scan.
    #[serde(default)]
    pub scan: bool,
    /// Whether it is sent the cells of maps.
    #[serde(default)]
    pub map: bool,
    /// How long it may take for an answer, seconds.
    #[serde(default = "Description::most_within")]
    pub answer_within_s: f64,
}

impl Description {
    /// As long as a stage of a cycle may take in lockstep, seconds.
    fn most_within() -> f64 {
        10.0
    }

    /// Refuses what cannot be used.
    pub(crate) fn check(&self) -> anyhow::Result<()> {
        check_id(&self.generator()).with_context(|| format!("name: is `{}`", self.name))?;
        ensure!(
            Profile::builtin(&self.name).is_none(),
            "name: `{}` is a built-in planner; choose another name",
            self.name
        );
        let most = Self::most_within();
        let within = self.answer_within_s;
        ensure!(
            (0.001..=most).contains(&within),
            "answer_within_s: is {within}; give 0.001 to {most} seconds"
        );
        if let Some(base) = self.profile.as_deref().filter(|base| Profile::builtin(base).is_none()) {
            let known: Vec<&str> = Profile::names().collect();
            bail!("profile: `{base}` is unknown; use one of {}", known.join(", "));
        }
        Ok(())
    }

    /// The generator of its profile, and the role of the services that serve it.
    pub fn generator(&self) -> String {
        format!("{PREFIX}{}", self.name)
    }

    /// How long an answer may take.
    pub(crate) fn limit(&self) -> Duration {
        Duration::from_secs_f64(self.answer_within_s)
    }

    /// The profile that plans with it. The description has a digest of the file, so that a changed planner is another.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn profile(&self, source: &Source) -> anyhow::Result<Profile> {
        let mut profile = self.profile.as_deref().and_then(Profile::builtin).unwrap_or_else(first_choice);
        profile.generator = self.generator();
        profile.trees = 1;
        profile.collision.final_check = self.check == Check::Arbiter;
        let file = source.file().file_name().unwrap_or_default().to_string_lossy();
        profile.description = format!("A planner of one's own, of {file} {}.", source.digest()?);
        profile.name.clone_from(&self.name);
        Ok(profile)
    }
}

/// A profile that takes the first candidate which passes the check, also if it is slow: as those of `dwa` and `mppi`.
fn first_choice() -> Profile {
    let mut profile = Profile::default();
    profile.min_speed = 0.0;
    profile.terms = BTreeMap::from([("order".to_owned(), Term::new(1.0, 1.0))]);
    profile
}

#[cfg(test)]
mod tests {
    use curionav_planning::parameters::Ranged;

    use super::*;

    fn described(json: &str) -> Description {
        serde_json::from_str(json).unwrap()
    }

    #[test]
    fn the_profile_names_the_planner_and_the_file_that_it_is_of() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("mine");
        std::fs::write(&file, "1").unwrap();
        let source = Source::Program(file.clone());
        let description = described(r#"{"name": "mine", "check": "driver"}"#);
        description.check().unwrap();
        let profile = description.profile(&source).unwrap();
        profile.check().unwrap();
        assert_eq!((profile.generator.as_str(), profile.trees), ("own-mine", 1));
        assert!(!profile.collision.final_check);
        assert_eq!(profile.iterations(), 1);
        std::fs::write(&file, "2").unwrap();
        assert_ne!(description.profile(&source).unwrap(), profile);
        let of_terms = described(r#"{"name": "mine", "profile": "curionav"}"#).profile(&source).unwrap();
        assert_eq!(of_terms.terms, Profile::builtin("curionav").unwrap().terms);
        assert!(of_terms.collision.final_check);
    }

    #[test]
    fn its_generator_is_a_role_that_generates() {
        let role = described(r#"{"name": "mine"}"#).generator();
        assert!(
            curionav_planning::generation::own::is_own(&role) && curionav_schemas::keys::generates(&role)
        );
    }

    #[test]
    fn what_cannot_be_used_is_named() {
        let refused = |json: &str| format!("{:#}", described(json).check().unwrap_err());
        assert!(refused(r#"{"name": "My planner"}"#).starts_with("name: is `My planner`"));
        assert!(refused(r#"{"name": "dwa"}"#).contains("is a built-in planner"));
        assert!(refused(r#"{"name": "a", "answer_within_s": 0.0}"#).starts_with("answer_within_s: is 0"));
        assert!(refused(r#"{"name": "a", "profile": "b"}"#).starts_with("profile: `b` is unknown"));
    }
}
