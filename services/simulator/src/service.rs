//! The simulator as a service: scenarios in, run status and results out.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::map_store::host;
use curionav_runtime::metrics::Metrics;
use curionav_runtime::process::OnReady;
use curionav_runtime::serve::{Server, serve, serve_state};
use curionav_runtime::shutdown::Shutdown;
use curionav_runtime::status::announce_service;
use curionav_runtime::topic::{Flow, Topic};
use curionav_schemas::{InjectRequest, Refusal, Reject, RunState, RunStatus, keys};
use tokio::sync::{mpsc, watch};
use zenoh::Session;

use crate::crowd::LiveCrowd;
use crate::inject::{Prepared, prepare};
use crate::run::{Progress, Streams};

/// How often progress is published while a run goes on.
const PROGRESS_PERIOD: Duration = Duration::from_millis(200);

type SharedStatus = Arc<Mutex<RunStatus>>;

fn locked(status: &SharedStatus) -> std::sync::MutexGuard<'_, RunStatus> {
    status.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Simulates one world until `shutdown`, one run at a time.
pub(crate) async fn run(
    config: &ServiceConfig,
    session: &Session,
    mut shutdown: Shutdown,
    on_ready: OnReady,
) -> anyhow::Result<()> {
    let status: SharedStatus = Arc::new(Mutex::new(idle(&config.world)));
    let key = |channel| keys::world(&config.world, channel);
    let published = Topic::<RunStatus>::new(session, &key("run")?, Flow::State)?;
    let shown = Arc::clone(&status);
    let (sender, mut injected) = mpsc::channel(1);
    let inject = serve_injection(config, session, &key("scenario")?, Arc::clone(&status), sender)?;
    let counts = inject.counts();
    let _state = serve_state(session, &key("run")?, &counts.refused, move || Ok(locked(&shown).clone()))?;
    let (robot, shown) = (config.robot.clone(), Arc::clone(&status));
    // As injecting, but nothing is run, whatever goes on meanwhile.
    let _checks = serve(session, &key("check")?, 1, 4, move |request: InjectRequest, _| {
        prepare(&request, &robot).map(|_| locked(&shown).clone()).map_err(Reject::from)
    })?;
    let crowd = LiveCrowd::new(session, &config.world, &counts)?;
    let mut streams = Streams::new(session, &config.robot, crowd, &counts)?;
    let metrics = Metrics::of_robot("simulator", config);
    let announced = announce_service(config, &[("data", session)], metrics, Arc::clone(&counts), Vec::new)?;
    on_ready(announced.metrics_address());
    tracing::info!(world = %config.world, robot = %config.robot, "simulator ready");
    // The map of the last run stays served: pictures and late services still ask for it.
    let mut _hosted: Option<Server> = None;
    loop {
        let prepared = tokio::select! {
            () = shutdown.requested() => return Ok(()),
            prepared = injected.recv() => match prepared {
                Some(prepared) => prepared,
                None => return Ok(()),
            },
        };
        drop(_hosted.take());
        _hosted = Some(host(session, prepared.map.clone(), &counts.refused)?);
        tokio::select! {
            () = play(&mut streams, prepared, &status, &published) => {}
            () = shutdown.requested() => return Ok(()),
        }
    }
}

fn idle(world: &str) -> RunStatus {
    RunStatus {
        run: 0,
        world: world.to_owned(),
        state: RunState::Idle,
        tick: 0,
        time_s: 0.0,
        distance_to_goal: 0.0,
        error: None,
        result: None,
    }
}

fn serve_injection(
    config: &ServiceConfig,
    session: &Session,
    key: &str,
    status: SharedStatus,
    sender: mpsc::Sender<Prepared>,
) -> anyhow::Result<Server> {
    let robot = config.robot.clone();
    let runs = AtomicU64::new(0);
    let server = serve(session, key, 1, 4, move |request: InjectRequest, _| {
        if matches!(locked(&status).state, RunState::Preparing | RunState::Running) {
            return Err(Refusal::Busy.into());
        }
        let prepared = prepare(&request, &robot)?;
        let mut status = locked(&status);
        let run = runs.fetch_add(1, Ordering::Relaxed) + 1;
        let fresh = RunStatus { run, state: RunState::Preparing, ..idle(&status.world) };
        sender.try_send(prepared).map_err(|_| Refusal::Busy)?;
        *status = fresh.clone();
        Ok(fresh)
    })?;
    Ok(server)
}

async fn play(
    streams: &mut Streams,
    prepared: Prepared,
    status: &SharedStatus,
    published: &Topic<RunStatus>,
) {
    let clock = prepared.order.clock;
    let (sender, progress) = watch::channel(Progress::default());
    let show = |change: &dyn Fn(&mut RunStatus)| {
        let shown = {
            let mut status = locked(status);
            change(&mut status);
            status.clone()
        };
        published.publish(&shown, clock);
    };
    show(&|_| {});
    let watching = async {
        loop {
            tokio::time::sleep(PROGRESS_PERIOD).await;
            let now = *progress.borrow();
            if now.running {
                show(&|s| {
                    s.state = RunState::Running;
                    (s.tick, s.time_s, s.distance_to_goal) = (now.tick, now.time_s, now.distance_to_goal);
                });
            }
        }
    };
    let outcome = tokio::select! {
        outcome = streams.play(prepared, &sender) => outcome,
        () = watching => return,
    };
    let last = *progress.borrow();
    show(&|s| {
        (s.tick, s.time_s, s.distance_to_goal) = (last.tick, last.time_s, last.distance_to_goal);
        match &outcome {
            Ok(result) => (s.state, s.result) = (RunState::Finished, Some(result.clone())),
            Err(error) => (s.state, s.error) = (RunState::Failed, Some(error.clone())),
        }
    });
}
