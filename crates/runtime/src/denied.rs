//! What a router's access rules have kept out, by the certificate that it came from.

use std::collections::BTreeMap;
use std::time::Duration;

use zenoh::{Session, Wait};

use crate::metrics::Metrics;

/// The session asks itself.
const TIMEOUT: Duration = Duration::from_secs(1);
/// What Zenoh calls the count of messages that came in and were dropped.
const COUNT: &str = "rx_network_message_dropped_payload_bytes_count";

/// Counts by name of a certificate and kind of message. Zenoh forgets the name a minute after the last session with it
/// has ended.
pub type Denied = BTreeMap<(String, String), u64>;

/// Adds the counts to what a router says of itself. They are there only behind access rules.
pub fn register(metrics: &mut Metrics, session: &Session) {
    let session = session.clone();
    let help = "Messages that the access rules have denied, by certificate and kind";
    metrics.gauges_by("denied", help, &["certificate", "message"], move || {
        counts(&session).into_iter().map(|((who, what), count)| (vec![who, what], count as f64)).collect()
    });
}

/// What has been denied until now. Blocks: the session asks its own admin space.
pub fn counts(session: &Session) -> Denied {
    let key = format!("@/{}/router/metrics?compression=false;per_link=false;per_key=false;disconnected=true", session.zid());
    let Ok(replies) = session.get(key).timeout(TIMEOUT).wait() else { return Denied::new() };
    let reply = replies.recv_timeout(TIMEOUT).ok().flatten();
    let sample = reply.and_then(|reply| reply.into_result().ok());
    sample.map_or_else(Denied::new, |sample| {
        let text = String::from_utf8_lossy(&sample.payload().to_bytes()).into_owned();
        eprintln!("{text}");
        parse(&text)
    })
}

fn parse(_text: &str) -> Denied {
    Denied::new()
}
