//! The localizer on its robot.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use curionav_robot::localizer::Localization;
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_runtime::kept_pose::KeptPose;
use curionav_runtime::locked::locked;
use curionav_runtime::lockstep::{Latest, has_started_over};
use curionav_runtime::metrics::Metrics;
use curionav_runtime::mission_follower::{MissionFollower, follow};
use curionav_runtime::process::{Running, Start};
use curionav_runtime::robot_service::RobotService;
use curionav_runtime::topic::{Flow, OnDemand, Topic};
use curionav_schemas::{Belief, Clock, Mission, Odometry, Particles, Refusal, Reject, Scan};

use crate::keeping::{Keeper, moved_since};
use crate::particle_cloud::{Rate, particles};

/// Scans remembered in real time, to be paired with the odometry of their tick.
const SCANS_KEPT: usize = 4;

/// A localizer that works is not silent for so long: it answers every tick, and none is longer.
const SILENCE: Duration = Duration::from_secs(1);

struct Service {
    service: RobotService,
    fields: Fields,
    scans: Latest<Scan>,
    odometry: Latest<Odometry>,
    recent_scans: Vec<Scan>,
    beliefs: Topic<Belief>,
    clouds: OnDemand<Particles>,
    cloud_rate: Rate,
    /// What localizes, and the run that it was started for.
    filter: Option<(u64, Localization)>,
    /// Keeps the belief in a file, if it is to.
    keeper: Option<Keeper>,
    /// The pose that the filter is to go on from with the next odometry: this localizer was started in mid-run.
    resumes: Option<KeptPose>,
    /// Tick of the last odometry.
    answered: Option<u64>,
    /// Why scans are not used, once it has been said.
    unusable: Option<Reject>,
    /// The newest belief, for operators.
    newest: Arc<Mutex<Option<Belief>>>,
}

