//! What a finished bench has found: rows compared, claims judged, traces to draw.

use std::collections::BTreeSet;
use std::time::Duration;

use curionav_schemas::{Message, RunResult};

use super::claims::{Claims, Judged};
use super::comparison::Comparison;
use super::density::Densities;
use super::options::What;
use super::places::places;
use super::plan::{Job, Plan, Planner, Scene};
use super::row::Row;
use super::worker_process::Missing;
use crate::statistics::mean;

pub(crate) struct Findings<'a> {
    pub(crate) comparison: Comparison<'a>,
    /// None if there was nothing to check.
    pub(crate) claims: Vec<Judged>,
    pub(crate) planners: &'a [Planner],
    pub(crate) scenes: &'a [Scene],
    /// Success over density, where several scenes have each density.
    pub(crate) densities: Option<Densities>,
    pub(crate) jobs: &'a [Job],
    pub(crate) missing: &'a [Missing],
    pub(crate) programs: Vec<String>,
    pub(crate) first_seed: u64,
    /// How people are known, unless as the scenarios say.
    pub(crate) perception: Option<&'static str>,
    pub(crate) repeats: u32,
    pub(crate) workers: usize,
    /// What the runs took on the clock with all workers busy.
    pub(crate) clock: Duration,
}

impl<'a> Findings<'a> {
    pub(super) fn new(
        plan: &'a Plan,
        what: &What,
        claims: &[Claims],
        jobs: &'a [Job],
        rows: &[&'a Row],
        missing: &'a [Missing],
        workers: usize,
    ) -> Self {
        let planners = plan.planners.iter().map(|p| p.name.clone()).collect();
        let scenarios = plan.scenes.iter().map(|s| s.name().to_owned()).collect();
        let places = places(plan.scenes.iter().map(|scene| &scene.map));
        let comparison = Comparison::new(planners, scenarios, places, rows);
        let worked: f64 = rows.iter().map(|row| row.wall_s).sum();
        let clock = Duration::from_secs_f64(worked / workers as f64);
        let programs: BTreeSet<String> = rows.iter().map(|row| row.program.clone()).collect();
        Self {
            claims: claims.iter().flat_map(|file| file.judge(&comparison, what.repeats)).collect(),
            densities: Densities::of(&comparison, &plan.scenes),
            comparison,
            planners: &plan.planners,
            scenes: &plan.scenes,
            jobs,
            missing,
            programs: programs.into_iter().collect(),
            first_seed: what.first_seed,
            perception: what.perception.map(Into::into),
            repeats: what.repeats,
            workers,
            clock,
        }
    }

    pub(crate) fn real_time_factor(&self, planner: usize) -> Option<f64> {
        let factors: Vec<f64> = self.comparison.all_runs(planner).map(|row| row.real_time_factor).collect();
        mean(&factors)
    }

    /// The kept trace of a planner's run with the first seed; none if that run did not take place.
    pub(crate) fn trace(&self, scenario: &str, planner: &str) -> Option<RunResult> {
        let first = self.jobs.iter().find(|job| job.scenario == scenario && job.planner == planner)?;
        let bytes = std::fs::read(first.trace.as_ref()?).ok()?;
        RunResult::decode(&bytes, None).ok()
    }
}
