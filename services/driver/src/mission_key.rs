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

use crate::desk::Desk;

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
    let desk = Arc::new(Mutex::new(Desk::new(since_epoch.as_millis() as u64)));
    let mut repeating = JoinSet::new();
    let (topic, known) = (Arc::clone(&published), Arc::clone(&desk));
    repeating.spawn(async move {
        loop {
            tokio::time::sleep(MISSION_REPEATED).await;
            // Held while it is published, so that no older mission is said after a newer one.
            let desk = locked(&known);
            if let Some(mission) = desk.mission() {
                topic.publish(mission, mission.order.clock);
            }
        }
    });
    let state = Arc::clone(&desk);
    let change = move |changing: &dyn Fn(&mut Desk) -> Result<Mission, Reject>| {
        let mut desk = locked(&desk);
        let mission = changing(&mut desk)?;
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
            move |command: MissionCommand, _| commanding(&|desk| desk.command(command.clone())),
        )?,
        serve_counted(
            session,
            &keys::mission_ready(robot)?,
            QUEUE,
            refused,
            move |readiness: Readiness, _| reporting(&|desk| desk.readiness(readiness.clone())),
        )?,
    ];
    Ok((servers, repeating))
}

fn locked(desk: &Mutex<Desk>) -> MutexGuard<'_, Desk> {
    desk.lock().unwrap_or_else(PoisonError::into_inner)
}
