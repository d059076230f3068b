//! How commands reach a deployment.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::Args;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::exit::Exit;
use curionav_runtime::process::default_endpoint;
use curionav_runtime::secure;
use curionav_runtime::session;
use curionav_security::name::Name;
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
    /// With a certificate of one of these names, if it is to be secure.
    pub(crate) fn config(&self, suffice: &[&str]) -> Result<ServiceConfig, Exit> {
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
                None => suffice
                    .iter()
                    .map(|name| name.parse())
                    .collect::<Result<_, _>>()
                    .map_err(Exit::bad_input)?,
            };
            secure::check(folder, &config.certificates).map_err(Exit::bad_input)?;
        }
        config.check().map_err(Exit::bad_input)?;
        Ok(config)
    }

    pub(crate) async fn session(&self, suffice: &[&str]) -> Result<Session, Exit> {
        session::client(&self.config(suffice)?).await.map_err(Exit::from)
    }

    /// Fails if the certificate to be shown does not allow this: the router would only be silent.
    pub(crate) fn require(&self, suffice: &[&str], verb: Verb, key: &str) -> Result<(), Exit> {
        let config = self.config(suffice)?;
        let shown = config.secure.as_ref().and_then(|folder| secure::shown(folder, &config.certificates));
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
