//! A service of one robot: its sessions and streams, its mission, and what it says about itself.

use std::sync::{Arc, Mutex};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use curionav_schemas::{Message, Mission, MissionState, Prepared, Readiness, Reject, Scan, keys};
use zenoh::Session;

use crate::config::ServiceConfig;
use crate::further_scans::FurtherScans;
use crate::locked::locked;
use crate::metrics::Metrics;
use crate::query::fetch;
use crate::ready::tell_driver;
use crate::serve::ServeCounts;
use crate::session::{self, SessionError};
use crate::status::{Announced, announce_service};
use crate::topic::{Flow, Inbox, OnDemand, Topic};

/// Missions are small and local.
const MISSION_TIMEOUT: Duration = Duration::from_secs(2);
/// Between two attempts to prepare for a mission.
const PREPARING_PAUSE: Duration = Duration::from_secs(1);

/// What arbiter, driver and localizer have in common.
pub struct RobotService {
    /// For everything but control.
    pub session: Session,
    /// For decisions and commands.
    pub control: Session,
    /// Messages taken and refused, ticks answered and how long that took.
    pub counts: Arc<ServeCounts>,
    role: &'static str,
    config: ServiceConfig,
    /// What it is prepared for, or what it waits for, as its status has it.
    prepared_for: Arc<Mutex<Option<Prepared>>>,
}

impl RobotService {
    /// A service that has nothing to do with control.
    pub fn new(role: &'static str, config: &ServiceConfig, session: &Session) -> Self {
        Self {
            session: session.clone(),
            control: session.clone(),
            counts: Arc::default(),
            role,
            config: config.clone(),
            prepared_for: Arc::default(),
        }
    }

    /// A service that sends or obeys decisions or commands. Behind a router these have a link of their own,
    /// so that candidates and reports on the other one cannot hold them up; in process there is no link. A router
    /// that has just been there is waited for.
    pub async fn with_control(
        role: &'static str,
        config: &ServiceConfig,
        session: &Session,
    ) -> Result<Self, SessionError> {
        let mut service = Self::new(role, config, session);
        if session.info().routers_zid().await.next().is_some() {
            let missing = |error: &SessionError| tracing::warn!("{error}");
            service.control = session::awaited(|| session::client(config), missing).await?;
        }
        Ok(service)
    }

    /// The key of one of the robot's streams.
    pub fn key(&self, stream: &str) -> anyhow::Result<String> {
        Ok(keys::robot(&self.config.robot, stream)?)
    }

    /// The session a stream travels on.
    pub fn session_of(&self, stream: &str) -> &Session {
        if matches!(stream, "decision" | "cmd") { &self.control } else { &self.session }
    }

    /// Subscribes to a stream; what is refused is counted.
    pub fn inbox<M: Message>(&self, stream: &str) -> anyhow::Result<Inbox<M>> {
        Ok(Inbox::counted(self.session_of(stream), &self.key(stream)?, &self.counts)?)
    }

    /// Follows the scans of the robot's further sensors; what is refused is counted.
    pub fn further_scans(&self) -> anyhow::Result<FurtherScans> {
        let key = keys::further_scans(&self.config.robot)?;
        Ok(FurtherScans::new(self.session_of("scan"), &key, &self.counts)?)
    }

    /// A publisher of the scans of one further sensor.
    pub fn further_scan(&self, sensor: &str) -> anyhow::Result<Topic<Scan>> {
        let key = keys::further_scan(&self.config.robot, sensor)?;
        Ok(Topic::new(self.session_of("scan"), &key, Flow::Sensor)?)
    }

    /// A publisher on a stream.
    pub fn topic<M: Message>(&self, stream: &str, flow: Flow) -> anyhow::Result<Topic<M>> {
        Ok(Topic::new(self.session_of(stream), &self.key(stream)?, flow)?)
    }

    /// A publisher on a stream that is made only while something listens.
    pub fn on_demand<M: Message>(&self, stream: &str, flow: Flow) -> anyhow::Result<OnDemand<M>> {
        Ok(OnDemand::new(self.session_of(stream), &self.key(stream)?, flow)?)
    }

    /// The metrics every service has; add to them what is peculiar to this one.
    pub fn metrics(&self) -> Metrics {
        Metrics::of_robot(self.role, &self.config)
    }

