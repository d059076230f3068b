//! curionav: the handshakes that are under way, which no single address can fill up.

use std::{
    collections::HashMap,
    io,
    net::{IpAddr, Ipv6Addr, SocketAddr},
    time::{Duration, Instant},
};

use tokio::{
    net::{TcpListener, TcpStream},
    task::{AbortHandle, JoinSet},
    time::timeout,
};
use tokio_rustls::{server::TlsStream, TlsAcceptor};

/// Handshakes of one origin at a time. The programs of a host that connect at once wait for each other no longer than
/// this many handshakes take, some 0.2 s on one core.
const PER_ORIGIN_MAX: usize = 256;
/// So long a handshake is left alone. After that it gives way to a newer one of its origin. Ten times what a slow
/// client needs on a local network.
const UNDISTURBED: Duration = Duration::from_millis(500);
/// A client that has not shown its certificate by then is dropped, as Zenoh's `accept_timeout` does for what follows.
const LONGEST: Duration = Duration::from_secs(2);

type Stream = TlsStream<TcpStream>;

/// Why there is no new client.
pub(crate) enum Failure {
    /// The system gives no more connections.
    Listener(io::Error),
    /// One stranger did not come through.
    Handshake(io::Error),
}

struct Begun {
    at: Instant,
    task: AbortHandle,
}

/// A listener, and the connections that have yet to show a certificate.
pub(crate) struct Handshakes {
    listener: TcpListener,
    acceptor: TlsAcceptor,
    limit: Duration,
    under_way: JoinSet<(io::Result<Stream>, SocketAddr)>,
    by_origin: HashMap<IpAddr, Vec<Begun>>,
}

impl Handshakes {
    pub(crate) fn new(listener: TcpListener, acceptor: TlsAcceptor, limit: Duration) -> Self {
        Self {
            listener,
            acceptor,
            limit: limit.min(LONGEST),
            under_way: JoinSet::new(),
            by_origin: HashMap::new(),
        }
    }

    /// The next client, or why there is none. Cancel-safe.
    pub(crate) async fn next(&mut self) -> Result<(Stream, SocketAddr), Failure> {
        loop {
            tokio::select! {
                accepted = self.listener.accept() => {
                    let (stream, address) = accepted.map_err(Failure::Listener)?;
                    self.begin(stream, address);
                }
                Some(ended) = self.under_way.join_next() => {
                    // One that gave way to a newer one is known no more.
                    let Ok((result, address)) = ended else { continue };
                    self.forget_ended(origin(address));
                    return result.map(|stream| (stream, address)).map_err(Failure::Handshake);
                }
            }
        }
    }

    /// Begins one more; drops the connection if its origin has begun too many just now.
    fn begin(&mut self, stream: TcpStream, address: SocketAddr) {
        let begun = self.by_origin.entry(origin(address)).or_default();
        if begun.len() >= PER_ORIGIN_MAX {
            // The oldest is the first.
            if begun[0].at.elapsed() < UNDISTURBED {
                tracing::debug!("{address}: too many handshakes at a time");
                return;
            }
            begun.remove(0).task.abort();
        }
        let handshake = timeout(self.limit, self.acceptor.accept(stream));
        let task = self.under_way.spawn(async move {
            let result = handshake.await.unwrap_or_else(|late| Err(late.into()));
            (result, address)
        });
        begun.push(Begun { at: Instant::now(), task });
    }

    fn forget_ended(&mut self, origin: IpAddr) {
        let Some(begun) = self.by_origin.get_mut(&origin) else { return };
        begun.retain(|one| !one.task.is_finished());
        if begun.is_empty() {
            self.by_origin.remove(&origin);
        }
    }
}

/// An address; of version 6 its network of 64 bits, all of which one host may have.
fn origin(address: SocketAddr) -> IpAddr {
    /// Of eight segments.
    const OF_NETWORK: usize = 4;
    match address.ip().to_canonical() {
        IpAddr::V6(address) => {
            let mut segments = address.segments();
            segments[OF_NETWORK..].fill(0);
            Ipv6Addr::from(segments).into()
        }
        address => address,
    }
}
