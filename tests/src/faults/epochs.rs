//! Which arbiter the driver obeys when arbiters start unheard, and when a stranger claims to be one.

use std::time::Duration;

use super::fault::{Episode, Epoch, Fault};
use super::invariants::HEALING;
use super::ten_thousand_cycles::play_world;

/// The pool is whole and in time: only the driver and the arbiters matter here.
const POOL: [usize; 3] = [2, 2, 2];

fn episode(fault: Fault, from: f64, until: f64) -> Episode {
    Episode { fault, from: Duration::from_secs_f64(from), until: Duration::from_secs_f64(until) }
}

#[test]
fn an_arbiter_that_starts_unheard_is_obeyed_soon_after_it_is_heard() {
    for seed in 1000..1010 {
        // The second succeeds the first; the third hears no driver when it starts, and decides below the second.
        let healed = 7.0;
        let world = play_world(
            seed,
            POOL,
            vec![
                episode(Fault::ArbiterCrash, 2.0, 2.5),
                episode(Fault::ArbiterCrash, 5.0, 5.5),
                episode(Fault::NoDriver, 5.2, healed),
            ],
            true,
        );
        let state = world.state();
        let of_third = |epoch: u64| state.epochs.get(&epoch) == Some(&3);
        let begun = state.decided.iter().map(|(d, _)| d).find(|d| of_third(d.epoch)).unwrap();
        let before = state.robot.taken.iter().map(|(_, _, d)| d).rfind(|d| !of_third(d.epoch)).unwrap();
        assert!(begun.epoch < before.epoch, "seed {seed}: it has heard which epoch to exceed");
        let obeyed = state.robot.taken.iter().find(|(_, _, d)| of_third(d.epoch));
        let at = obeyed.map(|(now, ..)| *now).unwrap_or(f64::INFINITY);
        assert!(at <= healed + HEALING, "seed {seed}: obeyed at {at} s");
    }
}

#[test]
fn a_foreign_decision_shuts_no_arbiter_out() {
    for seed in 1000..1010 {
        for (epoch, refused) in [(Epoch::Last, 1), (Epoch::Farthest, 0), (Epoch::Same, 0)] {
            // Also before anything has been obeyed: the driver has just forgotten every arbiter.
            for (crash, after) in [(2.0, 2.0), (3.15, 0.001)] {
                let driver = episode(Fault::DriverCrash, crash, crash + 0.2);
                let at = crash + after;
                // The stranger decides once only.
                let foreign = episode(Fault::Foreign(epoch), at, at);
                // Panics unless the arbiter is obeyed again within five cycles.
                let world = play_world(seed, POOL, vec![driver, foreign], true);
                let state = world.state();
                assert_eq!(state.robot.refused, refused, "seed {seed}, {epoch:?}");
                let taken = state
                    .robot
                    .taken
                    .iter()
                    .any(|(_, _, d)| !state.epochs.contains_key(&d.epoch) || d.seq == u64::MAX);
                assert_eq!(taken, refused == 0, "seed {seed}, {epoch:?}");
            }
        }
    }
}
