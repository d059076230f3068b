//! Many robots that plan in real time over one pool.

use std::sync::Arc;
use std::time::{Duration, Instant};

use curionav_pool::budget::Budget;
use curionav_runtime::latency::Latency;
use curionav_schemas::Clock;
use serde::Serialize;
use tokio::task::JoinSet;
use tokio::time::MissedTickBehavior;

use super::options::Pooled;
use super::processes::Processes;
use super::robots::{Answer, Robot, Robots, Work, on_a_thread};
use super::workload::Workload;
use curionav_runtime::exit::Exit;

/// Between two cycles of a robot: ten a second.
const PERIOD: Duration = Duration::from_millis(100);
/// Cycles at the start that are not counted.
const SETTLING: u32 = 5;

/// One number of robots.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    pub(super) replicas: usize,
    pub(super) robots: usize,
    /// Cycles counted, of all robots.
    pub(super) cycles: usize,
    /// From asking to the last answer, or to the end of the pool's time.
    pub(super) p50_ms: f64,
    pub(super) p99_ms: f64,
    /// The pool's time in a cycle: after it the arbiter computes itself what is missing.
    pub(super) budget_ms: f64,
    /// Share of shards that nobody answered in that time.
    pub(super) unanswered: f64,
    /// Share of cycles that were due and did not take place, the one before not being over.
    pub(super) skipped: f64,
    /// Jain's index of the candidates answered a robot: 1 if all have the same, 1/n if one has everything.
    pub(super) fairness: f64,
    /// Processors the replicas used together, and router and robots.
    pub(super) cores: f64,
    pub(super) asking_cores: f64,
}

/// Lets `count` robots plan for `seconds` over `replicas` replicas.
pub(super) async fn row(
    processes: &mut Processes,
    workload: &Workload,
    service: Pooled,
    work: &Arc<Work>,
    (replicas, count): (usize, usize),
    seconds: f64,
) -> Result<Row, Exit> {
    let of = (replicas, count);
    let robots = Robots::with_pool(processes, workload, service, of, Clock::Realtime).await?;
    let (begin, before) = (Instant::now(), processes.used());
    let cycles = SETTLING + (seconds / PERIOD.as_secs_f64()).ceil() as u32;
    let mut planning = JoinSet::new();
    for (index, robot) in robots.all.iter().enumerate() {
        // Evenly over the period, as robots that do not know each other are on average.
        let start = begin + PERIOD.mul_f64(index as f64 / count as f64);
        on_a_thread(&mut planning, plan(index, Arc::clone(robot), Arc::clone(work), start, cycles));
    }
    let mut of_robot = vec![Vec::new(); count];
    while let Some(joined) = planning.join_next().await {
        let (index, answers) = joined.map_err(|e| Exit::failed(e.into()))?.map_err(Exit::failed)?;
        of_robot[index] = answers;
    }
    let (cores, asking_cores) = processes.used().cores_since(&before, begin.elapsed().as_secs_f64());
    let budget = robots.all.first().map(|r| Budget::of_stage(Duration::ZERO, &r.context.mission));
    let budget = budget.map(|stage| stage.until(0.5, Duration::ZERO)).unwrap_or_default();
    robots.leave();
    processes.dismiss().await;
    let due = count * (cycles - SETTLING) as usize;
    Ok(Row { replicas, robots: count, cores, asking_cores, ..summary(&of_robot, due, budget) })
}

/// Asks on every beat of the robot's own clock, as an arbiter does whose beliefs come ten times a second.
async fn plan(
    index: usize,
    robot: Arc<Robot>,
    work: Arc<Work>,
    start: Instant,
    cycles: u32,
) -> anyhow::Result<(usize, Vec<Answer>)> {
    let mut beat = tokio::time::interval_at(start.into(), PERIOD);
    beat.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let (settled, end) = (start + PERIOD * SETTLING, start + PERIOD * cycles);
    let mut answers = Vec::new();
    let (mut seq, mut tree) = (index as u64, None);
    loop {
        let at = beat.tick().await.into_std();
        if at >= end {
            return Ok((index, answers));
        }
        let answer = robot.ask(&work, seq, &mut tree).await?;
        seq += 1;
        if at >= settled {
            answers.push(answer);
        }
    }
}

fn summary(of_robot: &[Vec<Answer>], due: usize, budget: Duration) -> Row {
    let mut latency = Latency::default();
    let (mut cycles, mut shards, mut unanswered) = (0, 0, 0);
    for answer in of_robot.iter().flatten() {
        latency.record(answer.took);
        cycles += 1;
        shards += answer.shards;
        unanswered += answer.unanswered;
    }
    let answered = |answers: &Vec<Answer>| answers.iter().map(|answer| answer.candidates as f64).sum();
    let answered: Vec<f64> = of_robot.iter().map(answered).collect();
    Row {
        replicas: 0,
        robots: of_robot.len(),
        cycles,
        p50_ms: latency.percentile_ms(0.50),
        p99_ms: latency.percentile_ms(0.99),
        budget_ms: 1e3 * budget.as_secs_f64(),
        unanswered: unanswered as f64 / shards.max(1) as f64,
        skipped: 1.0 - cycles as f64 / due.max(1) as f64,
        fairness: jain(&answered),
        cores: 0.0,
        asking_cores: 0.0,
    }
}

/// Jain's index of fairness, (sum x)^2 / (n sum x^2) (Jain, Chiu, Hawe 1984).
fn jain(shares: &[f64]) -> f64 {
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
