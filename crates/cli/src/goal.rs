//! What becomes of a goal: whether it can be asked for, and whether the robot's services take it.

use std::time::Duration;

use anyhow::anyhow;
use curionav_planning::parameters::Range;
use curionav_runtime::exit::Exit;
use curionav_runtime::query::{AskError, fetch};
use curionav_schemas::words::say;
use curionav_schemas::{Mission, MissionEnd, MissionState, keys};
use tokio::time::{Instant, sleep};
use zenoh::Session;

/// Longest that services are waited for: the arbiter gives its replicas half of it.
const PATIENCE: Duration = Duration::from_secs(10);
const TIMEOUT: Duration = Duration::from_secs(1);
const PAUSE: Duration = Duration::from_millis(100);

/// Whether x and y, in metres, and a yaw can be a goal on any map.
pub(crate) fn check(x: f64, y: f64, yaw: Option<f64>) -> Result<(), Exit> {
    for (name, number, range) in [
        ("x", x, Range::POSITION),
        ("y", y, Range::POSITION),
        ("yaw", yaw.unwrap_or_default(), Range::HEADING),
    ] {
        if !range.holds(number) {
            return Err(Exit::bad_input(anyhow!("{name}: is {number}; {}", range.mend())));
        }
    }
    Ok(())
}

/// The mission once its services have prepared for this revision or refused it; as it was if they take too long or
/// something else has been asked for meanwhile.
pub(crate) async fn settled(session: &Session, asked: Mission) -> Mission {
    let Ok(key) = keys::robot(&asked.order.robot, "mission") else { return asked };
    let deadline = Instant::now() + PATIENCE;
    while Instant::now() < deadline {
        let said: Result<Mission, AskError> = fetch(session, &key, TIMEOUT).await;
        match said {
            Ok(said) if said.revision != asked.revision => return asked,
            Ok(said) if said.state != MissionState::Preparing => return said,
            _ => sleep(PAUSE).await,
        }
    }
    asked
}

/// Fails with the reason if a service has refused the mission.
pub(crate) fn accepted(mission: &Mission) -> Result<(), Exit> {
    match &mission.end {
        Some(end @ MissionEnd::Unprepared { .. }) => {
            Err(Exit::failed(anyhow!("{}: the goal is refused: {}", mission.order.robot, say("end", end))))
        }
        _ => Ok(()),
    }
}
