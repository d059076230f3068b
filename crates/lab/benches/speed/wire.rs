//! Writing and reading the messages that are large.

use std::sync::Arc;

use anyhow::Context;
use curionav_arbiter::memory::Memory;
use curionav_planning::generation::Tree;
use curionav_pool::generator;
use curionav_runtime::convert;
use curionav_schemas::{Health, Message};

use crate::case::Case;
use crate::cycle::Arbiter;
use crate::hall;
use crate::mission::OnTheWay;

/// Each message of a cycle among people, encoded and decoded, and a question for the batch of the budgets.
pub(crate) fn cases() -> anyhow::Result<Vec<Case>> {
    let on_the_way = OnTheWay::with("curiosity")?;
    let (context, pose) = (&on_the_way.context, on_the_way.pose);
    let scene = on_the_way.scene(pose, 120);
    let health = Health { outside_weight: 0.0, scan_fit: 1.0, particles: 500, converged: true };
    let scene_message = convert::scene_to_wire(&scene, health);

    let (generated, _) = context.generate(&scene, 0, None, &[], &|| false);
    let question =
        |tree: Option<&Tree>| context.generate_request((1, 1), &scene_message, 0, tree, &[pose; 12]);
    let answer = |request| generator::answer("bench", &on_the_way.fields, &request, &|| false);
    let reply = answer(question(None)?)?;
    let evaluate = |set| context.evaluate_request("cpc", (1, 1), &scene_message, set, 0..set.len());

    let mut memory = Memory::new(1);
    let observation = on_the_way.observation(pose, 120, 0.2);
    let (decision, outcome) = Arbiter::new()?.plan(context, &mut memory, observation)?;
    let report = outcome.report(context, decision);

    Ok([
        both("generate-request", question(Some(&generated.tree))?)?,
        both("generate-reply", reply)?,
        both("evaluate-request/100x13", evaluate(&generated.candidates))?,
        both("evaluate-request/2000x56", evaluate(&hall::candidates(2000, 56, 0.1)?))?,
        both("report", report)?,
        both("map", on_the_way.map)?,
    ]
    .into_iter()
    .flatten()
    .collect())
}

fn both<M: Message + 'static>(name: &str, message: M) -> anyhow::Result<[Case; 2]> {
    let bytes: Arc<[u8]> = message.encode().into();
    M::decode(&bytes, None).with_context(|| name.to_owned())?;
    Ok([
        Case::new(format!("encode/{name}"), move || message.encode()),
        Case::new(format!("decode/{name}"), move || M::decode(&bytes, None)),
    ])
}
