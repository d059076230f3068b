//! Telling the driver about its mission: that a role is ready for it, or that it cannot be carried out.

use std::time::Duration;

use curionav_schemas::{Mission, MissionRequest};
use zenoh::Session;

use crate::query::{AskError, Urgency, ask};

/// The driver is on the same robot.
const TIMEOUT: Duration = Duration::from_secs(2);
const ATTEMPTS: u32 = 5;
const PAUSE: Duration = Duration::from_millis(200);

/// Sends a request about the mission; tried again unless the driver answers, if only to refuse it.
pub async fn tell_driver(session: &Session, mission_key: &str, request: &MissionRequest) {
    for _ in 0..ATTEMPTS {
        match ask::<_, Mission>(session, mission_key, request, TIMEOUT, Urgency::Normal).await {
            Ok(_) => return,
            Err(AskError::Rejected(reject)) => {
                tracing::warn!(%reject, "the driver refused a mission request");
                return;
            }
            Err(error) => tracing::warn!(%error, "the driver did not answer a mission request"),
        }
        tokio::time::sleep(PAUSE).await;
    }
}
