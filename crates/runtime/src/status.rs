//! What a service says about itself on its status key.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use curionav_schemas::limits::MAX_LIST;
use curionav_schemas::{ServiceStatus, keys};
use zenoh::Session;

use crate::serve::{ServeCounts, ServeError, Server, serve_state};

/// Serves the counts of one server, and what it is prepared for, under `status/{role}/{instance}`.
pub fn serve_status(
    session: &Session,
    role: &str,
    instance: &str,
    counts: Arc<ServeCounts>,
    warmed: impl Fn() -> Vec<String> + Send + Sync + 'static,
) -> Result<Server, ServeError> {
    let key = keys::status(role, instance)
        .map_err(|e| ServeError { key: format!("status of {role}"), reason: e.to_string() })?;
    let (role, instance, started) = (role.to_owned(), instance.to_owned(), Instant::now());
    serve_state(session, &key, move || {
        let latency = counts.latency();
        Ok(ServiceStatus {
            role: role.clone(),
            instance: instance.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            uptime_s: started.elapsed().as_secs_f64(),
            load: counts.in_flight.load(Ordering::Relaxed) as f64,
            requests: counts.answered.load(Ordering::Relaxed),
            rejected: counts.refused.load(Ordering::Relaxed),
            p50_ms: latency.percentile_ms(0.50),
            p99_ms: latency.percentile_ms(0.99),
            warmed: warmed().into_iter().take(MAX_LIST).collect(),
        })
    })
}
