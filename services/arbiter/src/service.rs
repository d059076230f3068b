//! The arbiter on its robot: from mission to decisions.

use std::sync::Arc;
use std::time::Duration;

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::fields::Fields;
use curionav_runtime::lockstep::Latest;
use curionav_runtime::query::{AskError, fetch};
use curionav_runtime::robot_service::RobotService;
use curionav_runtime::shutdown::Shutdown;
use curionav_runtime::topic::{Flow, Topic};
use curionav_schemas::{Belief, Clock, CycleReport, Decision, Mission, MissionState, People};
use tokio::task::JoinHandle;
use zenoh::Session;

use crate::context::PlanContext;
use crate::cycle::{self, Memory};
use crate::peers::{GENERATOR, Peers, ZenohPeers};
use crate::pool::Pool;

/// How long a mission waits for a ready replica of every role before the arbiter goes ahead on its own.
const POOL_PATIENCE: Duration = Duration::from_secs(5);
/// Cycles between two looks at whom the driver obeys.
const LOOK_EVERY: u64 = 8;
/// The driver is on the same robot; if it does not answer it is asked again with every cycle.
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
    mission: Option<Mission>,
    context: Option<Arc<PlanContext>>,
    keeping_ready: Option<JoinHandle<()>>,
    memory: Memory,
    /// Whether the driver obeys this arbiter, as far as is known.
    obeyed: bool,
    /// Tick of the last decision.
    planned: Option<u64>,
}

/// Serves one robot until `shutdown`. `on_ready` is called once missions are followed.
pub(crate) async fn run(
    config: &ServiceConfig,
    session: &Session,
    mut shutdown: Shutdown,
    on_ready: impl FnOnce(),
) -> anyhow::Result<()> {
    let service = RobotService::with_control("arbiter", config, session).await?;
    let missions = service.inbox::<Mission>("mission")?;
    let mut arbiter = Arbiter {
        fields: Fields::new(session),
        in_process: config.in_process,
        pool: Arc::new(Pool::new(ZenohPeers::new(session)?)),
        beliefs: Latest::new(service.inbox("belief")?),
        people: Latest::new(service.inbox("people")?),
        decisions: service.topic("decision", Flow::Control)?,
        reports: service.topic("report", Flow::Report)?,
        service,
        mission: None,
        context: None,
        keeping_ready: None,
        memory: Memory::new(nonce()),
        obeyed: false,
        planned: None,
    };
    let _announced = arbiter.service.announce()?;
    arbiter.succeed().await?;
    on_ready();
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
    /// decided here may be refused, and it is asked again with every cycle.
    async fn succeed(&mut self) -> anyhow::Result<()> {
        let last = self.last_obeyed(DRIVER_TIMEOUT).await?;
        if let Some(Some(last)) = &last {
            self.memory.succeed((last.epoch, last.seq));
        }
        self.obeyed = last.is_some();
        Ok(())
    }

    /// The last decision the driver has obeyed, if any; nothing if it does not answer.
    async fn last_obeyed(&self, timeout: Duration) -> anyhow::Result<Option<Option<Decision>>> {
        let key = self.service.key("decision")?;
        Ok(match fetch::<Decision>(self.service.session_of("decision"), &key, timeout).await {
            Ok(last) => Some(Some(last)),
            Err(AskError::Rejected(_)) => Some(None),
            Err(_) => None,
        })
    }

    /// A mission, or a change of the one at hand.
    async fn take(&mut self, mission: Mission) -> anyhow::Result<()> {
        let known = self.mission.as_ref().map(|m| (m.run, m.revision));
        self.mission = Some(mission.clone());
        let over = matches!(mission.state, MissionState::Cancelled | MissionState::Finished);
        if known == Some((mission.run, mission.revision)) || over {
            return Ok(());
        }
        let prepared = self.prepare(&mission).await;
        if known.is_none_or(|(run, _)| run != mission.run) {
            // Nothing of the new run can be on its way before this role has reported ready.
            self.beliefs.clear();
            self.people.clear();
            self.planned = None;
        }
        self.service.report(mission.revision, prepared.map_err(|error| error.to_string())).await
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
        let (pool, of) = (Arc::clone(&self.pool), Arc::clone(&context));
        self.keeping_ready = Some(tokio::spawn(async move { pool.keep_ready(&of).await }));
        self.wait_for_pool(&context).await;
        self.context = Some(context);
        Ok(())
    }

    async fn wait_for_pool(&self, context: &PlanContext) {
        let roles: Vec<&str> = std::iter::once(GENERATOR).chain(context.pool_metrics()).collect();
        let deadline = tokio::time::Instant::now() + POOL_PATIENCE;
        // Every replica that is alive now should be ready, and there should be one of each role.
        let missing = |role: &&&str| {
            let (ready, alive) = (self.pool.replicas().ready(role).len(), self.pool.peers.alive(role).len());
            ready == 0 || ready < alive
        };
        while let Some(role) = roles.iter().find(missing) {
            // What cannot be had here is worth any wait: without it nothing can be followed.
            if context.is_replaceable(role) && tokio::time::Instant::now() >= deadline {
                tracing::warn!(role, "not every replica is ready; what is missing is computed in process");
                return;
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }

    /// Plans on every `plan_every`-th tick of the localiser.
    async fn tick(&mut self, mut belief: Belief) -> anyhow::Result<()> {
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
        let now = belief.stamp;
        let (decision, report) =
            cycle::decide(&self.pool, context, &mut self.memory, &mission, belief, people).await;
        self.decisions.publish(&decision, mission.clock);
        if let Some(report) = report {
            self.reports.publish(&report, mission.clock);
        }
        self.service.counts.record(started.elapsed());
        if !self.obeyed || self.memory.seq.is_multiple_of(LOOK_EVERY) {
            let last = self.last_obeyed(Duration::from_millis(50)).await?;
            self.obeyed = last.is_some_and(|last| self.memory.is_obeyed(last.as_ref(), now));
        }
        Ok(())
    }
}
