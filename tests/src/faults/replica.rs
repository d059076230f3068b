//! A replica of the pool: the real queue and the real work, on a clock of its own making.

use std::sync::Arc;
use std::time::Duration;

use curionav_planning::random::{Rng, uniform};
use curionav_pool::{evaluation_service, generator};
use curionav_runtime::fair_queue::FairQueue;
use curionav_runtime::query::AskError;
use curionav_schemas::{EvaluateRequest, GenerateReply, GenerateRequest, Message, Refusal, Scores};
use tokio::sync::{Notify, oneshot};

use super::executor::TaskId;
use super::fault::{Fault, Nonsense};
use super::world::{Name, World};

/// Requests that may wait, as in production.
pub(super) const QUEUE: usize = 16;
/// A term that is not built in.
pub(super) const FOREIGN: &str = "comfort";
/// How the names of the robots of a flood begin.
const OTHER: &str = "other-";
/// What deriving the fields of the hall takes.
const PREPARATION: Duration = Duration::from_millis(150);
/// What a question takes besides its candidates, and what each of these takes.
const WORK: Duration = Duration::from_millis(4);
const WORK_EACH: Duration = Duration::from_micros(200);

#[derive(Clone)]
pub(super) enum Question {
    Generate(GenerateRequest),
    Evaluate(EvaluateRequest),
}

impl Question {
    /// Whether it is no probe.
    pub(super) fn is_work(&self) -> bool {
        match self {
            Self::Generate(request) => request.iterations > 0,
            Self::Evaluate(request) => request.candidates.count > 0,
        }
    }

    /// The same for two questions only if any replica answers both alike.
    pub(super) fn name(&self) -> String {
        match self {
            Self::Generate(request) => format!("cycle {}, seed {}", request.seq, request.seed),
            Self::Evaluate(request) => format!("cycle {}, shard {}", request.seq, request.shard),
        }
    }
}

#[derive(Clone)]
pub(super) enum Answer {
    Generated(Box<GenerateReply>),
    Scored(Scores),
}

pub(super) struct Job {
    pub(super) question: Question,
    /// Who asks.
    robot: String,
    arrived: Duration,
    reply: oneshot::Sender<Result<Answer, AskError>>,
}

impl Job {
    pub(super) fn new(
        robot: &str,
        question: Question,
        arrived: Duration,
    ) -> (Self, oneshot::Receiver<Result<Answer, AskError>>) {
        let (reply, answer) = oneshot::channel();
        (Self { question, robot: robot.to_owned(), arrived, reply }, answer)
    }

    pub(super) fn again(&self, arrived: Duration) -> Self {
        Self::new(&self.robot, self.question.clone(), arrived).0
    }

    fn is_of_flood(&self) -> bool {
        self.robot.starts_with(OTHER)
    }

    /// The time that the answer is of use, if the question is no probe.
    fn budget(&self) -> Option<Duration> {
        self.question.is_work().then(|| match &self.question {
            Question::Generate(request) => Duration::from_millis(request.budget_ms.into()),
            Question::Evaluate(request) => Duration::from_millis(request.budget_ms.into()),
        })
    }
}

pub(super) struct Replica {
    /// The process, while it is there.
    task: Option<TaskId>,
    pub(super) queue: FairQueue<Job>,
    pub(super) arrived: Arc<Notify>,
    prepared: bool,
    slots: u32,
    previous: Option<Answer>,
    /// The last question taken, for others to ask as well.
    question: Option<Question>,
    seen: bool,
    /// Since when it can, or cannot, be heard.
    since: Duration,
    audible: bool,
}

impl Replica {
    pub(super) fn new(task: TaskId, slots: u32, now: Duration) -> Self {
        Self {
            task: Some(task),
            queue: FairQueue::new(1, QUEUE, usize::MAX),
            arrived: Arc::default(),
            prepared: false,
            slots,
            previous: None,
            question: None,
            seen: false,
            since: now,
            audible: true,
        }
    }

    pub(super) fn is_up(&self) -> bool {
        self.task.is_some()
    }

