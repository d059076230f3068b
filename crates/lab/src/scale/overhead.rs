//! What splitting the cycle into processes costs: the same cycles over processes and in this process, and bare
//! queries of the same sizes, by turns.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use curionav_arbiter::cycle::{self, Observation};
use curionav_arbiter::memory::Memory;
use curionav_planning::generation::Generated;
use curionav_pool::budget::Budget;
use curionav_pool::dispatch;
use curionav_pool::peers::Peers;
use curionav_runtime::convert;
use curionav_runtime::echo::round_trip;
use curionav_runtime::latency::percentile_ms;
use curionav_schemas::{self as wire, Clock, Message};
use serde_json::json;
use zenoh::Session;

use super::figures::{self, Row, count, label, number};
use super::options::{Options, Service};
use super::processes::Processes;
use super::robots::{Robot, Robots};
use super::setup::Measured;
use super::workload::Workload;

/// What must not be exceeded: the cost of the split, in bare round trips.
const ROUND_TRIPS_MAX: f64 = 4.0;
/// Rounds at least, the first of which is not counted.
const ROUNDS_MIN: usize = 3;
/// Bare queries of each kind in a round.
const BARE: usize = 100;
const TIMEOUT: Duration = Duration::from_secs(5);

/// A question of the cycle, the sizes of question and answer in bytes, and times of bare queries of these sizes.
struct Question {
    role: String,
    sizes: (usize, usize),
    bare: Vec<Duration>,
}

/// Measures the split. `processes` must have no replicas yet.
pub(super) async fn measure(
    options: &Options,
    processes: &mut Processes,
    workload: &Workload,
) -> anyhow::Result<Measured> {
    let seconds = options.seconds.unwrap_or(10.0);
    eprintln!("{} cycles by turns in process and over processes, {seconds} s", workload.cycles.len());
    let pools = [Service::Generator, Service::Cpc, Service::Cnc];
    for service in pools {
        processes.add(service.name(), 1).await?;
    }
    processes.add("echo", 1).await?;
    // Processes are numbered in the order of their start.
    let echo = format!("echo-{}", pools.len());
    let robots = Robots::join(workload, &processes.endpoint, 1, Clock::Lockstep).await?;
    let over_processes = Arc::clone(robots.all.first().context("no robot")?);
    let in_process = Robot::on(&workload.services.session, workload.context("robot-0", Clock::Lockstep)?)?;
    for robot in [&over_processes, &in_process] {
        for role in robot.context.pool_roles() {
            robot.ready(role, 1).await?;
        }
    }
    let homes = [&in_process, &*over_processes];
    let measured = compare(homes, workload, (&robots.sessions[1], &echo), seconds).await?;
    drop(over_processes);
    robots.leave();
    processes.dismiss().await;
    Ok(measured)
}

async fn compare(
    homes: [&Robot; 2],
    workload: &Workload,
    (session, echo): (&Session, &str),
    seconds: f64,
) -> anyhow::Result<Measured> {
    let mut questions = questions(homes[0], workload).await?;
    let mut cycles = [Vec::new(), Vec::new()];
    let begin = Instant::now();
    let mut round = 0;
    while round < ROUNDS_MIN || begin.elapsed().as_secs_f64() < seconds {
        let (decided, took) = replay(homes[0], workload).await?;
        let (decided_over_processes, took_over_processes) = replay(homes[1], workload).await?;
        ensure!(decided == decided_over_processes, "processes decided otherwise");
        for question in &mut questions {
            for _ in 0..BARE {
                let time = round_trip(session, echo, question.sizes, TIMEOUT).await?;
                if round > 0 {
                    question.bare.push(time);
                }
            }
        }
        if round > 0 {
            cycles[0].extend(took);
            cycles[1].extend(took_over_processes);
        }
        round += 1;
    }
    Ok(measured(questions, &cycles))
}

fn measured(mut questions: Vec<Question>, cycles: &[Vec<wire::Timings>; 2]) -> Measured {
    let question = |q: &mut Question| {
        vec![
            label("question", "question", &q.role),
            count("question_bytes", q.sizes.0),
            count("answer_bytes", q.sizes.1),
            number("p50_ms", "bare p50 ms", percentile_ms(&mut q.bare, 0.5), 3),
        ]
    };
    let [in_process, processes] = cycles.each_ref().map(|times| median_ms(times, |t| t.total_us));
    // Of a bare query through the router, mean of the questions of a cycle.
    let sum: f64 = questions.iter_mut().map(|q| percentile_ms(&mut q.bare, 0.5)).sum();
    let bare = sum / questions.len().max(1) as f64;
    let round_trips = (processes - in_process) / bare;
    let questions: Vec<Row> = questions.iter_mut().map(question).collect();
    let homes = [stages("in process", &cycles[0]), stages("processes", &cycles[1])];
    let verdict = if round_trips <= ROUND_TRIPS_MAX { "within" } else { "beyond" };
    let count = cycles[0].len();
    Measured {
        json: json!({
            "cycles": count,
            "in_process_p50_ms": in_process,
            "processes_p50_ms": processes,
            "bare_p50_ms": bare,
            "round_trips": round_trips,
            "questions": questions.iter().map(figures::json).collect::<Vec<_>>(),
            "in_process": figures::json(&homes[0]),
            "processes": figures::json(&homes[1]),
        }),
        text: format!(
            "{}\n{}\n{count} cycles in either home\n\
             the split adds {round_trips:.2} bare round trips of {bare:.3} ms, {verdict} the {ROUND_TRIPS_MAX} allowed",
            figures::table(&questions),
            figures::table(&homes),
        ),
    }
}

