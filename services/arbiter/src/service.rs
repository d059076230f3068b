//! The arbiter on its robot: from mission to decisions.

use std::sync::Arc;
use std::time::Duration;

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::fields::Fields;
use curionav_runtime::lockstep::Latest;
use curionav_runtime::membership::{Membership, announce};
use curionav_runtime::query::fetch;
use curionav_runtime::ready::{report_ready, tell_driver};
use curionav_runtime::shutdown::Shutdown;
use curionav_runtime::topic::{Flow, Inbox, Topic};
use curionav_schemas::{
    Belief, Clock, CycleReport, Decision, Mission, MissionRequest, MissionState, People, keys,
};
use tokio::task::JoinHandle;
use zenoh::Session;

use crate::context::PlanContext;
use crate::cycle::{self, Memory, Observation};
use crate::peers::{GENERATOR, Peers, ZenohPeers};
use crate::pool::keep_warm;
use crate::report;

/// How long a mission waits for a warm replica of every role before the arbiter goes ahead on its own.
const POOL_PATIENCE: Duration = Duration::from_secs(5);
/// People older than this are no longer acted on, seconds of the robot's clock.
const PEOPLE_AGE_MAX: f64 = 1.0;
/// Missions and readiness are small and local.
const MISSION_TIMEOUT: Duration = Duration::from_secs(2);

struct Arbiter {
    config: ServiceConfig,
    session: Session,
    membership: Arc<Membership>,
    fields: Arc<Fields>,
    peers: Arc<ZenohPeers>,
    beliefs: Latest<Belief>,
    people: Latest<People>,
    decisions: Topic<Decision>,
    reports: Topic<CycleReport>,
    mission_key: String,
    decision_key: String,
    mission: Option<Mission>,
    context: Option<Arc<PlanContext>>,
    warming: Option<JoinHandle<()>>,
    memory: Memory,
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
    let key = |stream| keys::robot(&config.robot, stream);
    let missions = Inbox::<Mission>::new(session, &key("mission")?)?;
    let mut arbiter = Arbiter {
        config: config.clone(),
        session: session.clone(),
        membership: Arc::new(Membership::follow(session)?),
        fields: Arc::new(Fields::new(session)),
        peers: Arc::new(ZenohPeers::new(session)),
        beliefs: Latest::new(Inbox::new(session, &key("belief")?)?),
        people: Latest::new(Inbox::new(session, &key("people")?)?),
        decisions: Topic::new(session, &key("decision")?, Flow::Control)?,
        reports: Topic::new(session, &key("report")?, Flow::Report)?,
        mission_key: key("mission")?,
        decision_key: key("decision")?,
        mission: None,
        context: None,
        warming: None,
        memory: Memory::default(),
        planned: None,
    };
    let _token = announce(session, "arbiter", &config.instance)?;
    arbiter.memory.epoch = 1;
    arbiter.raise_epoch().await;
    on_ready();
    tracing::info!(robot = %config.robot, epoch = arbiter.memory.epoch, "arbiter ready");
    if let Ok(mission) = fetch::<Mission>(session, &arbiter.mission_key, MISSION_TIMEOUT).await {
        arbiter.take(mission).await;
    }
    loop {
        tokio::select! {
            biased;
            () = shutdown.requested() => break,
            mission = missions.next() => match mission {
                Some(mission) => arbiter.take(mission).await,
                None => break,
            },
            belief = arbiter.beliefs.next() => match belief.cloned() {
                Some(belief) => arbiter.tick(belief).await,
                None => break,
            },
        }
    }
    if let Some(warming) = arbiter.warming.take() {
        warming.abort();
    }
    Ok(())
}

impl Arbiter {
    /// Makes the epoch one more than that of the last decision the driver has seen from somebody else, so
    /// that it obeys this arbiter and no longer the one before.
    async fn raise_epoch(&mut self) {
        let last = fetch::<Decision>(&self.session, &self.decision_key, MISSION_TIMEOUT).await;
        if let Ok(last) = last
            && (last.epoch, last.seq) > (self.memory.epoch, self.memory.seq)
        {
            self.memory.epoch = last.epoch + 1;
        }
    }

