//! Commands to a robot: they reach everything that claims to drive it, and succeed only if what does drive it obeys.

use std::time::Duration;

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

/// Gives `command` to every driver of `robot`; answers with the mission of the one that drives under `lease`.
///
/// # Errors
/// If that one refuses or does not answer in time.
pub async fn command_driver(
    session: &Session,
    robot: &str,
    command: &MissionCommand,
    lease: u64,
    timeout: Duration,
) -> Result<Mission, AskError> {
    if lease == 0 {
        return Err(AskError::Rejected(Refusal::NoLease.into()));
    }
    let key = keys::mission_command(robot).map_err(|error| AskError::Send(error.to_string()))?;
    ask_all(session, &key, command, timeout, |mission: &Mission| mission.lease == lease).await
}

/// Gives `command` to the driver that holds the lease of `robot`, as its base says.
///
/// # Errors
/// If the base does not answer in time, or that driver refuses or does not answer.
pub async fn command_to_holder(
    session: &Session,
    robot: &str,
    command: &MissionCommand,
    timeout: Duration,
) -> Result<Mission, AskError> {
    let lease = lease_of(session, robot, timeout).await?.lease;
    command_driver(session, robot, command, lease, timeout).await
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

/// Pauses `robot`, or lets it go on: asks its base and every driver until both the base and the driver that holds the
/// lease have obeyed, or the time is over. Gives what has been reached.
///
/// # Errors
/// If nothing of the robot has obeyed.
pub async fn pause(
    session: &Session,
    robot: &str,
    paused: bool,
    timeout: Duration,
) -> Result<Halted, AskError> {
    let key = keys::robot(robot, "pause").map_err(|error| AskError::Send(error.to_string()))?;
    let deadline = tokio::time::Instant::now() + timeout;
    let mut obeyed: Vec<PauseReply> = Vec::new();
    loop {
        let left = deadline.saturating_duration_since(tokio::time::Instant::now());
        let request = PauseRequest { paused };
        let asked = ask_all(session, &key, &request, left, |reply: &PauseReply| {
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
