//! How much more a pool of more replicas does.

use std::sync::Arc;
use std::time::{Duration, Instant};

use curionav_runtime::latency::Latency;
use curionav_schemas::Clock;
use serde::Serialize;
use tokio::task::JoinSet;

use super::options::Pooled;
use super::processes::Processes;
use super::robots::{Answer, Robot, Robots, Work, on_a_thread};
use super::workload::Workload;
use curionav_runtime::exit::Exit;

/// Share of the time that is not measured: speeds are still being learned.
const SETTLING: f64 = 0.15;

/// One number of replicas.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    pub(super) replicas: usize,
    /// Candidates answered a second while work never runs out.
    pub(super) candidates_per_s: f64,
    /// Time of a batch that has the pool to itself.
    pub(super) p50_ms: f64,
    pub(super) p99_ms: f64,
    /// Throughput of a replica, as a share of that in the first row.
    pub(super) efficiency: f64,
    /// Processors the replicas used together while work never ran out.
    pub(super) cores: f64,
    /// Processors that router and robots used meanwhile.
    pub(super) asking_cores: f64,
}

/// Measures one number of replicas for `seconds`: half of the time with one batch at a time, half with `in_flight`
/// robots a replica, each with one batch in flight, so that work never runs out.
pub(super) async fn row(
    processes: &mut Processes,
    workload: &Workload,
    service: Pooled,
    work: &Arc<Work>,
    (replicas, in_flight): (usize, usize),
    seconds: f64,
) -> Result<Row, Exit> {
    let of = (replicas, in_flight * replicas);
    let robots = Robots::with_pool(processes, workload, service, of, Clock::Lockstep).await?;
    let half = Duration::from_secs_f64(seconds / 2.0);
    let alone = drive(processes, &robots.all[..1], work, half).await?;
    let busy = drive(processes, &robots.all, work, half).await?;
    robots.leave();
    processes.dismiss().await;
    Ok(Row {
        replicas,
        candidates_per_s: busy.candidates_per_s,
        p50_ms: alone.latency.percentile_ms(0.50),
        p99_ms: alone.latency.percentile_ms(0.99),
        efficiency: 1.0,
        cores: busy.cores,
        asking_cores: busy.asking_cores,
    })
}

struct Driven {
    candidates_per_s: f64,
    latency: Latency,
    cores: f64,
    asking_cores: f64,
}

/// Lets each of `robots` ask for one piece of work after the other for `time`.
async fn drive(
    processes: &Processes,
    robots: &[Arc<Robot>],
    work: &Arc<Work>,
    time: Duration,
) -> Result<Driven, Exit> {
    let begin = Instant::now();
    let (settled, end) = (begin + time.mul_f64(SETTLING), begin + time);
    let mut asking = JoinSet::new();
    for (index, robot) in robots.iter().enumerate() {
        on_a_thread(&mut asking, keep_asking(Arc::clone(robot), Arc::clone(work), index as u64, end));
    }
    tokio::time::sleep_until(settled.into()).await;
    let before = processes.used();
    tokio::time::sleep_until(end.into()).await;
    let (cores, asking_cores) = processes.used().cores_since(&before, (end - settled).as_secs_f64());
    let mut answers = Vec::new();
    while let Some(joined) = asking.join_next().await {
        let asked = joined.map_err(|e| Exit::failed(e.into()))?;
        answers.extend(asked.map_err(Exit::failed)?);
    }
    answers.retain(|(at, _)| *at >= settled);
    answers.sort_by_key(|(at, _)| *at);
    if let Some((_, answer)) = answers.iter().find(|(_, answer)| answer.unanswered > 0) {
        let lost = format!("{} of {} shards were not answered in time", answer.unanswered, answer.shards);
        return Err(Exit::network(anyhow::anyhow!(lost)));
    }
    let mut latency = Latency::default();
    answers.iter().for_each(|(_, answer)| latency.record(answer.took));
    answers.retain(|(at, _)| *at <= end);
    Ok(Driven { candidates_per_s: rate(&answers), latency, cores, asking_cores })
}

async fn keep_asking(
    robot: Arc<Robot>,
    work: Arc<Work>,
    first: u64,
    end: Instant,
) -> anyhow::Result<Vec<(Instant, Answer)>> {
    let mut answers = Vec::new();
    let (mut seq, mut tree) = (first, None);
    while Instant::now() < end {
        let answer = robot.ask(&work, seq, &mut tree).await?;
        answers.push((Instant::now(), answer));
        seq += 1;
    }
    Ok(answers)
}

/// Candidates a second from the first answer to the last, so that where the time is cut does not matter.
fn rate(answers: &[(Instant, Answer)]) -> f64 {
    let ([(first, _), rest @ ..], Some((last, _))) = (answers, answers.last()) else { return 0.0 };
    let candidates: usize = rest.iter().map(|(_, answer)| answer.candidates).sum();
    let seconds = last.duration_since(*first).as_secs_f64();
    if seconds > 0.0 { candidates as f64 / seconds } else { 0.0 }
}
