//! Ten thousand cycles of robots to which everything happens.

use std::sync::Arc;
use std::time::Duration;

use curionav_planning::random::{rng, uniform};
use curionav_schemas::{Action, Clock};

use super::fault::{Episode, Epoch, Fault, episodes};
use super::world::World;
use super::{arbiter, corridor_map, invariants, robot};

/// What came of one seed.
struct Outcome {
    cycles: usize,
    degraded: usize,
    metres: f64,
    /// Decisions as they were made: two runs of a seed must agree.
    trace: Vec<(u64, u64, String)>,
}

/// Plays one seed through and checks every invariant on the way.
pub(super) fn play_world(
    seed: u64,
    pool: [usize; 3],
    episodes: Vec<Episode>,
    in_process: bool,
) -> Arc<World> {
    let (fields, map) = corridor_map::fields();
    let world = World::new(
        &fields,
        corridor_map::mission(map, seed, Clock::Realtime, 1 + (seed % 3) as u32 / 2),
        in_process,
        pool,
    );
    arbiter::start(&world);
    let healed = episodes.iter().map(|e| e.until).max().unwrap_or_default();
    world.executor.spawn(robot::run(world.clone()));
    world.executor.spawn(world.clone().play(episodes));
    world.executor.run(healed + Duration::from_secs(7));
    invariants::at_the_end(&world, healed.as_secs_f64());
    world.executor.end();
    world
}

fn play(seed: u64, pool: [usize; 3], episodes: Vec<Episode>, in_process: bool) -> Outcome {
    let world = play_world(seed, pool, episodes, in_process);
    let state = world.state();
    let trace = state.decided.iter().map(|(d, _)| (d.epoch, d.seq, format!("{:?}", d.action))).collect();
    Outcome {
        cycles: state.decided.len(),
        degraded: state.decided.iter().filter(|(d, _)| !d.degraded.is_empty()).count(),
        metres: state.robot.driven.iter().map(|tick| tick.distance).sum(),
        trace,
    }
}

fn pool(seed: u64) -> [usize; 3] {
    let mut rng = rng(seed, 79);
    [0; 3].map(|_| 1 + (3.0 * uniform(&mut rng)) as usize)
}

fn play_seed(seed: u64) -> Outcome {
    let pool = pool(seed);
    let episodes = episodes(&mut rng(seed, 80), pool.iter().sum());
    play(seed, pool, episodes, !seed.is_multiple_of(5))
}

#[test]
fn the_invariants_hold_over_ten_thousand_cycles_of_faults() {
    let (mut cycles, mut degraded, mut metres, mut seed) = (0, 0, 0.0, 1000);
    while cycles < 10_000 {
        let outcome = play_seed(seed);
        cycles += outcome.cycles;
        degraded += outcome.degraded;
        metres += outcome.metres;
        seed += 1;
    }
    println!("{} seeds, {cycles} cycles, {degraded} degraded, {metres:.0} m", seed - 1000);
    // Faults that degrade nothing would prove nothing, nor would a robot that stands.
    assert!(degraded > cycles / 50 && degraded < cycles / 2, "{degraded} of {cycles} cycles degraded");
    assert!(metres > 0.1 * cycles as f64 * 0.3, "{metres} m in {cycles} cycles");
}

#[test]
fn a_seed_replays_exactly() {
    for seed in [1000, 1007, 1013] {
        let (once, again) = (play_seed(seed), play_seed(seed));
        assert_eq!(once.trace, again.trace, "seed {seed}");
    }
}

#[test]
fn without_faults_every_cycle_is_nominal() {
    let outcome = play(1000, [2, 2, 2], Vec::new(), true);
    // No replica is ready before the first ones.
    assert!(outcome.degraded <= 2, "{} of {} cycles degraded", outcome.degraded, outcome.cycles);
    assert!(outcome.trace.iter().skip(2).all(|(_, _, action)| *action == format!("{:?}", Action::Follow)));
}

#[test]
fn no_single_fault_takes_the_robot_out_of_control() {
    let always = |fault| Episode { fault, from: Duration::from_secs(3), until: Duration::from_secs(7) };
    let faults = [
        Fault::Crash(0),
        Fault::Hang(2),
        Fault::MassLeave,
        Fault::Overload(50.0),
        Fault::Flood,
        Fault::NoPool,
        Fault::NoRobot,
        Fault::ArbiterCrash,
        Fault::SecondArbiter,
        Fault::NoLocalizer,
        Fault::OldBelief,
        Fault::NoPeople,
        Fault::DriverCrash,
        Fault::NoDriver,
        Fault::Foreign(Epoch::Last),
        Fault::Foreign(Epoch::Same),
    ];
    for fault in faults {
        for in_process in [true, false] {
            println!("{fault:?}, in process: {in_process}");
            // Panics, naming invariant 7, if it does.
            play(1000, [1, 1, 1], vec![always(fault)], in_process);
        }
    }
}
