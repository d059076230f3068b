//! The tracker on its robot.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use curionav_robot::tracker::PeopleTracking;
use curionav_runtime::fields::Fields;
use curionav_runtime::lockstep::{Latest, has_started_over};
use curionav_runtime::mission_follower::{MissionFollower, follow};
use curionav_runtime::process::{Running, Start};
use curionav_runtime::robot_service::RobotService;
use curionav_runtime::topic::{Flow, Topic};
use curionav_schemas::{Belief, Clock, Mission, Odometry, People, Refusal, Reject, Scan, keys};

/// Messages remembered in real time, to be paired with those of their tick.
const KEPT: usize = 4;

struct Tracking {
    service: RobotService,
    fields: Fields,
    beliefs: Latest<Belief>,
    scans: Latest<Scan>,
    odometry: Latest<Odometry>,
    recent_scans: Vec<Scan>,
    recent_odometry: Vec<Odometry>,
    people: Topic<People>,
    /// The tracker, and the run that it was started for.
    tracker: Option<(u64, PeopleTracking)>,
    /// Tick of the last answer.
    answered: Option<u64>,
    /// Why scans are not used, once it has been said.
    unusable: Option<Reject>,
    /// How many people there are, for operators.
    count: Arc<AtomicUsize>,
}

/// Tracks the people around one robot until `shutdown`; `on_ready` is called once it follows missions.
pub fn run(start: Start<'_>) -> Running<'_> {
    Box::pin(async move {
        let Start { config, session, fields, shutdown, on_ready } = start;
        let service = RobotService::new(keys::TRACKER, config, session);
        let missions = service.inbox("mission")?;
        let mut tracking = Tracking {
            fields: fields.clone(),
            beliefs: Latest::new(service.inbox("belief")?),
            scans: Latest::new(service.inbox("scan")?),
            odometry: Latest::new(service.inbox("odom")?),
            recent_scans: Vec::new(),
            recent_odometry: Vec::new(),
            people: service.topic("people", Flow::Sensor)?,
            service,
            tracker: None,
            answered: None,
            unusable: None,
            count: Arc::default(),
        };
        let mut metrics = tracking.service.metrics();
        let count = Arc::clone(&tracking.count);
        let help = "People in the newest message, with those who are hidden now";
        metrics.gauge("tracked_people", help, move || Some(count.load(Ordering::Relaxed) as f64));
        let announced = tracking.service.announce(metrics)?;
        on_ready(announced.metrics_address());
        follow(&mut tracking, &missions, shutdown).await
    })
}

impl MissionFollower for Tracking {
    type Tick = Belief;

    fn service(&self) -> &RobotService {
        &self.service
    }

    /// Starts the tracker, in a new run only, and only if the mission requires one: otherwise people come from
    /// elsewhere.
    async fn prepare(&mut self, mission: &Mission) -> Result<(), Reject> {
        if self.tracker.as_ref().is_some_and(|(run, _)| *run == mission.run) {
            return Ok(());
        }
        self.tracker = None;
        let order = &mission.order;
        if !order.requires(keys::TRACKER) {
            return Ok(());
        }
        let fields = self.fields.clone();
        let id = order.map;
        let map = tokio::task::spawn_blocking(move || fields.map(id)).await;
        let map = map.map_err(|e| Refusal::failed(e).at("map"))??;
        self.tracker = Some((mission.run, PeopleTracking::new(order, map)?));
        Ok(())
    }

    fn forget_run(&mut self) {
        self.beliefs.clear();
        self.scans.clear();
        self.odometry.clear();
        self.recent_scans.clear();
        self.recent_odometry.clear();
        self.answered = None;
    }

    async fn next(&mut self) -> Option<Belief> {
        self.beliefs.next().await.cloned()
    }

    /// Answers a belief with people.
    async fn answer(&mut self, mut belief: Belief, mission: &Mission) {
        if self.tracker.is_none() {
            return;
        }
        let started = Instant::now();
        let clock = mission.order.clock;
        if clock == Clock::Realtime
            && let Some(newest) = self.beliefs.newest()
        {
            belief = newest.clone();
        }
        let Some((scan, odometry)) = self.sensed(belief.tick, clock).await else { return };
        let Some((_, tracker)) = &mut self.tracker else { return };
        let last = self.answered.replace(belief.tick);
        if last.is_some_and(|last| has_started_over(last, belief.tick)) {
            tracing::warn!(tick = belief.tick, ?last, "the base has started over");
            tracker.restart();
        }
        let people = match tracker.update(&odometry, &scan, &belief, mission.order.laser.range_sigma) {
            Ok(people) => people,
            Err(reject) => {
                // Without people the arbiter stops the robot, which is right while nothing can be seen.
                self.service.counts.refuse(&reject);
                if self.unusable.as_ref() != Some(&reject) {
                    tracing::warn!(%reject, tick = belief.tick, "scans are not used");
                    self.unusable = Some(reject);
                }
                return;
            }
        };
        self.count.store(people.id.len(), Ordering::Relaxed);
        self.people.publish(&people, clock);
        self.service.counts.record(started.elapsed());
    }
}

impl Tracking {
    /// Scan and odometry of a tick: in lockstep they are waited for, in real time they have come or are passed over.
    async fn sensed(&mut self, tick: u64, clock: Clock) -> Option<(Scan, Odometry)> {
        if clock == Clock::Lockstep {
            let scan = self.scans.of_tick(tick, clock).await?.clone();
            let odometry = self.odometry.of_tick(tick, clock).await?.clone();
            return Some((scan, odometry));
        }
        keep(&mut self.recent_scans, self.scans.drain());
        keep(&mut self.recent_odometry, self.odometry.drain());
        let scan = self.recent_scans.iter().find(|scan| scan.tick == tick)?.clone();
        let odometry = self.recent_odometry.iter().find(|odometry| odometry.tick == tick)?.clone();
        Some((scan, odometry))
    }
}

/// Adds what has come, and forgets all but the newest.
fn keep<M>(recent: &mut Vec<M>, come: Vec<M>) {
    recent.extend(come);
    recent.drain(..recent.len().saturating_sub(KEPT));
}
