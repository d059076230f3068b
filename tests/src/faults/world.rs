//! Everything that is simulated, and the network between it.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use curionav_planning::random::{Rng, rng, uniform};
use curionav_pool::context::PlanContext;
use curionav_pool::peers::{Call, Peers};
use curionav_pool::question::{EvaluateQuestion, GenerateQuestion};
use curionav_runtime::fields::Fields;
use curionav_runtime::query::AskError;
use curionav_schemas::{
    Belief, CycleReport, Decision, EvaluateRequest, GenerateReply, GenerateRequest, Message, Mission, People,
    Scores, Twist,
};
use tokio::sync::Notify;

use super::executor::{Executor, TaskId};
use super::fault::{Episode, Fault};
use super::replica::{Answer, Job, Question, Replica, serve};
use super::robot::Robot;
use crate::invariants::Checker;

/// How long a hung or cut-off process still counts as alive: the lease of its link.
const LEASE: Duration = Duration::from_secs(1);
/// How long one that is back takes to be seen.
const JOIN: Duration = Duration::from_millis(100);

/// Role and instance.
pub(super) type Name = (String, String);

/// What one arbiter has heard of the robot, and how to wake it.
#[derive(Default)]
pub(super) struct Heard {
    pub(super) belief: Option<Belief>,
    pub(super) people: Option<People>,
    /// The driver's newest.
    pub(super) command: Option<Twist>,
}

#[derive(Default)]
pub(super) struct ArbiterSeat {
    pub(super) latest: Mutex<Heard>,
    pub(super) arrived: Notify,
    pub(super) members: Notify,
    pub(super) task: Mutex<Option<TaskId>>,
}

pub(super) struct State {
    pub(super) rng: Rng,
    pub(super) faults: Vec<Fault>,
    pub(super) replicas: BTreeMap<Name, Replica>,
    pub(super) arbiters: Vec<Arc<ArbiterSeat>>,
    /// What every arbiter decided, with what it was decided from.
    pub(super) decided: Vec<(Decision, Option<CycleReport>)>,
    /// When an arbiter asked a replica which question.
    pub(super) asked: Vec<(Duration, String)>,
    /// How often replicas of a role were asked for work.
    pub(super) work_asked: BTreeMap<String, usize>,
    /// How often a robot, whose name comes first, was answered in time by replicas of a role.
    pub(super) work_answered: BTreeMap<(String, String), usize>,
    /// Questions that replicas answered in a flood.
    pub(super) flood_answered: usize,
    pub(super) robot: Robot,
    pub(super) checker: Checker,
    pub(super) arbiters_started: u64,
    /// Which arbiter an epoch is of.
    pub(super) epochs: BTreeMap<u64, u64>,
}

/// The world of one seed.
pub(super) struct World {
    pub(super) executor: Executor,
    pub(super) fields: Fields,
    pub(super) mission: Mission,
    pub(super) in_process: bool,
    /// What scoring one candidate in process takes on the robot's computer.
    pub(super) local_cost: Duration,
    state: Mutex<State>,
}

impl World {
    pub(super) fn new(fields: &Fields, mission: Mission, in_process: bool, pool: [usize; 3]) -> Arc<Self> {
        let mut rng = rng(mission.order.seed, 77);
        let local_cost = Duration::from_secs_f64(0.0001 + 0.002 * uniform(&mut rng));
        let context = PlanContext::new(mission.clone(), fields, true).unwrap();
        let state = State {
            rng,
            faults: Vec::new(),
            replicas: BTreeMap::new(),
            arbiters: Vec::new(),
            decided: Vec::new(),
            asked: Vec::new(),
            work_asked: BTreeMap::new(),
            work_answered: BTreeMap::new(),
            flood_answered: 0,
            robot: Robot::new(&mission),
            checker: Checker::new(format!("seed {}", mission.order.seed), vec![Arc::new(context)], 0.0),
            arbiters_started: 0,
            epochs: BTreeMap::new(),
        };
        let world = Arc::new(Self {
            executor: Executor::default(),
            fields: fields.clone(),
            mission,
            in_process,
            local_cost,
            state: Mutex::new(state),
        });
        for (role, count) in ["generator", "cpc", "cnc"].into_iter().zip(pool) {
            for i in 0..count {
                world.start_replica((role.to_owned(), format!("{role}-{i}")));
            }
        }
        world.executor.spawn(liveliness(Arc::clone(&world)));
        world
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap()
    }

    pub(super) fn start_replica(self: &Arc<Self>, name: Name) {
        let slots = 1 + (name.1.len() + self.mission.order.seed as usize) % 2;
        let task = self.executor.spawn(serve(Arc::clone(self), name.clone()));
        let fresh = Replica::new(task, slots as u32, self.executor.now());
        self.state().replicas.insert(name, fresh);
    }

    /// Lets the faults of `episodes` begin and end.
    pub(super) async fn play(self: Arc<Self>, episodes: Vec<Episode>) {
        let mut changes: Vec<(Duration, bool, Fault)> = Vec::new();
        for Episode { fault, from, until } in episodes {
            changes.extend([(from, true, fault), (until, false, fault)]);
        }
        changes.sort_by_key(|change| change.0);
        for (at, begins, fault) in changes {
            self.executor.sleep(at.saturating_sub(self.executor.now())).await;
            self.change(begins, fault);
        }
    }

