//! Configuration of one service process.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use curionav_schemas::keys;
use serde::{Deserialize, Serialize};

/// How a service reaches the others and what it is called. Read from a TOML file; the command line
/// overrides single fields.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ServiceConfig {
    /// Router endpoints to try in order, e.g. `tcp/10.0.0.1:7447`.
    pub connect: Vec<String>,
    /// A Zenoh configuration file (json5) to start from instead of ours; `connect` is added to it.
    /// Falls back on the environment variable `ZENOH_CONFIG`.
    pub zenoh_config: Option<PathBuf>,
    /// Prefix of every key: several deployments on one network stay apart.
    pub namespace: Option<String>,
    /// Name of this process within its role, `[a-z0-9_-]`, unique; it is part of its keys.
    pub instance: String,
    /// The robot this service works for (localizer, driver, arbiter, simulator).
    pub robot: String,
    /// The simulated world (simulator).
    pub world: String,
    /// Requests computed at once (generator, evaluators).
    pub slots: usize,
    /// Requests that may wait for a slot; further ones are refused as overloaded.
    pub queue: usize,
    /// Whether the arbiter generates and evaluates itself when no replica answers. Without it the robot then
    /// drives the rest of its last trajectory and stops (arbiter).
    pub in_process: bool,
    /// Address for metrics over HTTP, in Prometheus's format; without one there are none.
    pub metrics: Option<SocketAddr>,
    /// How long to keep trying to reach a router before giving up, seconds.
    pub connect_timeout_s: f64,
}

impl Default for ServiceConfig {
    fn default() -> Self {
        Self {
            connect: Vec::new(),
            zenoh_config: None,
            namespace: None,
            instance: "a".into(),
            robot: "robot".into(),
            world: "world".into(),
            slots: 1,
            queue: 16,
            in_process: true,
            metrics: None,
            connect_timeout_s: 10.0,
        }
    }
}

/// One line that names line, column's text and reason of a TOML error.
pub fn describe_toml_error(text: &str, error: &toml::de::Error) -> String {
    let reason = error.message().replace('\n', " ");
    match error.span() {
        Some(span) => {
            let line_number = text[..span.start.min(text.len())].matches('\n').count() + 1;
            let line = text.lines().nth(line_number - 1).unwrap_or("").trim();
            format!("line {line_number} (`{line}`): {reason}")
        }
        None => reason,
    }
}

impl ServiceConfig {
    /// Whether names are fit for keys and numbers make sense.
    pub fn check(&self) -> anyhow::Result<()> {
        for (field, name) in [("instance", &self.instance), ("robot", &self.robot), ("world", &self.world)] {
            keys::check_id(name).context(field)?;
        }
        if self.slots == 0 || self.queue == 0 {
            bail!("slots and queue must be at least 1, found {} and {}", self.slots, self.queue);
        }
        Ok(())
    }

    /// Reads a TOML file; an error names the line, the field and the reason.
    pub fn from_file(path: &Path) -> anyhow::Result<Self> {
        let shown = path.display();
        let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {shown}"))?;
        toml::from_str(&text).map_err(|e| anyhow!("{shown}: {}", describe_toml_error(&text, &e)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_field_is_named_with_its_line() {
        let text = "robot = \"r1\"\nslotz = 2\n";
        let error = toml::from_str::<ServiceConfig>(text).unwrap_err();
        let message = describe_toml_error(text, &error);
        assert!(message.starts_with("line 2") && message.contains("slotz"), "{message}");
    }
}
