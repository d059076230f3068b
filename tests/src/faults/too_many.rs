//! More robots than a pool has time for, each with a computer of its own: every robot decides in time, all get about
//! the same share of what the pool can do, and the pool is asked for no more than when it had time.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use curionav_arbiter::cycle;
use curionav_pool::context::PlanContext;
use curionav_pool::pool::Pool;
use curionav_robot::arbiter::memory::Memory;
use curionav_schemas::{Clock, Decision, Evaluated, keys};

use super::base::Base;
use super::corridor_map;
use super::world::{ArbiterSeat, SimulatedPeers, World};

/// Between two cycles, seconds: ten per second.
const PERIOD: f64 = 0.1;
/// Until this time replicas prepare, and what answers take is learnt.
const SETTLED: Duration = Duration::from_secs(2);
const END: Duration = Duration::from_secs(12);
/// Robots and replicas of each role. A replica answers a question within 4 to 11 ms, so two have time for some 15
/// robots.
const CASES: [(usize, usize); 6] = [(4, 2), (16, 2), (32, 2), (64, 2), (32, 3), (64, 3)];
/// Questions that may be asked twice, as a share, and what is left of the eight that may be at once.
const ASKED_TWICE: f64 = 0.05;
const LEFT_OF_EIGHT: f64 = 0.02;
/// Jain's index of the answers per robot, at least.
const FAIR: f64 = 0.95;

/// What one robot decided since [`SETTLED`].
type Decided = Arc<Mutex<Vec<Decision>>>;

/// One robot that stays where it is and plans as if it had just come there.
async fn plan(world: Arc<World>, index: usize, phase: Duration, decided: Decided) {
    let mut mission = world.mission.clone();
    (mission.order.robot, mission.order.plan_every) = (format!("robot-{index}"), 1);
    let context = PlanContext::new(mission.clone(), &world.fields, true).unwrap();
    let (seat, computing) = (Arc::new(ArbiterSeat::default()), AtomicU64::new(0));
    world.state().arbiters.push(Arc::clone(&seat));
    let peers = SimulatedPeers { world: Arc::clone(&world), seat, computing, ahead: Some(AtomicU64::new(0)) };
    let pool = Pool::new(Arc::new(peers));
    let planning = async {
        let (mut memory, mut base) = (Memory::new(1), Base::new(&mission));
        let mut due = phase;
        loop {
            world.executor.sleep(due.saturating_sub(world.executor.now())).await;
            let begun = world.executor.now();
            base.roll(None);
            let (belief, people) = (base.belief(), base.people());
            let (decision, _) =
                cycle::decide(&pool, Some(&context), &mut memory, &mission, belief, Some(people)).await;
            if begun >= SETTLED {
                decided.lock().unwrap().push(decision);
            }
            pool.peers.catch_up().await;
            // A cycle that took too long costs the next one.
            due += Duration::from_secs_f64(PERIOD);
            while due < world.executor.now() {
                due += Duration::from_secs_f64(PERIOD);
            }
        }
    };
    tokio::select! {
        biased;
        () = planning => {}
        () = pool.keep_ready(&context) => {}
    }
}

/// What came of so many robots at one pool.
#[derive(Debug)]
struct Outcome {
    /// Cycles of those that were due, as a share.
    planned: f64,
    /// The longest, seconds.
    longest: f64,
    /// Answers of generators, per second and robot by robot; and the same of replicas of `cnc`.
    grown: Vec<f64>,
    scored: Vec<f64>,
    /// Cycles in which the pool scored every candidate under `cnc`, as a share.
    whole: f64,
    /// Questions per cycle, by role.
    asked: BTreeMap<String, f64>,
}

fn jain(shares: &[f64]) -> f64 {
    let (sum, squares): (f64, f64) = (shares.iter().sum(), shares.iter().map(|x| x * x).sum());
    if squares > 0.0 { sum * sum / (shares.len() as f64 * squares) } else { 1.0 }
}

