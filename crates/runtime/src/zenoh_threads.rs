//! Zenoh's own threads: so many that a link that is lost does not hold up those that are left.
//!
//! Zenoh closes a TCP link with a linger of ten seconds, which nothing configures. While what was last sent on a
//! link that is cut waits to be acknowledged, closing it blocks one of the few threads that read and write for
//! all links: a router that lost two or three clients at once stood still for ten seconds. How many threads
//! there are can be said in the environment only, before Zenoh looks there.

use std::os::unix::process::CommandExt;
use std::process::Command;

/// Where Zenoh looks.
const VARIABLE: &str = "ZENOH_RUNTIME";

/// A thread for each link that may be lost at once.
#[derive(Debug, Clone, Copy)]
pub enum Links {
    /// A client's: one or two sessions, and a router to change over to.
    OfClient = 4,
    /// A router's: a whole pool.
    OfRouter = 64,
}

/// Sets the number of Zenoh's threads unless the environment does, by beginning the program again, under the
/// same process id. Call it first of all.
pub fn provide(links: Links) {
    if std::env::var_os(VARIABLE).is_some() {
        return;
    }
    let threads = links as usize;
    let value = ["rx", "tx", "net"].map(|pool| format!("{pool}:(worker_threads:{threads})")).join(",");
    let Ok(program) = std::env::current_exe() else { return };
    // It returns only if it fails. Fewer threads are no reason not to go on.
    let error =
        Command::new(program).args(std::env::args_os().skip(1)).env(VARIABLE, format!("({value})")).exec();
    tracing::warn!(%error, "Zenoh goes on with its default number of threads");
}