    pub(super) fn is_seen(&self) -> bool {
        self.seen
    }

    /// Takes the process away, giving its task to be killed, or says with `Some(None)` that it is to start.
    pub(super) fn set_down(&mut self, down: bool, now: Duration) -> Option<Option<TaskId>> {
        match (self.task, down) {
            (Some(task), true) => {
                (self.task, self.queue, self.prepared) = (None, FairQueue::new(1, QUEUE, usize::MAX), false);
                (self.audible, self.since) = (false, now);
                Some(Some(task))
            }
            (None, false) => Some(None),
            _ => None,
        }
    }

    /// Follows whether it is seen to be alive; whether that has changed.
    pub(super) fn see(&mut self, hung: bool, now: Duration, lease: Duration, join: Duration) -> bool {
        let audible = self.is_up() && !hung;
        if audible != self.audible {
            (self.audible, self.since) = (audible, now);
        }
        let lasted = now - self.since;
        let seen = match (audible, self.is_up()) {
            (true, _) => self.seen || lasted >= join,
            // A process that ends closes its link; one that hangs leaves it to time out.
            (false, false) => false,
            (false, true) => self.seen && lasted < lease,
        };
        std::mem::replace(&mut self.seen, seen) != seen
    }

    /// As a replica's server does: at once into the queue, or refused.
    pub(super) fn admit(&mut self, job: Job) {
        self.question = Some(job.question.clone());
        self.enqueue(job);
    }

    /// Five other robots ask what was asked last, each eight times.
    pub(super) fn flood(&mut self, now: Duration) {
        let Some(question) = self.question.clone().filter(|_| self.is_up()) else { return };
        for other in (0..40).map(|i| format!("{OTHER}{}", i % 5)) {
            self.enqueue(Job::new(&other, question.clone(), now).0);
        }
    }

    fn enqueue(&mut self, job: Job) {
        let (robot, now) = (job.robot.clone(), job.arrived);
        for refused in self.queue.push(&robot, 1, now, job) {
            let _ = refused.reply.send(Err(AskError::Rejected(Refusal::Overloaded.into())));
        }
        self.arrived.notify_one();
    }
}

/// Answers questions until its process is taken away.
pub(super) async fn serve(world: Arc<World>, name: Name) {
    // Its place in the world is taken right after it has started.
    world.executor.sleep(Duration::from_micros(1)).await;
    let index = world.index(&name);
    let arrived = Arc::clone(&world.state().replicas[&name].arrived);
    loop {
        let job = world.state().replicas.get_mut(&name).and_then(|replica| replica.queue.pop());
        let Some(job) = job else {
            arrived.notified().await;
            continue;
        };
        while world.has(|f| *f == Fault::Hang(index)) {
            arrived.notified().await;
        }
        let begun = world.executor.now();
        let (warms_up, count) = match &job.question {
            Question::Generate(request) => (request.iterations == 0, 10),
            Question::Evaluate(request) => (request.candidates.count == 0, request.candidates.count),
        };
        let prepared = world.state().replicas[&name].prepared;
        let mut slowness: f64 = 1.0;
        for fault in &world.state().faults {
            match fault {
                Fault::Slow(of, factor) if *of == index => slowness = slowness.max(*factor),
                Fault::Overload(factor) => slowness = slowness.max(*factor),
                _ => {}
            }
        }
        let work = if warms_up && !prepared { PREPARATION } else { WORK + WORK_EACH * count };
        world.executor.sleep(work.mul_f64(slowness)).await;
        while world.has(|f| *f == Fault::Hang(index)) {
            arrived.notified().await;
        }
        let mut answer = answer(&world, &name, &job, warms_up || prepared);
        if let Ok(Answer::Scored(scores)) = &mut answer {
            // The work takes no time of the simulated clock but the sleep above.
            scores.elapsed_us = (world.executor.now() - begun).as_micros() as u64;
        }
        if let Some(replica) = world.state().replicas.get_mut(&name) {
            let took = answer.is_ok().then(|| world.executor.now() - begun);
            replica.queue.done(&job.robot, took, job.budget());
        }
        world.state().flood_answered += usize::from(answer.is_ok() && job.is_of_flood());
        let answer = spoil(&world, &name, index, answer);
        if warms_up && let Some(replica) = world.state().replicas.get_mut(&name) {
            replica.prepared = true;
        }
        let _ = job.reply.send(answer);
    }
}

