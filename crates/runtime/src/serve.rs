//! Typed queryables with admission control.
//!
//! Zenoh calls back on its receiving threads, so the callback only puts the query into a bounded queue (or refuses it
//! as overloaded, at once); threads of our own compute and answer, one robot after the other. Without threads, that is with
//! 0 questions at once, the callback answers as well. Within one process that is the thread that asks.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use curionav_schemas::limits::MAX_TEXT;
use curionav_schemas::{Message, Offer, Refusal, Reject, keys};
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use zenoh::key_expr::KeyExpr;
use zenoh::pubsub::Subscriber;
use zenoh::query::{Query, Queryable};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use crate::fair_queue::FairQueue;
pub use crate::intake::Offers;
use crate::intake::{BYTES_MIN, Intake, Item, Ready};
use crate::latency::Latency;
use crate::locked::locked;
use crate::metrics::{Metrics, Tally, durations};

/// Bytes of questions that may wait, but for room for one of the largest: a queue of batches of two thousand candidates.
const QUEUE_BYTES: usize = 32 << 20;

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
        let (slots, queue) = (self.slots, self.queue);
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

/// What waits for a slot, its bytes, and when it came.
type Arrived = (Item, usize, Instant);

/// Queries, and offers to them, that wait for a slot.
struct Waiting {
    queue: Mutex<(FairQueue<Arrived>, bool)>,
    /// The queue counts time from here.
    started: Instant,
    /// Signalled for each arrival, and for all when the server ends.
    arrived: Condvar,
    /// Whether the key takes the questions of every robot, each with the robot's name as its last chunk.
    is_pool: bool,
}

impl Waiting {
    /// Adds what came from `robot`, of so many bytes, or gives back what finds no room.
    fn push(&self, robot: &str, bytes: usize, item: Item) -> Vec<Item> {
        let mut queue = locked(&self.queue);
        if queue.1 {
            return vec![item];
        }
        let (bytes, now) = (bytes.max(BYTES_MIN), Instant::now());
        let refused = queue.0.push(robot, bytes, now - self.started, (item, bytes, now));
        self.arrived.notify_one();
        refused.into_iter().map(|(item, ..)| item).collect()
    }

    /// What is next; nothing if nothing waits.
    fn pop(&self) -> Option<Arrived> {
        locked(&self.queue).0.pop()
    }

    /// What is next, waited for; nothing once the server ends.
    fn wait(&self) -> Option<Arrived> {
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

    /// Something is over that [`pop`](Self::pop) or [`wait`](Self::wait) has given: what its answer took, and the time that
    /// it gave.
    fn done(&self, robot: &str, took: Option<Duration>, budget: Option<Duration>) {
        locked(&self.queue).0.done(robot, took, budget);
    }

    /// The robot that asks with this key: its last chunk, or the same for all questions of a server that has no pool.
    fn asker<'a>(&self, key: &'a KeyExpr<'_>) -> Option<&'a str> {
        keys::asker(key).or((!self.is_pool).then_some(""))
    }

    /// Whom an item is from or about; nothing if a pool's question does not say it.
    fn robot(&self, item: &Item) -> Option<String> {
        match item {
            Item::Asked(query) => self.asker(query.key_expr()).map(str::to_owned),
            Item::Offered { robot, .. } => Some(robot.clone()),
        }
    }

    fn end(&self) {
        locked(&self.queue).1 = true;
        self.arrived.notify_all();
    }
}

/// A running server; dropping it undeclares the key, answers what waits and ends its threads.
pub struct Server {
    queryable: Option<Queryable<()>>,
    offers: Option<Subscriber<()>>,
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
        drop((self.queryable.take(), self.offers.take()));
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
pub fn serve<Q: Message + Send + 'static, A: Message>(
    session: &Session,
    key: &str,
    at_once_and_waiting: (usize, usize),
    refused: &Tally,
    handler: impl Fn(Q, Instant) -> Result<A, Reject> + Send + Sync + 'static,
) -> Result<Server, ServeError> {
    let handler = move |question: Q, asked: Asked<'_>| (None, handler(question, asked.came));
    serve_in_time(session, key, at_once_and_waiting, refused, None, handler)
}

/// Who asks, and since when the question is complete.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// The robot; empty where the key names none.
    pub robot: &'a str,
    /// When it came, with all that it had to wait for.
    pub came: Instant,
}

