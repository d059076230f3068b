//! How long a mission waits for its pool, on simulated time.

use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use curionav_arbiter::readiness::await_pool;
use curionav_planning::profile::Term;
use curionav_pool::context::PlanContext;
use curionav_pool::pool::Pool;
use curionav_schemas::{Clock, Refusal, Reject};

use super::corridor_map;
use super::fault::Fault;
use super::replica::FOREIGN;
use super::world::{ArbiterSeat, SimulatedPeers, World};

/// Longer than anything waits but for what it waits for without limit.
const LONG: Duration = Duration::from_secs(120);

/// A mission with a term that is not built in, for a pool of some generators, CPC, CNC and of that term.
struct PoolAtStart {
    pool: [usize; 3],
    foreign: usize,
    in_process: bool,
    has_run: bool,
    /// A replica that is alive and never gets ready.
    broken: Option<(&'static str, &'static str)>,
}

impl PoolAtStart {
    /// What came of it, and after how many seconds; nothing if it still waits.
    fn outcome(&self) -> Option<(Result<(), Reject>, f64)> {
        let (fields, map) = corridor_map::fields();
        let mut mission = corridor_map::mission(map, 1000, Clock::Realtime, 1);
        corridor_map::change_profile(&mut mission, |profile| {
            profile.terms.insert(FOREIGN.to_owned(), Term::new(1.0, 1.0));
        });
        mission.has_run = self.has_run;
        let world = World::new(&fields, mission.clone(), self.in_process, self.pool);
        for i in 0..self.foreign {
            world.start_replica((FOREIGN.to_owned(), format!("{FOREIGN}-{i}")));
        }
        if let Some((role, instance)) = self.broken {
            let index = world.index(&(role.to_owned(), instance.to_owned()));
            world.change(true, Fault::Slow(index, 1e6));
        }
        let context = PlanContext::new(mission, &fields, self.in_process).unwrap();
        let seat = Arc::new(ArbiterSeat::default());
        world.state().arbiters.push(Arc::clone(&seat));
        let computing = AtomicU64::new(0);
        let peers = SimulatedPeers { world: Arc::clone(&world), seat, computing, ahead: None };
        let pool = Pool::new(Arc::new(peers));
        let outcome = Arc::new(Mutex::new(None));
        let (told, clock) = (Arc::clone(&outcome), world.executor.clone());
        world.executor.spawn(async move {
            let ready = tokio::select! {
                biased;
                ready = await_pool(&pool, &context) => ready,
                () = pool.keep_ready(&context) => unreachable!("it goes on for ever"),
            };
            *told.lock().unwrap() = Some((ready, clock.now().as_secs_f64()));
        });
        world.executor.run(LONG);
        world.executor.end();
        outcome.lock().unwrap().take()
    }
}

const NONE_BROKEN: PoolAtStart =
    PoolAtStart { pool: [2, 2, 2], foreign: 1, in_process: false, has_run: false, broken: None };

#[test]
fn a_whole_pool_is_waited_for_no_longer_than_it_takes() {
    let (outcome, after) = NONE_BROKEN.outcome().unwrap();
    assert!(outcome.is_ok() && after < 2.0, "{outcome:?} after {after} s");
}

#[test]
fn what_can_be_replaced_is_waited_for_for_five_seconds() {
    // Whichever it is: generators, CPC, CNC, all of them.
    for pool in [[0, 2, 2], [2, 0, 2], [2, 2, 0], [0, 0, 0]] {
        let without = PoolAtStart { pool, in_process: true, ..NONE_BROKEN };
        let (outcome, after) = without.outcome().unwrap();
        assert!(outcome.is_ok() && (5.0..5.5).contains(&after), "{pool:?}: {outcome:?} after {after} s");
    }
}

#[test]
fn a_term_that_no_replica_computes_refuses_the_mission_whatever_else_is_missing() {
    for (pool, in_process) in [([2, 2, 2], true), ([0, 2, 2], true), ([0, 0, 0], true), ([0, 2, 2], false)] {
        let without = PoolAtStart { pool, foreign: 0, in_process, ..NONE_BROKEN };
        let (outcome, after) = without.outcome().unwrap();
        let reject = outcome.unwrap_err();
        let detail = "none is alive, or none answers".to_owned();
        let expected = Refusal::NoReplica { term: "comfort".into(), may_come: false, detail };
        assert_eq!(reject, expected.at("terms.comfort"), "{pool:?}");
        assert!((20.0..20.5).contains(&after), "{pool:?}: after {after} s");
    }
}

#[test]
fn a_mission_that_has_been_under_way_is_not_given_up_for_replicas_out_of_reach() {
    let later = PoolAtStart { foreign: 0, in_process: true, has_run: true, ..NONE_BROKEN };
    assert!(later.outcome().unwrap().0.unwrap_err().why.is_transient());
}

#[test]
fn what_must_not_be_replaced_is_waited_for_without_limit() {
    let without = PoolAtStart { pool: [0, 2, 2], ..NONE_BROKEN };
    assert!(without.outcome().is_none());
}

#[test]
fn a_replica_that_never_gets_ready_beside_one_that_is_holds_a_mission_up_for_five_seconds() {
    for broken in [("generator", "generator-1"), ("cpc", "cpc-0")] {
        for in_process in [true, false] {
            let all = PoolAtStart { in_process, broken: Some(broken), ..NONE_BROKEN };
            let (outcome, after) = all.outcome().unwrap_or_else(|| panic!("{broken:?}: it waits for ever"));
            assert!(
                outcome.is_ok() && (5.0..5.5).contains(&after),
                "{broken:?}: {outcome:?} after {after} s"
            );
        }
    }
    let alone = PoolAtStart { pool: [1, 2, 2], broken: Some(("generator", "generator-0")), ..NONE_BROKEN };
    assert!(alone.outcome().is_none(), "it goes on without any generator");
}

#[test]
fn a_term_whose_name_is_no_part_of_a_key_is_refused_at_once() {
    let (fields, map) = corridor_map::fields();
    let mut mission = corridor_map::mission(map, 1000, Clock::Realtime, 1);
    corridor_map::change_profile(&mut mission, |profile| {
        profile.terms.insert("com/fort".to_owned(), Term::new(1.0, 1.0));
    });
    let refused = PlanContext::new(mission, &fields, true).err();
    assert_eq!(refused, Some(Refusal::NotAName { found: "com/fort".into() }.at("profile.terms")));
}