fn stages(home: &str, times: &[wire::Timings]) -> Row {
    let evaluate_us = |t: &wire::Timings| t.total_us.saturating_sub(t.generate_us + t.arbitrate_us);
    vec![
        label("", "home", home),
        number("generate_ms", "generate ms", median_ms(times, |t| t.generate_us), 3),
        number("evaluate_ms", "evaluate ms", median_ms(times, evaluate_us), 3),
        number("decide_ms", "decide ms", median_ms(times, |t| t.arbitrate_us), 3),
        number("cycle_ms", "cycle p50 ms", median_ms(times, |t| t.total_us), 3),
    ]
}

fn median_ms(times: &[wire::Timings], of: impl Fn(&wire::Timings) -> u64) -> f64 {
    let mut times: Vec<Duration> = times.iter().map(|t| Duration::from_micros(of(t))).collect();
    percentile_ms(&mut times, 0.5)
}

/// Plans every cycle of the workload once more: what was decided, and how long each took.
async fn replay(
    robot: &Robot,
    workload: &Workload,
) -> anyhow::Result<(Vec<(wire::Reason, wire::F64Array)>, Vec<wire::Timings>)> {
    let mut memory = Memory::new(0);
    let (mut decisions, mut times) = (Vec::new(), Vec::new());
    for past in &workload.cycles {
        memory.seq += 1;
        let scene = past.scene.clone();
        let observation = Observation { belief: scene.belief, people: scene.people };
        let (decision, account) = cycle::plan(&robot.pool, &robot.context, &mut memory, observation).await?;
        times.push(account.timings);
        let degraded = wire::words::say_all("degradation", &decision.degraded);
        ensure!(degraded.is_empty(), "a cycle was degraded: {degraded}");
        decisions.push((decision.reason, decision.x));
    }
    Ok((decisions, times))
}

/// The questions of a cycle halfway through the workload, with the sizes they have.
async fn questions(robot: &Robot, workload: &Workload) -> anyhow::Result<Vec<Question>> {
    let half = workload.cycles.len() / 2;
    let mut tree = None;
    let mut questions = Vec::new();
    let mut add = |role: &str, question: Vec<u8>, answer: Vec<u8>| {
        let sizes = (question.len(), answer.len());
        questions.push(Question { role: role.to_owned(), sizes, bare: Vec::new() });
    };
    let context = &robot.context;
    let epoch = 1;
    for (seq, past) in workload.cycles.iter().enumerate().take(half + 1) {
        let seq = seq as u64;
        let asked = context.generate_question((epoch, seq), &past.scene, 0, tree.as_ref(), &[]);
        let stage = Budget::of_generation(robot.pool.peers.now(), &context.mission, &robot.pool.stages());
        let shape = (context.profile.steps, context.profile.dt);
        let generated =
            dispatch::generate(&robot.pool, &context.mission.order.robot, &asked, 0, shape, stage).await;
        let (Generated { candidates, tree: grown }, cut) = generated.context("no generator answered")?;
        tree = Some(grown.clone());
        if seq < half as u64 {
            continue;
        }
        let reply = wire::GenerateReply {
            epoch,
            seq,
            instance: "generator".into(),
            candidates: convert::candidates_to_wire(&candidates),
            tree: convert::tree_to_wire(grown),
            elapsed_us: 0,
            cut,
        };
        add(wire::keys::GENERATOR, asked.encode(Budget::ms(TIMEOUT)), reply.encode());
        let questions = context.evaluate_questions((epoch, seq), &past.scene, &candidates);
        for term in context.pool_terms() {
            let asked = questions.shard(term, 0, 0..candidates.len());
            let scores = wire::Scores {
                epoch,
                seq,
                shard: 0,
                term: term.to_owned(),
                instance: term.to_owned(),
                cost: vec![0.0; candidates.len()].into(),
                elapsed_us: 0,
                slots: 1,
            };
            add(term, asked.encode(Budget::ms(TIMEOUT)), scores.encode());
        }
    }
    Ok(questions)
}
