//! Batches as an arbiter has them: a scene of the workload, and candidates grown from it.

use anyhow::{Context, anyhow};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::Cell;
use curionav_planning::random::{Rng, rng, uniform};
use curionav_planning::scene::Scene;
use curionav_pool::context::PlanContext;
use curionav_runtime::convert;
use curionav_runtime::exit::Exit;
use curionav_schemas as wire;

use super::workload::Workload;

/// Different batches, asked for in turn.
const BATCHES: usize = 4;
/// Trees grown for one batch, at most; each offers a hundred candidates or so.
const TREES_MAX: usize = 400;
/// Greatest speed of a person along an axis, m/s, where more are needed than the scenario has.
const WALK: f64 = 0.7;
/// Attempts to find room for one more person.
const PLACES: usize = 1000;

pub(super) struct Batch {
    pub(super) scene: Scene,
    /// The same, as it travels.
    pub(super) message: wire::Scene,
    pub(super) candidates: CandidateSet,
}

/// Batches of `count` candidates among `people` people (or as many as there are), from moments evenly spread
/// over the workload in which there was a choice. Candidates are grown among the people of those moments.
pub(super) fn batches(
    workload: &Workload,
    context: &PlanContext,
    count: usize,
    people: Option<usize>,
) -> anyhow::Result<Vec<Batch>> {
    let moments: Vec<&wire::CycleReport> =
        workload.cycles.iter().filter(|cycle| cycle.candidates.count > 0).collect();
    let mut batches = Vec::new();
    for k in 0..BATCHES {
        let Some(moment) = moments.get((2 * k + 1) * moments.len() / (2 * BATCHES)) else { continue };
        let Some(candidates) = candidates(context, moment, count)? else { continue };
        let mut scene = convert::scene(&moment.scene);
        // All terms are active: what is measured does not depend on how sure the robot was.
        scene.uncertain = true;
        if let Some(people) = people {
            crowd(&mut scene, context, people, &mut rng(k as u64, people as u64))?;
        }
        let message = convert::scene_to_wire(&scene, moment.scene.belief.health.clone());
        batches.push(Batch { scene, message, candidates });
    }
    if batches.is_empty() {
        let none = anyhow!("the robot never had a choice of {count} candidates in this scenario");
        return Err(Exit::bad_input(none).into());
    }
    Ok(batches)
}

/// Leaves `wanted` people in the scene, or adds people who walk in free places of the Working Zone.
fn crowd(scene: &mut Scene, context: &PlanContext, wanted: usize, r: &mut Rng) -> anyhow::Result<()> {
    let people = &mut scene.people;
    for values in [&mut people.x, &mut people.y, &mut people.vx, &mut people.vy] {
        values.truncate(wanted);
    }
    people.id.truncate(wanted);
    let zone = context.course.profile.working_zone_radius(context.course.robot.v_max);
    let centre = scene.belief.pose.position();
    while people.len() < wanted {
        let (x, y) =
            place(context, centre, zone, r).context("no room for so many people").map_err(Exit::bad_input)?;
        people.id.push(people.id.last().map_or(0, |last| last + 1));
        people.x.push(x);
        people.y.push(y);
        people.vx.push(WALK * (2.0 * uniform(r) - 1.0));
        people.vy.push(WALK * (2.0 * uniform(r) - 1.0));
    }
    Ok(())
}

fn place(context: &PlanContext, centre: Point2, zone: f64, r: &mut Rng) -> Option<(f64, f64)> {
    (0..PLACES).find_map(|_| {
        let mut near = |c: f64| c + zone * (2.0 * uniform(r) - 1.0);
        let p = Point2::new(near(centre.x), near(centre.y));
        let inside = p.distance_squared(centre) <= zone * zone;
        (inside && context.course.map.grid.at(p) == Cell::Free).then_some((p.x, p.y))
    })
}

/// The first `count` candidates of trees grown at `moment` with one seed after the other, beginning with what
/// the robot had; nothing if they give too few.
fn candidates(
    context: &PlanContext,
    moment: &wire::CycleReport,
    count: usize,
) -> anyhow::Result<Option<CandidateSet>> {
    let scene = convert::scene(&moment.scene);
    let mut sets = vec![convert::candidates(moment.candidates.clone())?];
    let mut grown = sets[0].len();
    for seed in 0..TREES_MAX {
        if grown >= count {
            break;
        }
        let (generated, _) = context.course.generate(&scene, seed, None, &[], &|| 0.0);
        grown += generated.candidates.len();
        sets.push(generated.candidates);
    }
    let all = CandidateSet::concat(context.course.profile.steps, context.course.profile.dt, sets);
    Ok((grown >= count).then(|| all.pick(0..count)))
}
