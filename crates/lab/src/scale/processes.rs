//! A router and replicas of one service as processes of this program, on this machine.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;

use super::cgroup::Quotas;
use curionav_deployment::supervised::{Supervised, client_arguments};
use curionav_runtime::exit::Exit;

/// Clock ticks of `/proc/PID/stat` in a second, on every Linux.
const TICKS: f64 = 100.0;

/// The processes of one measurement. Call [`Processes::stop`] when done; dropped without it, they are killed.
pub(super) struct Processes {
    program: PathBuf,
    log: String,
    pub(super) endpoint: String,
    /// Folder of certificates, if links are over TLS.
    pub(super) secure: Option<PathBuf>,
    router: Supervised,
    replicas: Vec<Supervised>,
    quotas: Option<Quotas>,
}

impl Processes {
    /// Starts the router. With `quota`, each replica will get only so much of a processor.
    pub(super) async fn start(log: &str, quota: Option<f64>, secure: Option<&Path>) -> Result<Self, Exit> {
        secure.map_or(Ok(()), certify)?;
        let quotas = quota.map(Quotas::new).transpose().map_err(Exit::bad_input)?;
        let program =
            std::env::current_exe().context("cannot find this program's file").map_err(Exit::network)?;
        let (router, endpoint) = Supervised::router(&program, 0, secure, log).await.map_err(Exit::network)?;
        let secure = secure.map(Path::to_owned);
        Ok(Self { program, log: log.to_owned(), endpoint, secure, router, replicas: Vec::new(), quotas })
    }

    /// Starts `count` more replicas of the service that the subcommand `kind` runs.
    pub(super) async fn add(&mut self, kind: &str, count: usize) -> Result<(), Exit> {
        for _ in 0..count {
            let name = format!("{kind}-{}", self.replicas.len());
            let arguments = client_arguments(kind, &self.endpoint, &name, self.secure.as_deref(), &self.log);
            let started = Supervised::start(&self.program, &name, arguments).await;
            self.replicas.push(started.map_err(Exit::network)?.0);
        }
        Ok(())
    }

    /// Puts the quota in force. Before, replicas have the whole machine to get ready in.
    pub(super) fn limit(&mut self) -> Result<(), Exit> {
        let Some(quotas) = &mut self.quotas else { return Ok(()) };
        for (index, replica) in self.replicas.iter().enumerate() {
            quotas.limit(&format!("replica-{index}"), replica.pid()).map_err(Exit::bad_input)?;
        }
        Ok(())
    }

    pub(super) async fn dismiss(&mut self) {
        Supervised::stop_all(std::mem::take(&mut self.replicas)).await;
        if let Some(quotas) = &mut self.quotas {
            quotas.clear();
        }
    }

    /// Ends everything and removes every control group.
    pub(super) async fn stop(mut self) {
        self.dismiss().await;
        Supervised::stop_all(vec![self.router]).await;
    }

    /// Processor time used until now: by the replicas together, and by router and this process, which is what
    /// asking costs.
    pub(super) fn used(&self) -> Used {
        let replicas = self.replicas.iter().map(|replica| used(&replica.pid().to_string())).sum();
        Used { replicas, asking: used(&self.router.pid().to_string()) + used("self") }
    }
}

/// Makes the certificates of a router, of one replica of each service, and of what asks them.
#[cfg(feature = "tls")]
fn certify(directory: &Path) -> Result<(), Exit> {
    use curionav_security::folder::{Folder, LIFETIME_DAYS, days};

    let folder = Folder::new(directory);
    if !folder.is_initialised() {
        folder.init(None).map_err(Exit::bad_input)?;
    }
    let roles = ["generator", "cpc", "cnc", "echo"];
    let replicas = (0..roles.len()).flat_map(|n| roles.map(|role| format!("{role}.{role}-{n}")));
    for name in [HOSTS, ASKS, "router"].map(str::to_owned).into_iter().chain(replicas) {
        let name = name.parse().map_err(Exit::bad_input)?;
        folder.keep_valid(&name, days(LIFETIME_DAYS)).map_err(Exit::bad_input)?;
    }
    Ok(())
}

#[cfg(not(feature = "tls"))]
fn certify(_: &Path) -> Result<(), Exit> {
    Err(Exit::bad_input(anyhow::anyhow!("--secure: this program was built without the feature `tls`")))
}

/// The certificate of what hosts the map, and of what asks replicas.
pub(super) const HOSTS: &str = "base.robot-0";
/// See [`HOSTS`].
pub(super) const ASKS: &str = "operator";

pub(super) struct Used {
    replicas: Duration,
    asking: Duration,
}

impl Used {
    /// Processors used on average over the `seconds` since `before`: by replicas, and for asking.
    pub(super) fn cores_since(&self, before: &Self, seconds: f64) -> (f64, f64) {
        let cores = |now: Duration, then: Duration| (now - then).as_secs_f64() / seconds;
        (cores(self.replicas, before.replicas), cores(self.asking, before.asking))
    }
}

/// Processor time of one process; nothing where there is no `/proc`.
fn used(pid: &str) -> Duration {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // After the name, which may contain anything: utime and stime are fields 14 and 15, the name is field 2.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace().skip(11).take(2);
    let ticks: u64 = fields.filter_map(|field| field.parse::<u64>().ok()).sum();
    Duration::from_secs_f64(ticks as f64 / TICKS)
}
