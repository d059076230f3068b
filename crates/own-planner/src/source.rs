//! How a planner of one's own is named, and what starts it.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail, ensure};
use curionav_planning::profile::Profile;
use curionav_schemas::hex;
use sha2::{Digest, Sha256};

/// Names the interpreter of planners in Python.
const VARIABLE: &str = "CURIONAV_PYTHON";
/// What a Python file is run by.
const HOST: &str = "curionav.planner_host";

/// Where a planner comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// A name in a Python file: `mine.py:policy`.
    Python {
        /// The file.
        file: PathBuf,
        /// What the file calls the planner.
        name: String,
    },
    /// A program that speaks the protocol: `./planner`.
    Program(PathBuf),
}

impl Source {
    /// The planner that `text` names; nothing if it has neither the form of a Python file nor that of a path to a
    /// program, and is a profile.
    ///
    /// # Errors
    /// There is no such file, or a Python file comes without the planner's name.
    pub fn parse(text: &str) -> anyhow::Result<Option<Self>> {
        if has_ending(text, "py") {
            bail!("`{text}` is a Python file; name the planner in it too, such as `{text}:policy`");
        }
        if let Some((path, name)) = text.rsplit_once(':').filter(|(path, _)| has_ending(path, "py")) {
            let file = PathBuf::from(path);
            ensure!(file.is_file(), "`{text}`: there is no file {path}");
            ensure!(!name.is_empty(), "`{text}`: name the planner after the colon, such as `{path}:policy`");
            return Ok(Some(Self::Python { file, name: name.to_owned() }));
        }
        let path = Path::new(text);
        if has_ending(text, "toml") || Profile::builtin(text).is_some() {
            return Ok(None);
        }
        if path.is_file() {
            return Ok(Some(Self::Program(path.to_owned())));
        }
        ensure!(!text.contains('/'), "there is no program `{text}`");
        Ok(None)
    }

    /// The file that has the planner.
    pub fn file(&self) -> &Path {
        match self {
            Self::Python { file, .. } | Self::Program(file) => file,
        }
    }

    /// A digest of that file: results of another content are those of another planner. What the file imports is not
    /// part of it.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn digest(&self) -> anyhow::Result<String> {
        let file = self.file();
        let bytes = std::fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
        Ok(hex(&Sha256::digest(bytes)[..8]))
    }

    /// What starts it.
    pub(crate) fn command(&self) -> anyhow::Result<Command> {
        let file = self.file();
        // A name without a directory would be looked for among the system's programs.
        let path = std::path::absolute(file).with_context(|| format!("the path of {}", file.display()))?;
        Ok(match self {
            Self::Python { name, .. } => {
                let mut command = Command::new(python());
                command.args(["-m", HOST]).arg(path).arg(name);
                command
            }
            Self::Program(_) => Command::new(path),
        })
    }

    /// What to do if it does not start.
    pub(crate) fn mend(&self) -> String {
        match self {
            Self::Python { .. } => {
                let python = python();
                let python = python.to_string_lossy();
                format!(
                    "it is run by `{python} -m {HOST}`: `{python} -m pip install ./python` installs that, and \
                     {VARIABLE} names another interpreter"
                )
            }
            Self::Program(path) => {
                format!(
                    "{} has to be a program that answers `hello` (docs/own-planner.md), or name a profile",
                    path.display()
                )
            }
        }
    }
}

fn python() -> OsString {
    std::env::var_os(VARIABLE).unwrap_or_else(|| "python3".into())
}

fn has_ending(path: &str, ending: &str) -> bool {
    Path::new(path).extension().is_some_and(|found| found == ending)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_planner_is_a_name_in_a_python_file_or_a_program() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
        for name in ["mine.py", "planner", "mine.toml"] {
            std::fs::write(at(name), "").unwrap();
        }
        let named = Source::parse(&format!("{}:policy", at("mine.py"))).unwrap();
        assert_eq!(named, Some(Source::Python { file: at("mine.py").into(), name: "policy".into() }));
        assert_eq!(Source::parse(&at("planner")).unwrap(), Some(Source::Program(at("planner").into())));
        for profile in ["curionav", &at("mine.toml")] {
            assert_eq!(Source::parse(profile).unwrap(), None, "{profile}");
        }
        let refused = |text: &str| Source::parse(text).unwrap_err().to_string();
        assert!(refused(&at("mine.py")).contains("name the planner in it too"));
        assert!(refused(&format!("{}:", at("mine.py"))).contains("after the colon"));
        assert!(refused("other.py:policy").contains("there is no file other.py"));
        assert!(refused("./nothing").contains("there is no program"));
    }
}
