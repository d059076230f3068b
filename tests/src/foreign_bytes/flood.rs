//! The flood itself.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use curionav_planning::random::{Rng, rng};
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::query::fetch;
use curionav_runtime::session;
use curionav_schemas::{Message, Mission, Reject, ServiceStatus, keys};
use zenoh::handlers::FifoChannel;
use zenoh::qos::CongestionControl;
use zenoh::query::{ConsolidationMode, QueryTarget};
use zenoh::{Session, Wait};

use super::impostor::Impostor;
use super::spoilt::{Spoilt, below, spoilt};
use super::target::{SERVICES, Target, all};
use crate::end_to_end::program::{Deployment, LIMIT, is_alive, real_time, run, soak_time, turn, two_workers};

const SEED: u64 = 1000;
const QUICK: &str = "scenarios/quickstart.toml";
/// Between two payloads on one key, by the robot's clock. A service that is busy between two runs may have 256 waiting
/// before the oldest is dropped uncounted: at this rate that takes 25 s.
const PERIOD: Duration = Duration::from_millis(100);

/// What was sent to each role.
type Sent = BTreeMap<&'static str, u64>;

#[test]
fn bytes_that_are_not_ours_are_refused_and_counted_and_the_robot_arrives() {
    let _turn = turn();
    let lasts = soak_time(10).min(Duration::from_secs(60));
    println!("seed {SEED}, {} s", lasts.as_secs());
    // The flood takes its share of the machine, too.
    let speed = 0.5 * real_time();
    let deployment = Deployment::start(1);
    let pids = deployment.pids();
    let runtime = two_workers();
    let config =
        ServiceConfig { connect: vec![deployment.endpoint().to_owned()], ..ServiceConfig::default() };
    let session = runtime.block_on(session::client(&config)).unwrap();

    let theirs = runtime.block_on(session::client(&config)).unwrap();
    let impostor = Impostor::start(&theirs, SEED);
    let driving = Arc::new(AtomicBool::new(true));
    let runs = {
        let (endpoint, driving) = (deployment.endpoint().to_owned(), Arc::clone(&driving));
        let speed = speed.to_string();
        std::thread::spawn(move || {
            let mut runs = Vec::new();
            while driving.load(Ordering::Relaxed) {
                let (json, status) = run(QUICK, &["--connect", &endpoint, "--speed", &speed]);
                runs.push((json.outcome, json.cycles.degraded, status));
            }
            runs
        })
    };
    let sent = runtime.block_on(flood(&session, lasts, PERIOD.div_f64(speed)));
    driving.store(false, Ordering::Relaxed);
    let nonsense = impostor.nonsense.load(Ordering::Relaxed);
    drop(impostor);
    let runs = runs.join().unwrap();
    println!("runs meanwhile (outcome, cycles degraded, exit status): {runs:?}");
    assert!(runs.iter().all(|(outcome, _, status)| outcome == "reached" && *status == 0), "{runs:?}");

    // As if nothing had been.
    let (json, status) = run(QUICK, &["--connect", deployment.endpoint()]);
    assert_eq!((json.outcome.as_str(), json.cycles.degraded, status), ("reached", 0, 0), "{json:?}");
    assert!(pids.iter().all(|pid| is_alive(*pid)), "a process has died");
    println!("role        sent   refused");
    for (role, instance) in SERVICES {
        let key = keys::status(role, instance).unwrap();
        let status: ServiceStatus = runtime.block_on(fetch(&session, &key, LIMIT)).unwrap();
        // The arbiter also counts the impostor's answers, but for those that came when it had stopped waiting.
        let answers = if role == "arbiter" { nonsense } else { 0 };
        println!(
            "{role:10} {:5} {:9}{}",
            sent[role],
            status.rejected,
            if answers > 0 { format!(", {answers} answers of the impostor") } else { String::new() }
        );
        assert!(status.rejected >= sent[role] + answers / 2, "{role}: {status:?}");
    }
    session::close(&session);
    session::close(&theirs);
    drop(deployment);
    runtime.shutdown_timeout(Duration::from_secs(2));
}

/// Floods every key; gives what each role must have refused.
async fn flood(session: &Session, lasts: Duration, period: Duration) -> Sent {
    // The first mission names the map.
    let mission_key = keys::robot("robot", "mission").unwrap();
    let deadline = Instant::now() + LIMIT;
    let mission = loop {
        if let Ok(mission) = fetch::<Mission>(session, &mission_key, LIMIT).await {
            break mission;
        }
        assert!(Instant::now() < deadline, "the run did not begin");
        tokio::time::sleep(Duration::from_millis(50)).await;
    };
    let end = Instant::now() + lasts;
    let tasks: Vec<_> = (all(&mission.order.map).into_iter().zip(0..))
        .map(|(target, i)| {
            tokio::spawn(flood_one(session.clone(), target, rng(SEED, 100 + i), (period, end)))
        })
        .collect();
    let mut sent = Sent::new();
    for task in tasks {
        let (target, count) = task.await.unwrap();
        println!("{:5} {} {}", count, if target.asked { "asked" } else { "put  " }, target.key);
        for role in target.heard_by {
            *sent.entry(role).or_default() += count;
        }
    }
    sent
}

async fn flood_one(
    session: Session,
    target: Target,
    mut rng: Rng,
    (period, end): (Duration, Instant),
) -> (Target, u64) {
    let mut sent = 0;
    let mut pace = tokio::time::interval(period);
    pace.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    while Instant::now() < end {
        pace.tick().await;
        // Where nothing is asked, anything is too much: messages of ours, too.
        let message = target.message.unwrap_or(["mission", "scan", "none"][below(&mut rng, 3)]);
        let wrong = spoilt(&mut rng, message);
        // No bytes at all are no question.
        if target.asked && wrong.bytes.is_empty() {
            continue;
        }
        if target.asked {
            ask(&session, &target.key, wrong).await;
        } else {
            let put = session.put(&target.key, wrong.bytes).encoding(wrong.encoding);
            put.congestion_control(CongestionControl::Block).wait().unwrap();
        }
        sent += 1;
    }
    (target, sent)
}

/// Asks, and expects to be refused with a reason.
async fn ask(session: &Session, key: &str, wrong: Spoilt) {
    let shown = format!("{key}: {} bytes of `{:.40}`", wrong.bytes.len(), wrong.encoding);
    let get = session.get(key).payload(wrong.bytes).encoding(wrong.encoding).timeout(LIMIT);
    // Of a map's key the impostor says it serves it, too.
    let (get, shared) = (get.target(QueryTarget::All), key.contains("/map/"));
    let get = get.consolidation(ConsolidationMode::None);
    let replies = get.with(FifoChannel::new(4)).wait().unwrap();
    let mut refused = false;
    while let Ok(reply) = replies.recv_async().await {
        let Err(error) = reply.into_result() else {
            assert!(shared, "answered: {shown}");
            continue;
        };
        let reject = Reject::decode(&error.payload().to_bytes(), Some(&error.encoding().to_string()));
        refused |= reject.is_ok();
    }
    assert!(refused, "not refused: {shown}");
}
