//! A drive through the scenario with every service in this process: where scenes, missions and maps of a
//! measurement come from.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use curionav_planning::occupancy::StaticMap;
use curionav_pool::context::PlanContext;
use curionav_robot::arbiter::cycle::Observation;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_runtime::query::fetch;
use curionav_schemas::{Clock, CycleReport, Mission, OccupancyGrid, keys};

use curionav_deployment::embedded::Embedded;
use curionav_deployment::follow::follow;
use curionav_deployment::package::{self, Choice};
use curionav_runtime::exit::Exit;

/// Seed of the drive: none that a report uses.
const SEED: u64 = 1000;

/// What a drive leaves behind.
pub(super) struct Workload {
    pub(super) mission: Mission,
    pub(super) map: OccupancyGrid,
    /// Every planning cycle, in order; at least one.
    pub(super) cycles: Vec<CycleReport>,
    /// Fields of the map, derived once for the whole process.
    pub(super) fields: Fields,
    /// The services, which are warm for the mission.
    pub(super) services: Embedded,
}

impl Workload {
    pub(super) async fn of(scenario: &Path, planner: Option<&str>) -> anyhow::Result<Self> {
        let choice = Choice { planner: planner.map(str::to_owned), seed: Some(SEED), ..Choice::default() };
        let package = package::read(scenario, &choice, Clock::Lockstep, 1.0).map_err(Exit::bad_input)?;
        let config = ServiceConfig::default();
        let services = Embedded::start(&config).await.map_err(Exit::network)?;
        let driven = async {
            let finished = follow(&services.session, &config, &package, true).await?;
            let key = keys::robot(&config.robot, "mission")?;
            let mission = fetch::<Mission>(&services.session, &key, Duration::from_secs(2)).await;
            anyhow::Ok((finished.reports, finished.map?, mission.map_err(Exit::network)?))
        };
        let (cycles, map, mission) = match driven.await {
            Ok(driven) => driven,
            Err(error) => {
                services.stop().await;
                return Err(error);
            }
        };
        let grid = convert::occupancy_grid(map.clone()).context("map")?;
        let fields = Fields::of_maps([StaticMap::new(grid)]);
        Ok(Self { mission, map, cycles, fields, services })
    }

    /// What each cycle of the drive began with.
    pub(super) fn observations(&self) -> Arc<[Observation]> {
        let observed = self.cycles.iter().map(|cycle| Observation {
            belief: cycle.scene.belief.clone(),
            people: cycle.scene.people.clone(),
        });
        observed.collect()
    }

    /// Everything an arbiter derives from the mission, for a robot of that name.
    pub(super) fn context(&self, robot: &str, clock: Clock) -> anyhow::Result<Arc<PlanContext>> {
        let mut mission = self.mission.clone();
        (mission.order.robot, mission.order.clock) = (robot.to_owned(), clock);
        if clock == Clock::Realtime {
            // Ten times a second, as in a run in real time.
            mission.order.plan_every = ((0.1 / mission.order.tick_s).ceil() as u32).max(1);
        }
        Ok(Arc::new(PlanContext::new(mission, &self.fields, true).context("mission")?))
    }
}
