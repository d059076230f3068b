//! A process says to its supervisor that it still works.
//!
//! The supervisor asks with a byte through standard input. The process then asks its own status, as anyone on the
//! network would, but within its own session, and prints a line once that is answered. So what is shown to work is the
//! runtime, the task that runs the service, the session, and a thread that answers; routers and other processes have no
//! part in it.

use std::io::Write;
use std::time::Duration;

use tokio::sync::mpsc;
use zenoh::query::QueryTarget;
use zenoh::sample::Locality;
use zenoh::{Session, Wait};

use crate::shutdown::Questions;

/// The line that is printed.
pub const ALIVE: &str = "alive";
/// How long the own status is waited for before it is asked again.
const PATIENCE: Duration = Duration::from_secs(1);
/// Between two attempts.
const PAUSE: Duration = Duration::from_millis(100);

/// Answers the supervisor while `key` is answered here. It does not complete.
pub async fn beat(session: &Session, key: &str, mut questions: Questions) {
    loop {
        questions.asked().await;
        while !is_answered(session, key).await {
            tokio::time::sleep(PAUSE).await;
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
