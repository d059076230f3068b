//! The arbiter on its robot: from mission to decisions.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::sync::Arc;
use std::time::Instant;

use curionav_planning::arbitration::Localising;
use curionav_planning::geometry::Point2;
use curionav_pool::context::PlanContext;
use curionav_pool::peers::ZenohPeers;
use curionav_pool::pool::Pool;
use curionav_robot::arbiter::cycle::look_around;
use curionav_robot::arbiter::memory::Memory;
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_runtime::lockstep::{Latest, has_started_over};
use curionav_runtime::mission_course::doubt;
use curionav_runtime::mission_follower::{MissionFollower, follow};
use curionav_runtime::process::{Running, Start};
use curionav_runtime::robot_service::{RobotService, first_run, supersedes};
use curionav_runtime::topic::{Flow, OnDemand, Topic};
use curionav_schemas::{
    self as wire, Belief, Clock, CycleReport, Decision, Mission, MissionState, People, Refusal, Reject, Twist,
};
use tokio::task::{JoinError, JoinHandle, JoinSet};

use crate::cycle;
use crate::cycle_counts::CycleCounts;
use crate::obstacle_sensing::ObstacleSensing;
use crate::readiness::await_pool;

struct Arbiter {
    service: RobotService,
    fields: Fields,
    in_process: bool,
    alone: bool,
    pool: Arc<Pool<ZenohPeers>>,
    /// What keeps the replicas of the pool ready.
    keeping_ready: JoinSet<()>,
    beliefs: Latest<Belief>,
    people: Latest<People>,
    /// What stands around the robot that is on no map.
    sensing: ObstacleSensing,
    /// What the driver commands, and on whose decision.
    commands: Latest<Twist>,
    decisions: Topic<Decision>,
    reports: OnDemand<CycleReport>,
    memories: OnDemand<wire::Memory>,
    context: Option<Arc<PlanContext>>,
    memory: Memory,
    /// The run in which the robot was last given a way.
    follows: Option<u64>,
    /// Tick of the last decision.
    planned: Option<u64>,
    /// How far a robot that does not know where it is has looked around.
    localising: Localising,
    /// When it heard of the mission, until its first decision.
    heard: Option<Instant>,
    counts: CycleCounts,
}

