//! From which batch on asking replicas is faster than computing in the arbiter.

use std::time::{Duration, Instant};

use anyhow::Context;
use curionav_runtime::latency::Latency;
use curionav_schemas::Clock;
use serde::Serialize;

use super::batch::{Batch, batches};
use super::options::Pooled;
use super::processes::Processes;
use super::robots::{Robot, Robots, Work};
use super::workload::Workload;
use curionav_runtime::exit::Exit;

/// Batches of either kind that are not counted: caches are cold and speeds unknown.
const SETTLING: usize = 5;

/// One size of batch among some people, with some replicas.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    pub(super) replicas: usize,
    pub(super) people: usize,
    pub(super) batch: usize,
    /// Median time on one thread of the arbiter.
    pub(super) in_process_ms: f64,
    /// Median time with the pool.
    pub(super) pool_ms: f64,
}

/// The least batch from which on the pool is faster.
#[derive(Debug, Serialize)]
pub(super) struct BreakEven {
    pub(super) replicas: usize,
    pub(super) people: usize,
    /// Nothing if it never is among those measured.
    pub(super) batch: Option<usize>,
}

/// Measures every batch size among every number of people with `replicas` replicas, `seconds` each.
pub(super) async fn rows(
    processes: &mut Processes,
    workload: &Workload,
    service: Pooled,
    (replicas, sizes, people): (usize, &[usize], &[usize]),
    seconds: f64,
    on_row: impl Fn(&Row),
) -> Result<Vec<Row>, Exit> {
    let robots = Robots::with_pool(processes, workload, service, (replicas, 1), Clock::Lockstep).await?;
    let [robot] = robots.all.as_slice() else { return Err(Exit::failed(anyhow::anyhow!("no robot"))) };
    let mut rows = Vec::new();
    for &people in people {
        for &batch in sizes {
            let prepared = batches(workload, &robot.context, batch, Some(people)).map_err(Exit::bad_input)?;
            let work = Work::Evaluate(service.role().to_owned(), prepared);
            let (here, pool) = compare(robot, &work, seconds).await.map_err(Exit::failed)?;
            let [in_process_ms, pool_ms] = [here, pool].map(|latency| latency.percentile_ms(0.5));
            let row = Row { replicas, people, batch, in_process_ms, pool_ms };
            on_row(&row);
            rows.push(row);
        }
    }
    robots.leave();
    processes.dismiss().await;
    Ok(rows)
}

/// Times of the same batches here and in the pool, by turns.
async fn compare(robot: &Robot, work: &Work, seconds: f64) -> anyhow::Result<(Latency, Latency)> {
    let Work::Evaluate(term, batches) = work else { anyhow::bail!("only evaluators are compared") };
    let (mut here, mut pool) = (Latency::default(), Latency::default());
    let mut end = Instant::now() + Duration::from_secs_f64(seconds);
    let mut seq = 0;
    while (seq as usize) < SETTLING || Instant::now() < end {
        let batch = batches.get(seq as usize % batches.len()).context("no batch")?;
        let in_process = tokio::task::block_in_place(|| score(robot, term, batch))?;
        let answer = robot.ask(work, seq, &mut None).await?;
        anyhow::ensure!(answer.unanswered == 0, "a shard was not answered in time");
        seq += 1;
        if seq as usize == SETTLING {
            end = Instant::now() + Duration::from_secs_f64(seconds);
        } else if seq as usize > SETTLING {
            here.record(in_process);
            pool.record(answer.took);
        }
    }
    Ok((here, pool))
}

fn score(robot: &Robot, term: &str, batch: &Batch) -> anyhow::Result<Duration> {
    let started = Instant::now();
    let evaluator = robot.context.local(term).context("no such evaluator in process")?;
    let cost = evaluator.evaluate(&batch.scene, &batch.candidates, &|| false)?;
    std::hint::black_box(cost);
    Ok(started.elapsed())
}

/// Where the pool begins to be faster and stays so, for each number of replicas and people.
pub(super) fn break_even(rows: &[Row]) -> Vec<BreakEven> {
    let mut found: Vec<BreakEven> = Vec::new();
    for row in rows {
        let same = |b: &&mut BreakEven| (b.replicas, b.people) == (row.replicas, row.people);
        let faster = row.pool_ms <= row.in_process_ms;
        match found.iter_mut().find(same) {
            Some(even) if !faster => even.batch = None,
            Some(even) => even.batch = even.batch.or(Some(row.batch)),
            None => found.push(BreakEven {
                replicas: row.replicas,
                people: row.people,
                batch: faster.then_some(row.batch),
            }),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_breaks_even_where_the_pool_is_faster_for_good() {
        let row = |people, batch, pool_ms| Row { replicas: 2, people, batch, in_process_ms: 1.0, pool_ms };
        let rows = [
            row(5, 10, 0.9),
            row(5, 20, 1.1),
            row(5, 40, 0.8),
            row(5, 80, 0.5), // 40: below, 20 was slower
            row(9, 10, 2.0),
            row(9, 20, 1.5), // never
        ];
        let found: Vec<_> = break_even(&rows).iter().map(|b| (b.people, b.batch)).collect();
        assert_eq!(found, [(5, Some(40)), (9, None)]);
    }
}
