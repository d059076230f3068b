//! Clean ends: one token, fired by a signal, a supervisor or a test, that all parts of a process look at.

use std::sync::Arc;
use std::time::Duration;

use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;

/// Holds the right to end what listens to the [`Shutdown`] it came with. Dropping it ends it too.
#[derive(Debug)]
pub struct ShutdownTrigger(watch::Sender<bool>);

/// A cloneable view of whether to end.
#[derive(Debug, Clone)]
pub struct Shutdown(watch::Receiver<bool>);

/// A trigger and the token it fires.
pub fn shutdown() -> (ShutdownTrigger, Shutdown) {
    let (sender, receiver) = watch::channel(false);
    (ShutdownTrigger(sender), Shutdown(receiver))
}

impl ShutdownTrigger {
    /// Asks every holder of the token to end.
    pub fn fire(&self) {
        self.0.send_replace(true);
    }
}

impl Shutdown {
    /// Completes once the end is asked for, or the trigger is gone.
    pub async fn requested(&mut self) {
        // An error means the trigger was dropped: also an end.
        let _ = self.0.wait_for(|end| *end).await;
    }
}

/// How long a process may take to end by itself once it has been asked to. Then it ends as it is, within the two
/// seconds that a service manager or an impatient person waits.
const GRACE: Duration = Duration::from_millis(1500);

/// Exit status of a process that had to be ended as it was.
const ENDED: i32 = 130;

/// A token that fires on SIGINT or SIGTERM. From then on the process has `GRACE` to end; a second signal ends it at
/// once.
pub fn on_signals() -> std::io::Result<Shutdown> {
    on_end(false)
}

/// As [`on_signals`]; a process that is `supervised` is also asked to end when its standard input closes. That is a
/// pipe into which nothing is written, so it closes when the supervisor ends, for whatever reason.
pub fn on_end(supervised: bool) -> std::io::Result<Shutdown> {
    let (trigger, token) = shutdown();
    let trigger = Arc::new(trigger);
    // Threads of our own: whatever computes on the threads of the process's runtime cannot hold up its end.
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let (mut interrupt, mut terminate) = {
        let _entered = runtime.enter();
        (signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?)
    };
    if supervised {
        let trigger = Arc::clone(&trigger);
        std::thread::Builder::new().name("supervisor".into()).spawn(move || {
            // Either way, end of file or an unreadable pipe, the supervisor is gone.
            let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
            trigger.fire();
            std::thread::sleep(GRACE);
            std::process::exit(ENDED);
        })?;
    }
    std::thread::Builder::new().name("signals".into()).spawn(move || {
        runtime.block_on(async {
            let mut signalled = async || {
                tokio::select! {
                    _ = interrupt.recv() => {}
                    _ = terminate.recv() => {}
                }
            };
            signalled().await;
            tracing::info!("asked to end");
            trigger.fire();
            let _ = tokio::time::timeout(GRACE, signalled()).await;
        });
        std::process::exit(ENDED);
    })?;
    Ok(token)
}
