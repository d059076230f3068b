//! In lockstep, who answers changes nothing.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use curionav_arbiter::cycle;
use curionav_planning::Planner;
use curionav_planning::geometry::Point2;
use curionav_planning::random::rng;
use curionav_planning::terms::DerivedFields;
use curionav_pool::context::PlanContext;
use curionav_pool::pool::Pool;
use curionav_robot::arbiter::memory::Memory;
use curionav_runtime::convert;
use curionav_schemas::{Clock, Evaluated};

use super::base::TICK;
use super::corridor_map;
use super::fault::{Episode, Fault, episodes};
use super::world::{ArbiterSeat, SimulatedPeers, World};
use crate::invariants::SAME_DECISIONS;

/// Planning cycles of a run.
const CYCLES: u64 = 40;

/// What was decided: scene, action, and every number of the trajectory.
type Decided = Vec<(u64, String, Vec<u64>)>;

fn decisions(seed: u64, trees: u32, pool: [usize; 3], episodes: Vec<Episode>) -> Decided {
    decided(&driven(seed, trees, pool, episodes, false))
}

/// The world after a run.
fn driven(seed: u64, trees: u32, pool: [usize; 3], episodes: Vec<Episode>, alone: bool) -> Arc<World> {
    let (fields, map) = corridor_map::fields();
    let mission = corridor_map::mission(map, seed, Clock::Lockstep, trees);
    let world = World::new(&fields, mission, true, pool);
    let seat = Arc::new(ArbiterSeat::default());
    world.state().arbiters.push(Arc::clone(&seat));
    world.executor.spawn(world.clone().play(episodes));
    world.executor.spawn(run(Arc::clone(&world), seat, alone));
    world.executor.run(Duration::from_secs(3600));
    world.executor.end();
    world
}

fn decided(world: &World) -> Decided {
    let state = world.state();
    let numbers = |d: &curionav_schemas::Decision| {
        [&d.x, &d.y, &d.heading, &d.v, &d.omega].iter().flat_map(|a| a.iter().map(|n| n.to_bits())).collect()
    };
    let decided: Decided =
        state.decided.iter().map(|(d, _)| (d.tick, format!("{:?}", d.action), numbers(d))).collect();
    assert_eq!(decided.len() as u64, CYCLES);
    decided
}

/// What an arbiter in that seat plans with.
fn ready(world: &Arc<World>, seat: Arc<ArbiterSeat>) -> (PlanContext, Pool<SimulatedPeers>) {
    let context = PlanContext::new(world.mission.clone(), &world.fields, true).unwrap();
    let computing = AtomicU64::new(0);
    let peers = SimulatedPeers { world: Arc::clone(world), seat, computing, ahead: None };
    (context, Pool::new(Arc::new(peers)))
}

/// Arbiter and robot taking turns: no tick before the one before has been answered.
async fn run(world: Arc<World>, seat: Arc<ArbiterSeat>, alone: bool) {
    let (context, pool) = ready(&world, seat);
    let context = context.alone(alone);
    let driving = async {
        let mut memory = Memory::new(1);
        let period = u64::from(world.mission.order.plan_every);
        for tick in 0..CYCLES * period {
            let (belief, people) = {
                let mut state = world.state();
                (state.robot.base.belief(), state.robot.base.people())
            };
            if tick % period == 0 {
                let people = Some(people);
                let (decision, account) =
                    cycle::decide(&pool, Some(&context), &mut memory, &world.mission, belief.clone(), people)
                        .await;
                let mut state = world.state();
                let report = account.map(|account| account.report(&context, decision.clone()));
                state.decided.push((decision.clone(), report));
                state.robot.receive(decision);
            }
            world.state().robot.turn(belief);
            world.executor.sleep(Duration::from_secs_f64(TICK)).await;
        }
        // The world goes on without it for as long as its faults last.
    };
    tokio::select! {
        biased;
        () = driving => world.stop(),
        () = pool.keep_ready(&context) => {}
    }
}

#[test]
fn any_number_of_replicas_and_any_faults_decide_the_same() {
    for seed in 1000..1010 {
        let trees = 1 + 2 * (seed % 2) as u32;
        let expected = decisions(seed, trees, [1, 1, 1], Vec::new());
        let weather = Fault::Weather { delay: 0.02, loss: 0.2, repeated: 0.2 };
        let stormy = Episode { fault: weather, from: Duration::ZERO, until: Duration::from_secs(1000) };
        for pool in [[0, 0, 0], [1, 2, 3], [2, 5, 1], [3, 8, 8]] {
            let mut faults = episodes(&mut rng(seed, 80), pool.iter().sum::<usize>().max(1));
            faults.retain(|episode| episode.fault.is_of_the_pool());
            faults.push(stormy);
            assert!(
                decisions(seed, trees, pool, faults.clone()) == expected,
                "invariant {SAME_DECISIONS}; seed {seed}: {pool:?} {faults:?}"
            );
        }
    }
}