/// Localizes one robot until `shutdown`; `on_ready` is called once it follows missions.
pub fn run(start: Start<'_>) -> Running<'_> {
    Box::pin(async move {
        let Start { config, session, fields, shutdown, on_ready } = start;
        let service = RobotService::new("localizer", config, session);
        let missions = service.inbox("mission")?;
        let mut localization = Service {
            fields: fields.clone(),
            scans: Latest::new(service.inbox("scan")?),
            odometry: Latest::new(service.inbox("odom")?),
            recent_scans: Vec::new(),
            beliefs: service.topic("belief", Flow::Sensor)?,
            clouds: service.on_demand("particles", Flow::Glimpse)?,
            cloud_rate: Rate::default(),
            service,
            filter: None,
            keeper: Keeper::new(config),
            resumes: None,
            answered: None,
            unusable: None,
            newest: Arc::default(),
        };
        let mut metrics = localization.service.metrics();
        register_health(&mut metrics, &localization.newest);
        let announced = localization.service.announce(metrics)?;
        on_ready(announced.metrics_address());
        follow(&mut localization, &missions, shutdown).await
    })
}

/// What the newest belief says of itself.
fn register_health(metrics: &mut Metrics, newest: &Arc<Mutex<Option<Belief>>>) {
    let help = "Trace of the position's covariance, square metres";
    register(metrics, newest, "belief_trace_m2", help, |b| b.covariance[0] + b.covariance[4]);
    let help = "How well the scan fits the map at the mean, 0 to 1";
    register(metrics, newest, "belief_scan_fit", help, |b| b.health.scan_fit);
    let help = "Probability that the robot is not in the heaviest cluster, 0 to 1";
    register(metrics, newest, "belief_outside_weight", help, |b| b.health.outside_weight);
    let help = "Whether the belief is sure (0), doubtful (1) or lost (2)";
    register(metrics, newest, "belief_doubt", help, |b| f64::from(b.health.confidence as u8));
    register(metrics, newest, "belief_particles", "Particles in use", |b| f64::from(b.health.particles));
}

fn register(
    metrics: &mut Metrics,
    newest: &Arc<Mutex<Option<Belief>>>,
    name: &'static str,
    help: &'static str,
    number: fn(&Belief) -> f64,
) {
    let newest = Arc::clone(newest);
    metrics.gauge(name, help, move || locked(&newest).as_ref().map(number));
}

impl Service {
    /// Completes once no other localizer has answered for a while: a second one ends no mission that the first serves.
    async fn while_another_answers(&self) -> Result<(), Reject> {
        let others = self.service.inbox::<Belief>("belief").map_err(Refusal::failed)?;
        let mut is_told = false;
        while let Ok(Some(_)) = tokio::time::timeout(SILENCE, others.next()).await {
            if !is_told {
                tracing::warn!(
                    "another localizer answers for this robot, so this one does nothing; end one of them"
                );
            }
            is_told = true;
        }
        Ok(())
    }
}

impl MissionFollower for Service {
    type Tick = Odometry;

    fn service(&self) -> &RobotService {
        &self.service
    }

    /// Starts the filter, in a new run only: a robot that is sent to another goal still knows where it is.
    async fn prepare(&mut self, mission: &Mission) -> Result<(), Reject> {
        if self.filter.as_ref().is_some_and(|(run, _)| *run == mission.run) {
            return Ok(());
        }
        self.filter = None;
        self.resumes = None;
        if mission.has_run {
            // The robot has left the start. Either this localizer was restarted on the way, or it is a second one.
            self.while_another_answers().await?;
            let kept = self.keeper.as_ref().and_then(|keeper| keeper.of_run(mission));
            self.resumes = Some(kept.ok_or(Refusal::PoseLost)?);
        }
        let fields = self.fields.clone();
        let begun = mission.clone();
        let started = tokio::task::spawn_blocking(move || {
            let map = fields.map(begun.order.map)?;
            Localization::new(&begun, &map)
        });
        let filter = started.await.map_err(|e| Refusal::failed(e).at("map"))??;
        self.filter = Some((mission.run, filter));
        Ok(())
    }

    fn forget_run(&mut self) {
        self.scans.clear();
        self.odometry.clear();
        self.recent_scans.clear();
        self.answered = None;
    }

    async fn next(&mut self) -> Option<Odometry> {
        self.odometry.next().await.cloned()
    }

    /// Answers odometry with a belief.
    async fn answer(&mut self, mut odometry: Odometry, mission: &Mission) {
        let started = Instant::now();
        let clock = mission.order.clock;
        if clock == Clock::Realtime {
            // The newest odometry whose scan is here as well, if any: a scan of another tick is no
            // observation of this pose.
            self.recent_scans.extend(self.scans.drain());
            let excess = self.recent_scans.len().saturating_sub(SCANS_KEPT);
            self.recent_scans.drain(..excess);
            let mut waiting = vec![odometry];
            waiting.extend(self.odometry.drain());
            let seen = waiting.iter().rposition(|o| self.recent_scans.iter().any(|scan| scan.tick == o.tick));
            odometry = waiting.swap_remove(seen.unwrap_or(waiting.len() - 1));
        } else if let Some(scan) = self.scans.of_tick(odometry.tick, clock).await {
            self.recent_scans = vec![scan.clone()];
        }
        let Some((_, filter)) = &mut self.filter else { return };
        if let Some(kept) = self.resumes.take() {
            tracing::warn!(tick = kept.tick, "localisation goes on from the kept pose, in doubt");
            filter.resume(moved_since(&kept, &odometry));
        }
        let last = self.answered.replace(odometry.tick);
        if last.is_some_and(|last| has_started_over(last, odometry.tick)) {
            tracing::warn!(tick = odometry.tick, ?last, "the base has started over");
            filter.restart_odometry();
        }
        let scan = self.recent_scans.iter().find(|s| s.tick == odometry.tick);
        let (belief, unused) = filter.update(&odometry, scan, convert::laser(&mission.order.laser));
        if let Some(reject) = unused {
            self.service.counts.refuse(&reject);
            if self.unusable.as_ref() != Some(&reject) {
                tracing::warn!(%reject, tick = odometry.tick, "scans are not used");
                self.unusable = Some(reject);
            }
        }
        self.beliefs.publish(&belief, clock);
        if let Some(keeper) = &mut self.keeper {
            keeper.keep(mission, &odometry, &belief);
        }
        // After the belief, which others wait for.
        if self.cloud_rate.is_due(odometry.stamp) && self.clouds.is_heard() {
            self.clouds.publish(&particles(filter.particles(), odometry.tick, odometry.stamp), clock);
        }
        *locked(&self.newest) = Some(belief);
        self.service.counts.record(started.elapsed());
    }
}
