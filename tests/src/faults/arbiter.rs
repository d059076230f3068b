//! One process of the arbiter: its service's loop around the real cycle and the real pool.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use curionav_arbiter::cycle;
use curionav_pool::context::PlanContext;
use curionav_pool::pool::Pool;
use curionav_robot::arbiter::memory::Memory;

use super::invariants;
use super::world::{ArbiterSeat, SimulatedPeers, World};

/// Starts another arbiter.
pub(super) fn start(world: &Arc<World>) {
    let seat = Arc::new(ArbiterSeat::default());
    let number = {
        let mut state = world.state();
        state.arbiters.push(Arc::clone(&seat));
        state.arbiters_started += 1;
        state.arbiters_started
    };
    let task = world.executor.spawn(run(Arc::clone(world), Arc::clone(&seat), number));
    *seat.task.lock().unwrap() = Some(task);
}

async fn run(world: Arc<World>, seat: Arc<ArbiterSeat>, number: u64) {
    let mission = world.mission.clone();
    let context = PlanContext::new(mission, &world.fields, world.in_process).unwrap();
    let computing = AtomicU64::new(0);
    let peers = SimulatedPeers { world: Arc::clone(&world), seat: Arc::clone(&seat), computing, ahead: None };
    let pool = Pool::new(Arc::new(peers));
    tokio::select! {
        biased;
        () = plan(&world, &seat, &pool, &context, number) => {}
        () = pool.keep_ready(&context) => {}
    }
}

async fn plan(
    world: &Arc<World>,
    seat: &Arc<ArbiterSeat>,
    pool: &Pool<SimulatedPeers>,
    context: &PlanContext,
    number: u64,
) {
    // Smaller with each: which number is greater does not matter.
    let mut memory = Memory::new(!number);
    let mut planned: Option<u64> = None;
    loop {
        seat.arrived.notified().await;
        let (belief, people, command) = {
            let latest = seat.latest.lock().unwrap();
            (latest.belief.clone(), latest.people.clone(), latest.command.clone())
        };
        let Some(belief) = belief else { continue };
        let period = u64::from(world.mission.order.plan_every);
        if planned.is_some_and(|last| belief.tick < last + period) {
            continue;
        }
        command.iter().for_each(|command| memory.observe_command(command));
        planned = Some(belief.tick);
        let (decision, account) =
            cycle::decide(pool, Some(context), &mut memory, &world.mission, belief, people).await;
        let report = account.map(|account| account.report(context, decision.clone()));
        invariants::after_a_cycle(world, pool, number, &decision, report.as_ref());
        world.state().decided.push((decision.clone(), report));
        world.send(move |world| world.state().robot.receive(decision.clone()));
    }
}
