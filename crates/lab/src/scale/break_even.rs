//! From which batch on, or from how many trees on, asking replicas is faster than computing in the arbiter.

use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use curionav_planning::generation::Tree;
use curionav_pool::context::PlanContext;
use curionav_runtime::convert;
use curionav_runtime::latency::percentile_ms;
use curionav_runtime::print::note;
use curionav_schemas::Clock;
use serde_json::{Value, json};

use super::batch::{Batch, batches};
use super::figures::{Row, count, number};
use super::options::{Options, Service};
use super::processes::Processes;
use super::robots::{Robot, Work, turn, turn_of};
use super::setup::{Measured, Setup};

const BATCHES: [u32; 7] = [16, 64, 125, 250, 500, 1000, 4000];
const PEOPLE: [u32; 3] = [5, 20, 80];
const TREES: [u32; 4] = [1, 2, 4, 8];
/// Batches of either kind that are not counted: caches are cold and speeds unknown.
const SETTLING: usize = 5;

/// Median times of one size of the work: a batch among some people, or the trees of a cycle.
struct Times {
    replicas: usize,
    /// None where the scenario's are around.
    people: Option<usize>,
    size: usize,
    /// On one thread of the arbiter.
    in_process_ms: f64,
    pool_ms: f64,
}

/// The least size from which on the pool is faster; none if it never is among those measured.
struct BreakEven {
    replicas: usize,
    people: Option<usize>,
    size: Option<usize>,
}

pub(super) async fn measure(setup: &Setup<'_>, processes: &mut Processes) -> anyhow::Result<Measured> {
    // Also says whether the planner asks for this service at all.
    let any = setup.work(1)?;
    let seconds = setup.options.seconds.unwrap_or(1.0);
    let (unit, sizes) = sizes(setup.options);
    let of_trees = unit == "trees";
    let mut all = Vec::new();
    for replicas in setup.options.replicas_or(if of_trees { &[1, 2, 4] } else { &[1, 2] }) {
        let robots = setup.robots(processes, (replicas, 1), Clock::Lockstep).await?;
        let robot = robots.all.first().context("no robot")?;
        for &(people, size) in &sizes {
            let work = match people {
                None => setup.growth(size),
                people => {
                    let batches = batches(setup.workload, &robot.context, size, people)?;
                    Work::Evaluate(setup.service.name(), batches)
                }
            };
            let times = compare(robot, &work, seconds).await?;
            let among = people.map_or(String::new(), |people| format!(", {people} people"));
            note(format_args!("{replicas} replicas{among}, {unit}: {size}"));
            let [in_process_ms, pool_ms] = times.map(|mut times| percentile_ms(&mut times, 0.5));
            all.push(Times { replicas, people, size, in_process_ms, pool_ms });
        }
        robots.leave();
        processes.dismiss().await;
    }
    let row = |times: &Times| {
        let conditions =
            [("replicas", Some(times.replicas)), ("people", times.people), (unit, Some(times.size))];
        let mut row: Row = conditions.into_iter().filter_map(|(key, n)| n.map(|n| count(key, n))).collect();
        row.extend([
            number("in_process_ms", "in process ms", times.in_process_ms, 3),
            number("pool_ms", "pool ms", times.pool_ms, 3),
            number("", "pool / in process", times.pool_ms / times.in_process_ms, 2),
        ]);
        row
    };
    let mut measured = setup.measured(&any, &all.iter().map(row).collect::<Vec<_>>());
    let even = break_even(&all);
    for BreakEven { replicas, people, size } in &even {
        let from = size.map_or("asking is never faster".to_owned(), |size| match of_trees {
            true => format!("asking is faster from {size} trees on"),
            false => format!("asking is faster from batches of {size} on"),
        });
        let among = people.map_or(String::new(), |people| format!(", {people} people"));
        measured.text += &format!("\n{replicas} replicas{among}: {from}");
    }
    if let Value::Object(json) = &mut measured.json {
        json.retain(|key, _| key != "batch" && key != "people");
        let object = |b: &BreakEven| {
            let mut object = json!({"replicas": b.replicas, unit: b.size});
            if let Some(people) = b.people {
                object["people"] = people.into();
            }
            object
        };
        json.insert("break_even".into(), even.iter().map(object).collect());
    }
    Ok(measured)
}