    pub(super) fn change(self: &Arc<Self>, begins: bool, fault: Fault) {
        {
            let mut state = self.state();
            if begins {
                state.faults.push(fault);
            } else if let Some(at) = state.faults.iter().position(|f| *f == fault) {
                state.faults.remove(at);
            }
            // A replica that hung looks for work again.
            state.replicas.values().for_each(|replica| replica.arrived.notify_one());
        }
        let names: Vec<Name> = self.state().replicas.keys().cloned().collect();
        for (index, name) in names.iter().enumerate() {
            let gone = self.is_down(index);
            let task =
                self.state().replicas.get_mut(name).and_then(|r| r.set_down(gone, self.executor.now()));
            match task {
                Some(Some(task)) => self.executor.kill(task),
                Some(None) => self.start_replica(name.clone()),
                None => {}
            }
        }
        match fault {
            Fault::ArbiterCrash if begins => self.stop_arbiters(),
            Fault::ArbiterCrash => super::arbiter::start(self),
            Fault::SecondArbiter if begins => super::arbiter::start(self),
            // The second one goes; should only one be left, it stays.
            Fault::SecondArbiter => self.stop_newest_arbiter(),
            Fault::DriverCrash if begins => {
                let mut state = self.state();
                state.robot.crash_driver();
                state.checker.driver_restarted();
            }
            Fault::Foreign(epoch) if begins => self.state().robot.receive_foreign(epoch),
            _ => {}
        }
    }

    fn stop_arbiters(&self) {
        let seats = std::mem::take(&mut self.state().arbiters);
        for seat in seats {
            let task = seat.task.lock().unwrap().take();
            task.into_iter().for_each(|task| self.executor.kill(task));
        }
    }

    fn stop_newest_arbiter(&self) {
        let seat = {
            let mut state = self.state();
            if state.arbiters.len() > 1 { state.arbiters.pop() } else { None }
        };
        let task = seat.and_then(|seat| seat.task.lock().unwrap().take());
        task.into_iter().for_each(|task| self.executor.kill(task));
    }

    /// Ends everything that would go on by itself.
    pub(super) fn stop(&self) {
        self.executor.stop();
    }

    pub(super) fn has(&self, fault: impl Fn(&Fault) -> bool) -> bool {
        self.state().faults.iter().any(fault)
    }

    fn is_down(&self, replica: usize) -> bool {
        self.has(|f| *f == Fault::Crash(replica) || *f == Fault::MassLeave)
    }

    pub(super) fn index(&self, name: &Name) -> usize {
        self.state().replicas.keys().position(|other| other == name).unwrap_or(usize::MAX)
    }

    /// How long a message is under way, if it arrives, and whether it arrives twice.
    pub(super) fn travel(&self) -> (Option<Duration>, bool) {
        let mut state = self.state();
        let mut way = (0.0005, 0.0, 0.0);
        for fault in &state.faults {
            if let Fault::Weather { delay, loss, repeated } = fault {
                way = (delay.max(way.0), loss.max(way.1), repeated.max(way.2));
            }
        }
        let (luck, wait, again) = (uniform(&mut state.rng), uniform(&mut state.rng), uniform(&mut state.rng));
        // Half to twice the mean: messages overtake each other.
        let time = Duration::from_secs_f64(way.0 * (0.5 + 1.5 * wait * wait));
        ((luck >= way.1).then_some(time), again < way.2)
    }

    /// Sends something between arbiter and robot: `deliver` happens later, twice, or not at all.
    pub(super) fn send(self: &Arc<Self>, deliver: impl Fn(&Arc<Self>) + Send + 'static) {
        if self.has(|f| *f == Fault::NoRobot) {
            return;
        }
        let (time, twice) = self.travel();
        let Some(time) = time else { return };
        let world = Arc::clone(self);
        self.executor.spawn(async move {
            world.executor.sleep(time).await;
            deliver(&world);
            if twice {
                world.executor.sleep(time).await;
                deliver(&world);
            }
        });
    }

    fn note_asked(&self, role: &str, question: &Question) {
        let mut state = self.state();
        state.asked.push((self.executor.now(), format!("{role}: {}", question.name())));
        *state.work_asked.entry(role.to_owned()).or_default() += usize::from(question.is_work());
    }

