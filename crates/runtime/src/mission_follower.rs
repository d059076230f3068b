//! What arbiter and localizer have in common: they prepare for every mission of their robot, and answer its ticks.

use std::future::Future;

use curionav_schemas::{Mission, Reject};

use crate::robot_service::{Preparation, RobotService, superseded, supersedes};
use crate::shutdown::Shutdown;
use crate::topic::Inbox;

/// A service that prepares for missions and answers ticks.
pub trait MissionFollower: Send + Sync {
    /// What it answers.
    type Tick: Send;

    /// Its sessions, streams and counts.
    fn service(&self) -> &RobotService;

    /// Prepares for `mission`. It may be dropped on the way, when there is another mission to prepare for.
    fn prepare(&mut self, mission: &Mission) -> impl Future<Output = Result<(), Reject>> + Send;

    /// Whether what is now `said` ends the preparation for `mission`.
    fn is_superseded(said: &Mission, mission: &Mission) -> bool {
        supersedes(said, mission)
    }

    /// Forgets the streams of the run before: nothing of the new run can be on its way before this role is ready.
    fn forget_run(&mut self);

    /// The next tick to answer; nothing once the session is closed. Cancel-safe.
    fn next(&mut self) -> impl Future<Output = Option<Self::Tick>> + Send;

    /// Answers one tick; `mission` is the newest mission. It may be dropped on the way, when the run is over.
    fn answer(&mut self, tick: Self::Tick, mission: &Mission) -> impl Future<Output = ()> + Send;
}

/// Follows `missions` until `shutdown`, or until the session is closed.
pub async fn follow<F: MissionFollower>(
    follower: &mut F,
    missions: &Inbox<Mission>,
    mut shutdown: Shutdown,
) -> anyhow::Result<()> {
    let mut current = None::<Mission>;
    let mut prepared = None::<Preparation>;
    let mut said = tokio::select! {
        () = shutdown.requested() => return Ok(()),
        mission = follower.service().mission() => mission?,
    };
    loop {
        if let Some(mission) = said.take() {
            let anew = !mission.is_over() && !prepared.as_ref().is_some_and(|before| before.is_for(&mission));
            if anew {
                let preparing = async {
                    loop {
                        let outcome = follower.prepare(&mission).await;
                        if !follower.service().must_retry(&mission, &outcome).await {
                            break outcome;
                        }
                    }
                };
                let outcome = tokio::select! {
                    biased;
                    () = shutdown.requested() => return Ok(()),
                    () = superseded(missions, &mut said, |said| F::is_superseded(said, &mission)) => continue,
                    outcome = preparing => outcome,
                };
                if !prepared.as_ref().is_some_and(|before| before.is_of_run(&mission)) {
                    follower.forget_run();
                }
                prepared = Some(Preparation::new(&mission, outcome));
                if said.as_ref().is_some_and(|newer| supersedes(newer, &mission)) {
                    // Nothing waits for this mission any more; until the newer one is prepared it is what is left.
                    current = Some(mission);
                    continue;
                }
            }
            tokio::select! {
                biased;
                () = shutdown.requested() => return Ok(()),
                told = follower.service().tell(&mission, prepared.as_ref(), anew) => told?,
            }
            current = Some(mission);
            continue;
        }
        tokio::select! {
            biased;
            () = shutdown.requested() => return Ok(()),
            mission = missions.next() => match mission {
                Some(mission) => said = Some(mission),
                None => return Ok(()),
            },
            tick = follower.next() => match (tick, &current) {
                (Some(tick), Some(mission)) => {
                    // When the run is over or another has begun, no answer of its ticks is awaited.
                    let over = |said: &Mission| said.run != mission.run || said.is_over();
                    tokio::select! {
                        biased;
                        () = follower.answer(tick, mission) => {}
                        () = superseded(missions, &mut said, over) => {}
                        () = shutdown.requested() => return Ok(()),
                    }
                }
                (Some(_), None) => {}
                (None, _) => return Ok(()),
            },
        }
    }
}