#[test]
fn an_arbiter_that_is_alone_asks_nothing_decides_the_same_and_misses_nothing() {
    for (seed, trees) in [(1000, 1), (1001, 3)] {
        let with_pool = driven(seed, trees, [1, 1, 1], Vec::new(), false);
        let alone = driven(seed, trees, [1, 1, 1], Vec::new(), true);
        let asked = [&with_pool, &alone].map(|world| world.state().asked.clone());
        assert!(!asked[0].is_empty() && asked[1].is_empty(), "seed {seed}: {asked:?}");
        assert!(decided(&alone) == decided(&with_pool), "seed {seed}");
        for (decision, _) in &alone.state().decided {
            assert!(decision.degraded.is_empty(), "seed {seed}: {decision:?}");
            assert!(
                decision.evaluated.values().all(|how| *how == Evaluated::Local),
                "seed {seed}: {decision:?}"
            );
        }
    }
}

/// The library's planner for the mission of `world`, with its goal.
fn planner(world: &World) -> Planner {
    let order = &world.mission.order;
    let map = world.fields.of(order.map).map().unwrap();
    let profile = convert::parameters("profile", &order.profile).unwrap();
    let mut planner = Planner::new(map, profile, convert::robot_model(&order.robot_model))
        .unwrap()
        .with_seed(order.seed)
        .with_laser(convert::laser(&order.laser))
        .with_odometry_noise(convert::noise(&order.odometry_noise));
    planner.set_goal(Point2::new(order.goal_x, order.goal_y)).unwrap();
    planner
}

#[test]
fn the_librarys_planner_decides_as_the_services_do() {
    for (seed, trees) in [(1000, 1), (1001, 3)] {
        let world = driven(seed, trees, [1, 2, 2], Vec::new(), false);
        let mut planner = planner(&world);
        for (decision, report) in &world.state().decided {
            let scene = convert::scene(&report.as_ref().unwrap().scene);
            let verdict =
                planner.cycle_of_tick(scene.tick, scene.belief.clone(), &scene.people, scene.stamp).unwrap();
            let states = verdict.decision.trajectory.states();
            let planned = [&states.x, &states.y, &states.heading, &states.v, &states.omega];
            let decided = [&decision.x, &decision.y, &decision.heading, &decision.v, &decision.omega];
            for (planned, decided) in planned.into_iter().zip(decided) {
                assert_eq!(planned.as_slice(), &**decided, "seed {seed}, tick {}", decision.tick);
            }
            assert_eq!(verdict.decision.candidate, decision.candidate, "seed {seed}, tick {}", decision.tick);
        }
    }
}

#[test]
fn a_robot_that_was_told_to_stop_has_not_stayed_for_want_of_a_way() {
    let (fields, map) = corridor_map::fields();
    let mut mission = corridor_map::mission(map, 1000, Clock::Lockstep, 1);
    corridor_map::change_profile(&mut mission, |profile| {
        (profile.patience.after, profile.patience.stands, profile.hold.max_age) = (2.5, 100.0, 4.0);
    });
    let world = World::new(&fields, mission, true, [0, 0, 0]);
    let seat = Arc::new(ArbiterSeat::default());
    let (context, pool) = ready(&world, seat);
    let deciding = Arc::clone(&world);
    world.executor.spawn(async move {
        let mut memory = Memory::new(1);
        let (belief, people) = {
            let mut state = deciding.state();
            (state.robot.base.belief(), state.robot.base.people())
        };
        for (stamp, sees, in_place, impatient) in [
            (0.0, true, 0.0, false),
            (3.0, true, 3.0, true),
            (6.0, false, 0.0, false),
            (9.0, true, 0.0, false),
        ] {
            let belief = curionav_schemas::Belief { stamp, ..belief.clone() };
            let people = sees.then(|| curionav_schemas::People { stamp, ..people.clone() });
            let (decision, outcome) =
                cycle::decide(&pool, Some(&context), &mut memory, &deciding.mission, belief, people).await;
            let scene = outcome.map(|outcome| outcome.report(&context, decision).scene);
            let found = scene.map(|scene| (scene.in_place_s, scene.impatient));
            assert_eq!(found, sees.then_some((in_place, impatient)), "at {stamp} s");
        }
        deciding.stop();
    });
    world.executor.run(Duration::from_secs(60));
    world.executor.end();
}
