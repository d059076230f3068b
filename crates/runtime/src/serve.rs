//! Typed queryables with admission control.
//!
//! Zenoh calls back on its receiving threads, so the callback only puts the query into a bounded queue
//! (or refuses it as overloaded, at once); threads of our own compute and answer.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use curionav_schemas::{Message, Reject, RejectCode};
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use crate::latency::Latency;

/// When a request came in, so that its budget (relative milliseconds) can be kept.
#[derive(Debug, Clone, Copy)]
pub struct Arrival(Instant);

impl Arrival {
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
    /// Times from arrival to answer of the recent past.
    pub fn latency(&self) -> Latency {
        self.latency.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// A running server; dropping it undeclares the key and ends its threads.
pub struct Server {
    // Declared first so that it is dropped first: it owns the sender that keeps the threads alive.
    queryable: Option<Queryable<()>>,
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
    let (sender, receiver) = sync_channel::<(Query, Instant)>(queue.max(1));
    let receiver = Arc::new(Mutex::new(receiver));
    let handler = Arc::new(handler);
    let mut threads = Vec::new();
    for slot in 0..slots.max(1) {
        let (receiver, handler, counts) = (Arc::clone(&receiver), Arc::clone(&handler), Arc::clone(&counts));
        let thread = std::thread::Builder::new()
            .name(format!("serve-{slot}"))
            .spawn(move || work(&receiver, &*handler, &counts))
            .map_err(|e| error(e.to_string()))?;
        threads.push(thread);
    }
    let admission = Arc::clone(&counts);
    let queryable = session
        .declare_queryable(key.to_owned())
        .complete(true)
        .callback(move |query| admit(&sender, &admission, query))
        .wait()
        .map_err(|e| error(e.to_string()))?;
    Ok(Server { queryable: Some(queryable), threads, counts })
}

fn admit(sender: &SyncSender<(Query, Instant)>, counts: &ServeCounts, query: Query) {
    counts.in_flight.fetch_add(1, Ordering::Relaxed);
    let refused = match sender.try_send((query, Instant::now())) {
        Ok(()) => return,
        Err(TrySendError::Full((query, _)) | TrySendError::Disconnected((query, _))) => query,
    };
    counts.in_flight.fetch_sub(1, Ordering::Relaxed);
    counts.refused.fetch_add(1, Ordering::Relaxed);
    reply_error(&refused, &Reject::new(RejectCode::Overloaded, "every slot is busy and the queue is full"));
}

fn work<A: Message>(
    receiver: &Mutex<Receiver<(Query, Instant)>>,
    handler: &impl Fn(&Query, Arrival) -> Result<A, Reject>,
    counts: &ServeCounts,
) {
    loop {
        let next = match receiver.lock() {
            Ok(receiver) => receiver.recv(),
            Err(_) => return,
        };
        let Ok((query, came)) = next else { return };
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
