//! What splitting the cycle into processes costs: each cycle over processes and in this process, one right after the
//! other, and then bare queries of the same sizes.
//!
//! A machine's speed drifts from second to second by more than the split costs. So only times that were taken within
//! some milliseconds are compared, and what is reported is a mean over rounds with its interval.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use curionav_arbiter::cycle;
use curionav_planning::generation::Generated;
use curionav_pool::budget::Budget;
use curionav_pool::dispatch::{self, Grown};
use curionav_pool::peers::Peers;
use curionav_robot::arbiter::cycle::Observation;
use curionav_robot::arbiter::memory::Memory;
use curionav_runtime::convert;
use curionav_runtime::echo::round_trip;
use curionav_runtime::print::note;
use curionav_schemas::{self as wire, Clock, Message};
use serde_json::json;
use zenoh::Session;

use super::figures::{self, Row, count, label, number};
use super::options::{Options, Service};
use super::processes::Processes;
use super::robots::{Robot, Robots};
use super::setup::Measured;
use super::workload::Workload;
use crate::statistics::{mean, mean_interval, median};

/// What must not be exceeded: the cost of the split, in bare round trips.
const ROUND_TRIPS_MAX: f64 = 2.6;
/// Rounds at least, the first of which is not counted. With fewer there is no interval.
const ROUNDS_MIN: usize = 5;
const TIMEOUT: Duration = Duration::from_secs(5);

/// A question of the cycle, the sizes of question and answer in bytes, and the median time of bare queries of these
/// sizes in each round, ms.
struct Question {
    role: String,
    sizes: (usize, usize),
    bare: Vec<f64>,
}

