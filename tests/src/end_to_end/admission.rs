//! A busy replica, asked over Zenoh.

use std::sync::Mutex;
use std::sync::mpsc;
use std::time::Instant;

use curionav_runtime::query::{AskError, Urgency, ask};
use curionav_runtime::serve::{refusals, serve};
use curionav_runtime::session;
use curionav_schemas::{Clock, EvaluateRequest, Refusal, Scores, keys};
use curionav_testing::golden;
use tokio::task::JoinHandle;
use zenoh::Session;

use super::program::LIMIT;

/// The cycles that the questions of the two robots are about, by which the handler tells them apart.
const GREEDY: u64 = 1;
const MODEST: u64 = 2;

fn question(session: &Session, robot: &'static str, mark: u64) -> JoinHandle<Result<Scores, AskError>> {
    let (session, key) = (session.clone(), keys::question("cpc", "busy", robot).unwrap());
    tokio::spawn(async move {
        let request = EvaluateRequest { seq: mark, ..golden::evaluate_request() };
        ask(&session, &key, &request, LIMIT, Urgency::Shard { clock: Clock::Realtime }).await
    })
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_full_queue_refuses_at_once_and_robots_are_served_in_turn() {
    let session = session::embedded().await.unwrap();
    let (release, gate) = mpsc::channel::<()>();
    let (begun, begins) = mpsc::channel::<u64>();
    let gate = Mutex::new(gate);
    let handler = move |request: EvaluateRequest, _| {
        begun.send(request.seq).unwrap();
        gate.lock().unwrap().recv().unwrap();
        Ok(golden::scores())
    };
    // One slot, four may wait.
    let key = keys::questions("cpc", "busy").unwrap();
    let server = serve(&session, &key, (1, 4), &refusals(), handler).unwrap();
    let refused = || server.counts().refused.total();
    let in_flight = || server.counts().in_flight.get();
    let mut waiting = vec![question(&session, "greedy", GREEDY)];
    assert_eq!(begins.recv_timeout(LIMIT).unwrap(), GREEDY);
    for _ in 0..4 {
        waiting.push(question(&session, "greedy", GREEDY));
    }
    let deadline = Instant::now() + LIMIT;
    while in_flight() < 5 && Instant::now() < deadline {
        tokio::task::yield_now().await;
    }
    // Nothing is released: only a refusal can come back.
    let overloaded = question(&session, "greedy", GREEDY).await.unwrap().unwrap_err();
    assert!(matches!(&overloaded, AskError::Rejected(r) if r.why == Refusal::Overloaded), "{overloaded}");

    waiting.push(question(&session, "modest", MODEST));
    while refused() < 2 && Instant::now() < deadline {
        tokio::task::yield_now().await;
    }
    let mut served = Vec::new();
    for _ in 0..4 {
        release.send(()).unwrap();
        served.push(begins.recv_timeout(LIMIT).unwrap());
    }
    release.send(()).unwrap();
    assert_eq!(served, [GREEDY, MODEST, GREEDY, GREEDY]);
    let mut answered = 0;
    for question in waiting {
        answered += usize::from(question.await.unwrap().is_ok());
    }
    assert_eq!((answered, refused()), (5, 2));
    session::close(&session);
}
