//! A cycle of each generator: with no tree yet, and 0.3 s later with the tree of the first.

use std::sync::Arc;

use curionav_planning::generation::Tree;
use curionav_planning::geometry::Pose2;
use curionav_planning::scene::Scene;
use curionav_pool::context::PlanContext;

use crate::case::Case;
use crate::mission::OnTheWay;

/// Two cases for each generator.
pub(crate) fn cases() -> anyhow::Result<Vec<Case>> {
    let mut cases = Vec::new();
    for planner in ["curiosity", "risk-rrt", "bi-risk-rrt"] {
        let on_the_way = OnTheWay::with(planner)?;
        let context = &on_the_way.context;
        let scene = on_the_way.scene(on_the_way.pose, 120);
        let (generated, _) = context.course.generate(&scene, 0, None, &[], &|| 0.0);
        let generator = &context.course.profile.generator;
        anyhow::ensure!(!generated.candidates.is_empty(), "{generator} offers nothing");
        cases.push(cycle(format!("generate/{generator}/fresh"), context, scene, None, Vec::new()));
        // The robot has driven the first of the candidates as long as a cycle lasts.
        let states = generated.candidates.states(0);
        let scene = on_the_way.scene(states.pose(0), 123);
        let previous = (1..states.len()).map(|k| states.pose(k));
        let name = format!("generate/{generator}/follow-up");
        cases.push(cycle(name, context, scene, Some(generated.tree), previous.collect()));
    }
    Ok(cases)
}

fn cycle(
    name: String,
    context: &Arc<PlanContext>,
    scene: Scene,
    tree: Option<Tree>,
    previous: Vec<Pose2>,
) -> Case {
    let context = Arc::clone(context);
    let grow = move |tree| context.course.generate(&scene, 0, tree, &previous, &|| 0.0);
    Case::after(name, 1, move || tree.clone(), grow)
}
