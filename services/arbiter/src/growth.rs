//! Where a cycle's candidates come from: each tree grown by a replica, or in process.

use curionav_planning::candidates::CandidateSet;
use curionav_runtime::{convert, generator};
use curionav_schemas::{GenerateRequest, Reject, Tree};
use futures_util::future::join_all;

use crate::budget::Budget;
use crate::context::PlanContext;
use crate::dispatch;
use crate::peers::Peers;
use crate::pool::Pool;

/// What came of a cycle's growth.
pub(crate) struct Grown {
    /// Those of every tree.
    pub(crate) candidates: CandidateSet,
    /// As they are now; one that nobody grew is as it was.
    pub(crate) trees: Vec<Option<Tree>>,
    /// What fell short, if anything did.
    pub(crate) shortfall: Option<&'static str>,
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
    let mut shortfall = None;
    for (request, answer) in requests.iter().zip(answers) {
        match answer {
            Some((candidates, tree)) => {
                sets.push(candidates);
                trees.push(Some(tree));
            }
            None if context.in_process => {
                shortfall = Some("generated: local");
                let is_over = || stage.is_over(peers.now());
                let reply = peers.compute(|| {
                    generator::generate("arbiter", request, &context.map, &context.geodesic, &is_over)
                })?;
                sets.push(convert::candidates(reply.candidates)?);
                trees.push(Some(reply.tree));
            }
            None => trees.push(request.tree.clone()),
        }
    }
    if sets.len() < requests.len() {
        shortfall = Some(if sets.is_empty() { "not generated" } else { "partly generated" });
    }
    Ok(Grown { candidates: CandidateSet::concat(shape.0, shape.1, &sets), trees, shortfall })
}
