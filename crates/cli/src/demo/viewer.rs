//! The program `curionav-view` as a process.

use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::time::Duration;

use anyhow::Context;
use curionav_runtime::exit::Exit;
use curionav_schemas::keys;
use tokio::process::{Child, ChildStdin, Command};
use tokio::time::{Instant, sleep, timeout};
use zenoh::Session;

const PROGRAM: &str = "curionav-view";
/// Its exit status if what it needs is not installed.
pub(super) const NOT_INSTALLED: i32 = 3;
/// Python and Rerun are loaded, perhaps for the first time on a slow disk.
const START_TIMEOUT: Duration = Duration::from_secs(120);
/// Between two looks whether it listens.
const LOOK: Duration = Duration::from_millis(100);
/// It ends within this once it is asked to; then it is killed. A second and a half after a signal this program ends by
/// force.
const STOP_TIMEOUT: Duration = Duration::from_secs(1);

/// The viewer, which ends when its standard input closes, so at the latest with this process.
pub(super) struct Viewer {
    child: Child,
    /// By itself, because waiting for a child closes its standard input.
    stdin: Option<ChildStdin>,
}

/// The viewer's file: beside this program, as `pip` installs both, or else in PATH.
pub(super) fn program() -> Option<PathBuf> {
    let beside = std::env::current_exe().ok().and_then(|program| Some(program.parent()?.to_owned()));
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = beside.into_iter().chain(std::env::split_paths(&path));
    folders.map(|folder| folder.join(PROGRAM)).find(|file| file.is_file())
}

/// Whether a window can be opened here.
pub(super) fn has_display() -> bool {
    let mut displays = ["DISPLAY", "WAYLAND_DISPLAY"].into_iter().filter_map(std::env::var_os);
    cfg!(target_os = "macos") || displays.any(|display| !display.is_empty())
}

impl Viewer {
    pub(super) fn start(program: &Path, arguments: &[&str]) -> anyhow::Result<Self> {
        let mut command = Command::new(program);
        command.args(arguments).arg("--supervised").stdin(Stdio::piped()).stdout(Stdio::null());
        let mut child = command.spawn().with_context(|| format!("cannot start {}", program.display()))?;
        let stdin = child.stdin.take();
        Ok(Self { child, stdin })
    }

    /// Waits until it listens to the robot. Gives its exit status if it has ended instead, which it has explained.
    pub(super) async fn listens(
        &mut self,
        session: &Session,
        robot: &str,
    ) -> Result<Option<ExitStatus>, Exit> {
        // The stream that only it listens to before a run.
        let key = keys::robot(robot, "report").map_err(Exit::bad_input)?;
        let failed = |error: zenoh::Error| Exit::network(anyhow::anyhow!("{key}: {error}"));
        let reports = session.declare_publisher(&key).await.map_err(failed)?;
        let deadline = Instant::now() + START_TIMEOUT;
        while !reports.matching_status().await.map_err(failed)?.matching() {
            if let Some(status) = self.child.try_wait().map_err(Exit::failed)? {
                return Ok(Some(status));
            }
            if Instant::now() > deadline {
                let seconds = START_TIMEOUT.as_secs();
                return Err(Exit::failed(anyhow::anyhow!("{PROGRAM} did not listen within {seconds} s")));
            }
            sleep(LOOK).await;
        }
        Ok(None)
    }

    /// Completes when it has ended.
    pub(super) async fn ended(&mut self) {
        // A process that cannot be waited for has ended.
        let _ = self.child.wait().await;
    }

    /// Ends it.
    pub(super) async fn end(&mut self) {
        drop(self.stdin.take());
        if timeout(STOP_TIMEOUT, self.ended()).await.is_err() {
            tracing::warn!("{PROGRAM} did not end in time, killed");
            let _ = self.child.kill().await;
        }
    }
}
