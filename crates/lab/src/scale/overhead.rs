//! What splitting the cycle into processes costs: the same cycles over processes and in this process, and bare
//! queries of the same sizes, by turns.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use curionav_arbiter::cycle::{self, Observation};
use curionav_arbiter::memory::Memory;
use curionav_pool::budget::Budget;
use curionav_pool::dispatch::{self, Generated};
use curionav_pool::generator;
use curionav_pool::peers::Peers;
use curionav_runtime::convert;
use curionav_runtime::echo::round_trip;
use curionav_runtime::latency::Latency;
use curionav_schemas::{self as wire, Clock, Message};
use serde::Serialize;
use zenoh::Session;

use super::processes::Processes;
use super::robots::{Robot, Robots};
use super::workload::Workload;
use curionav_deployment::service_kind::Kind;
use curionav_runtime::exit::Exit;

/// What must not be exceeded: the cost of the split, in bare round trips.
pub(super) const ROUND_TRIPS_MAX: f64 = 4.0;
/// Rounds at least, the first of which is not counted.
const ROUNDS_MIN: usize = 3;
/// Bare queries of each kind in a round.
const BARE: usize = 100;
const TIMEOUT: Duration = Duration::from_secs(5);

/// A question of the cycle, and the bare query of its sizes.
#[derive(Debug, Serialize)]
pub(super) struct Question {
    pub(super) question: String,
    pub(super) question_bytes: usize,
    pub(super) answer_bytes: usize,
    pub(super) p50_ms: f64,
}

/// Medians of the stages of a cycle.
#[derive(Debug, Serialize)]
pub(super) struct Stages {
    pub(super) generate_ms: f64,
    pub(super) evaluate_ms: f64,
    pub(super) decide_ms: f64,
    pub(super) cycle_ms: f64,
}

/// What the split costs.
#[derive(Debug, Serialize)]
pub(super) struct Overhead {
    /// Cycles timed in either home.
    pub(super) cycles: usize,
    /// Median of a cycle whose services are threads of this process.
    pub(super) in_process_p50_ms: f64,
    /// Median of the same cycles with a process for each service and for the router.
    pub(super) processes_p50_ms: f64,
    /// Median of a bare query through the router, mean of the questions of a cycle.
    pub(super) bare_p50_ms: f64,
    /// What the split adds to the median, in bare queries.
    pub(super) round_trips: f64,
    pub(super) questions: Vec<Question>,
    /// Where the time goes in either home.
    pub(super) in_process: Stages,
    pub(super) processes: Stages,
}

/// Measures for `seconds`. `processes` must have no replicas yet.
pub(super) async fn measure(
    processes: &mut Processes,
    workload: &Workload,
    seconds: f64,
) -> Result<Overhead, Exit> {
    let pools = [Kind::Generator, Kind::Cpc, Kind::Cnc];
    for kind in pools {
        processes.add(kind.name(), 1).await?;
    }
    processes.add("echo", 1).await?;
    // Processes are numbered in the order of their start.
    let echo = format!("echo-{}", pools.len());
    let robots = Robots::join(workload, &processes.endpoint, 1, Clock::Lockstep).await?;
    let over_processes = Arc::clone(robots.all.first().context("no robot").map_err(Exit::failed)?);
    let in_process = Robot::on(&workload.services.session, workload.context("robot-0", Clock::Lockstep)?)?;
    for robot in [&over_processes, &in_process] {
        robot.ready(generator::ROLE, 1).await?;
        for term in robot.context.pool_terms() {
            robot.ready(term, 1).await?;
        }
    }
    let homes = [&in_process, &*over_processes];
    let overhead = compare(homes, workload, (robots.session(0), &echo), seconds).await;
    let overhead = overhead.map_err(Exit::failed)?;
    drop(over_processes);
    robots.leave();
    processes.dismiss().await;
    Ok(overhead)
}

