//! Commands to the driver, one after the other, beside everything else.

use std::time::Duration;

use curionav_runtime::query::{AskError, Urgency, ask};
use curionav_schemas::{Mission, MissionCommand, Refusal, Reject};
use tokio::sync::mpsc;
use tokio::time::Instant;
use zenoh::Session;

/// How long one command is tried: a driver that has just been started again answers within it.
const PATIENCE: Duration = Duration::from_secs(5);
/// The driver is on the same robot.
const TIMEOUT: Duration = Duration::from_secs(2);
/// Between two attempts.
const PAUSE: Duration = Duration::from_millis(100);
/// Commands that wait: more than one goal and its end need.
const QUEUE: usize = 32;

/// What has become of a command.
#[derive(Debug)]
pub(crate) struct Answer {
    /// The command's number.
    pub(crate) number: u64,
    /// The mission as it stands then, or why it was refused.
    pub(crate) outcome: Result<Mission, Reject>,
}

/// Where commands go in.
#[derive(Debug)]
pub(crate) struct Pilot {
    commands: mpsc::Sender<(u64, MissionCommand)>,
    sent: u64,
}

impl Pilot {
    /// Begins to send commands to `key`; answers come out in their order.
    pub(crate) fn start(session: &Session, key: String) -> (Self, mpsc::Receiver<Answer>) {
        let (commands, mut waiting) = mpsc::channel::<(u64, MissionCommand)>(QUEUE);
        let (answers, answered) = mpsc::channel(QUEUE);
        let session = session.clone();
        tokio::spawn(async move {
            while let Some((number, command)) = waiting.recv().await {
                let outcome = told(&session, &key, &command).await;
                if answers.send(Answer { number, outcome }).await.is_err() {
                    return;
                }
            }
        });
        (Self { commands, sent: 0 }, answered)
    }

    /// Sends a command; gives its number.
    pub(crate) fn send(&mut self, command: MissionCommand) -> u64 {
        self.sent += 1;
        if self.commands.try_send((self.sent, command)).is_err() {
            tracing::warn!("the driver answers so slowly that a command was dropped");
        }
        self.sent
    }
}

async fn told(session: &Session, key: &str, command: &MissionCommand) -> Result<Mission, Reject> {
    let deadline = Instant::now() + PATIENCE;
    loop {
        match ask(session, key, command, TIMEOUT, Urgency::Normal).await {
            Ok(mission) => return Ok(mission),
            Err(AskError::Rejected(reject)) if !reject.why.is_transient() => return Err(reject),
            Err(error) if Instant::now() > deadline => {
                return Err(Refusal::failed(format!("the driver: {error}")).into());
            }
            Err(_) => tokio::time::sleep(PAUSE).await,
        }
    }
}
