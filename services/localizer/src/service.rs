//! The localizer on its robot.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use curionav_localization::{Estimate, Localizer, LocalizerParams, Scan as LaserScan};
use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::sensor::LaserModel;
use curionav_pool::fields::Fields;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::convert;
use curionav_runtime::lockstep::{Latest, has_started_over};
use curionav_runtime::metrics::Metrics;
use curionav_runtime::process::OnReady;
use curionav_runtime::robot_service::{Preparation, RobotService, is_over, superseded, supersedes};
use curionav_runtime::shutdown::Shutdown;
use curionav_runtime::topic::{Flow, OnDemand, Topic};
use curionav_schemas::{Belief, Clock, Health, Mission, Odometry, Particles, Refusal, Reject, Scan};
use zenoh::Session;

use crate::glimpse::{Rate, particles};

/// Scans remembered in real time, to be paired with the odometry of their tick.
const SCANS_KEPT: usize = 4;

type Newest = Arc<Mutex<Option<Belief>>>;

struct Localization {
    service: RobotService,
    fields: Fields,
    scans: Latest<Scan>,
    odometry: Latest<Odometry>,
    recent_scans: Vec<Scan>,
    beliefs: Topic<Belief>,
    /// For those who look on.
    glimpses: OnDemand<Particles>,
    glimpse_rate: Rate,
    mission: Option<Mission>,
    filter: Option<Localizer>,
    /// Tick of the last odometry.
    answered: Option<u64>,
    /// The run whose streams it follows.
    run: Option<u64>,
    prepared: Option<Preparation>,
    /// The newest belief, for operators.
    newest: Newest,
}

/// Localizes one robot until `shutdown`. `on_ready` is called once missions are followed.
pub(crate) async fn run(
    config: &ServiceConfig,
    session: &Session,
    mut shutdown: Shutdown,
    on_ready: OnReady,
) -> anyhow::Result<()> {
    let service = RobotService::new("localizer", config, session);
    let missions = service.inbox::<Mission>("mission")?;
    let mut localization = Localization {
        fields: Fields::new(session),
        scans: Latest::new(service.inbox("scan")?),
        odometry: Latest::new(service.inbox("odom")?),
        recent_scans: Vec::new(),
        beliefs: service.topic("belief", Flow::Sensor)?,
        glimpses: service.on_demand("particles", Flow::Glimpse)?,
        glimpse_rate: Rate::default(),
        service,
        mission: None,
        filter: None,
        answered: None,
        run: None,
        prepared: None,
        newest: Newest::default(),
    };
    let mut metrics = localization.service.metrics();
    register_health(&mut metrics, &localization.newest);
    let announced = localization.service.announce(metrics)?;
    on_ready(announced.metrics_address());
    let mut said = localization.service.mission().await?;
    loop {
        if let Some(mission) = said.take() {
            tokio::select! {
                biased;
                () = shutdown.requested() => return Ok(()),
                () = superseded(&missions, &mut said, |said| supersedes(said, &mission)) => {}
                anew = localization.take(&mission) => {
                    localization.service.tell(&mission, localization.prepared.as_ref(), anew).await?;
                }
            }
            continue;
        }
        tokio::select! {
            biased;
            () = shutdown.requested() => return Ok(()),
            mission = missions.next() => match mission {
                Some(mission) => said = Some(mission),
                None => return Ok(()),
            },
            odometry = localization.odometry.next() => match odometry.cloned() {
                Some(odometry) => localization.tick(odometry).await,
                None => return Ok(()),
            },
        }
    }
}

/// What the newest belief says of itself.
fn register_health(metrics: &mut Metrics, newest: &Newest) {
    let of = |number: fn(&Belief) -> f64| {
        let newest = Arc::clone(newest);
        move || newest.lock().unwrap_or_else(PoisonError::into_inner).as_ref().map(number)
    };
    let help = "Trace of the position's covariance, square metres";
    metrics.gauge("belief_trace_m2", help, of(|b| b.covariance[0] + b.covariance[4]));
    let help = "How well the scan fits the map at the mean, 0 to 1";
    metrics.gauge("belief_scan_fit", help, of(|b| b.health.scan_fit));
    let help = "Weight of the particles outside the heaviest cluster, 0 to 1";
    metrics.gauge("belief_outside_weight", help, of(|b| b.health.outside_weight));
    metrics.gauge("belief_particles", "Particles in use", of(|b| f64::from(b.health.particles)));
}

impl Localization {
    /// A mission, or a change of the one at hand. Only a new run starts the filter over: a robot that is
    /// sent to another goal still knows where it is. May be dropped on the way, when there is another to take. Whether
    /// it has prepared.
    async fn take(&mut self, mission: &Mission) -> bool {
        self.mission = Some(mission.clone());
        if is_over(mission) || self.prepared.as_ref().is_some_and(|prepared| prepared.is_for(mission)) {
            return false;
        }
        if self.run != Some(mission.run) {
            self.filter = None;
        }
        let outcome = loop {
            let outcome = self.start(mission).await;
            if !self.service.must_retry(mission, &outcome).await {
                break outcome;
            }
        };
        if self.run.replace(mission.run) != Some(mission.run) {
            // Nothing of the new run can be on its way before this role has reported ready.
            self.scans.clear();
            self.odometry.clear();
            self.recent_scans.clear();
            self.answered = None;
        }
        self.prepared = Some(Preparation::new(mission, outcome));
        true
    }

