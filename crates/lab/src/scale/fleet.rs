//! A whole fleet: robots with a goal each, that plan as arbiters do, over a pool of all services behind one or two
//! routers; and then one of the routers is killed and started again.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::exit::Exit;
use curionav_runtime::latency::percentile_ms;
use curionav_runtime::print::note;
use curionav_runtime::serve::refusals;
use curionav_runtime::{map_store, session};
use serde_json::json;
use tokio::task::JoinSet;
use zenoh::Session;

use super::figures::{self, Row, count, number, share};
use super::fleet_robot::{Cycle, FleetRobot, goals};
use super::many_robots::jain;
use super::options::{Options, Service};
use super::processes::{HOSTS, Processes};
use super::robots::on_a_thread;
use super::setup::Measured;
use super::workload::Workload;

/// Replicas of each role unless the options say otherwise.
const REPLICAS: u16 = 4;
const POOL: [Service; 3] = [Service::Generator, Service::Cpc, Service::Cnc];
/// From the start of the robots to the first cycle that counts.
const SETTLING: Duration = Duration::from_secs(2);
/// How long it is watched at most what becomes of a router's restart.
const RESTART: Duration = Duration::from_secs(60);
/// For how long every replica must have been ready to count as ready again: a lost link takes a second to be noticed.
const STEADY: Duration = Duration::from_secs(3);
/// Between two looks whether every replica is ready again.
const LOOK: Duration = Duration::from_millis(20);

/// Lets each number of robots plan.
pub(super) async fn measure(
    options: &Options,
    processes: &mut Processes,
    workload: &Workload,
) -> anyhow::Result<Measured> {
    for _ in 1..options.routers {
        processes.add_router().await?;
    }
    let replicas = options.replicas_or(&[REPLICAS]).first().copied().unwrap_or_default();
    let mut rows = Vec::new();
    for &robots in &options.fleet {
        note(format_args!("{robots} robots, {replicas} replicas of each role, {} routers", options.routers));
        rows.push(row(options, processes, workload, (replicas, usize::from(robots))).await?);
    }
    let json = json!({
        "rows": rows.iter().map(figures::json).collect::<Vec<_>>(),
        "scenario": options.scenario.display().to_string(),
        "replicas": replicas,
        "routers": options.routers,
        "rate": options.rate,
        "light": options.light,
    });
    Ok(Measured { json, text: figures::upright(&rows) })
}

async fn row(
    options: &Options,
    processes: &mut Processes,
    workload: &Workload,
    (replicas, robot_count): (usize, usize),
) -> anyhow::Result<Row> {
    for service in POOL {
        processes.add(service.name(), replicas).await?;
    }
    let map_host = connect(processes, HOSTS, 0).await?;
    let hosted = map_store::host(&map_host, workload.map.clone(), &refusals()).map_err(Exit::network)?;
    let period = Duration::from_secs_f64(1.0 / options.rate);
    let mut robots = Vec::with_capacity(robot_count);
    for (index, context) in goals(workload, robot_count, period, options.light)?.into_iter().enumerate() {
        let link = connect(processes, &format!("arbiter.robot-{index}"), index).await?;
        robots.push(Arc::new(FleetRobot::new(link, context)?));
    }
    for robot in &robots {
        robot.ready(replicas).await?;
    }
    let scenes = workload.observations();
    let begin = Instant::now();
    let end = Arc::new(AtomicBool::new(false));
    let mut planning = JoinSet::new();
    for (index, robot) in robots.iter().enumerate() {
        // Evenly over the period, as robots that do not know each other are on average.
        let start = begin + period.mul_f64(index as f64 / robot_count as f64);
        let robot = Arc::clone(robot);
        let end = Arc::clone(&end);
        let scenes = Arc::clone(&scenes);
        on_a_thread(&mut planning, async move {
            (index, robot.plan(&scenes, index, (start, period), &end).await)
        });
    }
    tokio::time::sleep(SETTLING).await;
    let from = Instant::now();
    let used = processes.used();
    let traffic = total(&robots);
    tokio::time::sleep(Duration::from_secs_f64(options.seconds.unwrap_or(20.0))).await;
    let until = Instant::now();
    let seconds = (until - from).as_secs_f64();
    let cores = processes.used();
    let traffic = total(&robots).since(&traffic);
    let cores = cores.all_since(&used, seconds);
    let (routers_mib, replicas_mib) = processes.resident();
    let restarted = Instant::now();
    let ready_after = restart(processes, &robots, replicas).await?;
    end.store(true, Ordering::Relaxed);
    let mut of_robots = vec![Vec::new(); robot_count];
    while let Some(planned) = planning.join_next().await {
        let (index, cycles) = planned?;
        of_robots[index] = cycles?;
    }
    drop(hosted);
    robots.iter().for_each(|robot| robot.leave());
    session::close(&map_host);
    processes.dismiss().await;

    let counted = |cycle: &&Cycle| (from..until).contains(&cycle.begun);
    let due = seconds / period.as_secs_f64();
    let answered: Vec<f64> = of_robots
        .iter()
        .map(|cycles| cycles.iter().filter(counted).filter(|cycle| cycle.is_answered()).count() as f64 / due)
        .collect();
    let all: Vec<&Cycle> = of_robots.iter().flatten().filter(counted).collect();
    let part = |is_one: fn(&Cycle) -> bool| {
        all.iter().filter(|cycle| is_one(cycle)).count() as f64 / all.len().max(1) as f64
    };
    let mut times: Vec<Duration> = all.iter().map(|cycle| cycle.took).collect();
    let late = times.iter().filter(|took| **took > period).count() as f64 / times.len().max(1) as f64;
    let healed = of_robots.iter().map(|cycles| healed_after(cycles, restarted)).fold(0.0, f64::max);
    let per_robot = 1.0 / (robot_count as f64 * seconds);
    Ok(vec![
        count("robots", robot_count),
        share("planned", all.len() as f64 / (due * robot_count as f64)),
        share("late", late),
        share("answered", answered.iter().sum::<f64>() / robot_count as f64),
        share("trees_of_pool", part(|cycle| cycle.is_grown)),
        share("scores_of_pool", part(|cycle| cycle.is_scored)),
        number("fairness", "fairness", jain(&answered), 4),
        number("p50_ms", "cycle p50 ms", percentile_ms(&mut times, 0.50), 2),
        number("p99_ms", "cycle p99 ms", percentile_ms(&mut times, 0.99), 2),
        number("questions", "questions / robot / s", traffic.questions * per_robot, 1),
        number("sent_kb", "sent kB / robot / s", traffic.sent * per_robot / 1e3, 1),
        number("received_kb", "received kB / robot / s", traffic.received * per_robot / 1e3, 1),
        number("probes", "probes / robot / s", traffic.probes * per_robot, 3),
        count("tokens", robot_count + POOL.len() * replicas),
        number("routers_mib", "MiB of a router", most(&routers_mib), 0),
        number("replicas_mib", "MiB of a replica", most(&replicas_mib), 0),
        number("router_cores", "cores: routers", cores.routers, 2),
        number("replica_cores", "cores: replicas", cores.replicas, 2),
        number("robot_cores", "cores: robots", cores.own, 2),
        number("healed_s", "answered again after s", healed, 2),
        number("ready_s", "all ready again after s", ready_after, 2),
    ])
}