/// What is varied besides the replicas, and the sizes of the work that are compared, among so many people: batches of
/// an evaluator, or trees of a cycle.
fn sizes(options: &Options) -> (&'static str, Vec<(Option<usize>, usize)>) {
    let or = |given: &[u32], default: &[u32]| {
        let mut list = if given.is_empty() { default.to_vec() } else { given.to_vec() };
        list.sort_unstable();
        list.into_iter().map(|n| n as usize).collect::<Vec<_>>()
    };
    if options.service == Some(Service::Generator) {
        let given: Vec<u32> = options.trees.iter().map(|&n| n.into()).collect();
        return ("trees", or(&given, &TREES).into_iter().map(|trees| (None, trees)).collect());
    }
    let batches = or(&options.batch, &BATCHES);
    let crowds = or(&options.people, &PEOPLE);
    let sizes = crowds.iter().flat_map(|people| batches.iter().map(move |batch| (Some(*people), *batch)));
    ("batch", sizes.collect())
}

/// Times of the same work here and in the pool, by turns.
async fn compare(robot: &Robot, work: &Work, seconds: f64) -> anyhow::Result<[Vec<Duration>; 2]> {
    let mut here = Vec::new();
    let mut pool = Vec::new();
    let mut trees_here = Vec::new();
    let mut trees = Vec::new();
    let mut end = Instant::now() + Duration::from_secs_f64(seconds);
    let mut seq = 0;
    while (seq as usize) < SETTLING || Instant::now() < end {
        let in_process = tokio::task::block_in_place(|| compute(robot, work, seq, &mut trees_here))?;
        let answer = robot.ask(work, seq, &mut trees).await?;
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

/// Does piece `seq` of the work here, as an arbiter does that has no pool.
fn compute(robot: &Robot, work: &Work, seq: u64, trees: &mut Vec<Option<Tree>>) -> anyhow::Result<Duration> {
    let context = &robot.context;
    match work {
        Work::Evaluate(term, batches) => score(context, term, turn(batches, seq).context("no batch")?),
        Work::Generate(scenes, count) => {
            if turn_of(scenes, seq) == 0 {
                trees.clear();
            }
            trees.resize(*count, None);
            let scene = convert::scene(turn(scenes, seq).context("no scene")?);
            let started = Instant::now();
            for (index, tree) in trees.iter_mut().enumerate() {
                let (grown, _) = context.course.generate(&scene, index, tree.take(), &[], &|| 0.0);
                *tree = Some(std::hint::black_box(grown).tree);
            }
            Ok(started.elapsed())
        }
    }
}

fn score(context: &PlanContext, term: &str, batch: &Batch) -> anyhow::Result<Duration> {
    let started = Instant::now();
    let evaluator = context.course.evaluator(term).context("no such evaluator in process")?;
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
            Some(even) if !faster => even.size = None,
            Some(even) => even.size = even.size.or(Some(row.size)),
            None => found.push(BreakEven {
                replicas: row.replicas,
                people: row.people,
                size: faster.then_some(row.size),
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
        let row = |people, size, pool_ms| Times {
            replicas: 2,
            people: Some(people),
            size,
            in_process_ms: 1.0,
            pool_ms,
        };
        let rows = [
            row(5, 10, 0.9),
            row(5, 20, 1.1),
            row(5, 40, 0.8),
            row(5, 80, 0.5), // 40: below, 20 was slower
            row(9, 10, 2.0),
            row(9, 20, 1.5), // never
        ];
        let found: Vec<_> = break_even(&rows).iter().map(|b| (b.people.unwrap(), b.size)).collect();
        assert_eq!(found, [(5, Some(40)), (9, None)]);
    }
}