    /// A mission, or a change of the one at hand.
    async fn take(&mut self, mission: Mission) {
        let known = self.mission.as_ref().map(|m| (m.run, m.revision));
        self.mission = Some(mission.clone());
        let over = matches!(mission.state, MissionState::Cancelled | MissionState::Finished);
        if known == Some((mission.run, mission.revision)) || over {
            return;
        }
        let prepared = self.prepare(&mission).await;
        if known.is_none_or(|(run, _)| run != mission.run) {
            // Nothing of the new run can be on its way before this role has reported ready.
            self.beliefs.clear();
            self.people.clear();
            self.planned = None;
        }
        match prepared {
            Ok(()) => {
                let (role, instance) = ("arbiter", &self.config.instance);
                report_ready(&self.session, &self.mission_key, role, instance, mission.revision).await;
            }
            Err(error) => {
                tracing::error!(%error, "the mission cannot be planned");
                let reason = format!("arbiter: {error}");
                let request = MissionRequest::Finish { revision: mission.revision, reason };
                tell_driver(&self.session, &self.mission_key, &request).await;
            }
        }
    }

    async fn prepare(&mut self, mission: &Mission) -> anyhow::Result<()> {
        if let Some(warming) = self.warming.take() {
            warming.abort();
            // Until it has ended it could still call somebody warm.
            let _ = warming.await;
        }
        self.peers.clear();
        self.raise_epoch().await;
        self.context = None;
        self.memory = self.memory.fresh();
        let (fields, mission) = (Arc::clone(&self.fields), mission.clone());
        let context =
            Arc::new(tokio::task::spawn_blocking(move || PlanContext::new(mission, &fields)).await??);
        self.warming = Some(tokio::spawn(keep_warm(
            self.session.clone(),
            Arc::clone(&self.membership),
            Arc::clone(&self.peers),
            Arc::clone(&context),
        )));
        self.wait_for_pool(&context).await;
        self.context = Some(context);
        Ok(())
    }

    async fn wait_for_pool(&self, context: &PlanContext) {
        let roles: Vec<&str> = std::iter::once(GENERATOR).chain(context.pool_metrics()).collect();
        let deadline = tokio::time::Instant::now() + POOL_PATIENCE;
        // Every replica that is alive now should be warm, and there should be one of each role.
        let cold = |role: &&&str| {
            let (warm, alive) = (self.peers.warm(role).len(), self.membership.of(role).len());
            warm == 0 || warm < alive
        };
        while let Some(role) = roles.iter().find(cold) {
            // A metric without a home here is worth any wait: without it nothing can be followed.
            let replaceable = *role == GENERATOR || context.local(role).is_some();
            if replaceable && tokio::time::Instant::now() >= deadline {
                tracing::warn!(
                    role,
                    "no warm replica of every role yet; what is missing is computed in process"
                );
                return;
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }

    /// Plans on every `plan_every`-th tick of the localiser.
    async fn tick(&mut self, mut belief: Belief) {
        let Some(mission) = self.mission.clone() else { return };
        let period = u64::from(mission.plan_every.max(1));
        let due = match mission.clock {
            Clock::Lockstep => belief.tick % period == 0,
            Clock::Realtime => {
                if let Some(newest) = self.beliefs.newest() {
                    belief = newest.clone();
                }
                self.planned.is_none_or(|last| belief.tick >= last + period)
            }
        };
        if !due {
            return;
        }
        self.planned = Some(belief.tick);
        let (decision, report) = self.decide(&mission, belief).await;
        self.decisions.publish(&decision, mission.clock);
        if let Some(report) = report {
            self.reports.publish(&report, mission.clock);
        }
    }

    async fn decide(&mut self, mission: &Mission, belief: Belief) -> (Decision, Option<CycleReport>) {
        let context = self
            .context
            .clone()
            .filter(|c| (c.mission.run, c.mission.revision) == (mission.run, mission.revision));
        let stop = |memory: &mut Memory, reason: &str, degraded| {
            memory.seq += 1;
            (report::stop((memory.epoch, memory.seq), &belief, mission.tick_s, reason, degraded), None)
        };
        if mission.state != MissionState::Running {
            return stop(&mut self.memory, &format!("the mission is {}", mission.state), false);
        }
        let Some(context) = context else {
            return stop(&mut self.memory, "the mission is not prepared", true);
        };
        let people = self.people.of_tick(belief.tick, mission.clock).await.cloned();
        let people = match people {
            Some(people) if belief.stamp - people.stamp <= PEOPLE_AGE_MAX => people,
            _ => return stop(&mut self.memory, "nobody says where people are", true),
        };
        let observation = Observation { belief: belief.clone(), people };
        match cycle::plan(&self.peers, &context, &mut self.memory, observation).await {
            Ok((decision, report)) => (decision, Some(report)),
            Err(reject) => {
                tracing::error!(%reject, "the cycle failed");
                stop(&mut self.memory, "the cycle failed", true)
            }
        }
    }
}
