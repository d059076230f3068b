//! One robot of a fleet: its own goal, its own link, and the cycles of a real arbiter.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow, ensure};
use curionav_arbiter::cycle;
use curionav_planning::occupancy::Cell as Place;
use curionav_planning::profile::Profile;
use curionav_planning::random::{rng, uniform};
use curionav_pool::context::PlanContext;
use curionav_robot::arbiter::cycle::Observation;
use curionav_robot::arbiter::memory::Memory;
use curionav_runtime::convert;
use curionav_runtime::exit::Exit;
use curionav_runtime::membership::announce;
use curionav_runtime::session;
use curionav_schemas::{Clock, Degradation, Evaluated};
use tokio::time::MissedTickBehavior;
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;

use super::robots::{Robot, turn};
use super::workload::Workload;

/// A hundred goals take generators some seconds, and a busy machine minutes.
const READY_TIMEOUT: Duration = Duration::from_secs(600);
/// Places that are tried for each goal.
const TRIES: usize = 200;
/// Seed of the goals.
const SEED: u64 = 1000;

/// One cycle.
#[derive(Debug, Clone)]
pub(super) struct Cycle {
    pub(super) begun: Instant,
    pub(super) took: Duration,
    /// Whether a generator has grown its tree.
    pub(super) is_grown: bool,
    /// Whether replicas have scored its candidates under every term that pools are asked for.
    pub(super) is_scored: bool,
}

impl Cycle {
    pub(super) fn is_answered(&self) -> bool {
        self.is_grown && self.is_scored
    }
}

/// A mission for each of `count` robots, to goals in different cells to which there is a way from the scenario's start.
/// `light` lets a tree grow by one node per cycle, so that hardly anything is computed.
pub(super) fn goals(
    workload: &Workload,
    count: usize,
    period: Duration,
    light: bool,
) -> anyhow::Result<Vec<Arc<PlanContext>>> {
    let map = workload.fields.map(workload.mission.order.map).context("the map of the scenario")?;
    let grid = &map.grid;
    let mut random = rng(SEED, 1);
    let mut taken = BTreeSet::new();
    let mut contexts = Vec::new();
    for _ in 0..count * TRIES {
        if contexts.len() == count {
            break;
        }
        let column = (uniform(&mut random) * grid.width() as f64) as usize;
        let row = (uniform(&mut random) * grid.height() as f64) as usize;
        let goal = grid.centre(column, row);
        if grid.at(goal) != Place::Free || taken.contains(&(column, row)) {
            continue;
        }
        let mut mission = workload.mission.clone();
        let order = &mut mission.order;
        (order.robot, order.clock) = (format!("robot-{}", contexts.len()), Clock::Realtime);
        (order.goal_x, order.goal_y, order.goal_heading) = (goal.x, goal.y, None);
        order.plan_every = ((period.as_secs_f64() / order.tick_s).round() as u32).max(1);
        if light {
            let mut profile: Profile = convert::parameters("profile", &order.profile)?;
            profile.generation.tree.iterations = 1;
            order.profile = convert::to_value(&profile)?;
        }
        // No way leads to some of the free cells.
        if let Ok(context) = PlanContext::new(mission, &workload.fields, true) {
            taken.insert((column, row));
            contexts.push(Arc::new(context));
        }
    }
    ensure!(contexts.len() == count, "the map has no {count} places with a way to them");
    Ok(contexts)
}

pub(super) struct FleetRobot {
    robot: Robot,
    link: Session,
    _token: LivelinessToken,
}

impl std::ops::Deref for FleetRobot {
    type Target = Robot;

    fn deref(&self) -> &Robot {
        &self.robot
    }
}

impl FleetRobot {
    pub(super) fn new(link: Session, context: Arc<PlanContext>) -> anyhow::Result<Self> {
        let token = announce(&link, "arbiter", &context.mission.order.robot).map_err(Exit::network)?;
        Ok(Self { robot: Robot::on(&link, context)?, link, _token: token })
    }

    /// How many of the `replicas` of a role it keeps ready.
    fn wanted(&self, role: &str, replicas: usize) -> usize {
        self.context.replicas_wanted(role).min(replicas)
    }

    /// Whether all are ready that it keeps ready.
    pub(super) fn is_ready(&self, replicas: usize) -> bool {
        let ready = |role: &str| self.pool.replicas().ready(role).len();
        self.context.pool_roles().all(|role| ready(role) >= self.wanted(role, replicas))
    }

    /// Waits until they are.
    pub(super) async fn ready(&self, replicas: usize) -> anyhow::Result<()> {
        let deadline = Instant::now() + READY_TIMEOUT;
        while !self.is_ready(replicas) {
            if Instant::now() > deadline {
                let name = &self.context.mission.order.robot;
                let after_s = READY_TIMEOUT.as_secs();
                return Err(Exit::network(anyhow!(
                    "not every replica was ready for {name} after {after_s} s"
                ))
                .into());
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        Ok(())
    }

    /// Plans at every beat from `start` on, beginning with scene number `first`, until `end`.
    pub(super) async fn plan(
        &self,
        scenes: &[Observation],
        first: usize,
        (start, period): (Instant, Duration),
        end: &AtomicBool,
    ) -> anyhow::Result<Vec<Cycle>> {
        let mut beat = tokio::time::interval_at(start.into(), period);
        beat.set_missed_tick_behavior(MissedTickBehavior::Skip);
        let mut memory = Memory::new(first as u64);
        let mut cycles = Vec::new();
        let hand_made =
            [Degradation::GeneratedLocally, Degradation::NotGenerated, Degradation::PartlyGenerated];
        while !end.load(Ordering::Relaxed) {
            beat.tick().await;
            let begun = Instant::now();
            memory.seq += 1;
            let observation =
                turn(scenes, first as u64 + memory.seq).context("the drive had no cycle")?.clone();
            let (decision, outcome) = cycle::plan(&self.pool, &self.context, &mut memory, observation).await;
            let of_pool = |(term, how): (&String, &Evaluated)| {
                *how == Evaluated::Pool || !self.context.pool_terms().any(|asked| asked == term)
            };
            cycles.push(Cycle {
                begun,
                took: Duration::from_micros(outcome.timings.total_us),
                is_grown: !decision.degraded.iter().any(|why| hand_made.contains(why)),
                is_scored: decision.evaluated.iter().all(of_pool),
            });
        }
        Ok(cycles)
    }

    pub(super) fn leave(&self) {
        session::close(&self.link);
    }
}
