//! Typed queryables with admission control.
//!
//! Zenoh calls back on its receiving threads, so the callback only puts the query into a bounded queue (or refuses it
//! as overloaded, at once); threads of our own compute and answer, one robot after the other.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use curionav_schemas::keys::Commanded;
use curionav_schemas::{Message, Refusal, Reject};
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use zenoh::key_expr::KeyExpr;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use crate::fair_queue::FairQueue;
use crate::incoming::{self, Admission, Askers, Served};
use crate::latency::Latency;
use crate::locked::locked;
use crate::metrics::{Metrics, Tally, durations};

/// Bytes of questions that may wait, but for room for one of the largest: a queue of batches of two thousand
/// candidates.
const QUEUE_BYTES: usize = 32 << 20;
/// Commands that are answered at once, and that may wait: those who give them ask once and wait.
const COMMANDS: (usize, usize) = (1, 64);
/// What a question counts for at least: it may hold on to the batch of Zenoh's that it came in.
const QUESTION_BYTES_MIN: usize = 64 << 10;

/// Counts of one server since it started.
#[derive(Debug)]
pub struct ServeCounts {
    /// Questions answered.
    pub answered: Counter,
    /// Questions and messages refused by the whole service, by the code of the refusal.
    pub refused: Tally,
    /// Questions waiting or being computed.
    pub in_flight: Gauge,
    /// Questions computed at once; zero for a service that answers none.
    slots: usize,
    /// Questions that may wait.
    queue: usize,
    duration: Histogram,
    latency: Mutex<Latency>,
}

impl Default for ServeCounts {
    fn default() -> Self {
        Self::of(0, 0, refusals())
    }
}

/// No refusals yet. One service has one tally, which all its servers and subscribers add to.
pub fn refusals() -> Tally {
    let refused = Tally::new(&["reason"]);
    // A count that is there from the start shows its first increase.
    Refusal::CODES.iter().for_each(|code| refused.add_many(&[code], 0));
    refused
}

impl ServeCounts {
    /// Nothing counted yet, of a server that computes `slots` questions at once and lets `queue` more wait.
    fn of(slots: usize, queue: usize, refused: Tally) -> Self {
        Self {
            answered: Counter::default(),
            refused,
            in_flight: Gauge::default(),
            slots,
            queue,
            duration: durations(),
            latency: Mutex::default(),
        }
    }

    /// One more answer, and how long it took.
    pub fn record(&self, took: Duration) {
        self.answered.inc();
        self.took(took);
    }

    fn took(&self, took: Duration) {
        self.duration.observe(took.as_secs_f64());
        locked(&self.latency).record(took);
    }

    /// One more refusal.
    pub fn refuse(&self, reject: &Reject) {
        self.refused.add(&[reject.why.code()]);
    }

    /// Questions waiting or being computed, for each that can be computed at once.
    pub fn load(&self) -> f64 {
        self.in_flight.get() as f64 / self.slots.max(1) as f64
    }

    /// Adds these counts to what a service says of itself.
    pub fn register(&self, metrics: &mut Metrics) {
        metrics.count("requests", "Questions, or ticks of a robot, answered", self.answered.clone());
        metrics.tally("refused", "Questions or messages refused", &self.refused);
        metrics.count(
            "request_duration_seconds",
            "From the arrival of a question or tick to its answer, waiting included",
            self.duration.clone(),
        );
        if self.slots == 0 {
            return;
        }
        let slots = self.slots;
        let queue = self.queue;
        metrics.gauge("slots", "Questions computed at once", move || slots as f64);
        metrics.gauge("queue_limit", "Questions that may wait", move || queue as f64);
        metrics.count("in_flight", "Questions waiting or being computed", self.in_flight.clone());
        let in_flight = self.in_flight.clone();
        metrics.gauge("queue_depth", "Questions waiting", move || {
            (in_flight.get() as f64 - slots as f64).max(0.0)
        });
    }

    /// Times from arrival to answer of the recent past.
    pub fn latency(&self) -> Latency {
        locked(&self.latency).clone()
    }
}

/// Questions that wait for a slot.
struct Waiting {
    queue: Mutex<(FairQueue<(Query, Instant)>, bool)>,
    /// The queue counts time from here.
    started: Instant,
    /// Signalled for each question, and for all when the server ends.
    arrived: Condvar,
}

impl Waiting {
    /// Adds a question of so many bytes, or gives back those that find no room.
    fn push(&self, robot: &str, bytes: usize, question: Query) -> Vec<Query> {
        let mut queue = locked(&self.queue);
        if queue.1 {
            return vec![question];
        }
        let bytes = bytes.max(QUESTION_BYTES_MIN);
        let now = Instant::now();
        let refused = queue.0.push(robot, bytes, now - self.started, (question, now));
        self.arrived.notify_one();
        refused.into_iter().map(|(question, _)| question).collect()
    }