    /// Serves status and metrics and declares the service alive. Call it once everything else is declared.
    pub fn announce(&self, metrics: Metrics) -> anyhow::Result<Announced> {
        let mut sessions = vec![("data", &self.session)];
        if self.control.zid() != self.session.zid() {
            sessions.push(("control", &self.control));
        }
        let prepared_for = Arc::clone(&self.prepared_for);
        let prepared = move || locked(&prepared_for).iter().cloned().collect();
        let counts = Arc::clone(&self.counts);
        let announced = announce_service(&self.config, &sessions, metrics, counts, prepared)?;
        tracing::info!(robot = %self.config.robot, instance = %self.config.instance, "{} ready", self.role);
        Ok(announced)
    }

    /// The mission as it stands, if there is one.
    pub async fn mission(&self) -> anyhow::Result<Option<Mission>> {
        Ok(fetch(&self.session, &self.key("mission")?, MISSION_TIMEOUT).await.ok())
    }

    /// Whether to prepare for `mission` once more, as `outcome` is only that something is not there yet. Then it says
    /// so, in log and status, and waits before it answers: a mission is not given up for what may come by itself,
    /// least of all by one of several that are there to replace each other.
    pub async fn must_retry(&self, mission: &Mission, outcome: &Result<(), Reject>) -> bool {
        let revision = mission.revision;
        let waits = outcome.as_ref().err().filter(|reject| reject.why.is_transient());
        let now = match outcome {
            Ok(()) => Some(Prepared::Revision { revision }),
            Err(_) => waits.map(|reject| Prepared::Waiting { revision, reject: reject.clone() }),
        };
        let before = std::mem::replace(&mut *locked(&self.prepared_for), now.clone());
        let Some(reject) = waits else { return false };
        // Said once, however often it is tried.
        if before != now {
            tracing::warn!(revision, %reject, "cannot prepare for the mission yet; trying again");
        }
        tokio::time::sleep(PREPARING_PAUSE).await;
        true
    }

    /// That this role is prepared for `revision`, or that it never will be.
    pub fn readiness(&self, revision: u64, prepared: &Result<(), Reject>) -> Readiness {
        let role = self.role.to_owned();
        let instance = self.config.instance.clone();
        let refused = prepared.as_ref().err().cloned();
        if let Some(reject) = &refused {
            tracing::error!(%reject, "the mission cannot be carried out");
        }
        Readiness { role, instance, revision, refused }
    }

    /// Reports what has become of preparing for `mission`: if that was done `anew`, or else if the mission still waits
    /// for this role, as the driver may have been out of reach when it was told.
    pub async fn tell(
        &self,
        mission: &Mission,
        prepared: Option<&Preparation>,
        anew: bool,
    ) -> anyhow::Result<()> {
        let Some(prepared) = prepared.filter(|prepared| prepared.is_for(mission)) else { return Ok(()) };
        let named = |roles: &[String]| roles.iter().any(|role| role == self.role);
        let waits = mission.state == MissionState::Preparing && named(&mission.order.require);
        if anew || (waits && !named(&mission.ready)) {
            let readiness = self.readiness(mission.revision, &prepared.outcome);
            tell_driver(&self.session, &keys::mission_ready(&self.config.robot)?, &readiness).await;
        }
        Ok(())
    }
}

/// What has become of preparing for one revision of a mission.
#[derive(Debug)]
pub struct Preparation {
    run: u64,
    revision: u64,
    outcome: Result<(), Reject>,
}

impl Preparation {
    /// What has become of preparing for `mission`.
    pub fn new(mission: &Mission, outcome: Result<(), Reject>) -> Self {
        Self { run: mission.run, revision: mission.revision, outcome }
    }

    /// Whether it was for the run of `mission`.
    pub fn is_of_run(&self, mission: &Mission) -> bool {
        self.run == mission.run
    }

    /// Whether there is nothing left to prepare for `mission`.
    pub fn is_for(&self, mission: &Mission) -> bool {
        (self.run, self.revision) == (mission.run, mission.revision)
    }
}

/// Number of the first run of a driver or simulator that has just started: unlike that of any run of one that was here
/// before, which others may still remember.
pub fn first_run() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_millis() as u64
}

/// Whether what is `said` leaves nothing to prepare for `mission`: that is over, or another has been given.
pub fn supersedes(said: &Mission, mission: &Mission) -> bool {
    (said.run, said.revision) != (mission.run, mission.revision) || said.is_over()
}

/// Completes once a mission is said that `ends` what is being done, or the session is closed. Whatever is said until
/// then, the last of it is put into `newest`.
pub async fn superseded(
    missions: &Inbox<Mission>,
    newest: &mut Option<Mission>,
    ends: impl Fn(&Mission) -> bool,
) {
    while let Some(said) = missions.next().await {
        let end = ends(&said);
        *newest = Some(said);
        if end {
            return;
        }
    }
}
