//! Clean ends: one token, fired by a signal, a supervisor or a test, that all parts of a process look at.

use std::io::{ErrorKind, Read};
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

/// A supervisor's questions whether this process still works; see [`heartbeat`](crate::heartbeat).
#[derive(Debug)]
pub struct Questions(watch::Receiver<u64>);

impl Questions {
    /// Completes when there has been a question since it completed last; never without a supervisor.
    pub async fn asked(&mut self) {
        if self.0.changed().await.is_err() {
            std::future::pending::<()>().await;
        }
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
    on_end(false).map(|(shutdown, _)| shutdown)
}

/// As [`on_signals`]; a process that is `supervised` is also asked to end when its standard input closes. That is a
/// pipe, so it closes when the supervisor ends, for whatever reason. Each byte in it asks whether the process still
/// works.
pub fn on_end(supervised: bool) -> std::io::Result<(Shutdown, Questions)> {
    let (trigger, token) = shutdown();
    let (asking, asked) = watch::channel(0);
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
            let mut bytes = [0; 16];
            loop {
                match std::io::stdin().lock().read(&mut bytes) {
                    Err(error) if error.kind() == ErrorKind::Interrupted => {}
                    // Either way, end of file or an unreadable pipe, the supervisor is gone.
                    Ok(0) | Err(_) => break,
                    Ok(_) => asking.send_modify(|count: &mut u64| *count += 1),
                }
            }
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
    Ok((token, Questions(asked)))
}
