//! Services in this process, over one session.

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::map_store;
use curionav_runtime::process::Start;
use curionav_runtime::session;
use curionav_runtime::shutdown::{ShutdownTrigger, shutdown};
use tokio::task::JoinSet;
use zenoh::Session;

use crate::service_kind::Kind;

/// The services of one robot and its world, running.
pub struct Embedded {
    /// What all of them speak over.
    pub session: Session,
    tasks: JoinSet<(Kind, anyhow::Result<()>)>,
    triggers: Vec<ShutdownTrigger>,
}

impl Embedded {
    /// Starts them all on a session without a network and waits until each serves. Where they take turns, the arbiter
    /// does the work of the pools.
    pub async fn start(config: &ServiceConfig) -> anyhow::Result<Self> {
        let mut kinds = Kind::simulated();
        // A planner of one's own is asked by the arbiter, alone or not.
        let is_asked = |kind: Kind| !kind.is_of_pool() || kind == Kind::Generator && config.planner.is_some();
        kinds.retain(|kind| !config.takes_turns || is_asked(*kind));
        Self::of(&kinds, session::embedded().await?, config).await
    }

    /// Starts one of each of these kinds on `session` and waits until each serves. Others may be elsewhere.
    pub async fn of(kinds: &[Kind], session: Session, config: &ServiceConfig) -> anyhow::Result<Self> {
        let fields = map_store::fields(&session);
        let mut embedded = Self { session: session.clone(), tasks: JoinSet::new(), triggers: Vec::new() };
        for &kind in kinds {
            let (trigger, token) = shutdown();
            let (ready, is_ready) = tokio::sync::oneshot::channel();
            // What runs in one process with its world is a simulation, unless the configuration has limits.
            let simulated_base = config.limits.is_none();
            let config = ServiceConfig { instance: kind.name().into(), simulated_base, ..config.clone() };
            let session = session.clone();
            let fields = fields.clone();
            embedded.triggers.push(trigger);
            embedded.tasks.spawn(async move {
                // The receiver is gone if another service failed first.
                let on_ready = Box::new(move |_| {
                    let _ = ready.send(());
                });
                let config = &config;
                let session = &session;
                let fields = &fields;
                let start = Start { config, session, fields, shutdown: token, on_ready };
                (kind, kind.service()(start).await)
            });
            tokio::select! {
                _ = is_ready => {}
                failure = embedded.failure() => return Err(failure),
            }
        }
        Ok(embedded)
    }

    /// Completes when a service ends by itself, which none should.
    pub async fn failure(&mut self) -> anyhow::Error {
        match self.tasks.join_next().await {
            Some(Ok((kind, Ok(())))) => anyhow::anyhow!("the {} ended", kind.name()),
            Some(Ok((kind, Err(error)))) => error.context(format!("the {} failed", kind.name())),
            Some(Err(error)) => anyhow::anyhow!("a service panicked: {error}"),
            None => std::future::pending().await,
        }
    }

    /// Ends them in the reverse order of their start.
    pub async fn stop(mut self) {
        while let Some(trigger) = self.triggers.pop() {
            trigger.fire();
        }
        while self.tasks.join_next().await.is_some() {}
        session::close(&self.session);
    }
}
