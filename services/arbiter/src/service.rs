//! The arbiter on its robot: from mission to decisions.

use std::sync::Arc;
use std::time::Duration;

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::fields::Fields;
use curionav_runtime::lockstep::Latest;
use curionav_runtime::process::OnReady;
use curionav_runtime::query::{AskError, fetch};
use curionav_runtime::robot_service::RobotService;
use curionav_runtime::shutdown::Shutdown;
use curionav_runtime::topic::{Flow, Inbox, OnDemand, Topic};
use curionav_schemas::{
    self as wire, Belief, Clock, CycleReport, Decision, Mission, MissionState, People, RejectCode, Twist,
};
use tokio::task::JoinHandle;
use zenoh::Session;

use crate::context::PlanContext;
use crate::cycle::{self, Memory};
use crate::cycle_counts::CycleCounts;
use crate::peers::{GENERATOR, Peers, ZenohPeers};
use crate::pool::Pool;

/// How long a mission waits for a ready replica of every role before the arbiter goes ahead on its own.
const POOL_PATIENCE: Duration = Duration::from_secs(5);
/// How long it waits for a metric that is not built in. Nobody else can compute it, so the mission is then refused.
const FOREIGN_PATIENCE: Duration = Duration::from_secs(20);
/// The driver is on the same robot; if it does not answer, its commands say whom it obeys.
const DRIVER_TIMEOUT: Duration = Duration::from_millis(300);

struct Arbiter {
    service: RobotService,
    fields: Fields,
    in_process: bool,
    pool: Arc<Pool<ZenohPeers>>,
    beliefs: Latest<Belief>,
    people: Latest<People>,
    decisions: Topic<Decision>,
    reports: Topic<CycleReport>,
    memories: OnDemand<wire::Memory>,
    mission: Option<Mission>,
    context: Option<Arc<PlanContext>>,
    /// What came of preparing for the mission.
    prepared: Result<(), String>,
    keeping_ready: Option<JoinHandle<()>>,
    memory: Memory,
    /// What the driver commands, and on whose decision.
    commands: Inbox<Twist>,
    /// Tick of the last decision.
    planned: Option<u64>,
    counts: CycleCounts,
}

/// Serves one robot until `shutdown`. `on_ready` is called once missions are followed.
pub(crate) async fn run(
    config: &ServiceConfig,
    session: &Session,
    mut shutdown: Shutdown,
    on_ready: OnReady,
) -> anyhow::Result<()> {
    let service = tokio::select! {
        () = shutdown.requested() => return Ok(()),
        service = RobotService::with_control("arbiter", config, session) => service?,
    };
    let missions = service.inbox::<Mission>("mission")?;
    let mut arbiter = Arbiter {
        fields: Fields::new(session),
        in_process: config.in_process,
        pool: Arc::new(Pool::counted(ZenohPeers::new(session)?, service.counts.refused.clone())),
        beliefs: Latest::new(service.inbox("belief")?),
        people: Latest::new(service.inbox("people")?),
        decisions: service.topic("decision", Flow::Control)?,
        reports: service.topic("report", Flow::Report)?,
        commands: service.inbox("cmd")?,
        memories: service.on_demand("memory", Flow::Report)?,
        service,
        mission: None,
        context: None,
        prepared: Ok(()),
        keeping_ready: None,
        memory: Memory::new(nonce()),
        planned: None,
        counts: CycleCounts::new(),
    };
    let mut metrics = arbiter.service.metrics();
    arbiter.counts.register(&mut metrics, &arbiter.pool);
    let announced = arbiter.service.announce(metrics)?;
    arbiter.succeed().await?;
    on_ready(announced.metrics_address());
    if let Some(mission) = arbiter.service.mission().await? {
        arbiter.take(mission).await?;
    }
    loop {
        tokio::select! {
            biased;
            () = shutdown.requested() => break,
            mission = missions.next() => match mission {
                Some(mission) => arbiter.take(mission).await?,
                None => break,
            },
            belief = arbiter.beliefs.next() => match belief.cloned() {
                Some(belief) => arbiter.tick(belief).await?,
                None => break,
            },
        }
    }
    if let Some(keeping_ready) = arbiter.keeping_ready.take() {
        keeping_ready.abort();
    }
    Ok(())
}

/// A number that no other arbiter has: random enough for the few there are.
fn nonce() -> u64 {
    use std::hash::{BuildHasher, Hasher};
    std::collections::hash_map::RandomState::new().build_hasher().finish()
}

impl Arbiter {
    /// Outranks the arbiter whose decision the driver has obeyed last. If the driver does not answer, what is
    /// decided here may be refused until its first command is heard.
    async fn succeed(&mut self) -> anyhow::Result<()> {
        let key = self.service.key("decision")?;
        match fetch::<Decision>(self.service.session_of("decision"), &key, DRIVER_TIMEOUT).await {
            Ok(last) => self.memory.succeed(Some((last.epoch, last.seq))),
            // It has obeyed nobody yet.
            Err(AskError::Rejected(reject)) if reject.code == RejectCode::Unknown => {
                self.memory.succeed(None)
            }
            Err(error) => tracing::debug!(%error, "the driver does not say whom it obeys"),
        }
        Ok(())
    }

