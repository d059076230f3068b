//! What Zenoh and the allocator can be told in the environment only, before they look there.
//!
//! **Zenoh's threads**: so many that a link that is lost does not hold up those that are left. Zenoh closes a TCP link
//! with a linger of ten seconds, which nothing configures. While what was last sent on a link that is cut waits to be
//! acknowledged, closing it blocks one of the few threads that read and write for all links: a router that lost two or
//! three clients at once stood still for ten seconds. The single thread that lets clients in was held up in the same
//! way by strangers: it closed 100 idle sockets per second, and took 20 s for 2,000.
//!
//! **The allocator's arenas**: one. By default the threads of a process share up to eight arenas per processor (glibc),
//! and each of them keeps what it once needed: with every router that is lost and comes back a service took some 50 KB
//! more.

use std::os::unix::process::CommandExt;
use std::process::Command;

/// Where Zenoh looks for the number of its threads.
const THREADS: &str = "ZENOH_RUNTIME";
/// Where glibc looks for the greatest number of arenas; other allocators take no notice.
const ARENAS: &str = "MALLOC_ARENA_MAX";

/// A thread for each link that may be lost at once.
#[derive(Debug, Clone, Copy)]
pub enum Links {
    /// A client's: one or two sessions, and a router to change over to.
    OfClient = 4,
    /// A router's: a whole pool.
    OfRouter = 64,
}

/// Sets what the environment does not, by beginning the program again, under the same process id. Call it first of all.
pub fn provide(links: Links) {
    let threads = links as usize;
    let pools = ["rx", "tx", "net", "acc"].map(|pool| format!("{pool}:(worker_threads:{threads})")).join(",");
    let mut wanted = vec![(THREADS, format!("({pools})")), (ARENAS, "1".to_owned())];
    wanted.retain(|(variable, _)| std::env::var_os(variable).is_none());
    if wanted.is_empty() {
        return;
    }
    let Ok(program) = std::env::current_exe() else { return };
    // It returns only if it fails, and the defaults are no reason not to go on.
    let error = Command::new(program).args(std::env::args_os().skip(1)).envs(wanted).exec();
    tracing::warn!(%error, "the defaults of Zenoh's threads and of the allocator stay");
}
