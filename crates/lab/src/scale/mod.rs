//! What more replicas bring, from when on, for how many robots, and what the split costs.
//!
//! Scenes, candidates and missions come from a drive through a scenario (`workload`); replicas and router are
//! processes of this program ([`processes`]); what asks them is the arbiter's own pool and dispatch ([`robots`]).

mod batch;
mod break_even;
mod cgroup;
mod fleet;
mod options;
mod overhead;
mod processes;
mod robots;
mod tables;
mod throughput;
mod workload;

use std::sync::Arc;

use anyhow::anyhow;
use curionav_runtime::shutdown::on_signals;
use curionav_schemas::Clock;
use serde_json::{Value, json};

use curionav_runtime::exit::{Exit, SUCCESS};
use processes::Processes;
use robots::Work;
use workload::Workload;

pub use options::{Options, Pooled};

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

/// Measures, prints what came out, and gives the exit status. `log` is what the processes log, a filter.
///
/// # Errors
/// Bad input if the scenario or the planner cannot be used, the network if a process does not start or answer.
pub async fn scale(options: Options, log: &str) -> Result<u8, Exit> {
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

async fn measure(options: &Options, processes: &mut Processes) -> Result<Measured, Exit> {
    eprintln!("driving through {}", options.scenario.display());
    let workload = Workload::of(&options.scenario, options.planner.as_deref()).await?;
    let measured = match options.service {
        _ if options.overhead => overhead(options, processes, &workload).await,
        Some(service) if options.break_even => break_even(options, processes, &workload, service).await,
        Some(service) if !options.robots.is_empty() => fleet(options, processes, &workload, service).await,
        Some(service) => throughput(options, processes, &workload, service).await,
        None => Err(Exit::bad_input(anyhow!("--service is missing"))),
    };
    workload.services.stop().await;
    measured
}

/// What all robots ask for.
fn work(options: &Options, workload: &Workload, service: Pooled, batch: u32) -> Result<Arc<Work>, Exit> {
    if service == Pooled::Generator {
        let scenes = workload.cycles.iter().map(|cycle| cycle.scene.clone()).collect();
        return Ok(Arc::new(Work::Generate(scenes)));
    }
    let context = workload.context("robot", Clock::Lockstep)?;
    if !context.pool_terms().any(|term| term == service.role()) {
        let of = &context.profile.name;
        return Err(Exit::bad_input(anyhow!("--planner: `{of}` never asks for `{}`", service.role())));
    }
    let people = options.people.first().map(|&n| n as usize);
    let batches = batch::batches(workload, &context, batch as usize, people).map_err(Exit::bad_input)?;
    Ok(Arc::new(Work::Evaluate(service.role().to_owned(), batches)))
}

/// Extra keys of every JSON object: under which conditions it was measured.
fn conditions(options: &Options, work: &Work) -> serde_json::Map<String, Value> {
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
    options: &Options,
    processes: &mut Processes,
    workload: &Workload,
    service: Pooled,
) -> Result<Measured, Exit> {
    let batch = options.batch.first().copied().unwrap_or(BATCH);
    let work = work(options, workload, service, batch)?;
    let seconds = options.seconds.unwrap_or(10.0);
    let mut rows: Vec<throughput::Row> = Vec::new();
    for replicas in options.replicas_or(&[1, 2, 4, 8]) {
        eprintln!("{replicas} replicas, {seconds} s");
        let of = (replicas, usize::from(options.in_flight));
        let mut row = throughput::row(processes, workload, service, &work, of, seconds).await?;
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
    options: &Options,
    processes: &mut Processes,
    workload: &Workload,
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
    let smallest = work(options, workload, service, 1)?;
    let mut rows = Vec::new();
    for replicas in options.replicas_or(&[1, 2]) {
        let of = (replicas, sizes.as_slice(), people.as_slice());
        let seconds = options.seconds.unwrap_or(1.0);
        let said = |row: &break_even::Row| {
            eprintln!("{replicas} replicas, {} people, batch of {}", row.people, row.batch);
        };
        rows.extend(break_even::rows(processes, workload, service, of, seconds, said).await?);
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
    options: &Options,
    processes: &mut Processes,
    workload: &Workload,
    service: Pooled,
) -> Result<Measured, Exit> {
    let batch = options.batch.first().copied().unwrap_or(ROBOTS_BATCH);
    let work = work(options, workload, service, batch)?;
    let mut rows = Vec::new();
    for replicas in options.replicas_or(&[2]) {
        for &robots in &options.robots {
            eprintln!("{robots} robots over {replicas} replicas");
            let (of, seconds) = ((replicas, usize::from(robots)), options.seconds.unwrap_or(10.0));
            rows.push(fleet::row(processes, workload, service, &work, of, seconds).await?);
        }
    }
    let table = tables::fleet(&rows);
    Ok(Measured { json: result(service, json!(rows), conditions(options, &work)), table })
}

async fn overhead(
    options: &Options,
    processes: &mut Processes,
    workload: &Workload,
) -> Result<Measured, Exit> {
    let seconds = options.seconds.unwrap_or(10.0);
    eprintln!("{} cycles by turns in process and over processes, {seconds} s", workload.cycles.len());
    let overhead = overhead::measure(processes, workload, seconds).await?;
    let table = tables::overhead(&overhead);
    Ok(Measured { json: json!(overhead), table })
}