    /// A mission, or a change of the one at hand.
    async fn take(&mut self, mission: Mission) -> anyhow::Result<()> {
        let known = self.mission.as_ref().map(|m| (m.run, m.revision));
        self.mission = Some(mission.clone());
        let over = matches!(mission.state, MissionState::Cancelled | MissionState::Finished);
        if over {
            return Ok(());
        }
        if known == Some((mission.run, mission.revision)) {
            // The driver may have been out of reach when it was told.
            return self.service.remind(&mission, &self.prepared).await;
        }
        self.prepared = self.prepare(&mission).await.map_err(|error| error.to_string());
        if known.is_none_or(|(run, _)| run != mission.run) {
            // Nothing of the new run can be on its way before this role has reported ready.
            self.beliefs.clear();
            self.people.clear();
            self.planned = None;
        }
        self.service.report(mission.revision, &self.prepared).await
    }

    async fn prepare(&mut self, mission: &Mission) -> anyhow::Result<()> {
        if let Some(keeping_ready) = self.keeping_ready.take() {
            keeping_ready.abort();
            // Until it has ended it could still call somebody ready.
            let _ = keeping_ready.await;
        }
        self.pool.clear();
        self.succeed().await?;
        self.context = None;
        self.memory = self.memory.fresh();
        let (fields, mission, in_process) = (self.fields.clone(), mission.clone(), self.in_process);
        let preparing = move || PlanContext::new(mission, &fields, in_process);
        let context = Arc::new(tokio::task::spawn_blocking(preparing).await??);
        let roles = std::iter::once(GENERATOR).chain(context.pool_metrics());
        self.counts.follow(roles.map(str::to_owned));
        let (pool, of) = (Arc::clone(&self.pool), Arc::clone(&context));
        self.keeping_ready = Some(tokio::spawn(async move { pool.keep_ready(&of).await }));
        self.wait_for_pool(&context).await?;
        self.context = Some(context);
        Ok(())
    }

    async fn wait_for_pool(&self, context: &PlanContext) -> anyhow::Result<()> {
        let roles: Vec<&str> = std::iter::once(GENERATOR).chain(context.pool_metrics()).collect();
        let started = tokio::time::Instant::now();
        // Every replica that is alive now should be ready, and there should be one of each role.
        let missing = |role: &&&str| {
            let (ready, alive) = (self.pool.replicas().ready(role).len(), self.pool.peers.alive(role).len());
            ready == 0 || ready < alive
        };
        while let Some(role) = roles.iter().find(missing) {
            // What cannot be had here is worth a longer wait: without it nothing can be followed.
            if context.is_replaceable(role) && started.elapsed() >= POOL_PATIENCE {
                tracing::warn!(role, "not every replica is ready; what is missing is computed in process");
                return Ok(());
            }
            if context.is_foreign(role) {
                let refusal = self.pool.refusal(role);
                let patience = if refusal.is_some() { POOL_PATIENCE } else { FOREIGN_PATIENCE };
                if started.elapsed() >= patience {
                    if !self.pool.replicas().ready(role).is_empty() {
                        tracing::warn!(role, "not every replica is ready");
                        return Ok(());
                    }
                    let why = refusal.unwrap_or_else(|| "none is alive, or none answers".into());
                    anyhow::bail!("terms.{role}: no replica gets ready: {why}");
                }
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        Ok(())
    }

    /// Plans on every `plan_every`-th tick of the localiser.
    async fn tick(&mut self, mut belief: Belief) -> anyhow::Result<()> {
        while let Some(command) = self.commands.try_next() {
            self.memory.hear(&command);
        }
        let Some(mission) = self.mission.clone() else { return Ok(()) };
        let period = u64::from(mission.plan_every.max(1));
        let due = match mission.clock {
            Clock::Lockstep => belief.tick.is_multiple_of(period),
            Clock::Realtime => {
                if let Some(newest) = self.beliefs.newest() {
                    belief = newest.clone();
                }
                self.planned.is_none_or(|last| belief.tick >= last + period)
            }
        };
        if !due {
            return Ok(());
        }
        let started = std::time::Instant::now();
        self.planned = Some(belief.tick);
        let people = self.people.of_tick(belief.tick, mission.clock).await.cloned();
        let context = self.context.as_deref();
        let carried = self.memories.is_heard().then(|| self.memory.to_wire(&mission));
        let (decision, report) =
            cycle::decide(&self.pool, context, &mut self.memory, &mission, belief, people).await;
        self.decisions.publish(&decision, mission.clock);
        self.counts.record(&decision, report.as_ref());
        if let Some(report) = report {
            // Before the report: who has the one can wait for the other.
            if let Some(carried) = carried {
                self.memories.publish(&carried, mission.clock);
            }
            self.reports.publish(&report, mission.clock);
        }
        self.service.counts.record(started.elapsed());
        Ok(())
    }
}