/// Plans for one robot until `shutdown`; `on_ready` is called once it follows missions.
pub fn run(start: Start<'_>) -> Running<'_> {
    Box::pin(async move {
        let Start { config, session, fields, mut shutdown, on_ready } = start;
        let service = tokio::select! {
            () = shutdown.requested() => return Ok(()),
            service = RobotService::with_control("arbiter", config, session) => service?,
        };
        let missions = service.inbox("mission")?;
        let mut arbiter = Arbiter {
            fields: fields.clone(),
            in_process: config.in_process,
            alone: config.takes_turns,
            pool: Arc::new(Pool::counted(
                ZenohPeers::new(session, config.takes_turns)?,
                service.counts.refused.clone(),
            )),
            keeping_ready: JoinSet::new(),
            beliefs: Latest::new(service.inbox("belief")?),
            people: Latest::new(service.inbox("people")?),
            sensing: ObstacleSensing::new(
                Latest::new(service.inbox("scan")?),
                service.further_scans()?,
                Latest::new(service.inbox("odom")?),
            ),
            commands: Latest::new(service.inbox("cmd")?),
            decisions: service.topic("decision", Flow::Control)?,
            reports: service.on_demand("report", Flow::Report)?,
            memories: service.on_demand("memory", Flow::Report)?,
            service,
            context: None,
            memory: Memory::new(epoch()),
            follows: None,
            planned: None,
            localising: Localising::default(),
            heard: None,
            counts: CycleCounts::new(),
        };
        let mut metrics = arbiter.service.metrics();
        arbiter.counts.register(&mut metrics, &arbiter.pool);
        let announced = arbiter.service.announce(metrics)?;
        on_ready(announced.metrics_address());
        follow(&mut arbiter, &missions, shutdown).await
    })
}

/// Which arbiter this is: later ones have greater numbers, and of two that start in the same millisecond the random
/// part differs.
fn epoch() -> u64 {
    const RANDOM_BITS: u32 = 10;
    let random = RandomState::new().build_hasher().finish();
    (first_run() << RANDOM_BITS) | (random & ((1 << RANDOM_BITS) - 1))
}

impl MissionFollower for Arbiter {
    type Tick = Belief;

    fn service(&self) -> &RobotService {
        &self.service
    }

    async fn prepare(&mut self, mission: &Mission) -> Result<(), Reject> {
        let heard = Instant::now();
        // Until it has ended it could still call a replica ready.
        self.keeping_ready.shutdown().await;
        // Evaluators are asked nothing about a way: they stay ready, and the robot drives on without waiting for them.
        let goes_on = self.goes_on(mission);
        if !goes_on {
            self.pool.clear();
            self.memory = self.memory.fresh();
            self.context = None;
        }
        self.follows = mission.order.way.as_ref().map(|_| mission.run);
        self.sensing.watch.follow(convert::parameters("tracker", &mission.order.tracker_parameters())?);
        let fields = self.fields.clone();
        let mission = mission.clone();
        let in_process = self.in_process;
        let alone = self.alone;
        let preparing = move || {
            let context = PlanContext::new(mission, &fields, in_process)?.alone(alone);
            if let Some(doubt) = doubt(&context.mission, &context.course) {
                tracing::warn!(goal = ?context.course.goal, "{doubt}");
            }
            Ok::<_, Reject>(context)
        };
        let preparing = tokio::task::spawn_blocking(preparing);
        let prepared = self.decide_until(preparing).await;
        self.context = None;
        self.heard = Some(heard);
        let context = Arc::new(prepared.map_err(Refusal::failed)??);
        self.counts.follow(context.pool_roles().map(str::to_owned));
        let pool = Arc::clone(&self.pool);
        let of = Arc::clone(&context);
        self.keeping_ready.spawn(async move { pool.keep_ready(&of).await });
        if !goes_on {
            await_pool(&self.pool, &context).await?;
        }
        self.context = Some(context);
        Ok(())
    }

    /// Once another arbiter has begun the mission, it is no longer for this one to refuse it. Of ways along which a
    /// robot is led each is derived, as far as there is time: of those that are given faster none would ever be.
    fn is_superseded(said: &Mission, mission: &Mission) -> bool {
        let leads_on = said.run == mission.run
            && !said.is_over()
            && said.order.way.is_some()
            && mission.order.way.is_some();
        supersedes(said, mission) && !leads_on || said.has_run != mission.has_run
    }

    fn forget_run(&mut self) {
        self.beliefs.clear();
        self.people.clear();
        self.sensing.forget();
        self.commands.clear();
        self.planned = None;
    }

    async fn next(&mut self) -> Option<Belief> {
        self.beliefs.next().await.cloned()
    }

    /// Plans on every `plan_every`-th tick of the localiser.
    async fn answer(&mut self, mut belief: Belief, mission: &Mission) {
        let clock = mission.order.clock;
        let period = u64::from(mission.order.plan_every.max(1));
        if clock == Clock::Realtime
            && let Some(newest) = self.beliefs.newest()
        {
            belief = newest.clone();
        }
        if self.planned.is_some_and(|last| has_started_over(last, belief.tick)) {
            tracing::warn!(tick = belief.tick, last = ?self.planned, "the base has started over");
            self.planned = None;
            self.sensing.forget();
            self.commands.clear();
            self.memory = self.memory.fresh();
        }
        let people = self.people.of_tick(belief.tick, clock).await.cloned();
        if let Some(context) = self.context.as_deref() {
            self.sensing.see(&belief, people.as_ref(), context, clock).await;
        }
        let due = match clock {
            Clock::Lockstep => belief.tick.is_multiple_of(period),
            Clock::Realtime => self.planned.is_none_or(|last| belief.tick >= last.saturating_add(period)),
        };
        if !due {
            return;
        }
        let started = Instant::now();
        self.observe_command(belief.tick, clock).await;
        self.planned = Some(belief.tick);
        let obstructed = self.obstructed(Point2::new(belief.x, belief.y));
        let context = obstructed.as_deref();
        let carried = self.memories.is_heard().then(|| self.memory.to_wire(mission));
        let believed = convert::belief(&belief);
        let (mut decision, outcome) =
            cycle::decide(&self.pool, context, &mut self.memory, mission, belief, people).await;
        decision = look_around(decision, &mut self.localising, &self.sensing.watch, &believed, mission);
        if self.memory.are_ways_closed() {
            self.sensing.watch.look_again(decision.stamp);
        }
        self.decisions.publish(&decision, clock);
        if let Some(heard) = self.heard.take() {
            let ms = |since: Instant| 1e3 * since.elapsed().as_secs_f64();
            tracing::debug!(ms = ms(heard), cycle_ms = ms(started), "first decision of the mission");
        }
        self.counts.record(&decision, outcome.as_ref());
        self.service.counts.record(started.elapsed());
        let Some((context, outcome)) = context.zip(outcome) else { return };
        // Before the report: a recorder that has the memory can wait for the report.
        if let Some(carried) = carried {
            self.memories.publish(&carried, clock);
        }
        if self.reports.is_heard() {
            self.reports.publish(&outcome.report(context, decision), clock);
        }
    }
}

impl Arbiter {
    /// Whether a mission leads a robot that is on a way along another one: what has been decided is still of use then.
    fn goes_on(&self, mission: &Mission) -> bool {
        mission.order.way.is_some() && self.follows == Some(mission.run)
    }

    /// Waits until something is `derived`, and meanwhile goes on deciding along the way before, if there is one: on a
    /// large map it takes longer than a decision lasts.
    async fn decide_until<T>(&mut self, mut derived: JoinHandle<T>) -> Result<T, JoinError> {
        let Some(before) = self.context.clone() else { return derived.await };
        // It was still preparing when it was said.
        let before = Mission { state: MissionState::Running, ..before.mission.clone() };
        loop {
            tokio::select! {
                biased;
                outcome = &mut derived => return outcome,
                Some(belief) = self.next() => self.answer(belief, &before).await,
            }
        }
    }

    /// The mission with what is known of obstacles now, for a robot that is `here`.
    fn obstructed(&self, here: Point2) -> Option<Arc<PlanContext>> {
        let base = self.context.as_ref()?;
        let obstacles = self.sensing.watch.obstacles();
        if obstacles.is_empty() {
            return Some(Arc::clone(base));
        }
        match tokio::task::block_in_place(|| base.obstructed(obstacles, here, &self.fields)) {
            Ok(context) => Some(Arc::new(context)),
            Err(reject) => {
                tracing::warn!(%reject, "there is no course past obstacles");
                None
            }
        }
    }

    /// Takes note of what the driver has done. In lockstep its command of the tick before is waited for, so that a
    /// cycle always starts from the same; of a run that it has not yet planned in it has missed commands.
    async fn observe_command(&mut self, tick: u64, clock: Clock) {
        let command = match (clock, self.planned, tick.checked_sub(1)) {
            (Clock::Lockstep, Some(_), Some(before)) => self.commands.of_tick(before, clock).await,
            _ => self.commands.newest(),
        };
        if let Some(command) = command {
            self.memory.observe_command(command);
        }
    }
}
