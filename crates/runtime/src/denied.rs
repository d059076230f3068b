//! What a router's access rules have kept out, by the certificate that it came from.

use std::collections::BTreeMap;
use std::time::Duration;

use zenoh::{Session, Wait};

use crate::metrics::Metrics;

/// The session asks itself.
const TIMEOUT: Duration = Duration::from_secs(1);
/// What Zenoh calls the number of messages that came in and were dropped: in all, and by transport.
const COUNTS: [&str; 2] = [
    "zenoh_rx_network_message_dropped_payload_bytes_count{",
    "zenoh_rx_network_message_dropped_payload_per_transport_bytes_count{",
];
/// In the place of a certificate whose sessions have ended more than a minute ago.
const FORMER: &str = "former";

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
    let key = format!(
        "@/{}/router/metrics?compression=false;per_link=false;per_key=false;disconnected=true",
        session.zid()
    );
    let Ok(replies) = session.get(key).timeout(TIMEOUT).wait() else { return Denied::new() };
    let reply = replies.recv_timeout(TIMEOUT).ok().flatten();
    let sample = reply.and_then(|reply| reply.into_result().ok());
    let text = sample.map(|sample| String::from_utf8_lossy(&sample.payload().to_bytes()).into_owned());
    text.map_or_else(Denied::new, |text| parse(&text))
}

/// The counts in Zenoh's metrics.
fn parse(text: &str) -> Denied {
    let mut counts = Denied::new();
    let mut all = BTreeMap::<String, u64>::new();
    for line in text.lines().filter(|line| line.contains("reason=\"access-control\"")) {
        let Some((sample, count)) = line.rsplit_once(' ') else { continue };
        let count = count.parse::<f64>().unwrap_or_default() as u64;
        let label = |name: &str| sample.split_once(&format!("{name}=\""))?.1.split('"').next();
        let Some(message) = label("message") else { continue };
        if sample.starts_with(COUNTS[1]) {
            let who = label("remote_cn").unwrap_or_default().to_owned();
            *counts.entry((who, message.to_owned())).or_default() += count;
        } else if sample.starts_with(COUNTS[0]) {
            *all.entry(message.to_owned()).or_default() += count;
        }
    }
    for (message, all) in all {
        let known: u64 =
            counts.iter().filter(|((_, what), _)| *what == message).map(|(_, count)| count).sum();
        if all > known {
            counts.insert((FORMER.into(), message), all - known);
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_by_certificate_and_what_zenoh_has_forgotten_is_still_counted() {
        let of = |name: &str, labels: &str, count: u64| {
            format!("{name}local_whatami=\"router\",priority=\"data\",{labels}}} {count}\n")
        };
        let denied = "reason=\"access-control\"";
        let viewer = "remote_cn=\"viewer\"";
        let [all, each] = COUNTS;
        let text = [
            of(all, &format!("message=\"put\",{denied}"), 7),
            of(each, &format!("message=\"put\",{denied},{viewer},remote_zid=\"a\""), 3),
            of(each, &format!("message=\"put\",{denied},{viewer},remote_zid=\"b\""), 2),
            of(all, "message=\"put\",reason=\"congestion\"", 9),
            of(all, &format!("message=\"query\",{denied}"), 1),
            of(each, &format!("message=\"query\",{denied},remote_cn=\"cpc.a\""), 1),
        ];
        let counted = parse(&text.concat());
        let counted: Vec<(&str, &str, u64)> =
            counted.iter().map(|((who, what), count)| (who.as_str(), what.as_str(), *count)).collect();
        assert_eq!(counted, [("cpc.a", "query", 1), (FORMER, "put", 2), ("viewer", "put", 5)]);
    }
}
