//! From which batch on asking replicas is faster than computing in the arbiter.

use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};
use curionav_runtime::latency::percentile_ms;
use curionav_schemas::Clock;
use serde_json::{Value, json};

use super::batch::{Batch, batches};
use super::figures::{count, number};
use super::processes::Processes;
use super::robots::{Robot, Work};
use super::setup::{Measured, Setup};

const BATCHES: [u32; 7] = [16, 64, 125, 250, 500, 1000, 4000];
const PEOPLE: [u32; 3] = [5, 20, 80];
/// Batches of either kind that are not counted: caches are cold and speeds unknown.
const SETTLING: usize = 5;

/// Median times of one size of batch among some people, with some replicas.
struct Times {
    replicas: usize,
    people: usize,
    batch: usize,
    /// On one thread of the arbiter.
    in_process_ms: f64,
    pool_ms: f64,
}

/// The least batch from which on the pool is faster; none if it never is among those measured.
struct BreakEven {
    replicas: usize,
    people: usize,
    batch: Option<usize>,
}

pub(super) async fn measure(setup: &Setup<'_>, processes: &mut Processes) -> anyhow::Result<Measured> {
    let or = |given: &[u32], default: &[u32]| {
        let mut list = if given.is_empty() { default.to_vec() } else { given.to_vec() };
        list.sort_unstable();
        list.into_iter().map(|n| n as usize).collect::<Vec<_>>()
    };
    let (sizes, crowds) = (or(&setup.options.batch, &BATCHES), or(&setup.options.people, &PEOPLE));
    // Also says whether the planner asks for this service at all.
    let any = setup.work(1)?;
    let seconds = setup.options.seconds.unwrap_or(1.0);
    let mut all = Vec::new();
    for replicas in setup.options.replicas_or(&[1, 2]) {
        let robots = setup.robots(processes, (replicas, 1), Clock::Lockstep).await?;
        let robot = robots.all.first().context("no robot")?;
        for (&people, &batch) in crowds.iter().flat_map(|p| sizes.iter().map(move |b| (p, b))) {
            let prepared = batches(setup.workload, &robot.context, batch, Some(people))?;
            let times = compare(robot, &Work::Evaluate(setup.service.name(), prepared), seconds).await?;
            eprintln!("{replicas} replicas, {people} people, batch of {batch}");
            let [in_process_ms, pool_ms] = times.map(|mut times| percentile_ms(&mut times, 0.5));
            all.push(Times { replicas, people, batch, in_process_ms, pool_ms });
        }
        robots.leave();
        processes.dismiss().await;
    }
    let row = |times: &Times| {
        vec![
            count("replicas", times.replicas),
            count("people", times.people),
            count("batch", times.batch),
            number("in_process_ms", "in process ms", times.in_process_ms, 3),
            number("pool_ms", "pool ms", times.pool_ms, 3),
            number("", "pool / in process", times.pool_ms / times.in_process_ms, 2),
        ]
    };
    let mut measured = setup.measured(&any, &all.iter().map(row).collect::<Vec<_>>());
    let even = break_even(&all);
    for BreakEven { replicas, people, batch } in &even {
        let from = batch.map_or("asking is never faster".to_owned(), |batch| {
            format!("asking is faster from batches of {batch} on")
        });
        measured.text += &format!("\n{replicas} replicas, {people} people: {from}");
    }
    if let Value::Object(json) = &mut measured.json {
        json.retain(|key, _| key != "batch" && key != "people");
        let object = |b: &BreakEven| json!({"replicas": b.replicas, "people": b.people, "batch": b.batch});
        json.insert("break_even".into(), even.iter().map(object).collect());
    }
    Ok(measured)
}

/// Times of the same batches here and in the pool, by turns.
async fn compare(robot: &Robot, work: &Work, seconds: f64) -> anyhow::Result<[Vec<Duration>; 2]> {
    let Work::Evaluate(term, batches) = work else { bail!("only evaluators are compared") };
    let (mut here, mut pool) = (Vec::new(), Vec::new());
    let mut end = Instant::now() + Duration::from_secs_f64(seconds);
    let mut seq = 0;
    while (seq as usize) < SETTLING || Instant::now() < end {
        let batch = batches.get(seq as usize % batches.len()).context("no batch")?;
        let in_process = tokio::task::block_in_place(|| score(robot, term, batch))?;
        let answer = robot.ask(work, seq, &mut None).await?;
        ensure!(answer.unanswered == 0, "a shard was not answered in time");
        seq += 1;
        if seq as usize == SETTLING {
            end = Instant::now() + Duration::from_secs_f64(seconds);
        } else if seq as usize > SETTLING {
            here.push(in_process);
            pool.push(answer.took);
        }
    }
    Ok([here, pool])
}

fn score(robot: &Robot, term: &str, batch: &Batch) -> anyhow::Result<Duration> {
    let started = Instant::now();
    let evaluator = robot.context.local(term).context("no such evaluator in process")?;
    let cost = evaluator.evaluate(&batch.scene, &batch.candidates, &|| false)?;
    std::hint::black_box(cost);
    Ok(started.elapsed())
}

/// Where the pool begins to be faster and stays so, for each number of replicas and people.
fn break_even(rows: &[Times]) -> Vec<BreakEven> {
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
        let row = |people, batch, pool_ms| Times { replicas: 2, people, batch, in_process_ms: 1.0, pool_ms };
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
