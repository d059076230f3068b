//! The arbiter on its robot: from mission to decisions.

use std::sync::Arc;
use std::time::Duration;

use curionav_pool::fields::Fields;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::lockstep::{Latest, has_started_over};
use curionav_runtime::process::OnReady;
use curionav_runtime::query::{AskError, fetch};
use curionav_runtime::robot_service::{Preparation, RobotService, is_over, superseded, supersedes};
use curionav_runtime::shutdown::Shutdown;
use curionav_runtime::topic::{Flow, OnDemand, Topic};
use curionav_schemas::{
    self as wire, Belief, Clock, CycleReport, Decision, Mission, People, Refusal, Reject, Twist,
};
use tokio::task::JoinHandle;
use zenoh::Session;

use crate::cycle;
use crate::cycle_counts::CycleCounts;
use crate::memory::Memory;
use crate::muster::muster;
use curionav_pool::context::PlanContext;
use curionav_pool::peers::{GENERATOR, ZenohPeers};
use curionav_pool::pool::Pool;

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
    reports: OnDemand<CycleReport>,
    memories: OnDemand<wire::Memory>,
    mission: Option<Mission>,
    context: Option<Arc<PlanContext>>,
    /// The run whose streams it follows.
    run: Option<u64>,
    prepared: Option<Preparation>,
    keeping_ready: Option<JoinHandle<()>>,
    memory: Memory,
    /// What the driver commands, and on whose decision.
    commands: Latest<Twist>,
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
        reports: service.on_demand("report", Flow::Report)?,
        commands: Latest::new(service.inbox("cmd")?),
        memories: service.on_demand("memory", Flow::Report)?,
        service,
        mission: None,
        context: None,
        run: None,
        prepared: None,
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
    let mut said = arbiter.service.mission().await?;
    loop {
        if let Some(mission) = said.take() {
            // Once another arbiter has begun the mission, it is no longer for this one to refuse it.
            let ends = |said: &Mission| supersedes(said, &mission) || said.has_run != mission.has_run;
            tokio::select! {
                biased;
                () = shutdown.requested() => break,
                () = superseded(&missions, &mut said, ends) => {}
                anew = arbiter.take(&mission) => {
                    arbiter.service.tell(&mission, arbiter.prepared.as_ref(), anew).await?;
                }
            }
            continue;
        }
        tokio::select! {
            biased;
            () = shutdown.requested() => break,
            mission = missions.next() => match mission {
                Some(mission) => said = Some(mission),
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
            Err(AskError::Rejected(Reject { why: Refusal::NoDecision, .. })) => self.memory.succeed(None),
            Err(error) => tracing::debug!(%error, "the driver does not say whom it obeys"),
        }
        Ok(())
    }

    /// A mission, or a change of the one at hand. May be dropped on the way, when there is another to take. Whether it
    /// has prepared.
    async fn take(&mut self, mission: &Mission) -> bool {
        self.mission = Some(mission.clone());
        if is_over(mission) || self.prepared.as_ref().is_some_and(|prepared| prepared.is_for(mission)) {
            return false;
        }
        let outcome = loop {
            let outcome = self.prepare(mission).await;
            if !self.service.must_retry(mission, &outcome).await {
                break outcome;
            }
        };
        if self.run.replace(mission.run) != Some(mission.run) {
            // Nothing of the new run can be on its way before this role has reported ready.
            self.beliefs.clear();
            self.people.clear();
            self.commands.clear();
            self.planned = None;
        }
        self.prepared = Some(Preparation::new(mission, outcome));
        true
    }

    async fn prepare(&mut self, mission: &Mission) -> Result<(), Reject> {
        self.context = None;
        if let Some(keeping_ready) = &mut self.keeping_ready {
            keeping_ready.abort();
            // Until it has ended it could still call somebody ready.
            let _ = keeping_ready.await;
            self.keeping_ready = None;
        }
        self.pool.clear();
        self.succeed().await.map_err(Refusal::failed)?;
        self.memory = self.memory.fresh();
        let (fields, mission, in_process) = (self.fields.clone(), mission.clone(), self.in_process);
        let preparing = move || PlanContext::new(mission, &fields, in_process);
        let prepared = tokio::task::spawn_blocking(preparing).await;
        let context = Arc::new(prepared.map_err(Refusal::failed)??);
        let roles = std::iter::once(GENERATOR).chain(context.pool_terms());
        self.counts.follow(roles.map(str::to_owned));
        let (pool, of) = (Arc::clone(&self.pool), Arc::clone(&context));
        self.keeping_ready = Some(tokio::spawn(async move { pool.keep_ready(&of).await }));
        muster(&self.pool, &context).await?;
        self.context = Some(context);
        Ok(())
    }

    /// Plans on every `plan_every`-th tick of the localiser.
    async fn tick(&mut self, mut belief: Belief) -> anyhow::Result<()> {
        let Some(mission) = self.mission.clone() else { return Ok(()) };
        let period = u64::from(mission.order.plan_every.max(1));
        if mission.order.clock == Clock::Realtime
            && let Some(newest) = self.beliefs.newest()
        {
            belief = newest.clone();
        }
        if self.planned.is_some_and(|last| has_started_over(last, belief.tick)) {
            tracing::warn!(tick = belief.tick, last = ?self.planned, "the base has started over");
            self.planned = None;
            self.commands.clear();
            self.memory = self.memory.fresh();
        }
        let due = match mission.order.clock {
            Clock::Lockstep => belief.tick.is_multiple_of(period),
            Clock::Realtime => self.planned.is_none_or(|last| belief.tick >= last + period),
        };
        if !due {
            return Ok(());
        }
        let started = std::time::Instant::now();
        self.hear_commands(belief.tick, mission.order.clock).await;
        self.planned = Some(belief.tick);
        let people = self.people.of_tick(belief.tick, mission.order.clock).await.cloned();
        let context = self.context.as_deref();
        let carried = self.memories.is_heard().then(|| self.memory.to_wire(&mission));
        let (decision, account) =
            cycle::decide(&self.pool, context, &mut self.memory, &mission, belief, people).await;
        self.decisions.publish(&decision, mission.order.clock);
        self.counts.record(&decision, account.as_ref());
        self.service.counts.record(started.elapsed());
        if let Some((context, account)) = context.zip(account) {
            // Before the report: a recorder that has the memory can wait for the report.
            if let Some(carried) = carried {
                self.memories.publish(&carried, mission.order.clock);
            }
            if self.reports.is_heard() {
                self.reports.publish(&account.report(context, decision), mission.order.clock);
            }
        }
        Ok(())
    }

    /// Takes note of what the driver has done. In lockstep its command of the tick before is waited for, so that a
    /// cycle always starts from the same; of a run that it has not yet planned in it has missed commands.
    async fn hear_commands(&mut self, tick: u64, clock: Clock) {
        let command = match (clock, self.planned, tick.checked_sub(1)) {
            (Clock::Lockstep, Some(_), Some(before)) => self.commands.of_tick(before, clock).await,
            _ => self.commands.newest(),
        };
        if let Some(command) = command {
            self.memory.hear(command);
        }
    }
}
