//! The keys of the mission: one tells it, two take changes, which are published.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use curionav_runtime::metrics::Tally;
use curionav_runtime::serve::{Server, serve_counted, serve_state};
use curionav_runtime::topic::{Flow, Topic};
use curionav_schemas::{Mission, MissionCommand, Readiness, Refusal, Reject, keys};
use tokio::sync::watch;
use tokio::task::JoinSet;
use zenoh::Session;

use crate::mission_state::CurrentMission;

/// Between two times the mission is said.
const MISSION_REPEATED: Duration = Duration::from_secs(1);
/// One change at a time; a service or client asks once and waits.
const QUEUE: (usize, usize) = (1, 64);

/// The queryables of the mission, and the task that publishes it from time to time.
pub(crate) type Serving = ([Server; 3], JoinSet<()>);

/// Serves the mission of `robot` on three keys: its state, commands about it, and reports of readiness for it. Every
/// change is published, and so is the mission from time to time, for services that were cut off when it changed.
pub(crate) fn serve(
    session: &Session,
    robot: &str,
    refused: &Tally,
    changed: watch::Sender<Option<Mission>>,
) -> anyhow::Result<Serving> {
    let key = keys::robot(robot, "mission")?;
    let published = Arc::new(Topic::<Mission>::new(session, &key, Flow::State)?);
    let since_epoch = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    let current = Arc::new(Mutex::new(CurrentMission::new(since_epoch.as_millis() as u64)));
    let mut repeating = JoinSet::new();
    let (topic, known) = (Arc::clone(&published), Arc::clone(&current));
    repeating.spawn(async move {
        loop {
            tokio::time::sleep(MISSION_REPEATED).await;
            // Held while it is published, so that no older mission is said after a newer one.
            let current = locked(&known);
            if let Some(mission) = current.mission() {
                topic.publish(mission, mission.order.clock);
            }
        }
    });
    let state = Arc::clone(&current);
    let change = move |changing: &dyn Fn(&mut CurrentMission) -> Result<Mission, Reject>| {
        let mut current = locked(&current);
        let mission = changing(&mut current)?;
        changed.send_replace(Some(mission.clone()));
        published.publish(&mission, mission.order.clock);
        Ok(mission)
    };
    let (commanding, reporting) = (change.clone(), change);
    let servers = [
        serve_state(session, &key, refused, move || {
            locked(&state).mission().cloned().ok_or_else(|| Refusal::NoMission.into())
        })?,
        serve_counted(
            session,
            &keys::mission_command(robot)?,
            QUEUE,
            refused,
            move |command: MissionCommand, _| commanding(&|current| current.command(command.clone())),
        )?,
        serve_counted(
            session,
            &keys::mission_ready(robot)?,
            QUEUE,
            refused,
            move |readiness: Readiness, _| reporting(&|current| current.readiness(readiness.clone())),
        )?,
    ];
    Ok((servers, repeating))
}

fn locked(current: &Mutex<CurrentMission>) -> MutexGuard<'_, CurrentMission> {
    current.lock().unwrap_or_else(PoisonError::into_inner)
}
