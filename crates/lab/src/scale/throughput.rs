//! How much more a pool of more replicas does.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::anyhow;
use curionav_runtime::exit::Exit;
use curionav_runtime::latency::percentile_ms;
use curionav_runtime::print::note;
use curionav_schemas::Clock;
use tokio::task::JoinSet;

use super::figures::{count, number};
use super::processes::Processes;
use super::robots::{Answer, Robot, Work, on_a_thread};
use super::setup::{Measured, Setup};

/// Candidates in a batch unless told otherwise: the largest batch the planner is budgeted for.
const BATCH: u32 = 2000;
/// Share of the time that is not measured: speeds are still being learned.
const SETTLING: f64 = 0.15;

/// Measures each number of replicas: half of the time with one batch at a time, half with so many robots per replica,
/// each with one batch in flight, that work never runs out.
pub(super) async fn measure(setup: &Setup<'_>, processes: &mut Processes) -> anyhow::Result<Measured> {
    let work = setup.work(BATCH)?;
    let seconds = setup.options.seconds.unwrap_or(10.0);
    let half = Duration::from_secs_f64(seconds / 2.0);
    let mut rows = Vec::new();
    let mut first = None;
    for replicas in setup.options.replicas_or(&[1, 2, 4, 8]) {
        note(format_args!("{replicas} replicas, {seconds} s"));
        let robots = usize::from(setup.options.in_flight) * replicas;
        let robots = setup.robots(processes, (replicas, robots), Clock::Lockstep).await?;
        let mut alone = drive(processes, &robots.all[..1], &work, half).await?;
        let busy = drive(processes, &robots.all, &work, half).await?;
        robots.leave();
        processes.dismiss().await;
        let of_one = busy.candidates_per_s / replicas as f64;
        rows.push(vec![
            count("replicas", replicas),
            number("candidates_per_s", "candidates/s", busy.candidates_per_s, 0),
            number("p50_ms", "p50 ms", percentile_ms(&mut alone.times, 0.50), 2),
            number("p99_ms", "p99 ms", percentile_ms(&mut alone.times, 0.99), 2),
            number("efficiency", "efficiency", of_one / *first.get_or_insert(of_one), 3),
            number("cores", "cores", busy.cores, 2),
            number("asking_cores", "asking", busy.asking_cores, 2),
        ]);
    }
    Ok(setup.measured(&work, &rows))
}

struct Driven {
    candidates_per_s: f64,
    times: Vec<Duration>,
    cores: f64,
    asking_cores: f64,
}

/// Lets each of `robots` ask for one piece of work after the other for `time`.
async fn drive(
    processes: &Processes,
    robots: &[Arc<Robot>],
    work: &Arc<Work>,
    time: Duration,
) -> anyhow::Result<Driven> {
    let begin = Instant::now();
    let settled = begin + time.mul_f64(SETTLING);
    let end = begin + time;
    let mut asking = JoinSet::new();
    for (index, robot) in robots.iter().enumerate() {
        on_a_thread(&mut asking, keep_asking(Arc::clone(robot), Arc::clone(work), index as u64, end));
    }
    tokio::time::sleep_until(settled.into()).await;
    let before = processes.used();
    tokio::time::sleep_until(end.into()).await;
    let (cores, asking_cores) = processes.used().cores_since(&before, (end - settled).as_secs_f64());
    let mut answers = Vec::new();
    while let Some(asked) = asking.join_next().await {
        answers.extend(asked??);
    }
    answers.retain(|(at, _)| *at >= settled);
    answers.sort_by_key(|(at, _)| *at);
    if let Some((_, answer)) = answers.iter().find(|(_, answer)| answer.unanswered > 0) {
        let lost = anyhow!("{} of {} shards were not answered in time", answer.unanswered, answer.shards);
        return Err(Exit::network(lost).into());
    }
    let times = answers.iter().map(|(_, answer)| answer.took).collect();
    answers.retain(|(at, _)| *at <= end);
    Ok(Driven { candidates_per_s: rate(&answers), times, cores, asking_cores })
}

async fn keep_asking(
    robot: Arc<Robot>,
    work: Arc<Work>,
    first: u64,
    end: Instant,
) -> anyhow::Result<Vec<(Instant, Answer)>> {
    let mut answers = Vec::new();
    let mut seq = first;
    let mut trees = Vec::new();
    while Instant::now() < end {
        let answer = robot.ask(&work, seq, &mut trees).await?;
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