fn most(sizes: &[f64]) -> f64 {
    sizes.iter().copied().fold(0.0, f64::max)
}

/// A link of its own to the routers; robot by robot another router comes first.
async fn connect(processes: &Processes, certificate: &str, index: usize) -> anyhow::Result<Session> {
    let config = ServiceConfig {
        connect: processes.endpoints_from(index),
        secure: processes.secure.clone(),
        certificates: vec![certificate.parse()?],
        ..ServiceConfig::default()
    };
    Ok(session::client(&config).await.map_err(Exit::network)?)
}

/// Kills the first router and starts it again; gives the seconds until every replica was ready for every robot, of
/// those that it keeps ready; infinite if that was not seen.
async fn restart(
    processes: &mut Processes,
    robots: &[Arc<FleetRobot>],
    replicas: usize,
) -> anyhow::Result<f64> {
    let begun = Instant::now();
    processes.restart_router().await?;
    let mut ready_since = None;
    while begun.elapsed() < RESTART {
        let are_ready = robots.iter().all(|robot| robot.is_ready(replicas));
        ready_since = are_ready.then(|| ready_since.unwrap_or_else(|| begun.elapsed()));
        if ready_since.is_some_and(|since| begun.elapsed() > since + STEADY) {
            break;
        }
        tokio::time::sleep(LOOK).await;
    }
    Ok(ready_since.map_or(f64::INFINITY, |since| since.as_secs_f64()))
}

/// Seconds from `fault` to the first cycle that the pool answered after one that it did not; zero if there was none.
fn healed_after(cycles: &[Cycle], fault: Instant) -> f64 {
    let mut after = cycles.iter().filter(|cycle| cycle.begun >= fault);
    if after.find(|cycle| !cycle.is_answered()).is_none() {
        return 0.0;
    }
    after.find(|cycle| cycle.is_answered()).map_or(f64::INFINITY, |cycle| (cycle.begun - fault).as_secs_f64())
}

/// What robots have sent and received in all.
#[derive(Debug, Clone, Copy, Default)]
struct Traffic {
    questions: f64,
    sent: f64,
    received: f64,
    probes: f64,
}

impl Traffic {
    fn since(self, before: &Self) -> Self {
        Self {
            questions: self.questions - before.questions,
            sent: self.sent - before.sent,
            received: self.received - before.received,
            probes: self.probes - before.probes,
        }
    }
}

fn total(robots: &[Arc<FleetRobot>]) -> Traffic {
    robots.iter().fold(Traffic::default(), |sum, robot| {
        let pool = &robot.pool;
        let peers = &robot.pool.peers;
        Traffic {
            questions: sum.questions + peers.questions.total() as f64,
            sent: sum.sent + peers.sent.total() as f64,
            received: sum.received + peers.received.total() as f64,
            probes: sum.probes + pool.probes.total() as f64,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fleet_has_healed_with_the_first_answer_after_the_last_question_without() {
        let begin = Instant::now();
        let cycle = |ms: u64, is_grown: bool| Cycle {
            begun: begin + Duration::from_millis(ms),
            took: Duration::ZERO,
            is_grown,
            is_scored: true,
        };
        let cycles =
            [cycle(0, false), cycle(100, true), cycle(200, false), cycle(300, false), cycle(400, true)];
        let fault = begin + Duration::from_millis(50);
        assert!((healed_after(&cycles, fault) - 0.35).abs() < 1e-9);
        assert_eq!(healed_after(&cycles[..2], fault), 0.0);
        assert_eq!(healed_after(&cycles[..4], fault), f64::INFINITY);
    }
}
