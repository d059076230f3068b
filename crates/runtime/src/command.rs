//! Commands to a robot: they reach everything that claims to drive it, and succeed only if what does drive it obeys.

use std::time::Duration;

use curionav_schemas::keys::Commanded;
use curionav_schemas::{Lease, Message, Mission, MissionCommand, PauseReply, PauseRequest, Refusal, keys};
use zenoh::Session;
use zenoh::query::QueryTarget;

use crate::query::{AskError, Kept, Urgency, fetch, send};

/// Drivers of one robot whose replies are read.
const DRIVERS: usize = 16;
/// Between two attempts to pause.
const AGAIN: Duration = Duration::from_millis(300);

/// Asks every queryable of `key`, and takes the first reply that `accept` makes something of. Without one, the last
/// refusal is given; one for want of a lease only if there is no other.
async fn ask_all<Q: Message, A: Message>(
    session: &Session,
    key: &str,
    question: &Q,
    timeout: Duration,
    mut accept: impl FnMut(&A) -> bool,
) -> Result<A, AskError> {
    let encoded = Some((question.encode(), Q::ENCODING));
    let kept = Kept { replies: DRIVERS, most: A::MAX_BYTES };
    let mut replies = send(session, key, encoded, timeout, Urgency::Normal, QueryTarget::All, kept)?;
    let no_lease = AskError::Rejected(Refusal::NoLease.into());
    let mut failure = AskError::NoReply;
    while let Some(read) = replies.next_read(Ok).await {
        match read {
            Ok(answer) if accept(&answer) => return Ok(answer),
            Ok(_) if failure == AskError::NoReply => failure = no_lease.clone(),
            Ok(_) => {}
            Err(error) if error == no_lease && failure != AskError::NoReply => {}
            Err(error) => failure = error,
        }
    }
    Err(failure)
}

/// One who commands a robot.
#[derive(Debug, Clone)]
pub struct Commander {
    session: Session,
    robot: String,
    /// Its name, as certificates have it.
    by: String,
}

impl Commander {
    /// Commands `robot` as `by`, the name of the certificate that `session` shows, if it shows one.
    pub fn new(session: &Session, robot: &str, by: &str) -> Self {
        Self { session: session.clone(), robot: robot.to_owned(), by: by.to_owned() }
    }

    /// Its name.
    pub fn by(&self) -> &str {
        &self.by
    }

    fn key(&self, kind: Commanded) -> Result<String, AskError> {
        kind.by(&self.robot, &self.by).map_err(|error| AskError::Send(error.to_string()))
    }

    /// Gives `command` to every driver of the robot; answers with the mission of the one that drives under `lease`.
    ///
    /// # Errors
    /// If that one refuses or does not answer in time.
    pub async fn command_driver(
        &self,
        command: &MissionCommand,
        lease: u64,
        timeout: Duration,
    ) -> Result<Mission, AskError> {
        if lease == 0 {
            return Err(AskError::Rejected(Refusal::NoLease.into()));
        }
        let key = self.key(Commanded::Mission)?;
        ask_all(&self.session, &key, command, timeout, |mission: &Mission| mission.lease == lease).await
    }

    /// Gives `command` to the driver that holds the robot's lease, as its base says.
    ///
    /// # Errors
    /// If the base does not answer in time, or that driver refuses or does not answer.
    pub async fn command_to_holder(
        &self,
        command: &MissionCommand,
        timeout: Duration,
    ) -> Result<Mission, AskError> {
        let lease = lease_of(&self.session, &self.robot, timeout).await?.lease;
        self.command_driver(command, lease, timeout).await
    }

    /// Pauses the robot, or lets it go on: asks its base and every driver until both the base and the driver that holds
    /// the lease have obeyed, or the time is over. Gives what has been reached.
    ///
    /// # Errors
    /// If nothing of the robot has obeyed.
    pub async fn pause(&self, paused: bool, timeout: Duration) -> Result<Halted, AskError> {
        let key = self.key(Commanded::Pause)?;
        let deadline = tokio::time::Instant::now() + timeout;
        let mut obeyed: Vec<PauseReply> = Vec::new();
        loop {
            let left = deadline.saturating_duration_since(tokio::time::Instant::now());
            let request = PauseRequest { paused };
            let asked = ask_all(&self.session, &key, &request, left, |reply: &PauseReply| {
                obeyed.retain(|known| (&known.role, &known.instance) != (&reply.role, &reply.instance));
                obeyed.extend((reply.paused == paused).then(|| reply.clone()));
                Halted::by(&obeyed).is_complete()
            });
            let failure = asked.await.err();
            let halted = Halted::by(&obeyed);
            let Some(failure) = failure else { return Ok(halted) };
            if tokio::time::Instant::now() + AGAIN > deadline {
                return if obeyed.is_empty() { Err(failure) } else { Ok(halted) };
            }
            tokio::time::sleep(AGAIN).await;
        }
    }
}

/// Who drives `robot`, as its base says.
///
/// # Errors
/// If no base answers in time.
pub async fn lease_of(session: &Session, robot: &str, timeout: Duration) -> Result<Lease, AskError> {
    let key = keys::robot(robot, "lease").map_err(|error| AskError::Send(error.to_string()))?;
    fetch(session, &key, timeout).await
}

/// What has become of a pause or its end.
#[derive(Debug, Default)]
pub struct Halted {
    /// The base, once it obeys.
    pub base: Option<PauseReply>,
    /// The driver that holds the lease, once it obeys.
    pub driver: Option<PauseReply>,
}

impl Halted {
    /// Whether everything that moves the robot has obeyed.
    pub fn is_complete(&self) -> bool {
        self.base.as_ref().is_some_and(|base| base.lease == 0 || self.driver.is_some())
    }

    /// What these replies reach, of which those count that have obeyed.
    fn by(replies: &[PauseReply]) -> Self {
        let base = replies.iter().find(|reply| reply.role != keys::DRIVER).cloned();
        let lease = base.as_ref().map_or(0, |base| base.lease);
        let mut drivers = replies.iter().filter(|reply| reply.role == keys::DRIVER);
        let driver = drivers.find(|driver| driver.lease == lease && lease != 0).cloned();
        Self { base, driver }
    }
}
