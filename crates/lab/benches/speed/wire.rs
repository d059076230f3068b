//! Writing and reading the messages that are large.

use std::sync::Arc;

use anyhow::Context;
use curionav_planning::candidates::CandidateSet;
use curionav_robot::arbiter::memory::Memory;
use curionav_runtime::convert;
use curionav_schemas::{
    Confidence, CycleReport, EvaluateRequest, GenerateReply, GenerateRequest, Health, Message, OccupancyGrid,
};

use crate::case::Case;
use crate::cycle::Arbiter;
use crate::hall;
use crate::mission::OnTheWay;

/// Time that a question leaves for its answer.
const BUDGET_MS: u32 = 20;

/// Each message of a cycle among people, encoded and decoded, and a question for the batch of the budgets.
pub(crate) fn cases() -> anyhow::Result<Vec<Case>> {
    let on_the_way = OnTheWay::with("curiosity")?;
    let context = &on_the_way.context;
    let pose = on_the_way.pose;
    let scene = on_the_way.scene(pose, 120);
    let health = Health { outside_weight: 0.0, scan_fit: 1.0, particles: 500, confidence: Confidence::Sure };
    let scene_message = convert::scene_to_wire(&scene, health);

    let (generated, _) = context.course.generate(&scene, 0, None, &[], &|| 0.0);
    let tree = generated.tree;
    let reply = GenerateReply {
        epoch: 1,
        seq: 1,
        instance: "bench".into(),
        candidates: convert::candidates_to_wire(&generated.candidates),
        tree: convert::tree_to_wire(tree.clone()),
        elapsed_us: 0,
        cut: false,
    };
    let generate = {
        let context = Arc::clone(context);
        let scene = scene_message.clone();
        move || context.generate_question((1, 1), &scene, 0, Some(&tree), &[pose; 12]).encode(BUDGET_MS)
    };
    let evaluate = |candidates: CandidateSet| {
        let context = Arc::clone(context);
        let scene = scene_message.clone();
        move || {
            let questions = context.evaluate_questions((1, 1), &scene, &candidates);
            questions.shard("cpc", 0, 0..candidates.len()).encode(BUDGET_MS)
        }
    };

    let mut memory = Memory::new(1);
    let observation = on_the_way.observation(pose, 120, 0.2);
    let (decision, outcome) = Arbiter::new()?.plan(context, &mut memory, observation);
    let report = outcome.report(context, decision);

    Ok([
        both::<GenerateRequest>("generate-request", generate)?,
        both::<GenerateReply>("generate-reply", move || reply.encode())?,
        both::<EvaluateRequest>("evaluate-request/100x13", evaluate(generated.candidates))?,
        both::<EvaluateRequest>("evaluate-request/2000x56", evaluate(hall::candidates(2000, 56, 0.1)?))?,
        both::<CycleReport>("report", move || report.encode())?,
        both::<OccupancyGrid>("map", move || on_the_way.map.encode())?,
    ]
    .into_iter()
    .flatten()
    .collect())
}

fn both<M: Message + 'static>(
    name: &str,
    encode: impl Fn() -> Vec<u8> + 'static,
) -> anyhow::Result<[Case; 2]> {
    let bytes: Arc<[u8]> = encode().into();
    M::decode(&bytes, None).with_context(|| name.to_owned())?;
    Ok([
        Case::new(format!("encode/{name}"), encode),
        Case::new(format!("decode/{name}"), move || M::decode(&bytes, None)),
    ])
}
