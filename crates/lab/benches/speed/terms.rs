//! The cost terms, on the batch of the budgets and on that of an ordinary cycle.

use std::sync::Arc;

use anyhow::Context;
use curionav_planning::evaluation::Evaluator;
use curionav_planning::profile::Profile;
use curionav_planning::terms::{self, Task};

use crate::case::Case;
use crate::hall;

/// Each built-in term alone, `cnc` also with walls that hide people, and those of the paper's planner together.
pub(crate) fn cases() -> anyhow::Result<Vec<Case>> {
    let map = hall::map()?;
    let scene = Arc::new(hall::scene());
    let task = Task { goal: hall::GOAL, ..Task::default() };
    let built = |term: &&'static str| {
        let evaluator = terms::evaluator(term, &Profile::default(), &task, &map).context(*term)?;
        anyhow::Ok((*term, evaluator?))
    };
    let mut evaluators: Vec<(&str, Arc<dyn Evaluator>)> =
        terms::NAMES.iter().map(built).collect::<Result<_, _>>()?;
    let mut hiding = Profile::default();
    hiding.sight.walls_hide = true;
    let in_view = terms::evaluator("cnc", &hiding, &task, &map).context("cnc")??;
    evaluators.push(("cnc-in-view", in_view));
    let is_of_paper = |(term, _): &&(&str, _)| ["cnc", "cpc", "distance"].contains(term);
    let of_paper: Vec<_> = evaluators.iter().filter(is_of_paper).cloned().collect();
    let mut cases = Vec::new();
    for (size, count, steps, dt) in [("2000x56", 2000, 56, 0.1), ("100x13", 100, 13, 0.3)] {
        let candidates = Arc::new(hall::candidates(count, steps, dt)?);
        let case = |name: &str, evaluators: Vec<(&'static str, Arc<dyn Evaluator>)>| {
            let scene = Arc::clone(&scene);
            let candidates = Arc::clone(&candidates);
            Case::new(format!("term/{name}/{size}"), move || {
                let costs = |(_, e): &(_, Arc<dyn Evaluator>)| e.evaluate(&scene, &candidates, &|| false);
                evaluators.iter().map(costs).collect::<Vec<_>>()
            })
        };
        cases.extend(evaluators.iter().map(|(term, e)| case(term, vec![(*term, Arc::clone(e))])));
        cases.push(case("cnc+cpc+distance", of_paper.clone()));
    }
    Ok(cases)
}