/// Measures the split. `processes` must have no replicas yet.
pub(super) async fn measure(
    options: &Options,
    processes: &mut Processes,
    workload: &Workload,
) -> anyhow::Result<Measured> {
    let seconds = options.seconds.unwrap_or(20.0);
    note(format_args!(
        "{} cycles by turns in process and over processes, {seconds} s",
        workload.cycles.len()
    ));
    let pools = [Service::Generator, Service::Cpc, Service::Cnc];
    for service in pools {
        processes.add(service.name(), 1).await?;
    }
    processes.add("echo", 1).await?;
    // Processes are numbered in the order of their start.
    let echo = format!("echo-{}", pools.len());
    let robots = Robots::join(workload, processes, 1, Clock::Lockstep).await?;
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

/// What one round over all cycles has shown, medians in milliseconds.
struct Round {
    /// What a cycle took longer over processes than in process.
    added: f64,
    /// A bare query, mean of the questions of a cycle.
    bare: f64,
}

async fn compare(
    homes: [&Robot; 2],
    workload: &Workload,
    (session, echo): (&Session, &str),
    seconds: f64,
) -> anyhow::Result<Measured> {
    let mut questions = questions(homes[0], workload).await?;
    let mut cycles = [Vec::new(), Vec::new()];
    let mut rounds = Vec::new();
    let begin = Instant::now();
    while rounds.len() < ROUNDS_MIN || begin.elapsed().as_secs_f64() < seconds {
        let mut memories = [Memory::new(0), Memory::new(0)];
        let mut added = Vec::new();
        let mut bare = vec![Vec::new(); questions.len()];
        for (index, past) in workload.cycles.iter().enumerate() {
            // Which goes first alternates: the second finds the scene in the processor's cache.
            let first = (rounds.len() + index) % 2;
            let mut planned = [None, None];
            for home in [first, 1 - first] {
                planned[home] = Some(plan(homes[home], &mut memories[home], &past.scene).await?);
            }
            let [Some((decided, here)), Some((decided_over_processes, there))] = planned else { continue };
            ensure!(decided == decided_over_processes, "processes decided otherwise");
            added.push((there.total_us as f64 - here.total_us as f64) / 1e3);
            cycles[0].push(here);
            cycles[1].push(there);
            for (question, times) in questions.iter().zip(&mut bare) {
                let time = round_trip(session, echo, question.sizes, TIMEOUT).await?;
                times.push(1e3 * time.as_secs_f64());
            }
        }
        if rounds.is_empty() {
            cycles.iter_mut().for_each(Vec::clear);
        }
        let bare: Vec<f64> = bare.iter().filter_map(|times| median(times)).collect();
        for (question, time) in questions.iter_mut().zip(&bare) {
            question.bare.push(*time);
        }
        rounds
            .push(Round { added: median(&added).unwrap_or_default(), bare: mean(&bare).unwrap_or_default() });
    }
    Ok(measured(&questions, &cycles, &rounds[1..]))
}

fn measured(questions: &[Question], cycles: &[Vec<wire::Timings>; 2], rounds: &[Round]) -> Measured {
    let question = |q: &Question| {
        vec![
            label("question", "question", &q.role),
            count("question_bytes", q.sizes.0),
            count("answer_bytes", q.sizes.1),
            number("p50_ms", "bare p50 ms", median(&q.bare[1..]).unwrap_or_default(), 3),
        ]
    };
    let of = |value: fn(&Round) -> f64| rounds.iter().map(value).collect::<Vec<_>>();
    let ratios = of(|round| round.added / round.bare);
    let round_trips = mean(&ratios).unwrap_or_default();
    let (low, high) = mean_interval(&ratios, 0).unwrap_or((round_trips, round_trips));
    let middle = |values: Vec<f64>| median(&values).unwrap_or_default();
    let added = middle(of(|round| round.added));
    let bare = middle(of(|round| round.bare));
    let questions: Vec<Row> = questions.iter().map(question).collect();
    let homes = [stages("in process", &cycles[0]), stages("processes", &cycles[1])];
    let verdict = if high <= ROUND_TRIPS_MAX { "within" } else { "beyond" };
    let count = cycles[0].len();
    let rounds = rounds.len();
    Measured {
        json: json!({
            "cycles": count,
            "rounds": rounds,
            "added_ms": added,
            "bare_p50_ms": bare,
            "round_trips": round_trips,
            "round_trips_interval": [low, high],
            "questions": questions.iter().map(figures::json).collect::<Vec<_>>(),
            "in_process": figures::json(&homes[0]),
            "processes": figures::json(&homes[1]),
        }),
        text: format!(
            "{}\n{}\n{count} cycles in either home, in {rounds} rounds\n\
             the split adds {added:.3} ms to a cycle: {round_trips:.2} bare round trips of {bare:.3} ms \
             ({low:.2} to {high:.2} with 95 % confidence), {verdict} the {ROUND_TRIPS_MAX} allowed",
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
    let times: Vec<f64> = times.iter().map(|t| of(t) as f64 / 1e3).collect();
    median(&times).unwrap_or_default()
}

/// Plans one cycle of the workload once more: what was decided, and how long it took.
async fn plan(
    robot: &Robot,
    memory: &mut Memory,
    scene: &wire::Scene,
) -> anyhow::Result<((wire::Reason, wire::F64Array), wire::Timings)> {
    memory.seq += 1;
    let observation = Observation { belief: scene.belief.clone(), people: scene.people.clone() };
    let (decision, account) = cycle::plan(&robot.pool, &robot.context, memory, observation).await;
    let degraded = wire::words::say_all("degradation", &decision.degraded);
    ensure!(degraded.is_empty(), "a cycle was degraded: {degraded}");
    Ok(((decision.reason, decision.x), account.timings))
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
        let question = asked.encode(Budget::ms(TIMEOUT));
        let stage = Budget::of_generation(robot.pool.peers.now(), &context.mission, &robot.pool.stages());
        let shape = dispatch::Shape { steps: context.course.profile.steps, dt: context.course.profile.dt };
        let generated =
            dispatch::generate(&robot.pool, &context.mission.order.robot, &asked, 0, shape, stage).await;
        let Grown { generated, cut } = generated.context("no generator answered")?;
        let Generated { candidates, tree: grown } = generated;
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
        add(wire::keys::GENERATOR, question, reply.encode());
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