    /// The next question, waited for; nothing once the server ends.
    fn wait(&self) -> Option<(Query, Instant)> {
        let mut queue = locked(&self.queue);
        loop {
            if let Some(next) = queue.0.pop() {
                return Some(next);
            }
            if queue.1 {
                return None;
            }
            queue = self.arrived.wait(queue).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// A question is over that [`wait`](Self::wait) has given: what its answer took, and the time that it gave.
    fn done(&self, robot: &str, took: Option<Duration>, budget: Option<Duration>) {
        locked(&self.queue).0.done(robot, took, budget);
    }

    fn end(&self) {
        locked(&self.queue).1 = true;
        self.arrived.notify_all();
    }
}

/// A running server; dropping it undeclares the key, answers what waits and ends its threads.
pub struct Server {
    queryable: Option<Queryable<()>>,
    waiting: Arc<Waiting>,
    threads: Vec<JoinHandle<()>>,
    counts: Arc<ServeCounts>,
}

impl Server {
    /// Counts since the start.
    pub fn counts(&self) -> Arc<ServeCounts> {
        Arc::clone(&self.counts)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        drop(self.queryable.take());
        self.waiting.end();
        for thread in self.threads.drain(..) {
            // A panic in a handler has already been reported by its thread.
            let _ = thread.join();
        }
    }
}

/// The key was refused or the threads could not be started.
#[derive(Debug, thiserror::Error)]
#[error("cannot serve {key}: {reason}")]
pub struct ServeError {
    key: String,
    reason: String,
}

impl ServeError {
    pub(crate) fn new(key: &str, reason: impl ToString) -> Self {
        Self { key: key.to_owned(), reason: reason.to_string() }
    }
}

/// Answers questions on `key` with `handler`, which is also told when the question came; what is refused is added to
/// `refused`.
pub fn serve<Q: Message, A: Message>(
    session: &Session,
    key: &str,
    at_once_and_waiting: (usize, usize),
    refused: &Tally,
    handler: impl Fn(Q, Instant) -> Result<A, Reject> + Send + Sync + 'static,
) -> Result<Server, ServeError> {
    let handler = move |question: Q, asked: Asked<'_>| (None, handler(question, asked.came));
    serve_in_time(session, key, at_once_and_waiting, refused, handler)
}

/// Who asks, and since when.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// The robot, or the one who commands; empty where the key names neither.
    pub name: &'a str,
    /// When it came.
    pub came: Instant,
}

/// The same for questions that are of use for a time alone, which the handler also gives. If the key ends with `/*`,
/// its last chunk is the name of the robot that asks: robots are served in turn, and a question that will not be
/// answered in the time that its robot gave for the last one is refused as overloaded when it comes.
pub fn serve_in_time<Q: Message, A: Message>(
    session: &Session,
    key: &str,
    at_once_and_waiting: (usize, usize),
    refused: &Tally,
    handler: impl Fn(Q, Asked<'_>) -> (Option<Duration>, Result<A, Reject>) + Send + Sync + 'static,
) -> Result<Server, ServeError> {
    let admission = Admission { most: Q::MAX_BYTES, check: Q::admit };
    let handler = move |payload: &[u8], asked: Asked<'_>| match Q::decode(payload, None) {
        Ok(question) => handler(question, asked),
        Err(reject) => (None, Err(reject)),
    };
    let askers = if key.ends_with("/*") { Askers::Robots } else { Askers::Unnamed };
    serve_all(session, (key, askers), at_once_and_waiting, admission, refused, handler)
}

/// Answers the commands of one kind to `robot`. `handler` is also told who gives one. Those who command are served in
/// turn, so that a flood of one holds up no other.
pub fn serve_commands<Q: Message, A: Message>(
    session: &Session,
    robot: &str,
    kind: Commanded,
    refused: &Tally,
    handler: impl Fn(Q, &str) -> Result<A, Reject> + Send + Sync + 'static,
) -> Result<Server, ServeError> {
    let key = kind.from_all(robot).map_err(|error| ServeError::new(robot, error))?;
    let admission = Admission { most: Q::MAX_BYTES, check: Q::admit };
    let handler = move |payload: &[u8], asked: Asked<'_>| {
        let answer = Q::decode(payload, None).and_then(|command| handler(command, asked.name));
        (None, answer)
    };
    serve_all(session, (&key, Askers::Commanders), COMMANDS, admission, refused, handler)
}

