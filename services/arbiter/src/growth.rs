//! Where a cycle's candidates come from: each tree grown by a replica, or in process.

use curionav_planning::candidates::CandidateSet;
use curionav_runtime::{convert, generator};
use curionav_schemas::{GenerateRequest, Reject, Tree};
use futures_util::future::join_all;

use crate::budget::Budget;
use crate::context::PlanContext;
use crate::dispatch::{self, Generated};
use crate::peers::Peers;
use crate::pool::Pool;

/// What came of a cycle's growth.
pub(crate) struct Grown {
    /// Those of every tree.
    pub(crate) candidates: CandidateSet,
    /// As they are now; one that nobody grew is as it was.
    pub(crate) trees: Vec<Option<Tree>>,
    /// What fell short.
    pub(crate) shortfalls: Vec<&'static str>,
}

/// Grows the trees of `requests` side by side.
pub(crate) async fn grow<P: Peers>(
    pool: &Pool<P>,
    context: &PlanContext,
    requests: &[GenerateRequest],
) -> Result<Grown, Reject> {
    let peers = &*pool.peers;
    let shape = (context.profile.steps, context.profile.dt);
    let stage = Budget::of_stage(peers.now(), &context.mission);
    let asked = requests.iter().enumerate();
    let answers =
        join_all(asked.map(|(index, request)| dispatch::generate(pool, request, index, shape, stage))).await;
    let (mut sets, mut trees) = (Vec::new(), Vec::new());
    let (mut is_local, mut is_cut) = (false, false);
    for (request, answer) in requests.iter().zip(answers) {
        match answer {
            Some(Generated { candidates, tree, cut }) => {
                sets.push(candidates);
                trees.push(Some(tree));
                is_cut |= cut;
            }
            None if context.in_process => {
                is_local = true;
                let is_over = || stage.is_over(peers.now());
                let reply = peers.compute(|| {
                    generator::generate("arbiter", request, &context.map, &context.geodesic, &is_over)
                })?;
                sets.push(convert::candidates(reply.candidates)?);
                trees.push(Some(reply.tree));
                is_cut |= reply.cut;
            }
            None => trees.push(request.tree.clone()),
        }
    }
    let mut shortfalls = Vec::new();
    if sets.len() < requests.len() {
        shortfalls.push(if sets.is_empty() { "not generated" } else { "partly generated" });
    } else if is_local {
        shortfalls.push("generated: local");
    }
    if is_cut {
        shortfalls.push("tree cut short by the budget");
    }
    Ok(Grown { candidates: CandidateSet::concat(shape.0, shape.1, &sets), trees, shortfalls })
}
