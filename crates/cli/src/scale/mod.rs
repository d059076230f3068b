//! `curionav scale`: what more replicas bring, from when on, for how many robots, and what the split costs.
//!
//! Scenes, candidates and missions come from a drive through a scenario ([`rehearsal`]); replicas and router are
//! processes of this program ([`processes`]); what asks them is the arbiter's own pool and dispatch ([`robots`]).

mod batch;
mod break_even;
mod cgroup;
mod fleet;
mod options;
mod overhead;
mod processes;
mod rehearsal;
mod robots;
mod tables;
mod throughput;

use std::sync::Arc;

use anyhow::anyhow;
use curionav_runtime::shutdown::on_signals;
use curionav_schemas::Clock;
use serde_json::{Value, json};

use crate::exit::{Exit, SUCCESS};
use options::Pooled;
use processes::Processes;
use rehearsal::Rehearsal;
use robots::Work;

pub(crate) use options::ScaleOptions;

/// Candidates in a batch unless told otherwise: the largest batch the planner is budgeted for.
const BATCH: u32 = 2000;
/// Candidates that a robot of the paper scores in a cycle.
const ROBOTS_BATCH: u32 = 100;
const BREAK_EVEN_BATCHES: [u32; 7] = [16, 64, 125, 250, 500, 1000, 4000];
const BREAK_EVEN_PEOPLE: [u32; 3] = [5, 20, 80];

/// What was measured: for scripts, and for people.
struct Measured {
    json: Value,
    table: String,
}

pub(crate) async fn scale(options: ScaleOptions, log: &str) -> Result<u8, Exit> {
    check(&options)?;
    let mut signals = on_signals().map_err(|e| Exit::network(e.into()))?;
    let mut processes = Processes::start(log, options.cpu_quota).await?;
    let measured = tokio::select! {
        measured = measure(&options, &mut processes) => measured,
        () = signals.requested() => Err(Exit::failed(anyhow!("interrupted"))),
    };
    // Whatever happened: no process and no control group is left.
    processes.stop().await;
    let measured = measured?;
    #[expect(clippy::print_stdout, reason = "what the command is for")]
    if options.json {
        println!("{}", measured.json);
    } else {
        println!("{}", measured.table);
    }
    Ok(SUCCESS)
}

/// What the arguments say one by one makes sense together.
fn check(options: &ScaleOptions) -> Result<(), Exit> {
    let bad = |problem: &str| Err(Exit::bad_input(anyhow!("{problem}")));
    if !options.break_even && options.batch.len() > 1 {
        return bad("--batch: several batches are only compared with --break-even");
    }
    if !options.break_even && options.people.len() > 1 {
        return bad("--people: several crowds are only compared with --break-even");
    }
    if options.service == Some(Pooled::Generator) {
        if options.break_even {
            return bad("--break-even: is for evaluators; a generator's work is not cut into shards");
        }
        if !options.batch.is_empty() || !options.people.is_empty() {
            return bad("--batch, --people: are for evaluators; a generator is asked what the scenario asks");
        }
    }
    Ok(())
}

async fn measure(options: &ScaleOptions, processes: &mut Processes) -> Result<Measured, Exit> {
    eprintln!("driving through {}", options.scenario.display());
    let rehearsal = Rehearsal::of(&options.scenario, options.planner.as_deref()).await?;
    let measured = match options.service {
        _ if options.overhead => overhead(options, processes, &rehearsal).await,
        Some(service) if options.break_even => break_even(options, processes, &rehearsal, service).await,
        Some(service) if !options.robots.is_empty() => fleet(options, processes, &rehearsal, service).await,
        Some(service) => throughput(options, processes, &rehearsal, service).await,
        None => Err(Exit::bad_input(anyhow!("--service is missing"))),
    };
    rehearsal.services.stop().await;
    measured
}

/// What all robots ask for.
fn work(
    options: &ScaleOptions,
    rehearsal: &Rehearsal,
    service: Pooled,
    batch: u32,
) -> Result<Arc<Work>, Exit> {
    if service == Pooled::Generator {
        let scenes = rehearsal.cycles.iter().map(|cycle| cycle.scene.clone()).collect();
        return Ok(Arc::new(Work::Generate(scenes)));
    }
    let context = rehearsal.context("robot", Clock::Lockstep)?;
    if !context.pool_metrics().any(|metric| metric == service.role()) {
        let of = &context.profile.name;
        return Err(Exit::bad_input(anyhow!("--planner: `{of}` never asks for `{}`", service.role())));
    }
    let people = options.people.first().map(|&n| n as usize);
    let batches = batch::batches(rehearsal, &context, batch as usize, people).map_err(Exit::bad_input)?;
    Ok(Arc::new(Work::Evaluate(service.role().to_owned(), batches)))
}

