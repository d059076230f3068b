//! Where a cycle's candidates come from: each tree grown by a replica, or in process.

use curionav_planning::candidates::CandidateSet;
use curionav_planning::generation::Tree;
use curionav_planning::geometry::Pose2;
use curionav_planning::scene::Scene;
use curionav_schemas::{Degradation, GenerateRequest};
use futures_util::future::join_all;

use curionav_pool::budget::Budget;
use curionav_pool::context::PlanContext;
use curionav_pool::dispatch::{self, Generated};
use curionav_pool::peers::Peers;
use curionav_pool::pool::Pool;

/// What came of a cycle's growth.
pub(crate) struct GenerationOutcome {
    /// Those of every tree.
    pub(crate) candidates: CandidateSet,
    /// What fell short.
    pub(crate) shortfalls: Vec<Degradation>,
}

/// Grows `trees` side by side, each as its request in `requests` asks; a tree that no process grew stays as it was.
pub(crate) async fn grow<P: Peers>(
    pool: &Pool<P>,
    context: &PlanContext,
    scene: &Scene,
    requests: &[GenerateRequest],
    previous: &[Pose2],
    trees: &mut [Option<Tree>],
) -> GenerationOutcome {
    let peers = &*pool.peers;
    let shape = (context.profile.steps, context.profile.dt);
    let stage = Budget::of_stage(peers.now(), &context.mission);
    let asked = requests.iter().enumerate();
    let answers = join_all(asked.map(|(index, request)| {
        dispatch::generate(pool, &context.mission.order.robot, request, index, shape, stage)
    }))
    .await;
    let mut sets = Vec::new();
    let (mut is_local, mut is_cut) = (false, false);
    for (index, (tree, answer)) in trees.iter_mut().zip(answers).enumerate() {
        let answer = answer.or_else(|| {
            let is_over = || stage.is_over(peers.now());
            let here = || context.generate(scene, index, tree.clone(), previous, &is_over);
            let (grown, cut) = context.in_process.then(|| peers.compute(here))?;
            is_local = true;
            Some(Generated { candidates: grown.candidates, tree: grown.tree, cut })
        });
        let Some(Generated { candidates, tree: grown, cut }) = answer else { continue };
        sets.push(candidates);
        *tree = Some(grown);
        is_cut |= cut;
    }
    let mut shortfalls = Vec::new();
    if sets.len() < requests.len() {
        shortfalls.push(if sets.is_empty() {
            Degradation::NotGenerated
        } else {
            Degradation::PartlyGenerated
        });
    } else if is_local {
        shortfalls.push(Degradation::GeneratedLocally);
    }
    if is_cut {
        shortfalls.push(Degradation::CutShort);
    }
    GenerationOutcome { candidates: CandidateSet::concat(shape.0, shape.1, sets), shortfalls }
}
