//! The certificates of a deployment: made and renewed before it starts, and renewed while it runs.

use std::path::Path;
use std::time::Duration;

use curionav_runtime::exit::Exit;
use curionav_security::folder::{Folder, FolderError, LIFETIME_DAYS, days};
use curionav_security::name::Name;
use tokio::sync::Notify;

use super::deployment::Deployment;

/// Between two looks whether a certificate is due.
const LOOK: Duration = Duration::from_secs(10);
const ROUTER: &str = "router";

/// What a deployment shows.
pub(super) struct Certificates {
    folder: Folder,
    names: Vec<Name>,
}

impl Certificates {
    /// Makes what `deployment` needs and what is absent: for the router, for every process, and for the people who use
    /// it. Renews those of which less than a third of the time is left.
    pub(super) fn of(deployment: &Deployment, directory: &Path) -> Result<Self, Exit> {
        let folder = Folder::new(directory);
        if !folder.is_initialised() {
            folder.init(deployment.namespace.as_deref()).map_err(Exit::bad_input)?;
        }
        let namespace = folder.namespace().map_err(Exit::bad_input)?;
        if namespace != deployment.namespace {
            return Err(Exit::bad_input(anyhow::anyhow!(
                "{}: its rules are for the namespace `{}`, and this deployment's is `{}`; choose another folder",
                directory.display(),
                namespace.as_deref().unwrap_or("none"),
                deployment.namespace.as_deref().unwrap_or("none")
            )));
        }
        let Deployment { robot, world, replicas, .. } = deployment;
        let processes = deployment.processes();
        let names = processes.map(|(kind, instance)| Name::of_service(kind.name(), robot, world, &instance));
        let mut names: Vec<Name> = names.collect::<Result<_, _>>().map_err(Exit::bad_input)?;
        let mut more = vec![Name::new(ROUTER, &[]), Name::new("viewer", &[]), Name::new("operator", &[])];
        if replicas.simulator > 0 {
            more.extend([Name::new("experimenter", &[]), Name::new("crowd", &[world])]);
        }
        names.extend(more.into_iter().collect::<Result<Vec<_>, _>>().map_err(Exit::bad_input)?);
        let lifetime = days(LIFETIME_DAYS);
        names.iter().try_for_each(|name| folder.keep_valid(name, lifetime)).map_err(Exit::bad_input)?;
        Ok(Self { folder, names })
    }

    /// Renews what is due, again and again. Programs read their certificates when they connect, and the router when it
    /// starts: when its own is renewed, `restart` tells so, and all connect again with what they have by then. What was
    /// deleted meanwhile, so that a lost key is of no use, is not made again. It does not complete.
    pub(super) async fn keep_valid(&self, restart: &Notify) {
        let mut said = None;
        loop {
            tokio::time::sleep(LOOK).await;
            let folder = self.folder.clone();
            let names = self.names.clone();
            let (renewed, failed) = match tokio::task::spawn_blocking(move || renew(&folder, &names)).await {
                Ok(outcome) => outcome,
                Err(error) => {
                    tracing::error!(%error, "the renewal of certificates failed");
                    continue;
                }
            };
            if renewed.iter().any(Name::is_router) {
                restart.notify_one();
            }
            let told = failed.map(|error| error.to_string());
            if let Some(error) = told.as_ref().filter(|_| said != told) {
                tracing::error!(%error, "a certificate is due and was not renewed; it is tried again");
            }
            said = told;
        }
    }
}

/// Renews what is due. A certificate that cannot be renewed keeps no other from it; the first failure is given too.
fn renew(folder: &Folder, names: &[Name]) -> (Vec<Name>, Option<FolderError>) {
    let mut renewed = Vec::new();
    let mut failed = None;
    for name in names {
        match folder.renew_if_due(name, days(LIFETIME_DAYS)) {
            Ok(true) => {
                tracing::info!(%name, "certificate renewed");
                renewed.push(name.clone());
            }
            Ok(false) => {}
            Err(error) => failed = failed.or(Some(error)),
        }
    }
    (renewed, failed)
}
