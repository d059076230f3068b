//! The keys of the mission: one tells it, two take changes, which are published.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use curionav_runtime::locked::locked;
use curionav_runtime::metrics::Tally;
use curionav_runtime::robot_service::first_run;
use curionav_runtime::serve::{Server, serve, serve_state};
use curionav_runtime::topic::{Flow, Topic};
use curionav_schemas::{Mission, MissionCommand, Readiness, Refusal, Reject, keys};
use tokio::sync::watch;
use tokio::task::JoinSet;
use zenoh::Session;

use crate::mission_state::CurrentMission;

/// Time between two publications of the mission.
const MISSION_REPEATED: Duration = Duration::from_secs(1);
/// One change at a time; a service or client asks once and waits.
const QUEUE: (usize, usize) = (1, 64);

/// The queryables of the mission, and the task that publishes it from time to time.
pub(crate) type Serving = ([Server; 3], JoinSet<()>);

/// The mission, and where every change of it is published.
pub(crate) struct MissionKeys {
    current: Mutex<CurrentMission>,
    published: Topic<Mission>,
    changed: watch::Sender<Option<Mission>>,
}

impl MissionKeys {
    /// No mission yet. Every change is also sent to `changed`.
    pub(crate) fn new(
        session: &Session,
        robot: &str,
        changed: watch::Sender<Option<Mission>>,
    ) -> anyhow::Result<Self> {
        let published = Topic::new(session, &keys::robot(robot, "mission")?, Flow::State)?;
        Ok(Self { current: Mutex::new(CurrentMission::new(first_run())), published, changed })
    }

    /// Changes the mission and publishes it.
    pub(crate) fn change(
        &self,
        changing: impl FnOnce(&mut CurrentMission) -> Result<Mission, Reject>,
    ) -> Result<Mission, Reject> {
        // Held while it is published, so that no older mission is published after a newer one.
        let mut current = locked(&self.current);
        let mission = changing(&mut current)?;
        self.changed.send_replace(Some(mission.clone()));
        self.published.publish(&mission, mission.order.clock);
        Ok(mission)
    }

    /// Serves the mission of `robot` on three keys: its state, commands to it, and reports of readiness for it. The
    /// mission is also published from time to time, for services that were cut off when it changed.
    pub(crate) fn serve(
        self: &Arc<Self>,
        session: &Session,
        robot: &str,
        refused: &Tally,
    ) -> anyhow::Result<Serving> {
        let [repeated, state, commanded, reported] = std::array::from_fn(|_| Arc::clone(self));
        let mut repeating = JoinSet::new();
        repeating.spawn(async move {
            loop {
                tokio::time::sleep(MISSION_REPEATED).await;
                let current = locked(&repeated.current);
                if let Some(mission) = current.mission() {
                    repeated.published.publish(mission, mission.order.clock);
                }
            }
        });
        let (command, ready) = (keys::mission_command(robot)?, keys::mission_ready(robot)?);
        let servers = [
            serve_state(session, &keys::robot(robot, "mission")?, refused, move || {
                locked(&state.current).mission().cloned().ok_or_else(|| Refusal::NoMission.into())
            })?,
            serve(session, &command, QUEUE, refused, move |command: MissionCommand, _| {
                commanded.change(|current| current.command(command))
            })?,
            serve(session, &ready, QUEUE, refused, move |readiness: Readiness, _| {
                reported.change(|current| current.readiness(readiness))
            })?,
        ];
        Ok((servers, repeating))
    }
}
