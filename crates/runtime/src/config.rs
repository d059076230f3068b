//! Configuration of one service process.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use curionav_planning::parameters::Ranged;
use curionav_planning::text::text;
use curionav_schemas::keys;
use curionav_security::name::Name;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::endpoint::{Purpose, check_endpoint, check_namespace};
use crate::guard_settings::{GuardSettings, Zone, check_zones};
use crate::robot_limits::{Base, RobotLimits};
use crate::scanner_limits::ScannerLimits;

/// Most slots of one replica: more than machines have cores.
pub const SLOTS_MAX: u32 = 1024;
/// Far more questions than are answered before their budgets end.
const QUEUE_MAX: usize = 65_536;
/// As good as for ever, and within what a clock can count.
const CONNECT_TIMEOUT_MAX_S: f64 = 1e9;

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
    /// A folder of certificates, as `curionav secure` makes it: every link is then over TLS with both certificates.
    pub secure: Option<PathBuf>,
    /// The certificates that it may show, the first that is in the folder. Not part of a file: a service's is named
    /// by role, robot, world and instance.
    #[serde(skip)]
    pub certificates: Vec<Name>,
    /// Prefix of every key: several deployments on one network stay apart.
    pub namespace: Option<String>,
    /// Name of this process within its role, `[a-z0-9_-]`, unique; it is part of its keys.
    pub instance: String,
    /// The robot this service works for (localizer, driver, arbiter, simulator).
    pub robot: String,
    /// The simulated world (simulator).
    pub world: String,
    /// A planner of one's own that is served in the place of the built-in generators: `FILE.py:NAME` or a program. Not
    /// part of a file: `curionav planner` says it.
    #[serde(skip)]
    pub planner: Option<String>,
    /// Requests computed at once (generator, evaluators).
    pub slots: usize,
    /// Requests that may wait for a slot; further ones are refused as overloaded.
    pub queue: usize,
    /// Whether the arbiter generates and evaluates itself when no replica answers. Without it the robot then
    /// drives the rest of its last trajectory and stops (arbiter).
    pub in_process: bool,
    /// Whether the services of this process take turns, as in a simulated run in lockstep. The arbiter then computes
    /// itself all that it can, because to ask another service and to copy its answer would take longer. Not part of a
    /// file.
    #[serde(skip)]
    pub takes_turns: bool,
    /// What the robot can do, and what no mission can widen (driver).
    pub limits: Option<RobotLimits>,
    /// What the robot's laser sees at least (driver, ros2-gateway).
    pub scanner: Option<ScannerLimits>,
    /// A file in which the localizer keeps where the robot was last sure to be, beside this one unless its path is
    /// absolute. A localizer that is started again in mid-run goes on from there in doubt, and a gateway that is
    /// started begins there (localizer, ros2-gateway).
    pub keep_pose: Option<PathBuf>,
    /// Whether the base is a simulated one, which can do whatever its scenario says and has no limits of its own
    /// (driver).
    pub simulated_base: bool,
    /// Whether a driver that already drives the robot is asked to go first (driver). Not part of a file: a driver that
    /// is started again by itself must not take the robot from another.
    #[serde(skip)]
    pub take_over: bool,
    /// How the guard judges commands (driver).
    pub guard: GuardSettings,
    /// Where something stops or slows the robot (driver).
    pub zones: Vec<Zone>,
    /// How a robot of ROS 2 is met: the gateway reads it (ros2-gateway).
    pub ros2: Option<toml::Table>,
    /// The directory of the file that this was read from; files that it names lie beside it. Not part of the file.
    #[serde(skip)]
    pub directory: Option<PathBuf>,
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
            secure: None,
            certificates: Vec::new(),
            namespace: None,
            instance: "a".into(),
            robot: "robot".into(),
            world: "world".into(),
            planner: None,
            slots: 1,
            queue: 16,
            in_process: true,
            takes_turns: false,
            limits: None,
            scanner: None,
            keep_pose: None,
            simulated_base: false,
            take_over: false,
            guard: GuardSettings::default(),
            zones: Vec::new(),
            ros2: None,
            directory: None,
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