    /// Makes sure that there is a filter for the run of `mission`.
    async fn start(&mut self, mission: &Mission) -> Result<(), Reject> {
        if self.filter.is_some() {
            return Ok(());
        }
        if mission.has_run {
            // This localizer was restarted on the way: the robot has left the start.
            return Err(Refusal::PoseLost.into());
        }
        convert::check_order(&mission.order)?;
        let params: LocalizerParams = convert::parameters("localizer", &mission.order.localizer)?;
        let (fields, id) = (self.fields.clone(), mission.order.map);
        let fetched = tokio::task::spawn_blocking(move || fields.map(id)).await;
        let map = fetched.map_err(|e| Refusal::failed(e).at("map"))??;
        let mut filter = Localizer::new(
            (*map).clone(),
            convert::laser(&mission.order.laser),
            convert::noise(&mission.order.odometry_noise),
            params,
            mission.order.seed,
        )
        .map_err(|e| Refusal::invalid(e).at("localizer"))?;
        filter.initialise(
            convert::pose(mission.order.initial_pose),
            &convert::covariance(&mission.order.initial_covariance)?,
        );
        self.filter = Some(filter);
        Ok(())
    }

    /// One tick of odometry, answered with a belief.
    async fn tick(&mut self, mut odometry: Odometry) {
        let Some(mission) = self.mission.clone() else { return };
        let started = Instant::now();
        if mission.order.clock == Clock::Realtime {
            // The newest odometry whose scan is here as well, if any: a scan of another tick is no
            // observation of this pose.
            self.recent_scans.extend(self.scans.drain());
            let excess = self.recent_scans.len().saturating_sub(SCANS_KEPT);
            self.recent_scans.drain(..excess);
            let seen = |o: &Odometry| self.recent_scans.iter().any(|s| s.tick == o.tick);
            let mut waiting = vec![odometry];
            waiting.extend(self.odometry.drain());
            let chosen = waiting.iter().rposition(seen).unwrap_or(waiting.len() - 1);
            odometry = waiting.swap_remove(chosen);
        } else if let Some(scan) = self.scans.of_tick(odometry.tick, mission.order.clock).await {
            self.recent_scans = vec![scan.clone()];
        }
        let announced = convert::laser(&mission.order.laser);
        let scan = self.recent_scans.iter().find(|s| s.tick == odometry.tick);
        let Some(filter) = &mut self.filter else { return };
        let last = self.answered.replace(odometry.tick);
        if last.is_some_and(|last| has_started_over(last, odometry.tick)) {
            tracing::warn!(tick = odometry.tick, ?last, "the base has started over");
            filter.restart_odometry();
        }
        let (ranges, laser) = match scan {
            Some(scan) => (scan.ranges.as_ref(), laser_of(scan, announced)),
            None => (&[][..], announced),
        };
        let pose = Pose2::new(odometry.x, odometry.y, odometry.heading);
        let twist = Twist { v: odometry.v, omega: odometry.omega };
        let estimate = filter.update(pose, twist, odometry.stamp, &LaserScan { ranges, laser });
        let belief = belief(&estimate, &odometry);
        self.beliefs.publish(&belief, mission.order.clock);
        // After the belief, which others wait for.
        if self.glimpse_rate.is_due(odometry.stamp) && self.glimpses.is_heard() {
            let seen = particles(filter.particles(), odometry.tick, odometry.stamp);
            self.glimpses.publish(&seen, mission.order.clock);
        }
        *self.newest.lock().unwrap_or_else(PoisonError::into_inner) = Some(belief);
        self.service.counts.record(started.elapsed());
    }
}

/// The scanner as the scan itself describes it; noise is what the mission says.
fn laser_of(scan: &Scan, announced: LaserModel) -> LaserModel {
    let beams = scan.ranges.len() as u32;
    let span = scan.angle_increment * f64::from(beams.saturating_sub(1));
    let full = span + scan.angle_increment > std::f64::consts::TAU - 1e-6;
    LaserModel {
        robot_from_laser: convert::pose(scan.laser),
        fov: if full { std::f64::consts::TAU } else { span },
        beams,
        range_max: scan.range_max,
        range_sigma: announced.range_sigma,
    }
}

fn belief(estimate: &Estimate, odometry: &Odometry) -> Belief {
    let health = Health {
        outside_weight: estimate.health.outside_weight.clamp(0.0, 1.0),
        scan_fit: estimate.health.scan_fit.clamp(0.0, 1.0),
        particles: estimate.health.particles as u32,
        converged: estimate.health.converged,
    };
    convert::belief_to_wire(&estimate.belief(), odometry.tick, odometry.stamp, health)
}
