//! Typed queryables with admission control.
//!
//! Zenoh calls back on its receiving threads, so the callback only puts the query into a bounded queue
//! (or refuses it as overloaded, at once); threads of our own compute and answer, one robot after the
//! other in turn.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use curionav_schemas::{Message, Reject, RejectCode, keys};
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use crate::fair_queue::FairQueue;
use crate::latency::Latency;

/// When a request came in, so that its budget (relative milliseconds) can be kept.
#[derive(Debug, Clone, Copy)]
pub struct Arrival(Instant);

impl Arrival {
    /// How long ago.
    pub fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }

    /// Whether `budget_ms` is spent.
    pub fn is_over(&self, budget_ms: u32) -> bool {
        self.0.elapsed() > Duration::from_millis(u64::from(budget_ms))
    }
}

/// Counts of one server since it started.
#[derive(Debug, Default)]
pub struct ServeCounts {
    /// Questions answered.
    pub answered: AtomicU64,
    /// Questions refused: malformed, overloaded, stopped.
    pub refused: AtomicU64,
    /// Questions waiting or being computed.
    pub in_flight: AtomicU64,
    latency: Mutex<Latency>,
}

impl ServeCounts {
    /// One more answer, and how long it took.
    pub fn record(&self, took: Duration) {
        self.answered.fetch_add(1, Ordering::Relaxed);
        self.latency.lock().unwrap_or_else(PoisonError::into_inner).record(took);
    }

    /// Times from arrival to answer of the recent past.
    pub fn latency(&self) -> Latency {
        self.latency.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Queries that wait for a slot.
struct Waiting {
    queue: Mutex<(FairQueue<(Query, Instant)>, bool)>,
    /// Signalled for each query, and for all when the server ends.
    arrived: Condvar,
}

impl Waiting {
    /// Adds a query, or gives back the one that finds no room.
    fn push(&self, robot: &str, query: Query) -> Option<Query> {
        let mut queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        if queue.1 {
            return Some(query);
        }
        let refused = queue.0.push(robot, (query, Instant::now()));
        self.arrived.notify_one();
        refused.map(|(query, _)| query)
    }

    /// The next query, waited for; nothing once the server ends.
    fn pop(&self) -> Option<(Query, Instant)> {
        let mut queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
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

    fn end(&self) {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner).1 = true;
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
    /// Which key.
    pub key: String,
    /// Why.
    pub reason: String,
}

/// Answers questions on `key` with `handler`, `slots` at once, `queue` more waiting.
pub fn serve<Q: Message, A: Message>(
    session: &Session,
    key: &str,
    slots: usize,
    queue: usize,
    handler: impl Fn(Q, Arrival) -> Result<A, Reject> + Send + Sync + 'static,
) -> Result<Server, ServeError> {
    serve_queries(session, key, slots, queue, move |query, arrival| {
        let payload = query.payload().map(|p| p.to_bytes()).unwrap_or_default();
        let encoding = query.encoding().map(ToString::to_string);
        let question = Q::decode(&payload, encoding.as_deref()).map_err(|error| Reject::from(&error))?;
        handler(question, arrival)
    })
}

/// Answers questions that carry no payload: the current state, a map.
pub fn serve_state<A: Message>(
    session: &Session,
    key: &str,
    state: impl Fn() -> Result<A, Reject> + Send + Sync + 'static,
) -> Result<Server, ServeError> {
    serve_queries(session, key, 1, 64, move |_, _| state())
}

/// The general form: `handler` sees the query itself.
pub fn serve_queries<A: Message>(
    session: &Session,
    key: &str,
    slots: usize,
    queue: usize,
    handler: impl Fn(&Query, Arrival) -> Result<A, Reject> + Send + Sync + 'static,
) -> Result<Server, ServeError> {
    let error = |reason: String| ServeError { key: key.into(), reason };
    let counts = Arc::new(ServeCounts::default());
    let waiting =
        Arc::new(Waiting { queue: Mutex::new((FairQueue::new(queue), false)), arrived: Condvar::new() });
    let handler = Arc::new(handler);
    let mut threads = Vec::new();
    for slot in 0..slots.max(1) {
        let (waiting, handler, counts) = (Arc::clone(&waiting), Arc::clone(&handler), Arc::clone(&counts));
        let thread = std::thread::Builder::new()
            .name(format!("serve-{slot}"))
            .spawn(move || work(&waiting, &*handler, &counts))
            .map_err(|e| error(e.to_string()))?;
        threads.push(thread);
    }
    let (queue, admission) = (Arc::clone(&waiting), Arc::clone(&counts));
    let queryable = session
        .declare_queryable(key.to_owned())
        .complete(true)
        .callback(move |query| admit(&queue, &admission, query))
        .wait()
        .map_err(|e| error(e.to_string()))?;
    Ok(Server { queryable: Some(queryable), waiting, threads, counts })
}

fn admit(waiting: &Waiting, counts: &ServeCounts, query: Query) {
    counts.in_flight.fetch_add(1, Ordering::Relaxed);
    // Who says nothing about whose work it is shares a line with all who do not.
    let robot = query.attachment().map(|a| a.to_bytes().into_owned()).unwrap_or_default();
    let robot = std::str::from_utf8(&robot).ok().filter(|name| keys::check_id(name).is_ok()).unwrap_or("");
    let Some(refused) = waiting.push(robot, query) else { return };
    counts.in_flight.fetch_sub(1, Ordering::Relaxed);
    counts.refused.fetch_add(1, Ordering::Relaxed);
    reply_error(&refused, &Reject::new(RejectCode::Overloaded, "every slot is busy and the queue is full"));
}

fn work<A: Message>(
    waiting: &Waiting,
    handler: &impl Fn(&Query, Arrival) -> Result<A, Reject>,
    counts: &ServeCounts,
) {
    while let Some((query, came)) = waiting.pop() {
        // A handler that panics has answered nothing yet; the next question finds the service alive.
        let answered = catch_unwind(AssertUnwindSafe(|| handler(&query, Arrival(came))))
            .unwrap_or_else(|_| Err(Reject::new(RejectCode::Unknown, "the service failed on this question")));
        match answered {
            Ok(answer) => {
                counts.answered.fetch_add(1, Ordering::Relaxed);
                let sent =
                    query.reply(query.key_expr().clone(), answer.encode()).encoding(A::ENCODING).wait();
                if let Err(error) = sent {
                    tracing::debug!(%error, "reply not sent");
                }
            }
            Err(reject) => {
                counts.refused.fetch_add(1, Ordering::Relaxed);
                tracing::debug!(key = %query.key_expr(), %reject, "question refused");
                reply_error(&query, &reject);
            }
        }
        counts.latency.lock().unwrap_or_else(PoisonError::into_inner).record(came.elapsed());
        counts.in_flight.fetch_sub(1, Ordering::Relaxed);
    }
}

fn reply_error(query: &Query, reject: &Reject) {
    if let Err(error) = query.reply_err(reject.encode()).encoding(Reject::ENCODING).wait() {
        tracing::debug!(%error, "refusal not sent");
    }
}
