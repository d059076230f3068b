//! The keys of the mission: one tells it, two take changes, which are published; and the key of pauses.

use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use anyhow::Context;
use curionav_robot::driver::mission_state::CurrentMission;
use curionav_runtime::command_log::{CommandLog, in_words, pause_in_words, standing};
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::locked::locked;
use curionav_runtime::metrics::Tally;
use curionav_runtime::robot_limits::Base;
use curionav_runtime::robot_service::first_run;
use curionav_runtime::serve::{Server, serve, serve_commands, serve_state};
use curionav_runtime::topic::{Flow, Topic};
use curionav_schemas::keys::Commanded;
use curionav_schemas::{Mission, PauseReply, PauseRequest, Readiness, Refusal, Reject, keys};
use tokio::sync::watch;
use zenoh::Session;

/// Time between two publications of the mission.
const MISSION_REPEATED: Duration = Duration::from_secs(1);
/// One report at a time; a service asks once and waits.
const QUEUE: (usize, usize) = (1, 64);

/// The queryables of the mission.
pub(crate) type Serving = [Server; 4];

/// The mission, and where every change of it is published.
pub(crate) struct MissionKeys {
    current: Mutex<CurrentMission>,
    changed: watch::Sender<Option<Arc<Mission>>>,
    /// Wakes the thread that publishes; that thread ends with this.
    publish: SyncSender<()>,
}

impl MissionKeys {
    /// No mission yet. Every change is also sent to `changed`.
    pub(crate) fn new(
        session: &Session,
        robot: &str,
        base: Base,
        changed: watch::Sender<Option<Arc<Mission>>>,
    ) -> anyhow::Result<Self> {
        let published = Topic::new(session, &keys::robot(robot, "mission")?, Flow::Mission)?;
        let (publish, woken) = sync_channel(1);
        let newest = changed.subscribe();
        // A publication may wait for a slow network: on a thread of its own, where it holds up neither a change nor a
        // tick. It takes the newest mission each time, so no older one follows a newer one.
        let thread = std::thread::Builder::new().name("mission".into()).spawn(move || {
            while !matches!(woken.recv_timeout(MISSION_REPEATED), Err(RecvTimeoutError::Disconnected)) {
                let mission = newest.borrow().clone();
                if let Some(mission) = mission {
                    published.publish(&*mission, mission.order.clock);
                }
            }
        });
        thread.context("the mission's thread")?;
        Ok(Self { current: Mutex::new(CurrentMission::new(base, first_run())), changed, publish })
    }

    /// Changes the mission and has it published.
    pub(crate) fn change(
        &self,
        changing: impl FnOnce(&mut CurrentMission) -> Result<Mission, Reject>,
    ) -> Result<Mission, Reject> {
        let mut current = locked(&self.current);
        let mission = changing(&mut current)?;
        self.announce(&current);
        Ok(mission)
    }

    /// Says how the mission stands from now on. The lock is held, so that no change overtakes another.
    fn announce(&self, current: &CurrentMission) {
        let Some(mission) = current.mission() else { return };
        self.changed.send_replace(Some(Arc::new(mission.clone())));
        // If it is full, the thread has yet to look, and will find this one.
        let _ = self.publish.try_send(());
    }

    /// Under which grant of the base this driver drives, and whether it is paused.
    pub(crate) fn standing(&self) -> (u64, bool) {
        locked(&self.current).standing()
    }

    /// The base has granted a lease, under which it is paused or not, or has taken it back: 0.
    pub(crate) fn set_lease(&self, lease: u64, paused: bool) {
        let mut current = locked(&self.current);
        current.set_lease(lease);
        if paused {
            current.pause(true);
        }
        self.announce(&current);
    }

    /// Begins a pause or ends it; answers with what this driver is then.
    fn pause(&self, request: PauseRequest, instance: &str) -> PauseReply {
        let mut current = locked(&self.current);
        current.pause(request.paused);
        self.announce(&current);
        let (lease, paused) = current.standing();
        PauseReply { role: keys::DRIVER.into(), instance: instance.into(), lease, paused }
    }

    /// Serves the mission of the robot on three keys: its state, commands to it, and reports of readiness for it; and
    /// pauses on a fourth, which no flood of commands holds up. The mission is also published from time to time, for
    /// services that were cut off when it changed.
    pub(crate) fn serve(
        self: &Arc<Self>,
        session: &Session,
        config: &ServiceConfig,
        refused: &Tally,
    ) -> anyhow::Result<Serving> {
        let [state, commanded, reported, halted] = std::array::from_fn(|_| Arc::clone(self));
        let robot = &config.robot;
        let instance = config.instance.clone();
        let log = CommandLog::new(config);
        let of_pauses = log.clone();
        let ready = keys::mission_ready(robot)?;
        Ok([
            serve_state(session, &keys::robot(robot, "mission")?, refused, move || {
                locked(&state.current).mission().cloned().ok_or_else(|| Refusal::NoMission.into())
            })?,
            serve_commands(session, robot, Commanded::Mission, refused, move |command, by| {
                let words = in_words(&command);
                let answer = commanded.change(|current| current.command(command));
                log.note(by, &words, &answer.as_ref().map(standing));
                answer
            })?,
            serve(session, &ready, QUEUE, refused, move |readiness: Readiness, _| {
                reported.change(|current| current.readiness(readiness))
            })?,
            serve_commands(session, robot, Commanded::Pause, refused, move |request, by| {
                let answer = halted.pause(request, &instance);
                of_pauses.note(by, pause_in_words(request), &Ok("the driver obeys".into()));
                Ok(answer)
            })?,
        ])
    }
}