async fn compare(
    homes: [&Robot; 2],
    workload: &Workload,
    (session, echo): (&Session, &str),
    seconds: f64,
) -> anyhow::Result<Overhead> {
    let mut questions = questions(homes[0], workload).await?;
    let mut bare = vec![Latency::default(); questions.len()];
    let mut cycles = [Vec::new(), Vec::new()];
    let begin = Instant::now();
    let mut round = 0;
    while round < ROUNDS_MIN || begin.elapsed().as_secs_f64() < seconds {
        let (mut decided, mut took) = (Vec::new(), Vec::new());
        for home in homes {
            let (decisions, times) = replay(home, workload).await?;
            decided.push(decisions);
            took.push(times);
        }
        ensure!(decided[0] == decided[1], "processes decided otherwise");
        for (question, latency) in questions.iter().zip(&mut bare) {
            let sizes = (question.question_bytes, question.answer_bytes);
            for _ in 0..BARE {
                let time = round_trip(session, echo, sizes, TIMEOUT).await?;
                if round > 0 {
                    latency.record(time);
                }
            }
        }
        if round > 0 {
            cycles.iter_mut().zip(took).for_each(|(all, times)| all.extend(times));
        }
        round += 1;
    }
    for (question, latency) in questions.iter_mut().zip(&bare) {
        question.p50_ms = latency.percentile_ms(0.5);
    }
    let [in_process, processes] = cycles.each_ref().map(|times| stages(times));
    let (in_process_p50_ms, processes_p50_ms) = (in_process.cycle_ms, processes.cycle_ms);
    let bare_p50_ms = questions.iter().map(|q| q.p50_ms).sum::<f64>() / questions.len().max(1) as f64;
    Ok(Overhead {
        cycles: cycles[0].len(),
        in_process_p50_ms,
        processes_p50_ms,
        bare_p50_ms,
        round_trips: (processes_p50_ms - in_process_p50_ms) / bare_p50_ms,
        questions,
        in_process,
        processes,
    })
}

fn stages(times: &[wire::Timings]) -> Stages {
    let median_ms = |of: &dyn Fn(&wire::Timings) -> u64| {
        let mut latency = Latency::default();
        times.iter().for_each(|t| latency.record(Duration::from_micros(of(t))));
        latency.percentile_ms(0.5)
    };
    Stages {
        generate_ms: median_ms(&|t| t.generate_us),
        evaluate_ms: median_ms(&|t| t.total_us.saturating_sub(t.generate_us + t.arbitrate_us)),
        decide_ms: median_ms(&|t| t.arbitrate_us),
        cycle_ms: median_ms(&|t| t.total_us),
    }
}

/// Plans every cycle of the workload once more: what was decided, and how long each took.
async fn replay(
    robot: &Robot,
    workload: &Workload,
) -> anyhow::Result<(Vec<(wire::Reason, wire::F64Array)>, Vec<wire::Timings>)> {
    let mut memory = Memory::new(0);
    let (mut decisions, mut times) = (Vec::new(), Vec::new());
    for past in &workload.cycles {
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
    let mut sizes = Vec::new();
    let context = &robot.context;
    for (seq, past) in workload.cycles.iter().enumerate().take(half + 1) {
        let request = context.generate_request((1, seq as u64), &past.scene, 0, tree.as_ref(), &[])?;
        let stage = Budget::of_stage(robot.pool.peers.now(), &context.mission);
        let shape = (context.profile.steps, context.profile.dt);
        let generated =
            dispatch::generate(&robot.pool, &context.mission.order.robot, &request, 0, shape, stage).await;
        let Generated { candidates, tree: grown, cut } = generated.context("no generator answered")?;
        tree = Some(grown.clone());
        if seq < half {
            continue;
        }
        let reply = wire::GenerateReply {
            epoch: 1,
            seq: seq as u64,
            instance: "generator".into(),
            candidates: convert::candidates_to_wire(&candidates),
            tree: convert::tree_to_wire(grown),
            elapsed_us: 0,
            cut,
        };
        sizes.push((generator::ROLE.to_owned(), request.encode().len(), reply.encode().len()));
        for term in context.pool_terms() {
            let all = 0..candidates.len();
            let request = context.evaluate_request(term, (1, 0), &past.scene, &candidates, all);
            let scores = wire::Scores {
                epoch: 1,
                seq: seq as u64,
                shard: 0,
                term: term.to_owned(),
                instance: term.to_owned(),
                cost: vec![0.0; candidates.len()].into(),
                elapsed_us: 0,
                slots: 1,
            };
            sizes.push((term.to_owned(), request.encode().len(), scores.encode().len()));
        }
    }
    let question = |(question, question_bytes, answer_bytes)| Question {
        question,
        question_bytes,
        answer_bytes,
        p50_ms: 0.0,
    };
    Ok(sizes.into_iter().map(question).collect())
}
