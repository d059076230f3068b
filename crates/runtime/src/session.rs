//! Opening Zenoh sessions: in process, as a client of routers, or as a router.

use std::fs::{Permissions, set_permissions};
use std::net::{TcpListener, ToSocketAddrs};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use curionav_security::name::Name;
use zenoh::{Config, Session, Wait};

use crate::config::ServiceConfig;
use crate::endpoint::{AddressError, LINKS, Purpose, check_endpoint};
use crate::secure;
use crate::session_error::{IS_IT_RUNNING, set, without_places};

pub use crate::session_error::SessionError;

/// What every node shares (`docs/running.md` says why): no scouting, a lease of one second, blocked sends that give up
/// after half a second, room for 16 shards in the queue of a link, room for 4096 connections that have yet to say who
/// they are, for two seconds each, no message longer than a map of the most cells, no shared memory, short queries.
const COMMON: &str = r#"{
  scouting: { multicast: { enabled: false }, gossip: { enabled: false } },
  queries_default_timeout: 1000,
  adminspace: { enabled: false },
  transport: {
    unicast: { open_timeout: 1000, accept_timeout: 2000, accept_pending: 4096 },
    link: { tx: { lease: 1000, keep_alive: 4, queue: {
      size: { real_time: 8, interactive_low: 16 },
      congestion_control: {
        block: { wait_before_close: 500000 },
        drop: { wait_before_drop: 1000, max_wait_before_drop_fragments: 200000 } } } },
      rx: { max_message_size: 67174400 } },
    shared_memory: { enabled: false } } }"#;

/// How often a lost router is looked for.
const CONNECT_RETRY: &str = "{ period_init_ms: 100, period_max_ms: 400, period_increase_factor: 2 }";

/// Endpoints as json5.
fn list(endpoints: &[String]) -> String {
    let quoted: Vec<String> = endpoints.iter().map(|e| format!("{e:?}")).collect();
    format!("[{}]", quoted.join(","))
}

/// For how long the other side waits for a sign of life, on a network of ROS 2.
const ELSEWHERE_LEASE_MS: u32 = 60_000;
/// Between two attempts to reach a router for the first time.
const RETRY: Duration = Duration::from_millis(200);

/// What every node shares unless it is given a file: to write such a file by, or to check one.
pub fn built_in() -> Result<Config, SessionError> {
    common(None, None)
}

fn common(file: Option<&Path>, namespace: Option<&str>) -> Result<Config, SessionError> {
    let mut config = match file {
        Some(path) => {
            Config::from_file(path).map_err(|e| SessionError::config(format!("{}: {e}", path.display())))?
        }
        None => Config::from_json5(COMMON).map_err(SessionError::config)?,
    };
    if let Some(namespace) = namespace {
        set(&mut config, &[("namespace", &format!("{namespace:?}"))])?;
    }
    Ok(config)
}

/// The strings with a slash in a setting: endpoints, which may be a list, or a list per mode.
fn endpoints(config: &Config, key: &str) -> Result<Vec<String>, SessionError> {
    let json = config.get_json(key).map_err(|e| SessionError::config(format!("{key}: {e}")))?;
    Ok(json.split('"').filter(|text| text.contains('/')).map(str::to_owned).collect())
}

/// The protocol of an endpoint.
fn protocol(endpoint: &str) -> &str {
    endpoint.split('/').next().unwrap_or_default()
}

/// Zenoh would look for a router for ever over a protocol that it does not have, and over one that the configuration
/// does not allow.
fn check_protocols(config: &Config, keys: &[&str]) -> Result<(), SessionError> {
    let allowed = config.get_json("transport/link/protocols").map_err(SessionError::config)?;
    let is_allowed = |link: &str| allowed == "null" || allowed.contains(&format!("{link:?}"));
    let links: Vec<&str> = LINKS.iter().copied().filter(|link| is_allowed(link)).collect();
    for key in keys {
        for endpoint in endpoints(config, key)? {
            if links.contains(&protocol(&endpoint)) {
                continue;
            }
            let whose = if allowed == "null" { "this program has" } else { "this configuration allows" };
            return Err(SessionError::Input(format!(
                "{key}: {endpoint}: {whose} links over {} alone",
                links.join(", ")
            )));
        }
    }
    Ok(())
}

/// What is given beside a file must not be less safe than the file.
fn check_as_safe(file: &Path, of_file: &[String], given: &[String]) -> Result<(), SessionError> {
    let is_plain = |endpoint: &&String| protocol(endpoint) != "tls";
    match given.iter().find(is_plain) {
        Some(plain) if !of_file.is_empty() && !of_file.iter().any(|endpoint| is_plain(&endpoint)) => {
            Err(SessionError::Input(format!(
                "connect: {plain}: {} connects over tls alone; give a tls/ endpoint, or none",
                file.display()
            )))
        }
        _ => Ok(()),
    }
}

