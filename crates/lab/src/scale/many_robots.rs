//! Many robots that plan in real time over one pool.

use std::sync::Arc;
use std::time::{Duration, Instant};

use curionav_pool::budget::{Budget, StageTimes};
use curionav_runtime::latency::percentile_ms;
use curionav_runtime::print::note;
use curionav_schemas::Clock;
use tokio::task::JoinSet;
use tokio::time::MissedTickBehavior;

use super::figures::{Row, count, number, share};
use super::processes::Processes;
use super::robots::{Answer, Robot, Work, on_a_thread};
use super::setup::{Measured, Setup};

/// Candidates that a robot of the paper scores in a cycle.
const BATCH: u32 = 100;
/// Between two cycles of a robot: ten a second.
const PERIOD: Duration = Duration::from_millis(100);
/// Cycles at the start that are not counted.
const SETTLING: u32 = 5;

/// Lets robots plan over replicas, once for each pair of a number of robots and a number of replicas in the options.
pub(super) async fn measure(setup: &Setup<'_>, processes: &mut Processes) -> anyhow::Result<Measured> {
    let work = setup.work(BATCH)?;
    let mut rows = Vec::new();
    for replicas in setup.options.replicas_or(&[2]) {
        for &robots in &setup.options.robots {
            note(format_args!("{robots} robots over {replicas} replicas"));
            rows.push(row(setup, processes, &work, (replicas, usize::from(robots))).await?);
        }
    }
    Ok(setup.measured(&work, &rows))
}

async fn row(
    setup: &Setup<'_>,
    processes: &mut Processes,
    work: &Arc<Work>,
    (replicas, robot_count): (usize, usize),
) -> anyhow::Result<Row> {
    let robots = setup.robots(processes, (replicas, robot_count), Clock::Realtime).await?;
    let begin = Instant::now();
    let before = processes.used();
    let seconds = setup.options.seconds.unwrap_or(10.0);
    let cycles = SETTLING + (seconds / PERIOD.as_secs_f64()).ceil() as u32;
    let mut planning = JoinSet::new();
    for (index, robot) in robots.all.iter().enumerate() {
        // The robots start evenly spread over the period. So do robots that do not know each other, on average.
        let start = begin + PERIOD.mul_f64(index as f64 / robot_count as f64);
        on_a_thread(&mut planning, plan(index as u64, Arc::clone(robot), Arc::clone(work), start, cycles));
    }
    let mut times = Vec::new();
    let mut planned = 0;
    let mut shards = 0;
    let mut unanswered = 0;
    // Candidates answered, one entry per robot.
    let mut candidates = Vec::new();
    while let Some(answers) = planning.join_next().await {
        let answers = answers??;
        planned += answers.len();
        shards += answers.iter().map(|answer| answer.shards).sum::<usize>();
        unanswered += answers.iter().map(|answer| answer.unanswered).sum::<usize>();
        candidates.push(answers.iter().map(|answer| answer.candidates as f64).sum());
        times.extend(answers.iter().map(|answer| answer.took));
    }
    let (cores, asking_cores) = processes.used().cores_since(&before, begin.elapsed().as_secs_f64());
    let budget = robots
        .all
        .first()
        .map(|r| Budget::of_generation(Duration::ZERO, &r.context.mission, &StageTimes::default()));
    // Replicas have the first half of it. In the second half an arbiter computes itself what is missing.
    let budget = budget.map(|stage| stage.until(0.5, Duration::ZERO)).unwrap_or_default();
    robots.leave();
    processes.dismiss().await;
    let due = robot_count * (cycles - SETTLING) as usize;
    Ok(vec![
        count("replicas", replicas),
        count("robots", robot_count),
        count("cycles", planned),
        number("p50_ms", "p50 ms", percentile_ms(&mut times, 0.50), 2),
        number("p99_ms", "p99 ms", percentile_ms(&mut times, 0.99), 2),
        number("budget_ms", "budget ms", 1e3 * budget.as_secs_f64(), 0),
        share("unanswered", unanswered as f64 / shards.max(1) as f64),
        share("skipped", 1.0 - planned as f64 / due.max(1) as f64),
        number("fairness", "fairness", jain(&candidates), 4),
        number("cores", "cores", cores, 2),
        number("asking_cores", "asking", asking_cores, 2),
    ])
}

/// Asks on every beat of the robot's own clock, as an arbiter does whose beliefs come ten times a second. The first
/// question has the number `first_seq`.
async fn plan(
    first_seq: u64,
    robot: Arc<Robot>,
    work: Arc<Work>,
    start: Instant,
    cycles: u32,
) -> anyhow::Result<Vec<Answer>> {
    let mut beat = tokio::time::interval_at(start.into(), PERIOD);
    beat.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let settled = start + PERIOD * SETTLING;
    let end = start + PERIOD * cycles;
    let mut answers = Vec::new();
    let mut seq = first_seq;
    let mut trees = Vec::new();
    loop {
        let at = beat.tick().await.into_std();
        if at >= end {
            return Ok(answers);
        }
        let answer = robot.ask(&work, seq, &mut trees).await?;
        seq += 1;
        if at >= settled {
            answers.push(answer);
        }
    }
}

/// Jain's index of fairness, (sum x)^2 / (n sum x^2) (Jain, Chiu, Hawe 1984).
pub(super) fn jain(shares: &[f64]) -> f64 {
    let (sum, squares): (f64, f64) = (shares.iter().sum(), shares.iter().map(|x| x * x).sum());
    if squares > 0.0 { sum * sum / (shares.len() as f64 * squares) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_shares_are_fair_and_one_who_has_everything_is_not() {
        assert_eq!(jain(&[3.0, 3.0, 3.0]), 1.0);
        assert_eq!(jain(&[0.0, 8.0, 0.0, 0.0]), 0.25);
        // (1 + 3)^2 / (2 (1 + 9)) = 16 / 20
        assert_eq!(jain(&[1.0, 3.0]), 0.8);
    }
}
