//! The simulator as a service: scenarios in, run status and results out.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use curionav_in_process::{Prepared, prepare};
use curionav_runtime::fields::Fields;
use curionav_runtime::lease::BaseLease;
use curionav_runtime::map_store::host;
use curionav_runtime::metrics::Metrics;
use curionav_runtime::process::{Running, Start};
use curionav_runtime::robot_service::first_run;
use curionav_runtime::serve::{Server, refusals, serve, serve_state};
use curionav_runtime::status::announce_service;
use curionav_runtime::topic::{Flow, Topic};
use curionav_schemas::{Clock, InjectRequest, Refusal, Reject, RunState, RunStatus, keys};
use tokio::sync::{mpsc, watch};

use crate::crowd::LiveCrowd;
use crate::run::{SIMULATOR, Streams};

/// How often progress is published while a run goes on.
const PROGRESS_PERIOD: Duration = Duration::from_millis(200);

/// The status of the run, of which every clone is the same.
type SharedStatus = watch::Sender<RunStatus>;

/// Simulates one world until `shutdown`, one run at a time; `on_ready` is called once it takes scenarios.
pub fn run(start: Start<'_>) -> Running<'_> {
    Box::pin(async move {
        let Start { config, session, fields, mut shutdown, on_ready } = start;
        let status = SharedStatus::new(idle(&config.world));
        let run_key = keys::world(&config.world, "run")?;
        let published = Topic::<RunStatus>::new(session, &run_key, Flow::State)?;
        let shown = status.clone();
        let (sender, mut injected) = mpsc::channel(1);
        let injector = Injector {
            robot: config.robot.clone(),
            world: config.world.clone(),
            fields: fields.clone(),
            status: status.clone(),
            runs: AtomicU64::new(first_run()),
            prepared: sender,
        };
        let scenario_key = keys::world(&config.world, "scenario")?;
        let inject =
            serve(session, &scenario_key, (1, 4), &refusals(), move |request, _| injector.inject(&request))?;
        let counts = inject.counts();
        let _state = serve_state(session, &run_key, &counts.refused, move || Ok(shown.borrow().clone()))?;
        let robot = config.robot.clone();
        let shown = status.clone();
        // As injecting, but nothing is run and no map is kept, whatever goes on meanwhile.
        let check_key = keys::world(&config.world, "check")?;
        let _checks = serve(session, &check_key, (1, 4), &counts.refused, move |request, _| {
            prepare(&request, &robot, &Fields::of_maps([])).map(|_| shown.borrow().clone())
        })?;
        let crowd = LiveCrowd::new(session, &config.world, &counts)?;
        let (lease, _lease) = BaseLease::serve(session, config, SIMULATOR, &counts.refused)?;
        let mut streams = Streams::new(session, config, lease, crowd, &counts)?;
        let metrics = Metrics::of_robot(SIMULATOR, config);
        let announced =
            announce_service(config, &[("data", session)], metrics, Arc::clone(&counts), Vec::new)?;
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
                () = play(&mut streams, prepared, fields, &status, &published) => {}
                () = shutdown.requested() => return Ok(()),
            }
        }
    })
}

/// Takes scenarios, one run at a time.
struct Injector {
    robot: String,
    world: String,
    fields: Fields,
    status: SharedStatus,
    /// The number of the next run.
    runs: AtomicU64,
    prepared: mpsc::Sender<Prepared>,
}

impl Injector {
    fn inject(&self, request: &InjectRequest) -> Result<RunStatus, Reject> {
        if matches!(self.status.borrow().state, RunState::Preparing | RunState::Running) {
            return Err(Refusal::Busy.into());
        }
        let prepared = prepare(request, &self.robot, &self.fields)?;
        let run = self.runs.fetch_add(1, Ordering::Relaxed);
        let fresh = RunStatus { run, state: RunState::Preparing, ..idle(&self.world) };
        // Before it can be played, so that the end of the run is not overwritten.
        self.status.send_replace(fresh.clone());
        self.prepared.try_send(prepared).map_err(|_| Refusal::Busy)?;
        Ok(fresh)
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

/// Publishes the status as it is now, without holding on to it meanwhile.
fn publish(published: &Topic<RunStatus>, status: &SharedStatus, clock: Clock) {
    let shown = status.borrow().clone();
    published.publish(&shown, clock);
}

async fn play(
    streams: &mut Streams,
    prepared: Prepared,
    fields: &Fields,
    status: &SharedStatus,
    published: &Topic<RunStatus>,
) {
    let clock = prepared.order.clock;
    publish(published, status, clock);
    let publishing = async {
        loop {
            tokio::time::sleep(PROGRESS_PERIOD).await;
            if status.borrow().state == RunState::Running {
                publish(published, status, clock);
            }
        }
    };
    let progress = |tick, time_s, distance_to_goal| {
        status.send_modify(|status| {
            status.state = RunState::Running;
            status.tick = tick;
            status.time_s = time_s;
            status.distance_to_goal = distance_to_goal;
        });
    };
    let outcome = tokio::select! {
        outcome = streams.play(prepared, fields, &progress) => outcome,
        () = publishing => return,
    };
    status.send_modify(|status| match outcome {
        Ok(result) => {
            status.state = RunState::Finished;
            status.result = Some(result);
        }
        Err(end) => {
            status.state = RunState::Failed;
            status.error = Some(end);
        }
    });
    publish(published, status, clock);
}