fn answer(world: &Arc<World>, name: &Name, job: &Job, prepared: bool) -> Result<Answer, AskError> {
    if !prepared {
        return Err(AskError::Rejected(Refusal::Cold { detail: "the map".into() }.into()));
    }
    let elapsed = || world.executor.now() - job.arrived;
    let answered = match &job.question {
        Question::Generate(request) => {
            let reply = generator::answer(&name.1, &world.fields, request.clone(), &elapsed);
            reply.map(|reply| Answer::Generated(Box::new(reply)))
        }
        Question::Evaluate(request) if name.0 == FOREIGN => Ok(Answer::Scored(foreign(name, request))),
        Question::Evaluate(request) => {
            let slots = world.state().replicas.get(name).map_or(1, |r| r.slots);
            let (request, fields) = (request.clone(), &world.fields);
            let scores = evaluation_service::answer(&name.0, &name.1, fields, request, slots, &elapsed);
            scores.map(Answer::Scored)
        }
    };
    answered.map_err(AskError::Rejected)
}

/// Costs under a term that is not built in: the same for all.
fn foreign(name: &Name, request: &EvaluateRequest) -> Scores {
    Scores {
        epoch: request.epoch,
        seq: request.seq,
        shard: request.shard,
        term: name.0.clone(),
        instance: name.1.clone(),
        cost: vec![1.0; request.candidates.count as usize].into(),
        elapsed_us: 0,
        slots: 1,
    }
}

/// What becomes of an answer where something is wrong with its replica.
fn spoil(
    world: &Arc<World>,
    name: &Name,
    index: usize,
    answer: Result<Answer, AskError>,
) -> Result<Answer, AskError> {
    let mut state = world.state();
    let nonsense = state.faults.iter().find_map(|fault| match fault {
        Fault::Garbage(of, nonsense) if *of == index => Some(*nonsense),
        _ => None,
    });
    let Ok(good) = &answer else { return answer };
    let good = good.clone();
    let previous = state.replicas.get_mut(name).and_then(|r| r.previous.replace(good.clone()));
    let Some(nonsense) = nonsense else { return answer };
    match (nonsense, good) {
        (Nonsense::Previous, good) => Ok(previous.unwrap_or(good)),
        (Nonsense::Shape, Answer::Scored(mut scores)) => {
            scores.cost.0.pop();
            Ok(Answer::Scored(scores))
        }
        (Nonsense::Shape, Answer::Generated(mut reply)) => {
            reply.candidates.dt *= 2.0;
            Ok(Answer::Generated(reply))
        }
        (Nonsense::NotANumber, Answer::Scored(mut scores)) => {
            scores.cost.0.fill(f64::NAN);
            Ok(Answer::Scored(scores))
        }
        (_, Answer::Scored(scores)) => through_bytes(&scores, nonsense, &mut state.rng).map(Answer::Scored),
        (_, Answer::Generated(reply)) => {
            through_bytes(&*reply, nonsense, &mut state.rng).map(|reply| Answer::Generated(Box::new(reply)))
        }
    }
}

fn through_bytes<M: Message>(message: &M, nonsense: Nonsense, rng: &mut Rng) -> Result<M, AskError> {
    let mut bytes = message.encode();
    let mut encoding = M::ENCODING.to_owned();
    match nonsense {
        Nonsense::Version => encoding = encoding.replace(".v1", ".v2"),
        Nonsense::Bytes => bytes.iter_mut().for_each(|byte| *byte = (256.0 * uniform(rng)) as u8),
        _ => bytes.truncate((uniform(rng) * bytes.len() as f64) as usize),
    }
    M::decode(&bytes, Some(&encoding)).map_err(|error| AskError::Malformed(error.to_string()))
}
