//! A service of one robot: its sessions and streams, its mission, and what it says about itself.

use std::sync::Arc;
use std::time::Duration;

use curionav_schemas::{Message, Mission, MissionRequest, MissionState, keys};
use zenoh::Session;

use crate::config::ServiceConfig;
use crate::metrics::Metrics;
use crate::query::fetch;
use crate::ready::tell_driver;
use crate::serve::ServeCounts;
use crate::session::{self, SessionError};
use crate::status::{Announced, announce_service};
use crate::topic::{Flow, Inbox, OnDemand, Topic};

/// Missions are small and local.
const MISSION_TIMEOUT: Duration = Duration::from_secs(2);

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
            service.control = loop {
                match session::client(config).await {
                    Err(error @ SessionError::NoRouter { .. }) => tracing::warn!("{error}"),
                    opened => break opened?,
                }
            };
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

    /// A publisher on a stream.
    pub fn topic<M: Message>(&self, stream: &str, flow: Flow) -> anyhow::Result<Topic<M>> {
        Ok(Topic::new(self.session_of(stream), &self.key(stream)?, flow)?)
    }

    /// A publisher on a stream that is made only while somebody listens.
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
        let announced =
            announce_service(&self.config, &sessions, metrics, Arc::clone(&self.counts), Vec::new)?;
        tracing::info!(robot = %self.config.robot, instance = %self.config.instance, "{} ready", self.role);
        Ok(announced)
    }

    /// The mission as it stands, if there is one.
    pub async fn mission(&self) -> anyhow::Result<Option<Mission>> {
        Ok(fetch(&self.session, &self.key("mission")?, MISSION_TIMEOUT).await.ok())
    }

    /// Tells the driver that this role is prepared for `revision`, or that it cannot be.
    pub async fn report(&self, revision: u64, prepared: &Result<(), String>) -> anyhow::Result<()> {
        let (role, instance) = (self.role.to_owned(), self.config.instance.clone());
        let request = match prepared {
            Ok(()) => MissionRequest::Ready { role, instance, revision },
            Err(reason) => {
                tracing::error!(reason, "the mission cannot be carried out");
                MissionRequest::Finish { revision, reason: format!("{role}: {reason}") }
            }
        };
        tell_driver(&self.session, &self.key("mission")?, &request).await;
        Ok(())
    }

    /// Reports once more, if the mission still waits for this role.
    pub async fn remind(&self, mission: &Mission, prepared: &Result<(), String>) -> anyhow::Result<()> {
        let named = |roles: &[String]| roles.iter().any(|role| role == self.role);
        let waits = mission.state == MissionState::Preparing && named(&mission.require);
        if waits && !named(&mission.ready) {
            self.report(mission.revision, prepared).await?;
        }
        Ok(())
    }
}