fn at_one_pool(robots: usize, replicas: usize) -> Outcome {
    let (fields, map) = corridor_map::fields();
    let mut mission = corridor_map::mission(map, 1000, Clock::Realtime, 1);
    mission.order.plan_every = 1;
    let world = World::new(&fields, mission, true, [replicas; 3]);
    let all: Vec<Decided> = (0..robots)
        .map(|index| {
            let decided = Decided::default();
            // In every period at the same time, as robots do whose clocks run alike.
            let phase = Duration::from_secs_f64(PERIOD * index as f64 / robots as f64);
            world.executor.spawn(plan(Arc::clone(&world), index, phase, Arc::clone(&decided)));
            decided
        })
        .collect();
    world.executor.run(SETTLED);
    {
        let mut state = world.state();
        state.work_asked.clear();
        state.work_answered.clear();
    }
    world.executor.run(END);
    world.executor.end();
    let seconds = (END - SETTLED).as_secs_f64();
    let count = |of: &Decided, counts: &dyn Fn(&Decision) -> bool| {
        of.lock().unwrap().iter().filter(|decision| counts(decision)).count() as f64
    };
    let sum = |counts: &dyn Fn(&Decision) -> bool| all.iter().map(|of| count(of, counts)).sum::<f64>();
    let cycles = sum(&|_| true);
    let answers = world.state().work_answered.clone();
    let each = |role: &str| -> Vec<f64> {
        let of_robot = |index| answers.get(&(format!("robot-{index}"), role.to_owned())).copied();
        (0..robots).map(|index| of_robot(index).unwrap_or_default() as f64 / seconds).collect()
    };
    let longest = all.iter().flat_map(|of| of.lock().unwrap().iter().map(|d| d.elapsed_us).max()).max();
    let asked = world.state().work_asked.clone();
    Outcome {
        planned: cycles / (robots as f64 * seconds / PERIOD),
        longest: longest.unwrap_or_default() as f64 / 1e6,
        grown: each(keys::GENERATOR),
        scored: each("cnc"),
        whole: sum(&|d| d.evaluated.get("cnc") == Some(&Evaluated::Pool)) / cycles,
        asked: asked.into_iter().map(|(role, count)| (role, count as f64 / cycles)).collect(),
    }
}

#[test]
fn with_too_little_pool_every_robot_decides_in_time_and_gets_its_share() {
    let outcomes = CASES.map(|(robots, replicas)| (robots, replicas, at_one_pool(robots, replicas)));
    let (idle, busy) = (&outcomes[0].2, &outcomes[1].2);
    let mut most: BTreeMap<usize, [f64; 2]> = BTreeMap::new();
    for (robots, replicas, outcome) in &outcomes {
        let Outcome { planned, longest, grown, scored, whole, asked } = outcome;
        let sums = [grown, scored].map(|of| of.iter().sum::<f64>());
        let fair = [grown, scored].map(|of| jain(of));
        println!(
            "{robots:3} robots, {replicas} of each role: {:5.1} % of the cycles, longest {:2.0} ms; per second {:4.0} trees, {:4.0} shards; \
             fairness {:.3}, {:.3}; {:.0} % scored whole; questions per cycle {asked:.2?}",
            1e2 * planned,
            1e3 * longest,
            sums[0],
            sums[1],
            fair[0],
            fair[1],
            1e2 * whole
        );
        assert!(*planned > 0.99 && *longest < PERIOD, "{outcome:?}");
        assert!(fair.iter().all(|fair| *fair >= FAIR), "{fair:?}: {outcome:?}");
        for (role, count) in asked {
            let before = idle.asked[role].max(busy.asked[role]);
            assert!(
                *count <= (1.0 + ASKED_TWICE) * before + LEFT_OF_EIGHT,
                "{role}: {count:.3} instead of {before:.3}"
            );
        }
        for (most, now) in most.entry(*replicas).or_default().iter_mut().zip(sums) {
            assert!(now > 0.8 * *most, "the pool does less the more it is asked: {now:.0} after {most:.0}");
            *most = most.max(now);
        }
    }
}
