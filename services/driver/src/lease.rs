//! The lease under which this driver drives: asked of the base, kept, and given up.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::bail;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::lease::LEASE;
use curionav_runtime::query::{AskError, Urgency, ask};
use curionav_schemas::keys::Commanded;
use curionav_schemas::{Lease, LeaseRequest, LeaseWish, Refusal, Reject, keys};
use tokio::sync::watch;
use zenoh::Session;

use crate::mission_keys::MissionKeys;

/// Between two wishes of a driver that drives: several fit in the time after which a lease is lost.
const RENEWED: Duration = Duration::from_millis(200);
/// Between two wishes of a driver that waits.
const WAITING: Duration = Duration::from_millis(50);
/// The base is on the same robot.
const TIMEOUT: Duration = Duration::from_millis(500);
/// For how long a driver asks that finds another one at work: if that one has died, its lease is over by then.
const PATIENCE: Duration = Duration::from_millis(1500);
/// For how long a driver waits that has asked the holder to go: that one brakes first.
const TAKE_OVER_PATIENCE: Duration = Duration::from_secs(30);

/// What this driver has of the lease.
#[derive(Debug, Clone, Default)]
pub(crate) struct Standing {
    /// When the wish was sent that the base has granted last.
    renewed: Option<Instant>,
    /// Another driver that has asked this one to go.
    pub(crate) wanted_by: Option<String>,
}

impl Standing {
    /// Whether the base may still obey: on a clock that nothing sets, it was asked a short while ago.
    pub(crate) fn is_fresh(&self) -> bool {
        self.renewed.is_some_and(|renewed| renewed.elapsed() < LEASE)
    }
}

/// Asks for the lease of a robot and keeps it.
pub(crate) struct Keeper {
    session: Session,
    key: String,
    driver: String,
    take_over: bool,
    missions: Arc<MissionKeys>,
    standing: watch::Sender<Standing>,
    /// Since when another driver has been found at work.
    refused_since: Option<Instant>,
}

impl Keeper {
    pub(crate) fn new(
        session: &Session,
        config: &ServiceConfig,
        missions: Arc<MissionKeys>,
    ) -> anyhow::Result<Self> {
        Ok(Self {
            session: session.clone(),
            key: Commanded::Lease.by(&config.robot, &config.identity(keys::DRIVER)?)?,
            driver: config.instance.clone(),
            take_over: config.take_over,
            missions,
            standing: watch::Sender::default(),
            refused_since: None,
        })
    }

    /// What this driver has of the lease, from now on.
    pub(crate) fn standing(&self) -> watch::Receiver<Standing> {
        self.standing.subscribe()
    }

    async fn wish(&self, wish: LeaseWish) -> Result<Lease, AskError> {
        let (lease, paused) = self.missions.standing();
        let driver = self.driver.clone();
        let request = LeaseRequest { driver, lease, wish, paused };
        ask(&self.session, &self.key, &request, TIMEOUT, Urgency::Normal).await
    }

    /// Asks once; whether the base has granted the lease.
    ///
    /// # Errors
    /// If another driver drives the robot: this one must not.
    async fn ask_once(&mut self) -> anyhow::Result<bool> {
        let sent = Instant::now();
        let (lease, _) = self.missions.standing();
        let wish = if self.take_over && lease == 0 { LeaseWish::TakeOver } else { LeaseWish::Hold };
        match self.wish(wish).await {
            Ok(granted) => {
                self.refused_since = None;
                if granted.lease != lease {
                    tracing::info!(lease = granted.lease, "the base lets this driver drive");
                    self.missions.set_lease(granted.lease, granted.paused);
                }
                let wanted_by = granted.wanted_by.filter(|driver| *driver != self.driver);
                self.standing.send_replace(Standing { renewed: Some(sent), wanted_by });
                Ok(true)
            }
            Err(AskError::Rejected(Reject { why: Refusal::LeaseHeld { holder }, .. })) => {
                self.refused(lease, &holder).map(|()| false)
            }
            Err(error) => {
                tracing::debug!(%error, "the base says nothing of the lease");
                Ok(false)
            }
        }
    }

    fn refused(&mut self, lease: u64, holder: &str) -> anyhow::Result<()> {
        if lease != 0 {
            self.standing.send_replace(Standing::default());
            self.missions.set_lease(0, false);
            bail!("driver `{holder}` drives this robot now: this driver was silent for too long");
        }
        let since = *self.refused_since.get_or_insert_with(Instant::now);
        let patience = if self.take_over { TAKE_OVER_PATIENCE } else { PATIENCE };
        if since.elapsed() > patience {
            bail!("driver `{holder}` drives this robot; stop it first, or start this one with --take-over");
        }
        Ok(())
    }

    /// Asks until the base has granted the lease, or says nothing: it may come later.
    ///
    /// # Errors
    /// If another driver drives the robot.
    pub(crate) async fn begin(&mut self) -> anyhow::Result<()> {
        while !self.ask_once().await? && self.refused_since.is_some() {
            tokio::time::sleep(WAITING).await;
        }
        Ok(())
    }

    /// Keeps the lease for as long as it is polled.
    ///
    /// # Errors
    /// Once another driver drives the robot.
    pub(crate) async fn keep(&mut self) -> anyhow::Error {
        loop {
            match self.ask_once().await {
                Ok(true) => tokio::time::sleep(RENEWED).await,
                Ok(false) => tokio::time::sleep(WAITING).await,
                Err(error) => return error,
            }
        }
    }

    /// Gives the lease up, so that the next driver need not wait until it is over.
    pub(crate) async fn release(self) {
        if self.missions.standing().0 == 0 {
            return;
        }
        if let Err(error) = self.wish(LeaseWish::Release).await {
            tracing::debug!(%error, "the lease is not given up");
        }
        self.missions.set_lease(0, false);
    }
}