/// One session without any network: all services of one process share it.
pub async fn embedded() -> Result<Session, SessionError> {
    let mut config = common(None, None)?;
    set(&mut config, &[("mode", r#""peer""#), ("listen/endpoints", "[]"), ("connect/endpoints", "[]")])?;
    let failed = |e: zenoh::Error| without_places(&format!("cannot open a Zenoh session: {e}"));
    zenoh::open(config).await.map_err(|e| SessionError::Other(failed(e)))
}

/// A client of the first router that answers, found again by itself after a loss. `service` must have been checked.
pub async fn client(service: &ServiceConfig) -> Result<Session, SessionError> {
    let from_environment = std::env::var_os(Config::DEFAULT_CONFIG_PATH_ENV).map(PathBuf::from);
    client_by(service, service.zenoh_config.clone().or(from_environment), None).await
}

/// The same, of a network that is not curionav's: what the environment says of that does not count here. Its nodes wait
/// for each other as `rmw_zenoh_cpp` does, 60 s: a link that stalls for a few seconds ends no question that is open.
pub async fn client_elsewhere(service: &ServiceConfig) -> Result<Session, SessionError> {
    client_by(service, service.zenoh_config.clone(), Some(ELSEWHERE_LEASE_MS)).await
}

/// A session opened by `open`, tried again for as long as there is no router, which `missing` is told each time.
pub async fn awaited<F: Future<Output = Result<Session, SessionError>>>(
    open: impl Fn() -> F,
    missing: impl Fn(&SessionError),
) -> Result<Session, SessionError> {
    loop {
        match open().await {
            Err(error @ SessionError::NoRouter { .. }) => missing(&error),
            opened => return opened,
        }
    }
}

async fn client_by(
    service: &ServiceConfig,
    file: Option<PathBuf>,
    lease_ms: Option<u32>,
) -> Result<Session, SessionError> {
    check_endpoints(&service.connect, Purpose::Connect)?;
    let mut config = common(file.as_deref(), service.namespace.as_deref())?;
    if let Some(lease_ms) = lease_ms.filter(|_| file.is_none()) {
        set(&mut config, &[("transport/link/tx/lease", &lease_ms.to_string())])?;
    }
    if let Some(folder) = &service.secure {
        secure::client(&mut config, folder, &service.certificates)?;
    }
    if file.is_none() || !service.connect.is_empty() {
        if let Some(file) = &file {
            check_as_safe(file, &endpoints(&config, "connect/endpoints")?, &service.connect)?;
        }
        set(&mut config, &[("mode", r#""client""#), ("connect/endpoints", &list(&service.connect))])?;
    }
    check_protocols(&config, &["connect/endpoints"])?;
    let timeout = Duration::from_secs_f64(service.connect_timeout_s);
    // Zenoh spends whatever time it has on the first endpoint before it turns to the next: it gets none, tries
    // each once, and the waiting is done here.
    let once =
        [("connect/timeout_ms", "0"), ("connect/exit_on_failure", "true"), ("connect/retry", CONNECT_RETRY)];
    set(&mut config, &once)?;
    let named = (!service.connect.is_empty()).then(|| service.connect.join(", "));
    let endpoints = named.unwrap_or_else(|| "the configured endpoints".into());
    let deadline = tokio::time::Instant::now() + timeout;
    let session = loop {
        match tokio::time::timeout_at(deadline, zenoh::open(config.clone())).await {
            Ok(Ok(session)) => break session,
            Ok(Err(error)) => {
                tracing::debug!(%error, "opening failed");
                if let Some(reason) = distrust(service).await {
                    return Err(SessionError::Distrust { endpoints, reason });
                }
            }
            Err(_) => return Err(no_router(service, endpoints).await),
        }
        if tokio::time::Instant::now() + RETRY >= deadline {
            return Err(no_router(service, endpoints).await);
        }
        tokio::time::sleep(RETRY).await;
    };
    // `open` can succeed without a router behind it (a refused certificate is only a warning).
    while session.info().routers_zid().await.next().is_none() {
        if tokio::time::Instant::now() >= deadline {
            let _ = session.close().await;
            return Err(no_router(service, endpoints).await);
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    Ok(session)
}

/// Why one of the routers is not trusted, or does not trust this program; nothing if none is there.
async fn distrust(service: &ServiceConfig) -> Option<String> {
    let folder = service.secure.clone()?;
    let endpoints = service.connect.clone();
    let names = service.certificates.clone();
    let asking = move || endpoints.iter().find_map(|endpoint| secure::distrust(endpoint, &folder, &names));
    tokio::task::spawn_blocking(asking).await.ok().flatten()
}

fn check_endpoints(endpoints: &[String], purpose: Purpose) -> Result<(), AddressError> {
    endpoints.iter().try_for_each(|endpoint| check_endpoint(endpoint, purpose))
}

/// No router has answered in time, and why, as far as can be found out.
async fn no_router(service: &ServiceConfig, endpoints: String) -> SessionError {
    let tried = service.connect.clone();
    let asking = move || tried.iter().find_map(|endpoint| silent_because(endpoint));
    let found = tokio::task::spawn_blocking(asking).await.ok().flatten();
    let hint = found.unwrap_or_else(|| IS_IT_RUNNING.into());
    SessionError::NoRouter { endpoints, seconds: service.connect_timeout_s, hint }
}

/// Why Zenoh finds no router at `endpoint`, if that can be told. Blocks for a second at most, and for as long as a name
/// is looked up.
fn silent_because(endpoint: &str) -> Option<String> {
    let (protocol, rest) = endpoint.split_once('/')?;
    let address = rest.split(['?', '#']).next()?;
    if protocol == "unixsock-stream" {
        return None;
    }
    if address.to_socket_addrs().is_err() {
        let host = address.rsplit_once(':').map_or(address, |(host, _)| host);
        return Some(format!("the host `{host}` is not known here; give another name, or its address"));
    }
    let is_secure = protocol == "tcp" && secure::speaks_tls(address);
    is_secure.then(|| {
        format!(
            "what listens there speaks TLS; give tls/{address}, and the folder of certificates (--secure)"
        )
    })
}

/// How a router is set up.
#[derive(Debug, Clone, Copy, Default)]
pub struct RouterSettings<'a> {
    /// Where it listens: `tcp/host:port`, `tls/host:port` or `unixsock-stream/path`; port 0 takes a free one.
    pub listen: &'a [String],
    /// The routers it links with, whenever they are there.
    pub connect: &'a [String],
    /// A Zenoh configuration file, instead of both.
    pub file: Option<&'a Path>,
    /// The folder of its certificate and of the access rules, and its name.
    pub secure: Option<(&'a Path, &'a Name)>,
}

/// A router.
pub async fn router(settings: RouterSettings<'_>) -> Result<Session, SessionError> {
    let RouterSettings { listen, connect: others, file, secure } = settings;
    check_endpoints(listen, Purpose::Listen)?;
    check_endpoints(others, Purpose::Connect)?;
    let all = listen.join(", ");
    let mut config = common(file, None)?;
    set(&mut config, &[("mode", r#""router""#)])?;
    if let Some((folder, name)) = secure {
        secure::router(&mut config, folder, name)?;
    }
    if file.is_none() {
        let own = list(listen);
        let others = list(others);
        let settings = [
            ("listen/endpoints", own.as_str()),
            ("listen/exit_on_failure", "true"),
            ("connect/endpoints", &others),
            ("connect/timeout_ms", "-1"),
            ("connect/exit_on_failure", "false"),
            ("connect/retry", CONNECT_RETRY),
        ];
        set(&mut config, &settings)?;
        // Zenoh only warns when a port is taken; ask the system first.
        for endpoint in listen {
            let Some(address) = endpoint.strip_prefix("tcp/").or_else(|| endpoint.strip_prefix("tls/"))
            else {
                continue;
            };
            let mend = "choose another port or end what uses it";
            TcpListener::bind(address).map_err(|e| SessionError::listen(endpoint, format!("{e}; {mend}")))?;
        }
    }
    check_protocols(&config, &["connect/endpoints", "listen/endpoints"])?;
    let router = zenoh::open(config).await.map_err(|e| SessionError::listen(&all, e))?;
    for socket in listen.iter().filter_map(|endpoint| endpoint.strip_prefix("unixsock-stream/")) {
        // Who may open the socket may do what is allowed through it.
        let owner_alone = Permissions::from_mode(0o600);
        set_permissions(socket, owner_alone).map_err(|e| SessionError::listen(socket, e))?;
    }
    Ok(router)
}

/// Where a router really listens, e.g. `tcp/127.0.0.1:40123`.
pub async fn locators(session: &Session) -> Vec<String> {
    session.info().locators().await.into_iter().map(|l| l.to_string()).collect()
}

/// Closes a session, whatever state it is in.
pub fn close(session: &Session) {
    if let Err(error) = session.close().wait() {
        tracing::debug!(%error, "closing the session");
    }
}