/// The same for questions that are of use for a time alone, which the handler also gives. If the key ends with `/*`, its
/// last chunk is the name of the robot that asks: robots are served in turn, and a question that will not be answered in
/// the time that its robot gave for the last one is refused as overloaded when it comes. With `offers` a question may come
/// before its candidates; it then counts as coming when both are there.
pub fn serve_in_time<Q: Message + Send + 'static, A: Message>(
    session: &Session,
    key: &str,
    at_once_and_waiting: (usize, usize),
    refused: &Tally,
    offers: Option<Offers<Q>>,
    handler: impl Fn(Q, Asked<'_>) -> (Option<Duration>, Result<A, Reject>) + Send + Sync + 'static,
) -> Result<Server, ServeError> {
    let admission = Admission { most: Q::MAX_BYTES, check: Q::admit };
    let intake = Intake::new(|bytes| Q::decode(bytes, None), offers);
    serve_queries(session, key, at_once_and_waiting, (admission, intake), refused, handler)
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
    let intake = Intake::new(|_| Ok(()), None);
    serve_queries(session, key, (1, 64), (admission, intake), refused, move |(), _| (None, state()))
}

/// What a question may be, before anything of it is read.
#[derive(Clone, Copy)]
struct Admission {
    /// Bytes of the longest.
    most: usize,
    /// By length and encoding.
    check: fn(usize, Option<&str>) -> Result<(), Reject>,
}

impl Admission {
    /// The bytes that a question brings along, if it may be asked. All that is not its payload says nothing here, so it is
    /// short or refused.
    fn bytes(&self, query: &Query) -> Result<usize, Reject> {
        let beside = query.attachment().map_or(0, |a| a.len()) + query.parameters().as_str().len();
        if beside > MAX_TEXT {
            return Err(Refusal::Oversize { found: beside as u64, most: MAX_TEXT as u64 }.into());
        }
        let (length, encoding) =
            (query.payload().map_or(0, |p| p.len()), query.encoding().map(ToString::to_string));
        (self.check)(length, encoding.as_deref().filter(|_| length > 0))?;
        Ok(length)
    }
}

/// The general form: `handler` also says for how long an answer is of use; what it refuses is added to `refused`.
fn serve_queries<Q: Send + 'static, A: Message>(
    session: &Session,
    key: &str,
    (slots, queue): (usize, usize),
    (admission, intake): (Admission, Intake<Q>),
    refused: &Tally,
    handler: impl Fn(Q, Asked<'_>) -> (Option<Duration>, Result<A, Reject>) + Send + Sync + 'static,
) -> Result<Server, ServeError> {
    let counts = Arc::new(ServeCounts::of(slots.max(1), queue, refused.clone()));
    let waiting = Arc::new(Waiting {
        queue: Mutex::new((FairQueue::new(slots, queue, QUEUE_BYTES.max(admission.most)), false)),
        started: Instant::now(),
        arrived: Condvar::new(),
        is_pool: key.ends_with("/*"),
    });
    let (handler, intake) = (Arc::new(handler), Arc::new(intake));
    let own = KeyExpr::try_from(key.to_owned()).map_err(|e| ServeError::new(key, e))?;
    let (queue, counted) = (Arc::clone(&waiting), Arc::clone(&counts));
    // If what follows fails, dropping it ends the threads that have been started.
    let mut server = Server { queryable: None, offers: None, waiting, threads: Vec::new(), counts };
    for slot in 0..slots {
        let (waiting, handler, counts) = (Arc::clone(&queue), Arc::clone(&handler), Arc::clone(&counted));
        let (own, intake) = (own.clone(), Arc::clone(&intake));
        let work = move || {
            while let Some(next) = waiting.wait() {
                answer(&waiting, &own, (&intake, &*handler), &counts, next);
            }
        };
        let thread = std::thread::Builder::new().name(format!("serve-{slot}")).spawn(work);
        server.threads.push(thread.map_err(|e| ServeError::new(key, e))?);
    }
    if let Some(offers) = intake.offers_key() {
        let (queue, counted, intake) = (Arc::clone(&queue), Arc::clone(&counted), Arc::clone(&intake));
        let subscriber = session
            .declare_subscriber(offers.to_owned())
            .callback(move |sample| admit_offer(&queue, &intake, &counted, &sample))
            .wait();
        server.offers = Some(subscriber.map_err(|e| ServeError::new(key, e))?);
    }
    let queryable = session
        .declare_queryable(key.to_owned())
        .complete(true)
        .callback(move |query| {
            admit(&queue, (admission, &intake), &counted, query);
            while slots == 0
                && let Some(next) = queue.pop()
            {
                answer(&queue, &own, (&intake, &*handler), &counted, next);
            }
        })
        .wait();
    server.queryable = Some(queryable.map_err(|e| ServeError::new(key, e))?);
    Ok(server)
}