/// Answers questions that carry no payload: the current state, a map. Those that do carry one, and are refused,
/// are added to `refused`.
pub fn serve_state<A: Message>(
    session: &Session,
    key: &str,
    refused: &Tally,
    state: impl Fn() -> Result<A, Reject> + Send + Sync + 'static,
) -> Result<Server, ServeError> {
    let nothing =
        |length, _: Option<&str>| if length == 0 { Ok(()) } else { Err(Refusal::UnexpectedPayload.into()) };
    let admission = Admission { most: 0, check: nothing };
    serve_all(session, (key, Askers::Unnamed), (1, 64), admission, refused, move |_, _| (None, state()))
}

/// The general form: `handler` sees the bytes, and also says for how long an answer is of use; what it refuses is added
/// to `refused`.
fn serve_all<A: Message>(
    session: &Session,
    (key, askers): (&str, Askers),
    (slots, queue): (usize, usize),
    admission: Admission,
    refused: &Tally,
    handler: impl Fn(&[u8], Asked<'_>) -> (Option<Duration>, Result<A, Reject>) + Send + Sync + 'static,
) -> Result<Server, ServeError> {
    let counts = Arc::new(ServeCounts::of(slots, queue, refused.clone()));
    let waiting = Arc::new(Waiting {
        queue: Mutex::new((FairQueue::new(slots, queue, QUEUE_BYTES.max(admission.most)), false)),
        started: Instant::now(),
        arrived: Condvar::new(),
    });
    let handler = Arc::new(handler);
    let served = Arc::new(Served {
        key: KeyExpr::try_from(key.to_owned()).map_err(|e| ServeError::new(key, e))?,
        askers,
    });
    let queue = Arc::clone(&waiting);
    let counted = Arc::clone(&counts);
    // If what follows fails, dropping it ends the threads that have been started.
    let mut server = Server { queryable: None, waiting, threads: Vec::new(), counts };
    for slot in 0..slots {
        let waiting = Arc::clone(&queue);
        let handler = Arc::clone(&handler);
        let counts = Arc::clone(&counted);
        let served = Arc::clone(&served);
        let work = move || {
            while let Some(next) = waiting.wait() {
                answer(&waiting, &served, &*handler, &counts, next);
            }
        };
        let thread = std::thread::Builder::new().name(format!("serve-{slot}")).spawn(work);
        server.threads.push(thread.map_err(|e| ServeError::new(key, e))?);
    }
    let queryable = session
        .declare_queryable(key.to_owned())
        .complete(true)
        .callback(move |query| admit(&queue, &served, admission, &counted, query))
        .wait();
    server.queryable = Some(queryable.map_err(|e| ServeError::new(key, e))?);
    Ok(server)
}

fn admit(waiting: &Waiting, served: &Served, admission: Admission, counts: &ServeCounts, query: Query) {
    let bytes = match admission.admit(&query) {
        Ok(bytes) => bytes,
        Err(reject) => return refuse(&query, &reject, counts),
    };
    let asker = match served.asker(&query) {
        Ok(asker) => asker.to_owned(),
        Err(refusal) => return refuse(&query, &refusal.into(), counts),
    };
    counts.in_flight.inc();
    for refused in waiting.push(&asker, bytes, query) {
        counts.in_flight.dec();
        refuse(&refused, &Refusal::Overloaded.into(), counts);
    }
}

fn refuse(query: &Query, reject: &Reject, counts: &ServeCounts) {
    counts.refuse(reject);
    incoming::refuse(query, reject);
}

fn answer<A: Message>(
    waiting: &Waiting,
    served: &Served,
    handler: &impl Fn(&[u8], Asked<'_>) -> (Option<Duration>, Result<A, Reject>),
    counts: &ServeCounts,
    (query, came): (Query, Instant),
) {
    let begun = Instant::now();
    let name = served.asker(&query).unwrap_or_default();
    // A handler that panics has answered nothing yet; the next question finds the service alive.
    let failed = || Err(Refusal::failed("the service failed on this question").into());
    let handle = || handler(&incoming::payload(&query), Asked { name, came });
    let (budget, answered) = catch_unwind(AssertUnwindSafe(handle)).unwrap_or_else(|_| (None, failed()));
    let took = answered.is_ok().then(|| begun.elapsed());
    waiting.done(name, took, budget);
    match answered {
        Ok(answer) => {
            counts.answered.inc();
            served.answer(&query, &answer);
        }
        Err(reject) => {
            tracing::debug!(key = %served.key, asker = name, %reject, "question refused");
            refuse(&query, &reject, counts);
        }
    }
    counts.took(came.elapsed());
    counts.in_flight.dec();
}
