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
fn an_arbiter_that_starts_unheard_is_obeyed_once_the_one_before_is_silent() {
    for seed in 1000..1010 {
        // The third hears no driver when it starts.
        let began = 5.5;
        let world = play_world(
            seed,
            POOL,
            vec![
                episode(Fault::ArbiterCrash, 2.0, 2.5),
                episode(Fault::ArbiterCrash, 5.0, began),
                episode(Fault::NoDriver, 5.2, 7.0),
            ],
            true,
        );
        let state = world.state();
        let of_third = |epoch: u64| state.epochs.get(&epoch) == Some(&3);
        let obeyed = state.robot.taken.iter().find(|(_, _, d)| of_third(d.epoch));
        let at = obeyed.map_or(f64::INFINITY, |(now, ..)| *now);
        assert!(at <= began + HEALING, "seed {seed}: obeyed at {at} s");
    }
}

#[test]
fn a_foreign_decision_shuts_no_arbiter_out() {
    for seed in 1000..1010 {
        for epoch in [Epoch::Last, Epoch::Same] {
            // Also before anything has been obeyed: the driver has just forgotten every arbiter.
            for (crash, after) in [(2.0, 2.0), (3.15, 0.001)] {
                let driver = episode(Fault::DriverCrash, crash, crash + 0.2);
                let at = crash + after;
                // The stranger decides once only.
                let foreign = episode(Fault::Foreign(epoch), at, at);
                // Panics unless the arbiter is obeyed again within five cycles.
                let world = play_world(seed, POOL, vec![driver, foreign], true);
                let state = world.state();
                let is_foreign = |epoch: u64, seq: u64| !state.epochs.contains_key(&epoch) || seq == u64::MAX;
                let taken = state.robot.taken.iter().any(|(_, _, d)| is_foreign(d.epoch, d.seq));
                // An arbiter that is obeyed keeps strangers out, unless they speak in its name.
                assert_eq!(taken, epoch == Epoch::Same || after < 1.0, "seed {seed}, {epoch:?}");
            }
        }
    }
}
