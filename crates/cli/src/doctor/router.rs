//! The router: there, of which version, and how long a question takes across it.

use std::collections::BTreeSet;
use std::time::Duration;

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::latency::percentile_ms;
use curionav_runtime::{echo, session};
use curionav_schemas::ServiceStatus;
use zenoh::Session;

use super::finding::Finding;

const TIMEOUT: Duration = Duration::from_secs(1);
/// Sizes asked with: a question, and a batch of candidates, bytes.
const SIZES: [usize; 2] = [64, 100_000];
const QUESTIONS: usize = 15;
/// Routers announce their key when they open; a client hears of it a moment later.
const ATTEMPTS: usize = 20;
const PAUSE: Duration = Duration::from_millis(50);

pub(super) async fn examine(
    config: &ServiceConfig,
    session: &Session,
    statuses: &[ServiceStatus],
) -> anyhow::Result<Finding> {
    let link = format!("router {}", config.connect.join(", "));
    let Some([small, large]) = round_trips(config, session).await? else {
        let routers = session.info().routers_zid().await.count();
        return Ok(Finding::missing(
            link,
            format!("{routers} connected, but no question comes through between two sessions"),
            "look at the router's log, and at its access_control: queries and replies must pass",
        ));
    };
    let detail = format!(
        "{}; bare round trip between two sessions {small:.2} ms ({} B), {large:.2} ms ({} kB)",
        version(statuses),
        SIZES[0],
        SIZES[1] / 1000
    );
    let bytes = Some(SIZES.iter().map(|size| (size * QUESTIONS) as u64).sum());
    Ok(Finding { round_trip_ms: Some(small), bytes, ..Finding::proven(link, detail) })
}

/// Median round trip of each size, ms, from `session` to another of our own.
async fn round_trips(config: &ServiceConfig, session: &Session) -> anyhow::Result<Option<[f64; 2]>> {
    let other = session::client(config).await?;
    let name = other.zid().to_string();
    let echoing = echo::serve(&other, &name)?;
    let mut medians = Vec::new();
    for size in SIZES {
        let mut times = Vec::new();
        for _ in 0..ATTEMPTS + QUESTIONS {
            if times.len() == QUESTIONS {
                break;
            }
            match echo::round_trip(session, &name, (size, size), TIMEOUT).await {
                Ok(took) => times.push(took),
                Err(_) => tokio::time::sleep(PAUSE).await,
            }
        }
        if times.len() < QUESTIONS {
            break;
        }
        medians.push(percentile_ms(&mut times, 0.5));
    }
    drop(echoing);
    session::close(&other);
    Ok(medians.try_into().ok())
}

/// What the routers say of themselves.
fn version(statuses: &[ServiceStatus]) -> String {
    let versions: BTreeSet<&str> = statuses.iter().map(|s| s.version.as_str()).collect();
    let versions = versions.into_iter().collect::<Vec<_>>().join(" and ");
    match statuses {
        [] => "a Zenoh router that does not say its version".into(),
        [one] => format!("curionav {versions}, up {:.0} s", one.uptime_s),
        several => format!("{} routers linked, curionav {versions}", several.len()),
    }
}
