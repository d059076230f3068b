//! Services of one robot under test.

use std::sync::Arc;
use std::time::Duration;

use curionav_runtime::command::Commander;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::convert;
use curionav_runtime::lease::{BaseLease, LeaseServers};
use curionav_runtime::map_store::{self, host};
use curionav_runtime::process::{Service, Start};
use curionav_runtime::query::{AskError, fetch};
use curionav_runtime::serve::{Server, refusals};
use curionav_runtime::session;
use curionav_runtime::shutdown::{ShutdownTrigger, shutdown};
use curionav_runtime::topic::{Flow, Inbox, Topic};
use curionav_schemas::{
    Clock, Message, Mission, MissionCommand, MissionOrder, MissionState, ServiceStatus, keys,
};
use tokio::task::JoinSet;
use zenoh::Session;

use crate::end_to_end::program::LIMIT;
use crate::faults::corridor_map;

/// A service that is asked to end gives up a question for a map, which may take 20 s.
const END_LIMIT: Duration = Duration::from_secs(15);
/// As in a service's configuration.
const ROBOT: &str = "robot";

/// Services on one session, ended when it is dropped.
pub(super) struct TestBench {
    session: Session,
    services: JoinSet<anyhow::Result<()>>,
    triggers: Vec<ShutdownTrigger>,
    map: Option<Server>,
    /// The base: it grants the driver its lease.
    pub(super) lease: Arc<BaseLease>,
    _lease: LeaseServers,
}

impl TestBench {
    /// Starts these, one after the other, each once the one before serves.
    pub(super) async fn start(services: &[Service], in_process: bool) -> Self {
        let config = ServiceConfig { in_process, simulated_base: true, ..ServiceConfig::default() };
        Self::configured(services, config).await
    }

    /// The same with this configuration.
    pub(super) async fn configured(services: &[Service], config: ServiceConfig) -> Self {
        let session = session::embedded().await.unwrap();
        let (lease, _lease) = BaseLease::serve(&session, &config, "base", &refusals()).unwrap();
        let services_at_work = JoinSet::new();
        let triggers = Vec::new();
        let mut bench = Self { session, services: services_at_work, triggers, map: None, lease, _lease };
        for service in services {
            bench.add(*service, config.clone()).await;
        }
        bench
    }

    /// Starts one more, and waits until it serves.
    pub(super) async fn add(&mut self, service: Service, config: ServiceConfig) {
        let (trigger, token) = shutdown();
        let (ready, is_ready) = tokio::sync::oneshot::channel();
        let session = self.session.clone();
        let fields = map_store::fields(&session);
        self.triggers.push(trigger);
        self.services.spawn(async move {
            let on_ready = Box::new(move |_| ready.send(()).unwrap());
            let (config, session, fields) = (&config, &session, &fields);
            service(Start { config, session, fields, shutdown: token, on_ready }).await
        });
        is_ready.await.unwrap();
    }

    /// Ends one of them, counted from 0 in the order in which they were started, and waits until it has.
    pub(super) async fn end_one(&mut self, index: usize) {
        self.triggers[index].fire();
        self.services.join_next().await.unwrap().unwrap().unwrap();
    }

    /// Serves the map of the corridor.
    pub(super) fn host_map(&mut self) {
        let (fields, id) = corridor_map::fields();
        let grid = convert::occupancy_grid_to_wire(&fields.map(id).unwrap().grid);
        self.map = Some(host(&self.session, grid, &refusals()).unwrap());
    }

    /// Asks every service to end; whether they all have before the question for a map would be over.
    pub(super) async fn end(mut self) -> bool {
        self.triggers.iter().for_each(ShutdownTrigger::fire);
        let ended = async { while self.services.join_next().await.is_some() {} };
        tokio::time::timeout(END_LIMIT, ended).await.is_ok()
    }

    pub(super) fn topic<M: Message>(&self, stream: &str, flow: Flow) -> Topic<M> {
        Topic::new(&self.session, &keys::robot(ROBOT, stream).unwrap(), flow).unwrap()
    }

    pub(super) fn inbox<M: Message>(&self, stream: &str) -> Inbox<M> {
        Inbox::new(&self.session, &keys::robot(ROBOT, stream).unwrap()).unwrap()
    }

    pub(super) async fn request(&self, request: MissionCommand) -> Mission {
        self.try_request(&request).await.unwrap()
    }

    /// What the driver answers to a command.
    pub(super) async fn try_request(&self, request: &MissionCommand) -> Result<Mission, AskError> {
        let commander = Commander::new(&self.session, ROBOT, "operator");
        commander.command_driver(request, self.lease.number(), LIMIT).await
    }

    /// A mission through the corridor, in real time and planned by a term that needs no pool but a generator, that
    /// begins once these roles are ready. Time passes slowly, so that a busy machine keeps no service waiting for too
    /// long.
    pub(super) async fn set_mission(&self, require: &[&str]) -> Mission {
        self.set_mission_in(Clock::Realtime, require).await
    }

    /// The same mission in real time or in lockstep.
    pub(super) async fn set_mission_in(&self, clock: Clock, require: &[&str]) -> Mission {
        let mut order = Self::order(clock, require);
        order.time_scale = 0.1;
        self.request(MissionCommand::Set { order: Box::new(order) }).await
    }

    /// The order of that mission, in which time passes as it does.
    pub(super) fn order(clock: Clock, require: &[&str]) -> MissionOrder {
        let mut mission = corridor_map::mission(corridor_map::fields().1, 1000, clock, 1);
        corridor_map::change_profile(&mut mission, |profile| {
            profile.terms.retain(|term, _| term == "distance");
        });
        mission.order.robot = ROBOT.to_owned();
        (mission.order.tick_s, mission.order.time_scale, mission.order.plan_every) = (0.1, 1.0, 1);
        mission.order.require = require.iter().map(|role| (*role).to_owned()).collect();
        mission.order
    }

    /// The mission once it is as it should be.
    pub(super) async fn mission_that(&self, is: impl Fn(&Mission) -> bool) -> Mission {
        let key = keys::robot(ROBOT, "mission").unwrap();
        self.await_state(&key, is).await
    }

    /// Waits until the mission runs.
    pub(super) async fn runs(&self) -> Mission {
        self.mission_that(|mission| mission.state == MissionState::Running).await
    }

    /// The status of a service once it is as it should be.
    pub(super) async fn status_that(&self, role: &str, is: impl Fn(&ServiceStatus) -> bool) -> ServiceStatus {
        self.await_state(&keys::status(role, &ServiceConfig::default().instance).unwrap(), is).await
    }

    async fn await_state<M: Message + std::fmt::Debug>(&self, key: &str, is: impl Fn(&M) -> bool) -> M {
        let begun = tokio::time::Instant::now();
        loop {
            let state: M = fetch(&self.session, key, LIMIT).await.unwrap();
            if is(&state) {
                return state;
            }
            assert!(begun.elapsed() < LIMIT, "{key} stays as it is: {state:?}");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
}

impl Drop for TestBench {
    fn drop(&mut self) {
        self.map = None;
        session::close(&self.session);
    }
}
