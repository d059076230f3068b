//! What a service says about itself: alive, with a status, and with metrics where they are asked for.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use curionav_schemas::limits::MAX_LIST;
use curionav_schemas::{Prepared, ServiceStatus, keys};
use zenoh::liveliness::LivelinessToken;
use zenoh::{Session, Wait};

use crate::config::ServiceConfig;
use crate::membership::announce;
use crate::metrics::Metrics;
use crate::metrics_endpoint::MetricsEndpoint;
use crate::serve::{ServeCounts, ServeError, Server, serve_state};

/// Alive and with a status for as long as it is held.
pub struct Announced {
    // The token goes first, so that a service that no longer answers is not asked.
    _token: LivelinessToken,
    _status: Server,
    endpoint: Option<MetricsEndpoint>,
}

impl Announced {
    /// Where the metrics are, if anywhere.
    pub fn metrics_address(&self) -> Option<SocketAddr> {
        self.endpoint.as_ref().map(|endpoint| endpoint.address)
    }
}

/// Serves status and metrics of a service and declares it alive. Call it once everything else is declared.
/// `sessions` are all it has, by name; the first is the one it answers on.
pub fn announce_service(
    config: &ServiceConfig,
    sessions: &[(&'static str, &Session)],
    mut metrics: Metrics,
    counts: Arc<ServeCounts>,
    prepared: impl Fn() -> Vec<Prepared> + Send + Sync + 'static,
) -> anyhow::Result<Announced> {
    let Some((_, session)) = sessions.first() else { anyhow::bail!("a service without a session") };
    counts.register(&mut metrics);
    let links: Vec<(&'static str, Session)> =
        sessions.iter().map(|(name, s)| (*name, (*s).clone())).collect();
    metrics.gauges("router_links", "Routers each session is connected to", "session", move || {
        let routers = |session: &Session| session.info().routers_zid().wait().count() as f64;
        links.iter().map(|(name, session)| ((*name).to_owned(), routers(session))).collect()
    });
    let metrics = Arc::new(metrics);
    let start = |address| MetricsEndpoint::start(address, Arc::clone(&metrics), session);
    let endpoint = config.metrics.map(start).transpose()?;
    let status = serve_status(session, Arc::clone(&metrics), counts, prepared)?;
    let token = announce(session, &metrics.role, &metrics.instance)?;
    Ok(Announced { _token: token, _status: status, endpoint })
}

/// Serves the counts of one server, and what it is prepared for, under `status/{role}/{instance}`.
pub fn serve_status(
    session: &Session,
    metrics: Arc<Metrics>,
    counts: Arc<ServeCounts>,
    prepared: impl Fn() -> Vec<Prepared> + Send + Sync + 'static,
) -> Result<Server, ServeError> {
    let key = keys::status(&metrics.role, &metrics.instance).map_err(|e| ServeError::new("status", e))?;
    serve_state(session, &key, &counts.refused.clone(), move || {
        let latency = counts.latency();
        Ok(ServiceStatus {
            role: metrics.role.clone(),
            instance: metrics.instance.clone(),
            robot: metrics.robot.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            uptime_s: metrics.uptime().as_secs_f64(),
            time_s: SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64(),
            load: counts.load(),
            requests: counts.answered.get(),
            rejected: counts.refused.total(),
            p50_ms: latency.percentile_ms(0.50),
            p99_ms: latency.percentile_ms(0.99),
            prepared: prepared().into_iter().take(MAX_LIST).collect(),
            metrics: metrics.samples(),
        })
    })
}
