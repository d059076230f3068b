//! How commands reach a deployment.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::Args;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::exit::Exit;
use curionav_runtime::process::default_endpoint;
use curionav_runtime::secure;
use curionav_runtime::session;
use curionav_schemas::ServiceStatus;
use curionav_schemas::keys::check_id;
use curionav_security::folder::Folder;
use curionav_security::name::{ALL_ROBOTS, Name, NameError};
use curionav_security::table::Verb;
use zenoh::Session;

/// The certificates that suffice for looking, the least first.
pub(crate) const LOOKS: [&str; 3] = ["viewer", "operator", "experimenter"];
/// Those that suffice for commanding a robot.
pub(crate) const OPERATES: [&str; 2] = ["operator", "experimenter"];
/// Those that suffice for looking for faults.
pub(crate) const EXAMINES: [&str; 1] = ["operator"];
/// Those that suffice for running a scenario.
pub(crate) const EXPERIMENTS: [&str; 1] = ["experimenter"];

/// The certificates of a folder that a command about `robot` may show, the one with the fewest rights first: those that
/// list the robot, then those for the whole deployment. One that lists other robots is better than none, as it says so.
fn names(folder: &Folder, suffice: &[&str], robot: Option<&str>) -> Result<Vec<Name>, NameError> {
    let listing = suffice.iter().flat_map(|role| folder.that_list_robots(role));
    let (mut names, others): (Vec<Name>, Vec<Name>) =
        listing.partition(|name| robot.is_some_and(|robot| !name.leaves_out(robot)));
    for role in suffice {
        names.push(role.parse()?);
    }
    names.extend(others);
    Ok(names)
}

/// The name of the certificate that a program with this configuration shows.
fn shown(config: &ServiceConfig) -> Option<Name> {
    config.secure.as_ref().and_then(|folder| secure::shown(folder, &config.certificates))
}

/// The robots that the certificate of this configuration is for; none if it is for the whole deployment.
pub(crate) fn robots_of(config: &ServiceConfig) -> Vec<String> {
    let listed = shown(config).map_or(Vec::new(), |name| name.robots().to_vec());
    if listed == [ALL_ROBOTS] { Vec::new() } else { listed }
}

/// Whether a service is one of these robots', or of no robot, or if none are listed.
pub(crate) fn is_of(status: Option<&ServiceStatus>, listed: &[String]) -> bool {
    let robot = status.and_then(|status| status.robot.as_ref());
    listed.is_empty() || robot.is_none_or(|robot| listed.contains(robot))
}

/// The name under which a program with this configuration commands: that of its certificate. Without one it says that
/// it is `role`, and who has started it.
pub(crate) fn commands_as(config: &ServiceConfig, role: &str) -> String {
    if let Some(name) = shown(config) {
        return name.to_string();
    }
    let user = std::env::var("USER").ok().filter(|user| check_id(user).is_ok());
    user.map_or_else(|| role.to_owned(), |user| format!("{role}.{user}"))
}

/// Where the deployment is.
#[derive(Debug, Clone, Default, Args)]
pub(crate) struct ConnectOptions {
    /// Router endpoint, e.g. tcp/10.0.0.1:7447. Default: the one in the file that ZENOH_CONFIG names, or else port 7447
    /// of this machine, over TCP, or over TLS with --secure.
    #[arg(long, value_name = "ENDPOINT")]
    pub(crate) connect: Option<String>,
    /// Folder of certificates made by `curionav secure`; connect over TLS only.
    #[arg(long, value_name = "DIR")]
    pub(crate) secure: Option<PathBuf>,
    /// Certificate from that folder to use. Default: the one with the fewest rights that suffice.
    #[arg(long = "as", value_name = "NAME", requires = "secure")]
    pub(crate) certificate: Option<Name>,
    /// Key prefix of the deployment.
    #[arg(long, value_name = "NS")]
    pub(crate) namespace: Option<String>,
}

impl ConnectOptions {
    /// With a certificate of one of these roles, if it is to be secure: for `robot`, if it is about one.
    pub(crate) fn config(&self, suffice: &[&str], robot: Option<&str>) -> Result<ServiceConfig, Exit> {
        let mut config = ServiceConfig {
            connect: self.connect.iter().cloned().collect(),
            namespace: self.namespace.clone(),
            secure: self.secure.clone(),
            ..ServiceConfig::default()
        };
        if config.connect.is_empty() {
            config.connect.extend(default_endpoint(&config));
        }
        if let Some(folder) = &self.secure {
            config.certificates = match &self.certificate {
                Some(name) => vec![name.clone()],
                None => names(&Folder::new(folder), suffice, robot).map_err(Exit::bad_input)?,
            };
            secure::check(folder, &config.certificates).map_err(Exit::bad_input)?;
        }
        config.check().map_err(Exit::bad_input)?;
        Ok(config)
    }

    pub(crate) async fn session(&self, suffice: &[&str], robot: Option<&str>) -> Result<Session, Exit> {
        session::client(&self.config(suffice, robot)?).await.map_err(Exit::from)
    }

    /// Fails if the certificate that `config` shows does not allow this: the router would only be silent.
    pub(crate) fn require(
        &self,
        config: &ServiceConfig,
        suffice: &[&str],
        verb: Verb,
        key: &str,
    ) -> Result<(), Exit> {
        let shown = shown(config);
        let namespace = self.namespace.as_deref();
        let whole = namespace.map_or_else(|| key.to_owned(), |namespace| format!("{namespace}/{key}"));
        match shown {
            Some(name) if !name.may(verb, &whole, namespace) => Err(Exit::bad_input(anyhow!(
                "the certificate `{name}` may not {} {key}; use --as {}",
                verb.word(),
                suffice.join(" or ")
            ))),
            _ => Ok(()),
        }
    }

    /// Where that is, for people.
    pub(crate) fn place(&self) -> String {
        let config = ServiceConfig { secure: self.secure.clone(), ..ServiceConfig::default() };
        let place = self.connect.clone().or_else(|| default_endpoint(&config));
        place.unwrap_or_else(|| "the router that ZENOH_CONFIG names".into())
    }

    /// What makes another command go there.
    pub(crate) fn arguments(&self) -> String {
        let config = ServiceConfig { secure: self.secure.clone(), ..ServiceConfig::default() };
        let endpoint = self.connect.clone().or_else(|| default_endpoint(&config));
        let mut arguments = Vec::new();
        arguments.extend(endpoint.map(|endpoint| format!("--connect {endpoint}")));
        arguments.extend(self.secure.as_ref().map(|folder| format!("--secure {}", folder.display())));
        arguments.extend(self.namespace.as_ref().map(|namespace| format!("--namespace {namespace}")));
        arguments.join(" ")
    }
}
