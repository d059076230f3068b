//! Strangers at a router: sockets that say nothing, and handshakes that fail, keep no client out.

use std::io::Write;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{Duration, Instant};

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::session;

use super::program::{Serving, turn, two_workers};
use crate::certificates::issued;

/// Sockets that are opened and say nothing.
const IDLE: usize = 2000;
/// Between two handshakes that fail: fifty per second.
const BETWEEN: Duration = Duration::from_millis(20);
/// Clients that connect, one after the other.
const CLIENTS: usize = 5;
/// A client has no more time: it should need a tenth of it, on a machine that has nothing else to do.
const LIMIT: Duration = Duration::from_secs(10);

/// Strangers are gone so long after the last client: two seconds, and what a busy machine needs.
const GONE: Duration = Duration::from_secs(8);
/// Sockets that a router has open for itself, and for a client that has just left.
const OF_ROUTER: usize = 24;
/// Handshakes that one address may have under way (`third-party/zenoh-link-tls/src/handshakes.rs`).
const SHARE: usize = 256;

fn address(endpoint: &str) -> String {
    endpoint.split_once('/').unwrap().1.to_owned()
}

/// Strangers that begin handshakes and send something else, until they are told to stop.
struct Garbage {
    stop: Arc<AtomicBool>,
    sent: Arc<AtomicU32>,
    sending: Option<std::thread::JoinHandle<()>>,
}

impl Garbage {
    fn start(address: String) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let sent = Arc::new(AtomicU32::new(0));
        let stopped = Arc::clone(&stop);
        let counted = Arc::clone(&sent);
        let sending = std::thread::spawn(move || {
            while !stopped.load(Ordering::Relaxed) {
                if let Ok(mut socket) = TcpStream::connect(&address) {
                    counted.fetch_add(
                        u32::from(socket.write_all(b"GET / HTTP/1.1\r\n\r\n").is_ok()),
                        Ordering::Relaxed,
                    );
                }
                std::thread::sleep(BETWEEN);
            }
        });
        Self { stop, sent, sending: Some(sending) }
    }
}

impl Drop for Garbage {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.sending.take().unwrap().join().unwrap();
    }
}

/// How long the slowest of some clients needs to connect while strangers are at the router, a process with this id.
fn slowest_client(config: &ServiceConfig, router: u32) -> Duration {
    let endpoint = address(&config.connect[0]);
    let garbage = Garbage::start(endpoint.clone());
    let idle: Vec<TcpStream> = (0..IDLE).map(|_| TcpStream::connect(&endpoint).unwrap()).collect();
    let runtime = two_workers();
    let mut slowest = Duration::ZERO;
    for _ in 0..CLIENTS {
        std::thread::sleep(Duration::from_millis(300));
        let begun = Instant::now();
        let connected = runtime.block_on(session::client(config)).expect("it connects");
        slowest = slowest.max(begun.elapsed());
        session::close(&connected);
    }
    println!(
        "{} handshakes that failed, {} idle sockets: {slowest:.2?}",
        garbage.sent.load(Ordering::Relaxed),
        idle.len()
    );
    // Open, but not through with who they are: the router lets go of them.
    drop(garbage);
    let held = || sockets(router);
    let before_long = Instant::now() + GONE;
    while held() > OF_ROUTER && Instant::now() < before_long {
        std::thread::sleep(Duration::from_millis(50));
    }
    println!(
        "{} sockets held {:.1?} after the last client",
        held(),
        GONE.saturating_sub(before_long - Instant::now())
    );
    assert!(held() <= OF_ROUTER, "{} sockets are still held", held());
    drop(idle);
    slowest
}

/// Sockets that a process has open.
fn sockets(pid: u32) -> usize {
    let open = std::fs::read_dir(format!("/proc/{pid}/fd")).unwrap();
    let is_socket = |entry: &std::io::Result<std::fs::DirEntry>| {
        // One may be closed while they are listed.
        let to = entry.as_ref().ok().and_then(|entry| std::fs::read_link(entry.path()).ok());
        to.is_some_and(|to| to.to_string_lossy().starts_with("socket:"))
    };
    open.filter(is_socket).count()
}

#[test]
fn one_address_has_no_more_than_its_share_of_handshakes_with_a_secured_router() {
    let _turn = turn();
    let folder = issued(["router"].iter().map(|name| name.parse().unwrap()), &[]);
    let path = folder.path().to_str().unwrap();
    let router = Serving::start(&["router", "--listen", "tls/127.0.0.1:0", "--secure", path]);
    let endpoint = address(router.endpoint());
    let begun = Instant::now();
    let idle: Vec<TcpStream> = (0..IDLE).map(|_| TcpStream::connect(&endpoint).unwrap()).collect();
    let mut most = 0;
    while begun.elapsed() < Duration::from_secs(1) {
        std::thread::sleep(Duration::from_millis(100));
        most = most.max(sockets(router.pid()));
    }
    println!("{most} sockets held for {} strangers of one address", idle.len());
    assert!(most < SHARE + OF_ROUTER, "{most}");
}

#[test]
fn strangers_keep_no_client_from_a_router_without_tls() {
    let _turn = turn();
    let router = Serving::start(&["router", "--listen", "tcp/127.0.0.1:0"]);
    let connect = vec![router.endpoint().to_owned()];
    let slowest = slowest_client(&ServiceConfig { connect, ..ServiceConfig::default() }, router.pid());
    assert!(slowest < LIMIT, "{slowest:?}");
}

#[test]
fn strangers_without_a_certificate_keep_no_client_from_a_secured_router() {
    let _turn = turn();
    let folder = issued(["router", "viewer"].iter().map(|name| name.parse().unwrap()), &[]);
    let path = folder.path().to_str().unwrap();
    let router = Serving::start(&["router", "--listen", "tls/127.0.0.1:0", "--secure", path]);
    let config = ServiceConfig {
        connect: vec![router.endpoint().to_owned()],
        secure: Some(folder.path().to_owned()),
        certificates: vec!["viewer".parse().unwrap()],
        ..ServiceConfig::default()
    };
    let slowest = slowest_client(&config, router.pid());
    assert!(slowest < LIMIT, "{slowest:?}");
}
