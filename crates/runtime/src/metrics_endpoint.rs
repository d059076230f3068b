//! A service's metrics over HTTP, for Prometheus and for probes: `/metrics`, `/livez`, `/readyz`.

use std::convert::Infallible;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::time::Duration;

use anyhow::anyhow;
use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::header::CONTENT_TYPE;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::TokioIo;
use tokio::sync::Semaphore;
use tokio::task::JoinSet;
use zenoh::Session;

use crate::heartbeat;
use crate::metrics::Metrics;

/// What Prometheus takes for OpenMetrics.
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
/// Connections at a time: Prometheus holds one, a probe another, and strangers keep neither out.
const CONNECTIONS_MAX: usize = 256;
/// One question and its answer. A client that takes longer is cut off.
const CONNECTION_TIMEOUT: Duration = Duration::from_secs(2);

/// A socket that listens on `address`.
///
/// # Errors
/// The address is in use or not one of this machine.
pub fn listen(address: SocketAddr) -> anyhow::Result<TcpListener> {
    let mend = "choose another address or port, or end what uses it";
    TcpListener::bind(address).map_err(|e| anyhow!("metrics: cannot listen on {address}: {e}; {mend}"))
}

/// Serves until it is dropped.
#[derive(Debug)]
pub struct MetricsEndpoint {
    /// Where it listens, with the real port.
    pub address: SocketAddr,
    _serving: JoinSet<()>,
}

impl MetricsEndpoint {
    /// Serves `metrics` on `address`; port 0 takes a free one. A process is ready while there is a router behind
    /// `session`. Call inside a Tokio runtime.
    pub fn start(address: SocketAddr, metrics: Arc<Metrics>, session: &Session) -> anyhow::Result<Self> {
        let listener = listen(address)?;
        listener.set_nonblocking(true)?;
        let listener = tokio::net::TcpListener::from_std(listener)?;
        let address = listener.local_addr()?;
        let mut serving = JoinSet::new();
        serving.spawn(accept(listener, metrics, session.clone()));
        tracing::info!(%address, "metrics");
        Ok(Self { address, _serving: serving })
    }
}

async fn accept(listener: tokio::net::TcpListener, metrics: Arc<Metrics>, session: Session) {
    let room = Arc::new(Semaphore::new(CONNECTIONS_MAX));
    loop {
        let Ok(permit) = Arc::clone(&room).acquire_owned().await else { return };
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            Err(error) => {
                // Too many open files, for one: trying again at once would be a busy loop.
                tracing::debug!(%error, "no connection accepted");
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        let metrics = Arc::clone(&metrics);
        let session = session.clone();
        tokio::spawn(async move {
            let answering = service_fn(|request| answer(request, Arc::clone(&metrics), session.clone()));
            let serving = hyper::server::conn::http1::Builder::new()
                .keep_alive(false)
                .serve_connection(TokioIo::new(stream), answering);
            if let Ok(Err(error)) = tokio::time::timeout(CONNECTION_TIMEOUT, serving).await {
                tracing::debug!(%error, "metrics not sent");
            }
            drop(permit);
        });
    }
}

async fn answer(
    request: Request<Incoming>,
    metrics: Arc<Metrics>,
    session: Session,
) -> Result<Response<Full<Bytes>>, Infallible> {
    let reads = matches!(*request.method(), Method::GET | Method::HEAD);
    let (status, body) = match request.uri().path() {
        _ if !reads => (StatusCode::METHOD_NOT_ALLOWED, "only GET and HEAD\n".into()),
        "/metrics" => (StatusCode::OK, metrics.text()),
        "/livez" if heartbeat::works() => (StatusCode::OK, "alive\n".into()),
        "/livez" => (StatusCode::SERVICE_UNAVAILABLE, "it hangs\n".into()),
        "/readyz" => match session.info().routers_zid().await.next() {
            Some(_) => (StatusCode::OK, "ready\n".into()),
            None => (StatusCode::SERVICE_UNAVAILABLE, "no router\n".into()),
        },
        _ => (StatusCode::NOT_FOUND, "there are /metrics, /livez and /readyz\n".into()),
    };
    let is_metrics = reads && request.uri().path() == "/metrics";
    let kind = if is_metrics { OPEN_METRICS } else { "text/plain; charset=utf-8" };
    let mut response = Response::new(Full::new(Bytes::from(body)));
    *response.status_mut() = status;
    response.headers_mut().insert(CONTENT_TYPE, hyper::header::HeaderValue::from_static(kind));
    Ok(response)
}
