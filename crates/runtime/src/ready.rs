//! Telling the driver that a role is ready for its mission, or that it never will be.

use std::time::Duration;

use curionav_schemas::{Mission, Readiness};
use zenoh::Session;

use crate::query::{AskError, Urgency, ask};

/// The driver is on the same robot.
const TIMEOUT: Duration = Duration::from_secs(2);
const ATTEMPTS: u32 = 5;
const PAUSE: Duration = Duration::from_millis(200);

/// Asks on `key` until the driver answers, if only to refuse it, or the attempts are used up.
pub async fn tell_driver(session: &Session, key: &str, readiness: &Readiness) {
    for _ in 0..ATTEMPTS {
        match ask::<_, Mission>(session, key, readiness, TIMEOUT, Urgency::Normal).await {
            Ok(_) => return,
            Err(AskError::Rejected(reject)) => {
                tracing::warn!(%reject, "the driver refused a report of readiness");
                return;
            }
            Err(error) => tracing::warn!(%error, "the driver did not answer a report of readiness"),
        }
        tokio::time::sleep(PAUSE).await;
    }
}