/// What a TOML file says; an error names the file, the line, the field and the reason.
pub fn read_toml<T: DeserializeOwned>(path: &Path) -> anyhow::Result<T> {
    let shown = path.display();
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {shown}"))?;
    let text = text(&bytes).map_err(|error| anyhow!("{shown} {error}"))?;
    toml::from_str(text).map_err(|e| anyhow!("{shown}: {}", describe_toml_error(text, &e)))
}

impl ServiceConfig {
    /// Whether names are fit for keys and numbers make sense.
    pub fn check(&self) -> anyhow::Result<()> {
        for (field, name) in [("instance", &self.instance), ("robot", &self.robot), ("world", &self.world)] {
            keys::check_id(name).context(field)?;
        }
        for endpoint in &self.connect {
            check_endpoint(endpoint, Purpose::Connect).context("connect")?;
        }
        if let Some(namespace) = &self.namespace {
            check_namespace(namespace).context("namespace")?;
        }
        let numbers = [
            ("slots", self.slots as f64, 1.0, f64::from(SLOTS_MAX)),
            ("queue", self.queue as f64, 1.0, QUEUE_MAX as f64),
            ("connect_timeout_s", self.connect_timeout_s, 0.1, CONNECT_TIMEOUT_MAX_S),
        ];
        for (field, number, least, most) in numbers {
            if !(least..=most).contains(&number) {
                bail!("{field}: is {number}; give {least} to {most}");
            }
        }
        if let Some(limits) = &self.limits {
            limits.check().map_err(|fault| anyhow!("{}", fault.below("limits")))?;
        }
        if let Some(scanner) = &self.scanner {
            scanner.check().map_err(|fault| anyhow!("{}", fault.below("scanner")))?;
            if self.simulated_base {
                bail!(
                    "scanner: is given, but the base is simulated, whose laser is that of the scenario; leave it out"
                );
            }
        }
        self.guard.check().map_err(|fault| anyhow!("{}", fault.below("guard")))?;
        let radius = self.limits.as_ref().map(|limits| limits.radius);
        check_zones(&self.zones, radius).map_err(|fault| anyhow!("{fault}"))?;
        Ok(())
    }

    /// The file in which the pose is kept, if any.
    pub fn kept_pose(&self) -> Option<PathBuf> {
        let directory = self.directory.clone().unwrap_or_default();
        self.keep_pose.as_ref().map(|file| directory.join(file))
    }

    /// The name under which the service `role` of this configuration commands others: that of its certificate, whether
    /// it shows one or not.
    pub fn identity(&self, role: &str) -> anyhow::Result<String> {
        Ok(Name::of_service(role, &self.robot, &self.world, &self.instance)?.to_string())
    }

    /// Whether the time of the robot is that of a simulation, which may pass at any speed: `ros2.use_sim_time`.
    pub fn has_simulated_time(&self) -> bool {
        let said = self.ros2.as_ref().and_then(|ros2| ros2.get("use_sim_time"));
        self.simulated_base || said.and_then(toml::Value::as_bool) == Some(true)
    }

    /// Refuses the default name for a robot with a real base: two of them on one network would be taken for each other.
    pub fn check_real_name(&self) -> anyhow::Result<()> {
        if self.robot == Self::default().robot {
            bail!(
                "robot: is `{}`, the name of simulated robots; give this one a name of its own with \
                 `robot = \"r1\"` or --robot r1",
                self.robot
            );
        }
        Ok(())
    }

