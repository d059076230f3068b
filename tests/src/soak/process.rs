//! A service in a process of its own, and what the system says of it.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::net::TcpListener;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::time::Duration;

use crate::end_to_end::program::{program, ready_line, root, signal};

/// Kernel ticks a second in `/proc/PID/stat`.
const KERNEL_HZ: f64 = 100.0;

/// A running process, killed when dropped. It also ends when this one does: its standard input closes.
pub(super) struct Process {
    child: Child,
    _input: Option<ChildStdin>,
    /// What it complained of.
    errors: File,
    /// What it said when it was ready.
    pub(super) line: String,
}

impl Process {
    /// Starts `curionav ARGUMENTS` and waits until it is ready.
    pub(super) fn start(arguments: &[String]) -> Self {
        let mut process = Self::begin(arguments);
        process.await_ready();
        process
    }

    /// Starts it without waiting.
    pub(super) fn begin(arguments: &[String]) -> Self {
        let errors = tempfile::tempfile().unwrap();
        let mut child = Command::new(program())
            .args(arguments)
            .args(["--supervised", "--log", "error"])
            .current_dir(root())
            .env_remove("RUST_LOG")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(errors.try_clone().unwrap())
            .spawn()
            .unwrap();
        let input = child.stdin.take();
        Self { child, _input: input, errors, line: String::new() }
    }

    /// Waits until it is ready. It may not end before, however slow others are to start.
    pub(super) fn await_ready(&mut self) {
        let output = self.child.stdout.take().unwrap();
        self.line = ready_line(output).unwrap_or_else(|reason| panic!("{reason}: {}", self.complaints()));
    }

    /// How it ended, if it has.
    pub(super) fn ended(&mut self) -> Option<String> {
        let status = self.child.try_wait().unwrap()?;
        Some(format!("{status}: {}", self.complaints()))
    }

    /// The last of what it complained of.
    fn complaints(&mut self) -> String {
        let length = self.errors.seek(SeekFrom::End(0)).unwrap();
        self.errors.seek(SeekFrom::Start(length.saturating_sub(2000))).unwrap();
        let mut last = Vec::new();
        self.errors.read_to_end(&mut last).unwrap();
        String::from_utf8_lossy(&last).into_owned()
    }

    pub(super) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Stops it where it is, or lets it go on.
    pub(super) fn signal(&self, name: &str) {
        signal(name, self.pid());
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Also one that stands still.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A port that is free and stays so while nothing listens: none that the system gives to a process that connects. A
/// process that looks for a router that is down would sooner or later be given the very port it looks for.
pub(crate) fn port_for_a_restart() -> u16 {
    let first = 20_000 + (std::process::id() % 10_000) as u16;
    let is_free = |port: &u16| TcpListener::bind(("127.0.0.1", *port)).is_ok();
    (first..32_000).find(is_free).expect("a free port")
}

/// What a process takes.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Usage {
    /// Resident, MiB: its own, and the pages of the program it has touched.
    pub(crate) resident: f64,
    /// Its own, MiB.
    pub(super) own: f64,
    /// On a processor since it started.
    pub(super) busy: Duration,
}

/// What `pid` takes, unless it is gone.
pub(crate) fn usage(pid: u32) -> Option<Usage> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let mib = |field: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(field))?;
        line.split_whitespace().next()?.parse::<f64>().ok().map(|kib| kib / 1024.0)
    };
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // After the name, which may hold anything: fields 3 and on; user and system time are 14 and 15.
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    let ticks: f64 = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    Some(Usage {
        resident: mib("VmRSS:")?,
        own: mib("RssAnon:")?,
        busy: Duration::from_secs_f64(ticks / KERNEL_HZ),
    })
}
