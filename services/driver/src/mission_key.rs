//! The mission key: questions read or change the mission, and changes are published.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use curionav_runtime::metrics::Tally;
use curionav_runtime::serve::{Server, serve_queries};
use curionav_runtime::topic::{Flow, Topic};
use curionav_schemas::{Message, Mission, MissionRequest, Reject, RejectCode};
use tokio::sync::watch;
use tokio::task::JoinSet;
use zenoh::Session;

use crate::desk::Desk;

/// Between two times the mission is said.
const MISSION_REPEATED: Duration = Duration::from_secs(1);

/// Serves the mission key: questions without a payload read, others change. What the mission is is also said
/// again from time to time, for whoever was cut off when it changed.
pub(crate) fn serve(
    session: &Session,
    key: &str,
    refused: &Tally,
    changed: watch::Sender<Option<Mission>>,
) -> anyhow::Result<(Server, JoinSet<()>)> {
    let published = Arc::new(Topic::<Mission>::new(session, key, Flow::State)?);
    let since_epoch = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    let desk = Arc::new(Mutex::new(Desk::new(since_epoch.as_millis() as u64)));
    let mut repeating = JoinSet::new();
    let (topic, known) = (Arc::clone(&published), Arc::clone(&desk));
    repeating.spawn(async move {
        loop {
            tokio::time::sleep(MISSION_REPEATED).await;
            // Held while it is published, so that no older mission is said after a newer one.
            let desk = known.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(mission) = desk.mission() {
                topic.publish(mission, mission.clock);
            }
        }
    });
    let server = serve_queries(session, key, (1, 64), refused, move |query, _| {
        let mut desk = desk.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(payload) = query.payload() else {
            let none = || Reject::new(RejectCode::Unknown, "the robot has no mission yet");
            return desk.mission().cloned().ok_or_else(none);
        };
        let encoding = query.encoding().map(ToString::to_string);
        let request =
            MissionRequest::decode(&payload.to_bytes(), encoding.as_deref()).map_err(|e| Reject::from(&e))?;
        let mission = desk.handle(request)?;
        changed.send_replace(Some(mission.clone()));
        published.publish(&mission, mission.clock);
        Ok(mission)
    })?;
    Ok((server, repeating))
}
