//! The file that `curionav up` reads.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use curionav_deployment::service_kind::Kind;
use curionav_runtime::config::{ServiceConfig, read_toml};
use serde::Deserialize;

/// What `curionav up` starts. All fields have defaults: an empty file is one of everything.
#[derive(Debug, Clone, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Deployment {
    /// Robot name, part of every robot key.
    pub(super) robot: String,
    /// World name of the simulator.
    pub(super) world: String,
    /// Prefix of every key.
    pub(super) namespace: Option<String>,
    /// TCP port of the router on 127.0.0.1; 0 takes a free one.
    pub(super) port: u16,
    /// First of consecutive TCP ports on 127.0.0.1 for the metrics of each service; 0 takes free ones.
    pub(super) metrics_port: Option<u16>,
    /// The driver's configuration file, with the robot's own limits; beside the deployment file if it is relative. A
    /// deployment with a simulator needs none.
    driver_config: Option<PathBuf>,
    /// Configuration file of the gateway to a robot of ROS 2, which is then started; beside the deployment file if it
    /// is relative. The driver has the same file unless `driver_config` names another.
    ros2_config: Option<PathBuf>,
    /// How many processes of each kind.
    pub(super) replicas: Replicas,
    /// Restarts of one process within a minute; it then rests until one of them is a minute ago.
    pub(super) max_restarts_per_minute: usize,
}

/// Processes per kind; tracker and simulator may be 0 (a robot that has its own) or 1, the evaluator of a term that the
/// default planner lacks 0 to 64, the others 1 to 64.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Replicas {
    pub(super) generator: usize,
    pub(super) cpc: usize,
    pub(super) cpc_occluded: usize,
    pub(super) cnc: usize,
    pub(super) tracker: usize,
    pub(super) simulator: usize,
}

impl Default for Replicas {
    fn default() -> Self {
        Self { generator: 1, cpc: 1, cpc_occluded: 0, cnc: 1, tracker: 1, simulator: 1 }
    }
}

impl Replicas {
    fn of(&self, kind: Kind) -> usize {
        match kind {
            Kind::Generator => self.generator,
            Kind::Cpc => self.cpc,
            Kind::CpcOccluded => self.cpc_occluded,
            Kind::Cnc => self.cnc,
            Kind::Tracker => self.tracker,
            Kind::Simulator => self.simulator,
            // They belong to the one robot; whether there is a gateway, its file says.
            Kind::Driver | Kind::Localizer | Kind::Arbiter | Kind::Ros2Gateway => 1,
        }
    }
}

impl Default for Deployment {
    fn default() -> Self {
        Self {
            robot: "robot".into(),
            world: "world".into(),
            namespace: None,
            port: 7447,
            metrics_port: None,
            driver_config: None,
            ros2_config: None,
            replicas: Replicas::default(),
            max_restarts_per_minute: 5,
        }
    }
}

impl Deployment {
    pub(super) fn from_file(path: &Path) -> anyhow::Result<Self> {
        let mut deployment: Self = read_toml(path)?;
        let beside = path.parent().unwrap_or(Path::new(""));
        deployment.driver_config = deployment.driver_config.map(|file| beside.join(file));
        deployment.ros2_config = deployment.ros2_config.map(|file| beside.join(file));
        deployment.check().with_context(|| path.display().to_string())?;
        Ok(deployment)
    }

    fn check(&self) -> anyhow::Result<()> {
        let Self { robot, world, namespace, .. } = self.clone();
        ServiceConfig { robot, world, namespace, ..ServiceConfig::default() }.check()?;
        for &kind in Kind::ALL {
            let (least, most) = match kind {
                Kind::Tracker | Kind::Simulator => (0, 1),
                Kind::CpcOccluded => (0, 64),
                _ => (1, 64),
            };
            let field = kind.name();
            let count = self.replicas.of(kind);
            let is_allowed = (least..=most).contains(&count);
            ensure!(is_allowed, "replicas.{field}: is {count}; give {least} to {most}");
        }
        ensure!(
            self.driver_config.is_some() || self.ros2_config.is_some() || self.replicas.simulator == 1,
            "driver_config: is missing; without a simulator the base is a real one: name the driver's configuration \
             file, which says the robot's own limits (or `simulated_base = true` for a simulator elsewhere)"
        );
        ensure!(
            self.ros2_config.is_none() || self.replicas.simulator == 0,
            "replicas.simulator: is 1, and ros2_config names another base; give 0"
        );
        Ok(())
    }

    /// What tells the driver which base it commands, and the gateway which robot it joins.
    pub(super) fn file_arguments(&self, kind: Kind) -> Vec<String> {
        let file = match kind {
            Kind::Driver => self.driver_config.as_ref().or(self.ros2_config.as_ref()),
            Kind::Ros2Gateway => self.ros2_config.as_ref(),
            _ => return Vec::new(),
        };
        match file {
            Some(file) => vec!["--config".into(), file.display().to_string()],
            None if kind == Kind::Driver => vec!["--simulated-base".into()],
            None => Vec::new(),
        }
    }

    /// Kind and instance of every service process.
    pub(super) fn processes(&self) -> impl Iterator<Item = (Kind, String)> {
        let has_gateway = self.ros2_config.is_some();
        let kinds = Kind::ALL.iter().copied().filter(move |kind| has_gateway || *kind != Kind::Ros2Gateway);
        kinds
            .flat_map(|kind| (0..self.replicas.of(kind)).map(move |i| (kind, format!("{}-{i}", kind.name()))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_deployment_is_refused_by_field_with_the_range() {
        for (text, fault) in [
            ("replicas.simulator = 2", "replicas.simulator: is 2; give 0 to 1"),
            ("replicas.cpc-occluded = 65", "replicas.cpc-occluded: is 65; give 0 to 64"),
            ("replicas.cnc = 65", "replicas.cnc: is 65; give 1 to 64"),
            (
                "replicas.simulator = 0",
                "driver_config: is missing; without a simulator the base is a real one: name the driver's \
                 configuration file, which says the robot's own limits (or `simulated_base = true` for a simulator \
                 elsewhere)",
            ),
            (
                "ros2_config = \"r1.toml\"",
                "replicas.simulator: is 1, and ros2_config names another base; give 0",
            ),
            ("robot = \"A B\"", "robot: name `A B` must be 1 to 64 of the characters a-z, 0-9, `_` and `-`"),
        ] {
            let deployment: Deployment = toml::from_str(text).unwrap();
            assert_eq!(format!("{:#}", deployment.check().unwrap_err()), fault);
        }
    }
}