    /// What the driver commands. A real base without limits is never assumed: one of the two has to be said.
    pub fn base(&self) -> anyhow::Result<Base> {
        match (&self.limits, self.simulated_base) {
            (Some(limits), false) => Ok(Base::Real(limits.clone())),
            (None, true) => Ok(Base::Simulated),
            (Some(_), true) => bail!(
                "simulated_base: is true, and [limits] are given; a simulated base can do whatever its scenario \
                 says, so leave one of them out"
            ),
            (None, false) => bail!(
                "limits: are missing; give the robot's own limits in a table [limits], as deploy/service.toml shows, \
                 or say `simulated_base = true` or `--simulated-base` if the base is simulated"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_out_of_its_range_is_named_with_the_range() {
        for (line, named) in [
            ("connect_timeout_s = inf", "connect_timeout_s: is inf; give 0.1 to 1000000000"),
            ("connect_timeout_s = nan", "connect_timeout_s: is NaN; give 0.1 to 1000000000"),
            ("slots = 0", "slots: is 0; give 1 to 1024"),
            ("queue = 1000000", "queue: is 1000000; give 1 to 65536"),
        ] {
            let config: ServiceConfig = toml::from_str(line).unwrap();
            assert_eq!(config.check().unwrap_err().to_string(), named);
        }
    }

    #[test]
    fn a_driver_without_limits_has_to_say_that_its_base_is_simulated() {
        let base = |text: &str| toml::from_str::<ServiceConfig>(text).unwrap().base();
        let limits = "limits = { v_max = 1.0, a_max = 0.5, omega_max = 1.0, alpha_max = 1.0, radius = 0.3, \
                      tick_s = 0.1 }";
        assert!(matches!(base(limits).unwrap(), Base::Real(own) if own.decision_age_max == 0.6));
        assert_eq!(base("simulated_base = true").unwrap(), Base::Simulated);
        assert!(base("").unwrap_err().to_string().starts_with("limits: are missing; give"));
        let both = format!("simulated_base = true\n{limits}");
        assert!(base(&both).unwrap_err().to_string().starts_with("simulated_base: is true, and"));
        let wrong = limits.replace("radius = 0.3", "radius = 0.0");
        let error = toml::from_str::<ServiceConfig>(&wrong).unwrap().check().unwrap_err();
        assert!(error.to_string().starts_with("limits.radius: is 0"), "{error}");
    }

    #[test]
    fn what_a_scanner_should_see_is_within_reason_and_of_a_real_robot() {
        let said =
            |text: &str| toml::from_str::<ServiceConfig>(text).unwrap().check().unwrap_err().to_string();
        assert!(said("[scanner]\nfov = 180.0").starts_with("scanner.fov: is 180"));
        assert!(said("simulated_base = true\n[scanner]").starts_with("scanner: is given, but"));
        let config: ServiceConfig = toml::from_str("[scanner]\nvalid_share = 0.2").unwrap();
        assert_eq!(config.scanner.unwrap(), ScannerLimits { valid_share: 0.2, ..ScannerLimits::default() });
    }

    #[test]
    fn guard_and_zones_are_checked_at_the_start() {
        let fault =
            |text: &str| toml::from_str::<ServiceConfig>(text).unwrap().check().unwrap_err().to_string();
        assert!(fault("guard.braking_share = 1.2").starts_with("guard.braking_share: is 1.2; give 0.3 to 1"));
        let slow = "[[zones]]\nname = \"front\"\nkind = \"slow\"\n\
                    vertices = [{x = 0.0, y = 0.0}, {x = 1.0, y = 0.0}, {x = 1.0, y = 1.0}]";
        assert!(fault(slow).starts_with("zones[0].speed: is missing; give"));
        let good: ServiceConfig = toml::from_str(&format!("{slow}\nspeed = 0.3")).unwrap();
        assert!(good.check().is_ok() && good.zones[0].points == 4);
    }

    #[test]
    fn an_unknown_field_is_named_with_its_line() {
        let text = "robot = \"r1\"\nslotz = 2\n";
        let error = toml::from_str::<ServiceConfig>(text).unwrap_err();
        let message = describe_toml_error(text, &error);
        assert!(message.starts_with("line 2") && message.contains("slotz"), "{message}");
    }
}