fn admit<Q>(
    waiting: &Waiting,
    (admission, intake): (Admission, &Intake<Q>),
    counts: &ServeCounts,
    query: Query,
) {
    let key = query.key_expr().clone();
    let Some(robot) = waiting.asker(&key) else {
        return refuse(&query, Refusal::WrongRobot, counts);
    };
    let bytes = match admission.bytes(&query) {
        Ok(bytes) => bytes,
        Err(reject) => return refuse(&query, reject, counts),
    };
    push(waiting, intake, counts, (robot, bytes, Item::Asked(query)));
}

/// Candidates for a question that has come, or is to come.
fn admit_offer<Q>(waiting: &Waiting, intake: &Intake<Q>, counts: &ServeCounts, sample: &Sample) {
    let payload = sample.payload();
    let Some((from, robot)) = keys::offerer(sample.key_expr()) else {
        return counts.refuse(&Refusal::WrongRobot.into());
    };
    if let Err(reject) = Offer::admit(payload.len(), Some(&sample.encoding().to_string())) {
        return counts.refuse(&reject);
    }
    // A copy, because the bytes received hold on to the whole batch that they came in.
    let bytes = payload.to_bytes().into_owned();
    let item = Item::Offered { from: from.to_owned(), robot: robot.to_owned(), bytes };
    push(waiting, intake, counts, (robot, payload.len(), item));
}

/// Lets an item wait for a slot, or refuses the questions that find no room, or whose offers find none.
fn push<Q>(
    waiting: &Waiting,
    intake: &Intake<Q>,
    counts: &ServeCounts,
    (robot, bytes, item): (&str, usize, Item),
) {
    counts.in_flight.inc();
    for refused in waiting.push(robot, bytes, item) {
        counts.in_flight.dec();
        let questions = match refused {
            Item::Asked(query) => vec![query],
            Item::Offered { robot, .. } => intake.lost(&robot),
        };
        questions.iter().for_each(|query| refuse(query, Refusal::Overloaded, counts));
    }
}

fn refuse(query: &Query, why: impl Into<Reject>, counts: &ServeCounts) {
    let reject = why.into();
    counts.refuse(&reject);
    reply_error(query, &reject);
}

fn answer<Q, A: Message>(
    waiting: &Waiting,
    own: &KeyExpr<'static>,
    (intake, handler): (&Intake<Q>, &impl Fn(Q, Asked<'_>) -> (Option<Duration>, Result<A, Reject>)),
    counts: &ServeCounts,
    arrived: Arrived,
) {
    let begun = Instant::now();
    let robot = waiting.robot(&arrived.0).unwrap_or_default();
    let (ready, lost) = intake.take(&robot, arrived).unwrap_or_else(|reject| {
        counts.refuse(&reject);
        (None, Vec::new())
    });
    lost.iter().for_each(|query| refuse(query, Refusal::Overloaded, counts));
    let Some(Ready { query, came, question }) = ready else {
        waiting.done(&robot, None, None);
        counts.in_flight.dec();
        return;
    };
    // A handler that panics has answered nothing yet; the next question finds the service alive.
    let failed = || Err(Refusal::failed("the service failed on this question").into());
    let (budget, answered) = match question {
        Ok(question) => {
            let asked = Asked { robot: &robot, came };
            catch_unwind(AssertUnwindSafe(|| handler(question, asked))).unwrap_or_else(|_| (None, failed()))
        }
        Err(reject) => (None, Err(reject)),
    };
    let took = answered.is_ok().then(|| begun.elapsed());
    waiting.done(&robot, took, budget);
    match answered {
        Ok(answer) => {
            counts.answered.inc();
            // A question to several is answered under the key of this one: access rules allow no other.
            let asked = query.key_expr();
            let key = if asked.is_wild() { own.clone() } else { asked.clone().into_owned() };
            let sent = query.reply(key, answer.encode()).encoding(A::ENCODING).wait();
            if let Err(error) = sent {
                tracing::debug!(%error, "reply not sent");
            }
        }
        Err(reject) => {
            counts.refuse(&reject);
            tracing::debug!(key = %query.key_expr(), %reject, "question refused");
            reply_error(&query, &reject);
        }
    }
    counts.took(came.elapsed());
    counts.in_flight.dec();
}

fn reply_error(query: &Query, reject: &Reject) {
    if let Err(error) = query.reply_err(reject.encode()).encoding(Reject::ENCODING).wait() {
        tracing::debug!(%error, "refusal not sent");
    }
}
