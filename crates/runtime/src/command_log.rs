//! Who has commanded what, and what was answered: one line of the log for each command.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use curionav_schemas::{Mission, MissionCommand, PauseRequest, Reject};

use crate::config::ServiceConfig;
use crate::locked::locked;

/// Where these lines go in the log. A service logs them whatever its filter says of everything else.
pub const TARGET: &str = "commands";
/// Longest text of a line, characters: a refusal may quote what it refuses.
const LONGEST: usize = 300;

/// Most lines within [`PERIOD`]: far more than people and programs command, and no flood that holds a service up.
const LINES_MAX: u32 = 100;
const PERIOD: Duration = Duration::from_secs(1);

/// Writes down what a service is commanded. Clones count together.
#[derive(Debug, Clone)]
pub struct CommandLog {
    /// Whether the router lets only the holder of a certificate command under its name.
    is_proven: bool,
    written: Arc<Mutex<Written>>,
}

/// What was written in the period that goes on.
#[derive(Debug, Default)]
struct Written {
    since: Option<Instant>,
    lines: u32,
    left_out: u64,
}

impl Written {
    /// Whether one more line may be written `now`, and how many were left out in the period before, if it is over.
    fn admit(&mut self, now: Instant) -> (bool, u64) {
        let mut left_out = 0;
        if self.since.is_none_or(|since| now.saturating_duration_since(since) >= PERIOD) {
            left_out = self.left_out;
            *self = Self { since: Some(now), lines: 0, left_out: 0 };
        }
        self.lines += 1;
        let is_admitted = self.lines <= LINES_MAX;
        if !is_admitted {
            self.lines = LINES_MAX;
            self.left_out += 1;
        }
        (is_admitted, left_out)
    }
}

impl CommandLog {
    /// Of a service that is configured so.
    pub fn new(config: &ServiceConfig) -> Self {
        Self { is_proven: config.secure.is_some(), written: Arc::default() }
    }

    /// `by` has given `command`, and this was the answer.
    pub fn note(&self, by: &str, command: &str, answer: &Result<String, &Reject>) {
        let (is_admitted, left_out) = locked(&self.written).admit(Instant::now());
        if left_out > 0 {
            tracing::info!(target: TARGET, "{left_out} more commands in one second are not listed");
        }
        if is_admitted {
            let line = self.line(by, command, answer);
            tracing::info!(target: TARGET, "{line}");
        }
    }

    fn line(&self, by: &str, command: &str, answer: &Result<String, &Reject>) -> String {
        let who = if self.is_proven { by.to_owned() } else { format!("one who says it is {by}") };
        let outcome = match answer {
            Ok(done) => done.clone(),
            Err(reject) => format!("refused: {reject}"),
        };
        plain(&format!("{who}: {command}: {outcome}"))
    }
}

/// The text without anything that could look like another line, and no longer than a line should be.
fn plain(text: &str) -> String {
    let shown = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    shown.take(LONGEST).collect()
}

/// A command about a mission in words.
pub fn in_words(command: &MissionCommand) -> String {
    match command {
        MissionCommand::Set { order } => {
            format!("a mission to ({:.2}, {:.2})", order.goal_x, order.goal_y)
        }
        MissionCommand::Goal { x, y, way: None, .. } => format!("a goal at ({x:.2}, {y:.2})"),
        MissionCommand::Goal { x, y, .. } => format!("a way to ({x:.2}, {y:.2})"),
        MissionCommand::Cancel => "cancel".into(),
        MissionCommand::Finish { revision, .. } => format!("finish revision {revision}"),
    }
}

/// A pause or its end in words.
pub fn pause_in_words(request: PauseRequest) -> &'static str {
    if request.paused { "pause" } else { "go on" }
}

/// How a mission stands, as the answer to a command.
pub fn standing(mission: &Mission) -> String {
    format!("revision {}, {}", mission.revision, mission.state.name())
}

#[cfg(test)]
mod tests {
    use curionav_schemas::Refusal;

    use super::*;

    fn log(is_proven: bool) -> CommandLog {
        CommandLog { is_proven, written: Arc::default() }
    }

    #[test]
    fn a_flood_is_counted_and_does_not_fill_the_log() {
        let mut written = Written::default();
        let start = Instant::now();
        let admitted = (0..1000).filter(|_| written.admit(start).0).count();
        assert_eq!(admitted, LINES_MAX as usize);
        assert_eq!(written.admit(start + PERIOD), (true, 1000 - u64::from(LINES_MAX)));
        assert_eq!(written.admit(start + 3 * PERIOD), (true, 0));
    }

    #[test]
    fn a_name_is_a_fact_only_where_the_router_holds_everyone_to_theirs() {
        let done = Ok("revision 4, preparing".to_owned());
        let proven = log(true).line("operator.ward3", "a goal at (1.00, 2.00)", &done);
        assert_eq!(proven, "operator.ward3: a goal at (1.00, 2.00): revision 4, preparing");
        let said = log(false).line("operator", "cancel", &Err(&Refusal::NoMission.into()));
        assert_eq!(said, "one who says it is operator: cancel: refused: the robot has no mission yet");
    }

    #[test]
    fn nothing_in_a_command_makes_another_line_or_a_long_one() {
        let detail = format!("x\n2026-01-01 INFO commands: operator: cancel\u{1b}[2J{}", "y".repeat(2000));
        let refused: Reject = Refusal::Invalid { detail }.into();
        let line = log(true).line("viewer", "cancel", &Err(&refused));
        assert!(line.chars().count() == LONGEST && !line.chars().any(char::is_control), "{line}");
    }
}