/// Extra keys of every JSON object: under which conditions it was measured.
fn conditions(options: &ScaleOptions, work: &Work) -> serde_json::Map<String, Value> {
    let mut conditions = serde_json::Map::new();
    conditions.insert("scenario".into(), options.scenario.display().to_string().into());
    conditions.insert("cpu_quota".into(), options.cpu_quota.into());
    if let Work::Evaluate(_, batches) = work
        && let Some(batch) = batches.first()
    {
        let people: usize = batches.iter().map(|b| b.scene.people.len()).sum();
        conditions.insert("batch".into(), batch.candidates.len().into());
        conditions.insert("states".into(), batch.candidates.steps().into());
        conditions.insert("people".into(), (people as f64 / batches.len() as f64).into());
    }
    conditions
}

fn result(service: Pooled, rows: Value, more: serde_json::Map<String, Value>) -> Value {
    let mut object = json!({ "service": service.kind().name(), "rows": rows });
    if let Some(object) = object.as_object_mut() {
        object.extend(more);
    }
    object
}

async fn throughput(
    options: &ScaleOptions,
    processes: &mut Processes,
    rehearsal: &Rehearsal,
    service: Pooled,
) -> Result<Measured, Exit> {
    let batch = options.batch.first().copied().unwrap_or(BATCH);
    let work = work(options, rehearsal, service, batch)?;
    let seconds = options.seconds.unwrap_or(10.0);
    let mut rows: Vec<throughput::Row> = Vec::new();
    for replicas in options.replicas_or(&[1, 2, 4, 8]) {
        eprintln!("{replicas} replicas, {seconds} s");
        let of = (replicas, usize::from(options.in_flight));
        let mut row = throughput::row(processes, rehearsal, service, &work, of, seconds).await?;
        if let Some(first) = rows.first() {
            let of_one = |row: &throughput::Row| row.candidates_per_s / row.replicas as f64;
            row.efficiency = of_one(&row) / of_one(first);
        }
        rows.push(row);
    }
    let table = tables::throughput(&rows);
    let json = result(service, json!(rows), conditions(options, &work));
    Ok(Measured { json, table })
}

async fn break_even(
    options: &ScaleOptions,
    processes: &mut Processes,
    rehearsal: &Rehearsal,
    service: Pooled,
) -> Result<Measured, Exit> {
    let or = |given: &[u32], default: &[u32]| {
        let mut list: Vec<usize> =
            (if given.is_empty() { default } else { given }).iter().map(|&n| n as usize).collect();
        list.sort_unstable();
        list
    };
    let (sizes, people) = (or(&options.batch, &BREAK_EVEN_BATCHES), or(&options.people, &BREAK_EVEN_PEOPLE));
    // Also says whether the planner asks for this service at all.
    let smallest = work(options, rehearsal, service, 1)?;
    let mut rows = Vec::new();
    for replicas in options.replicas_or(&[1, 2]) {
        let of = (replicas, sizes.as_slice(), people.as_slice());
        let seconds = options.seconds.unwrap_or(1.0);
        let said = |row: &break_even::Row| {
            eprintln!("{replicas} replicas, {} people, batch of {}", row.people, row.batch);
        };
        rows.extend(break_even::rows(processes, rehearsal, service, of, seconds, said).await?);
    }
    let even = break_even::break_even(&rows);
    let mut more = conditions(options, &smallest);
    more.remove("batch");
    more.remove("people");
    more.insert("break_even".into(), json!(even));
    let table = tables::break_even(&rows, &even);
    Ok(Measured { json: result(service, json!(rows), more), table })
}

async fn fleet(
    options: &ScaleOptions,
    processes: &mut Processes,
    rehearsal: &Rehearsal,
    service: Pooled,
) -> Result<Measured, Exit> {
    let batch = options.batch.first().copied().unwrap_or(ROBOTS_BATCH);
    let work = work(options, rehearsal, service, batch)?;
    let mut rows = Vec::new();
    for replicas in options.replicas_or(&[2]) {
        for &robots in &options.robots {
            eprintln!("{robots} robots over {replicas} replicas");
            let (of, seconds) = ((replicas, usize::from(robots)), options.seconds.unwrap_or(10.0));
            rows.push(fleet::row(processes, rehearsal, service, &work, of, seconds).await?);
        }
    }
    let table = tables::fleet(&rows);
    Ok(Measured { json: result(service, json!(rows), conditions(options, &work)), table })
}

async fn overhead(
    options: &ScaleOptions,
    processes: &mut Processes,
    rehearsal: &Rehearsal,
) -> Result<Measured, Exit> {
    let seconds = options.seconds.unwrap_or(10.0);
    eprintln!("{} cycles by turns in process and over processes, {seconds} s", rehearsal.cycles.len());
    let overhead = overhead::measure(processes, rehearsal, seconds).await?;
    let table = tables::overhead(&overhead);
    Ok(Measured { json: json!(overhead), table })
}