    /// A question to a replica and back.
    async fn exchange(
        self: &Arc<Self>,
        name: Name,
        (robot, timeout): (&str, Duration),
        question: Question,
    ) -> Result<Answer, AskError> {
        let (is_work, whose) = (question.is_work(), (robot.to_owned(), name.0.clone()));
        self.note_asked(&name.0, &question);
        let asking = async {
            self.way_to_pool().await;
            let (job, answer) = Job::new(robot, question, self.executor.now());
            let twice = self.travel().1.then(|| job.again(self.executor.now()));
            {
                let mut state = self.state();
                let Some(replica) = state.replicas.get_mut(&name).filter(|r| r.is_up()) else {
                    return Err(AskError::NoReply);
                };
                replica.admit(job);
                twice.into_iter().for_each(|job| replica.admit(job));
            }
            // The process that held the question is gone.
            let answer = answer.await.map_err(|_| AskError::NoReply)?;
            self.way_to_pool().await;
            answer
        };
        let answer = tokio::select! {
            biased;
            answer = asking => answer,
            () = self.executor.sleep(timeout) => Err(AskError::Timeout),
        };
        if is_work && answer.is_ok() {
            *self.state().work_answered.entry(whose).or_default() += 1;
        }
        answer
    }

    /// Completes when a message between arbiter and pool has arrived; never if it is lost.
    async fn way_to_pool(&self) {
        let (time, _) = self.travel();
        match time.filter(|_| !self.has(|f| *f == Fault::NoPool)) {
            Some(time) => self.executor.sleep(time).await,
            None => std::future::pending().await,
        }
    }
}

/// Which replicas are seen to be alive follows, late, which are.
async fn liveliness(world: Arc<World>) {
    loop {
        world.executor.sleep(Duration::from_millis(50)).await;
        let now = world.executor.now();
        let cut = world.has(|f| *f == Fault::NoPool);
        let hung: Vec<bool> = {
            let n = world.state().replicas.len();
            (0..n).map(|i| cut || world.has(|f| *f == Fault::Hang(i))).collect()
        };
        let flood = world.has(|f| *f == Fault::Flood);
        let mut state = world.state();
        if flood {
            state.replicas.values_mut().for_each(|replica| replica.flood(now));
        }
        let mut changed = false;
        for (replica, hung) in state.replicas.values_mut().zip(hung) {
            changed |= replica.see(hung, now, LEASE, JOIN);
        }
        if changed {
            state.arbiters.iter().for_each(|seat| seat.members.notify_one());
        }
    }
}

/// The world as one arbiter sees it.
pub(super) struct SimulatedPeers {
    pub(super) world: Arc<World>,
    pub(super) seat: Arc<ArbiterSeat>,
    /// Set while it computes: then every look at the clock costs what scoring a candidate does.
    pub(super) computing: AtomicU64,
    /// By how many nanoseconds its computer is ahead of the world, if it is one of many: what one computes takes none
    /// of the others' time.
    pub(super) ahead: Option<AtomicU64>,
}

impl SimulatedPeers {
    /// Waits until the world has caught up.
    pub(super) async fn catch_up(&self) {
        let ahead = self.ahead.as_ref().map_or(0, |ahead| ahead.swap(0, Ordering::Relaxed));
        self.world.executor.sleep(Duration::from_nanos(ahead)).await;
    }
}

impl Peers for SimulatedPeers {
    fn now(&self) -> Duration {
        let cost = match self.computing.load(Ordering::Relaxed) {
            0 => Duration::ZERO,
            _ => self.world.local_cost,
        };
        match &self.ahead {
            None => {
                self.world.executor.pass(cost);
                self.world.executor.now()
            }
            Some(ahead) => {
                let before = ahead.fetch_add(cost.as_nanos() as u64, Ordering::Relaxed);
                self.world.executor.now() + Duration::from_nanos(before) + cost
            }
        }
    }

    async fn sleep(&self, time: Duration) {
        self.world.executor.sleep(time).await;
    }

    fn compute<R>(&self, work: impl FnOnce() -> R) -> R {
        self.computing.store(1, Ordering::Relaxed);
        let result = work();
        self.computing.store(0, Ordering::Relaxed);
        result
    }

    fn follow(&self, _: &[&str]) {}

    fn alive(&self, role: &str) -> Vec<String> {
        let state = self.world.state();
        let seen = state.replicas.iter().filter(|((of, _), replica)| of == role && replica.is_seen());
        seen.map(|((_, instance), _)| instance.clone()).collect()
    }

    async fn membership_changed(&self) {
        self.seat.members.notified().await;
    }

    async fn generate(
        &self,
        call: Call<'_>,
        question: &GenerateQuestion<'_>,
    ) -> Result<GenerateReply, AskError> {
        let name = ("generator".to_owned(), call.instance.to_owned());
        let request = GenerateRequest::decode(&question.encode(call.budget_ms()), None).unwrap();
        match self.world.exchange(name, (call.robot, call.timeout), Question::Generate(request)).await? {
            Answer::Generated(reply) => Ok(*reply),
            Answer::Scored(_) => Err(AskError::Malformed("scores".into())),
        }
    }

    async fn evaluate(
        &self,
        term: &str,
        call: Call<'_>,
        question: &EvaluateQuestion<'_>,
    ) -> Result<Scores, AskError> {
        let name = (term.to_owned(), call.instance.to_owned());
        let request = EvaluateRequest::decode(&question.encode(call.budget_ms()), None).unwrap();
        match self.world.exchange(name, (call.robot, call.timeout), Question::Evaluate(request)).await? {
            Answer::Scored(scores) => Ok(scores),
            Answer::Generated(_) => Err(AskError::Malformed("candidates".into())),
        }
    }
}
