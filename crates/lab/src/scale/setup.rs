//! What one measurement of a service needs, and what comes out.

use std::sync::Arc;

use anyhow::anyhow;
use curionav_runtime::exit::Exit;
use curionav_schemas::Clock;
use serde_json::{Value, json};

use super::batch::batches;
use super::figures::{self, Row};
use super::options::{Options, Service};
use super::processes::Processes;
use super::robots::{Robots, Work};
use super::workload::Workload;

/// What was measured: for scripts, and for people.
pub(super) struct Measured {
    pub(super) json: Value,
    pub(super) text: String,
}

pub(super) struct Setup<'a> {
    pub(super) options: &'a Options,
    pub(super) workload: &'a Workload,
    pub(super) service: Service,
}

impl Setup<'_> {
    /// What all robots ask for; `default` is the size of a batch unless the options have one.
    pub(super) fn work(&self, default: u32) -> anyhow::Result<Arc<Work>> {
        let role = self.service.name();
        if self.service == Service::Generator {
            return Ok(Arc::new(self.growth(1)));
        }
        let context = self.workload.context("robot", Clock::Lockstep)?;
        if !context.pool_terms().any(|term| term == role) {
            let of = &context.course.profile.name;
            return Err(Exit::bad_input(anyhow!("--planner: `{of}` never asks for `{role}`")).into());
        }
        let batch = self.options.batch.first().copied().unwrap_or(default);
        let people = self.options.people.first().map(|&n| n as usize);
        Ok(Arc::new(Work::Evaluate(role, batches(self.workload, &context, batch as usize, people)?)))
    }

    /// The growth of so many trees in every cycle of the drive.
    pub(super) fn growth(&self, trees: usize) -> Work {
        Work::Generate(self.workload.cycles.iter().map(|cycle| cycle.scene.clone()).collect(), trees)
    }

    /// Starts `replicas` of the service, connects `count` robots, and waits until all are ready for all. From then
    /// on the quota is in force. It ends with [`Robots::leave`] and [`Processes::dismiss`].
    pub(super) async fn robots(
        &self,
        processes: &mut Processes,
        (replicas, count): (usize, usize),
        clock: Clock,
    ) -> anyhow::Result<Robots> {
        processes.add(self.service.name(), replicas).await?;
        let robots = Robots::join(self.workload, processes, count, clock).await?;
        for robot in &robots.all {
            robot.ready(self.service.name(), replicas).await?;
        }
        processes.limit()?;
        Ok(robots)
    }

    /// The rows, with the conditions under which they were measured.
    pub(super) fn measured(&self, work: &Work, rows: &[Row]) -> Measured {
        let mut json = json!({
            "service": self.service.name(),
            "rows": rows.iter().map(figures::json).collect::<Vec<_>>(),
            "scenario": self.options.scenario.display().to_string(),
            "cpu_quota": self.options.cpu_quota,
        });
        if let Work::Evaluate(_, batches) = work
            && let Some(batch) = batches.first()
        {
            let people: usize = batches.iter().map(|b| b.scene.people.len()).sum();
            json["batch"] = batch.candidates.len().into();
            json["states"] = batch.candidates.steps().into();
            json["people"] = (people as f64 / batches.len() as f64).into();
        }
        Measured { json, text: figures::table(rows) }
    }
}
