//! Where a cycle's candidates come from: each tree grown by a replica, or in process.

use curionav_planning::candidates::CandidateSet;
use curionav_planning::generation::Generated;
use curionav_planning::scene::Scene;
use curionav_pool::budget::Budget;
use curionav_pool::context::PlanContext;
use curionav_pool::dispatch::{self, Grown, Shape};
use curionav_pool::peers::Peers;
use curionav_pool::pool::Pool;
use curionav_robot::arbiter::memory::Memory;
use curionav_schemas::{self as wire, Degradation};
use futures_util::future::join_all;

/// What came of a cycle's growth.
pub(crate) struct GenerationOutcome {
    /// The candidates of all trees.
    pub(crate) candidates: CandidateSet,
    /// What fell short.
    pub(crate) shortfalls: Vec<Degradation>,
}

/// Grows the trees side by side; a tree that no process grew stays as it was.
pub(crate) async fn generate<P: Peers>(
    pool: &Pool<P>,
    context: &PlanContext,
    memory: &mut Memory,
    scene: &Scene,
    scene_message: &wire::Scene,
) -> GenerationOutcome {
    let id = memory.id();
    let peers = &*pool.peers;
    let previous = memory.carried.ahead(scene.stamp);
    let trees = &mut memory.carried.trees;
    let profile = &context.course.profile;
    trees.resize(profile.trees as usize, None);
    let shape = Shape { steps: profile.steps, dt: profile.dt };
    let stage = Budget::of_generation(peers.now(), &context.mission, &pool.stages());
    let asked = trees.iter().enumerate().map(|(index, tree)| {
        let question = context.generate_question(id, scene_message, index, tree.as_ref(), &previous);
        async move {
            if context.generates_itself() {
                return None;
            }
            dispatch::generate(pool, &context.mission.order.robot, &question, index, shape, stage).await
        }
    });
    let answers = join_all(asked).await;
    let mut sets = Vec::new();
    let mut is_local = false;
    let mut is_cut = false;
    for (index, (tree, answer)) in trees.iter_mut().zip(answers).enumerate() {
        let answer = answer.or_else(|| {
            let spent = || stage.spent(peers.now());
            let here = || context.course.generate(scene, index, tree.clone(), &previous, &spent);
            let can = context.in_process || context.generates_itself();
            let computes = can && !context.course.asks_own();
            let (generated, cut) = computes.then(|| peers.compute(here))?;
            is_local = !context.generates_itself();
            Some(Grown { generated, cut })
        });
        let Some(Grown { generated, cut }) = answer else { continue };
        let Generated { candidates, tree: grown } = generated;
        sets.push(candidates);
        *tree = Some(grown);
        is_cut |= cut;
    }
    let missing = match sets.len() {
        0 => Some(Degradation::NotGenerated),
        grown if grown < trees.len() => Some(Degradation::PartlyGenerated),
        _ => is_local.then_some(Degradation::GeneratedLocally),
    };
    let shortfalls = missing.into_iter().chain(is_cut.then_some(Degradation::CutShort)).collect();
    let candidates = CandidateSet::concat(shape.steps, shape.dt, sets);
    GenerationOutcome { candidates, shortfalls }
}
