//! A router and replicas of one service as processes of this program, on this machine.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;

use super::cgroup::Quotas;
use curionav_deployment::supervised::{Supervised, client_arguments, processor_time};
use curionav_runtime::exit::Exit;

/// The processes of one measurement. Call [`Processes::stop`] when done; dropped without it, they are killed.
pub(super) struct Processes {
    program: PathBuf,
    log: String,
    /// Where each router listens.
    endpoints: Vec<String>,
    /// Folder of certificates, if links are over TLS.
    pub(super) secure: Option<PathBuf>,
    routers: Vec<Supervised>,
    replicas: Vec<Supervised>,
    quotas: Option<Quotas>,
}

impl Processes {
    /// Starts a router. With `quota`, each replica will get only so much of a processor. With `secure`, there are
    /// certificates for so many replicas, of whichever role, and for the arbiters of so many robots.
    pub(super) async fn start(
        log: &str,
        quota: Option<f64>,
        secure: Option<&Path>,
        replicas_and_robots: (usize, usize),
    ) -> Result<Self, Exit> {
        secure.map_or(Ok(()), |folder| certify(folder, replicas_and_robots))?;
        let quotas = quota.map(Quotas::new).transpose().map_err(Exit::bad_input)?;
        let program =
            std::env::current_exe().context("cannot find this program's file").map_err(Exit::network)?;
        let secure = secure.map(Path::to_owned);
        let log = log.to_owned();
        let endpoints = Vec::new();
        let routers = Vec::new();
        let replicas = Vec::new();
        let mut processes = Self { program, log, endpoints, secure, routers, replicas, quotas };
        processes.add_router().await?;
        Ok(processes)
    }

    /// Starts a router that links with those there are.
    pub(super) async fn add_router(&mut self) -> Result<(), Exit> {
        let Self { program, endpoints, secure, log, .. } = &*self;
        let started = Supervised::router(program, 0, endpoints, secure.as_deref(), log).await;
        let (router, endpoint) = started.map_err(Exit::network)?;
        self.routers.push(router);
        self.endpoints.push(endpoint);
        Ok(())
    }

    /// Kills the first router and starts it again.
    pub(super) async fn restart_router(&mut self) -> anyhow::Result<()> {
        self.routers.first_mut().context("no router")?.kill_and_start(&self.program).await;
        Ok(())
    }

    /// Where to connect to, in the order of process or robot number `index`: each router comes first for some.
    pub(super) fn endpoints_from(&self, index: usize) -> Vec<String> {
        let mut endpoints = self.endpoints.clone();
        let first = index % endpoints.len().max(1);
        endpoints.rotate_left(first);
        endpoints
    }

    /// Starts `count` more replicas of the service that the subcommand `kind` runs.
    pub(super) async fn add(&mut self, kind: &str, count: usize) -> Result<(), Exit> {
        for _ in 0..count {
            let name = format!("{kind}-{}", self.replicas.len());
            let routers = self.endpoints_from(self.replicas.len());
            let [first, others @ ..] = &routers[..] else { break };
            let mut arguments = client_arguments(kind, first, &name, self.secure.as_deref(), &self.log);
            arguments.extend(others.iter().flat_map(|other| ["--connect".to_owned(), other.clone()]));
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
        Supervised::stop_all(self.routers).await;
    }

    /// Processor time used until now: by the replicas together, and by router and this process, which is what
    /// asking costs.
    pub(super) fn used(&self) -> Used {
        let of = |some: &[Supervised]| some.iter().map(|one| processor_time(&one.pid().to_string())).sum();
        Used { replicas: of(&self.replicas), routers: of(&self.routers), own: processor_time("self") }
    }

    /// What each router and each replica has in memory, MiB.
    pub(super) fn resident(&self) -> (Vec<f64>, Vec<f64>) {
        let of = |some: &[Supervised]| some.iter().map(|one| resident(one.pid())).collect();
        (of(&self.routers), of(&self.replicas))
    }
}

/// Makes the certificates of a router, of one replica of each service, and of what asks them.
fn certify(directory: &Path, (replicas, robots): (usize, usize)) -> Result<(), Exit> {
    use curionav_security::folder::{Folder, LIFETIME_DAYS, days};

    let folder = Folder::new(directory);
    if !folder.is_initialised() {
        folder.init(None).map_err(Exit::bad_input)?;
    }
    let roles = ["generator", "cpc", "cnc", "echo"];
    let arbiters = (0..robots).map(|n| format!("arbiter.robot-{n}"));
    let replicas = (0..replicas).flat_map(|n| roles.map(|role| format!("{role}.{role}-{n}")));
    for name in [HOSTS, ASKS, "router"].map(str::to_owned).into_iter().chain(replicas).chain(arbiters) {
        let name = name.parse().map_err(Exit::bad_input)?;
        folder.keep_valid(&name, days(LIFETIME_DAYS)).map_err(Exit::bad_input)?;
    }
    Ok(())
}

/// The certificate of what hosts the map, and of what asks replicas.
pub(super) const HOSTS: &str = "base.robot-0";
/// See [`HOSTS`].
pub(super) const ASKS: &str = "operator";

/// Processor time.
pub(super) struct Used {
    replicas: Duration,
    routers: Duration,
    own: Duration,
}

/// Processors used on average.
pub(super) struct Cores {
    pub(super) replicas: f64,
    pub(super) routers: f64,
    /// By this process.
    pub(super) own: f64,
}

impl Used {
    /// Processors used on average over the `seconds` since `before`: by replicas, and for asking.
    pub(super) fn cores_since(&self, before: &Self, seconds: f64) -> (f64, f64) {
        let Cores { replicas, routers, own } = self.all_since(before, seconds);
        (replicas, routers + own)
    }

    /// The same one by one.
    pub(super) fn all_since(&self, before: &Self, seconds: f64) -> Cores {
        let cores = |now: Duration, then: Duration| now.saturating_sub(then).as_secs_f64() / seconds;
        Cores {
            replicas: cores(self.replicas, before.replicas),
            routers: cores(self.routers, before.routers),
            own: cores(self.own, before.own),
        }
    }
}

/// What a process has in memory, MiB; nothing where there is no `/proc`.
fn resident(pid: u32) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kib = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kib.unwrap_or_default() / 1024.0
}
