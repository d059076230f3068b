//! An overload costs no cycle and does not feed itself: every cycle is decided in time, and once a burst of load is
//! over the robot is nominal again within a second.

use std::sync::Arc;
use std::time::Duration;

use curionav_schemas::Clock;

use super::fault::{Episode, Fault};
use super::world::World;
use super::{arbiter, corridor_map, robot};

/// When the burst begins and when it ends.
const FROM: Duration = Duration::from_secs(3);
const UNTIL: Duration = Duration::from_millis(5500);
/// Nominal from then on, for as long as is watched.
const NOMINAL_AFTER: f64 = 1.0;
const WATCHED: f64 = 4.0;
/// A flood is one if each replica gives others at least this many answers in a burst.
const BUSY: usize = 50;
/// Between two cycles, seconds: ten a second.
const PERIOD: f64 = 0.1;

/// What came of a burst.
#[derive(Debug)]
struct Outcome {
    /// Cycles of the burst, and how many of them were degraded.
    during: (usize, usize),
    /// Questions of other robots that replicas answered.
    others: usize,
    /// Ticks without a cycle, and cycles that took longer than the time between two.
    missed: usize,
    /// Cycles later than [`NOMINAL_AFTER`] the burst.
    after: usize,
    /// From the end of the burst to the last degraded cycle, seconds.
    recovered: f64,
}

/// A robot with `pool` (generators, cpc, cnc) and that many trees, to which all of `faults` happen at once.
fn burst(seed: u64, trees: u32, pool: [usize; 3], faults: &[Fault]) -> Outcome {
    let (fields, map) = corridor_map::fields();
    let mut mission = corridor_map::mission(map, seed, Clock::Realtime, trees);
    mission.order.plan_every = 1;
    let world = World::new(&fields, mission, true, pool);
    arbiter::start(&world);
    world.executor.spawn(robot::run(Arc::clone(&world)));
    let episodes = faults.iter().map(|&fault| Episode { fault, from: FROM, until: UNTIL }).collect();
    world.executor.spawn(Arc::clone(&world).play(episodes));
    let end = UNTIL.as_secs_f64();
    world.executor.run(Duration::from_secs_f64(end + WATCHED));
    world.executor.end();
    let state = world.state();
    // What the robot sees right before the burst is planned with when it has begun.
    let cycles: Vec<_> =
        state.decided.iter().map(|(d, _)| d).filter(|d| d.stamp > FROM.as_secs_f64() - PERIOD).collect();
    let gaps: u64 = cycles.windows(2).map(|pair| pair[1].tick - pair[0].tick - 1).sum();
    let slow = cycles.iter().filter(|d| d.elapsed_us as f64 > 1e6 * PERIOD).count();
    let during = || cycles.iter().filter(|d| d.stamp < end);
    let after = || cycles.iter().filter(|d| d.stamp > end + NOMINAL_AFTER);
    let unwell = cycles.iter().rev().find(|d| d.stamp >= end && !d.degraded.is_empty());
    Outcome {
        during: (during().count(), during().filter(|d| !d.degraded.is_empty()).count()),
        others: state.flood_answered,
        missed: gaps as usize + slow,
        after: after().count(),
        recovered: unwell.map_or(0.0, |d| d.stamp - end),
    }
}

#[test]
fn after_a_burst_of_load_the_robot_is_nominal_within_a_second() {
    let bursts: [&[Fault]; 6] = [
        &[Fault::Flood],
        &[Fault::Overload(4.0)],
        &[Fault::Overload(10.0)],
        &[Fault::Overload(60.0)],
        &[Fault::Flood, Fault::Overload(5.0)],
        &[Fault::Flood, Fault::Weather { delay: 0.02, loss: 0.3, repeated: 0.2 }],
    ];
    let mut worst: f64 = 0.0;
    for faults in bursts {
        for (pool, trees) in [([1, 1, 1], 1), ([2, 2, 2], 1), ([3, 3, 3], 3), ([3, 2, 1], 1)] {
            for seed in 1000..1004 {
                let outcome = burst(seed, trees, pool, faults);
                let (cycles, degraded) = outcome.during;
                let told = format!("{faults:?}, pool {pool:?}, {trees} trees, seed {seed}: {outcome:?}");
                println!("{told}");
                // A flood alone may take nothing away, because replicas serve robots in turn.
                let is_felt = degraded > cycles / 2
                    || (faults == [Fault::Flood] && outcome.others >= BUSY * pool.iter().sum::<usize>());
                assert!(is_felt && cycles > 10, "no burst: {told}");
                // Where the robot itself is not heard, there is nothing to plan from.
                let is_heard = !faults.iter().any(|f| matches!(f, Fault::Weather { .. }));
                assert!(outcome.missed == 0 || !is_heard, "{told}");
                assert!(outcome.recovered <= NOMINAL_AFTER, "{told}");
                assert!(outcome.after as f64 > 0.9 * (WATCHED - NOMINAL_AFTER) / PERIOD, "{told}");
                worst = worst.max(outcome.recovered);
            }
        }
    }
    println!("nominal after {worst:.1} s at the latest");
}
