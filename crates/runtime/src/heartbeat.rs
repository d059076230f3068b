//! A process says to its supervisor that it still works.
//!
//! The process asks its own status every second, as anyone on the network would, but within its own session. So what is
//! shown to work is the runtime, the task that runs the service, the session, and a thread that answers; routers and
//! other processes have no part in it. `/livez` and a service manager (`sd_notify(3)`) learn of it at once; `curionav
//! up` asks with a byte through standard input, and a line is printed.

use std::io::Write;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use tokio::sync::mpsc;
use zenoh::query::QueryTarget;
use zenoh::sample::Locality;
use zenoh::{Session, Wait};

use crate::locked::locked;
use crate::shutdown::Questions;

/// The line that is printed.
pub const ALIVE: &str = "alive";
/// How long the own status is waited for before it is asked again.
const PATIENCE: Duration = Duration::from_secs(1);
/// Between two signs of life without a question.
const PERIOD: Duration = Duration::from_secs(1);
/// A process without a sign of life for so long hangs.
const HANGS: Duration = Duration::from_secs(10);
/// Between two attempts.
const PAUSE: Duration = Duration::from_millis(100);

/// When this process has shown last that it works; nothing in one that does not show it.
static SHOWN: Mutex<Option<Instant>> = Mutex::new(None);

/// Whether this process works, as far as it shows that at all.
pub fn works() -> bool {
    locked(&SHOWN).is_none_or(|shown| shown.elapsed() < HANGS)
}

/// Tells the service manager that has started this process, if it wants to know: `READY=1`, `WATCHDOG=1`.
pub fn notify(state: &str) {
    let Some(socket) = std::env::var_os("NOTIFY_SOCKET") else { return };
    let told = UnixDatagram::unbound().and_then(|from| match socket.as_encoded_bytes().split_first() {
        Some((b'@', name)) => from.send_to_addr(state.as_bytes(), &SocketAddr::from_abstract_name(name)?),
        _ => from.send_to(state.as_bytes(), &socket),
    });
    if let Err(error) = told {
        tracing::debug!(%error, state, "the service manager is not told");
    }
}

/// Shows that this process works, and answers the supervisor, while `key` is answered here. It does not complete.
pub async fn beat(session: &Session, key: &str, mut questions: Questions) {
    loop {
        let is_asked = tokio::time::timeout(PERIOD, questions.asked()).await.is_ok();
        while !is_answered(session, key).await {
            tokio::time::sleep(PAUSE).await;
        }
        *locked(&SHOWN) = Some(Instant::now());
        notify("WATCHDOG=1");
        if !is_asked {
            continue;
        }
        let mut out = std::io::stdout().lock();
        if let Err(error) = writeln!(out, "{ALIVE}").and_then(|()| out.flush()) {
            tracing::debug!(%error, "the supervisor does not listen");
        }
    }
}

async fn is_answered(session: &Session, key: &str) -> bool {
    let (sender, mut answers) = mpsc::channel(1);
    let asked = session
        .get(key.to_owned())
        .target(QueryTarget::BestMatching)
        .allowed_destination(Locality::SessionLocal)
        .timeout(PATIENCE)
        .callback(move |reply| {
            if reply.result().is_ok() {
                // A second answer says nothing more.
                let _ = sender.try_send(());
            }
        })
        .wait();
    match asked {
        Ok(()) => matches!(tokio::time::timeout(PATIENCE, answers.recv()).await, Ok(Some(()))),
        Err(error) => {
            tracing::debug!(key, %error, "cannot ask the own status");
            false
        }
    }
}
