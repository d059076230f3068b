//! Commands to the driver, one after the other, beside everything else.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use curionav_runtime::command::Commander;
use curionav_runtime::lease::BaseLease;
use curionav_runtime::query::AskError;
use curionav_schemas::{Mission, MissionCommand, Refusal, Reject};
use tokio::sync::{mpsc, watch};
use tokio::time::Instant;

/// How long one command is tried: a driver that has just been started again answers within it.
const PATIENCE: Duration = Duration::from_secs(5);
/// The driver is on the same robot.
const TIMEOUT: Duration = Duration::from_secs(2);
/// Between two attempts.
const PAUSE: Duration = Duration::from_millis(100);
/// Answers that wait to be read.
const ANSWERS: usize = 32;

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
pub(crate) struct DriverClient {
    waiting: watch::Sender<Waiting>,
    sent: u64,
}

/// Numbered commands that wait.
type Waiting = VecDeque<(u64, MissionCommand)>;

impl DriverClient {
    /// Begins to send commands to the driver that holds `lease`; answers come out in their order.
    pub(crate) fn start(commander: Commander, lease: Arc<BaseLease>) -> (Self, mpsc::Receiver<Answer>) {
        let (waiting, mut more) = watch::channel(Waiting::new());
        let (answers, answered) = mpsc::channel(ANSWERS);
        let robots_driver = RobotsDriver { commander, lease };
        let queue = waiting.clone();
        tokio::spawn(async move {
            while more.wait_for(|waiting| !waiting.is_empty()).await.is_ok() {
                let mut next = None;
                queue.send_modify(|waiting| next = waiting.pop_front());
                let Some((number, command)) = next else { continue };
                let outcome = robots_driver.told(&command).await;
                if answers.send(Answer { number, outcome }).await.is_err() {
                    return;
                }
            }
        });
        (Self { waiting, sent: 0 }, answered)
    }

    /// Sends a command; gives its number.
    pub(crate) fn send(&mut self, command: MissionCommand) -> u64 {
        self.sent += 1;
        let numbered = (self.sent, command);
        self.waiting.send_modify(|waiting| add(waiting, numbered));
        self.sent
    }
}

/// While a driver answers slowly, a mission, a goal or an end takes the place of all that waits: the robot does what
/// was said last, and what waits stays short. What was replaced has no answer.
fn add(waiting: &mut Waiting, numbered: (u64, MissionCommand)) {
    if !matches!(numbered.1, MissionCommand::Finish { .. }) {
        waiting.clear();
    }
    waiting.push_back(numbered);
}

/// The driver of a robot.
struct RobotsDriver {
    commander: Commander,
    lease: Arc<BaseLease>,
}

impl RobotsDriver {
    async fn told(&self, command: &MissionCommand) -> Result<Mission, Reject> {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let lease = self.lease.number();
            match self.commander.command_driver(command, lease, TIMEOUT).await {
                Ok(mission) => return Ok(mission),
                Err(AskError::Rejected(reject)) if !reject.why.is_transient() => return Err(reject),
                Err(error) if Instant::now() > deadline => return Err(refusal(error)),
                Err(_) => tokio::time::sleep(PAUSE).await,
            }
        }
    }
}

/// Why the driver did not do as it was told.
fn refusal(error: AskError) -> Reject {
    match error {
        AskError::Rejected(reject) => reject,
        error => Refusal::failed(format!("the driver: {error}")).into(),
    }
}

#[cfg(test)]
mod tests {
    use curionav_schemas::MissionEnd;

    use super::*;

    #[test]
    fn what_was_said_last_takes_the_place_of_what_waits() {
        let goal = |x| MissionCommand::Goal { x, y: 0.0, heading: None, way: None };
        let finish = MissionCommand::Finish { revision: 3, end: MissionEnd::Reached };
        let mut waiting = Waiting::new();
        let said = [goal(1.0), finish.clone(), goal(2.0), goal(3.0), finish];
        said.into_iter().zip(1..).for_each(|(command, number)| add(&mut waiting, (number, command)));
        assert_eq!(waiting.iter().map(|(number, _)| *number).collect::<Vec<_>>(), [4, 5]);
        add(&mut waiting, (6, MissionCommand::Cancel));
        assert_eq!(waiting, [(6, MissionCommand::Cancel)]);
    }
}
