//! The driver on its robot.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::bail;
use curionav_planning::geometry::Twist;
use curionav_robot::driver::control::Command;
use curionav_robot::driver::decision_fence::DecisionFence;
use curionav_robot::driver::drive::{Drive, Grounds, Now, given_up};
use curionav_robot::driver::guard::Guard;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_runtime::further_scans::FurtherScans;
use curionav_runtime::lockstep::{Latest, has_started_over};
use curionav_runtime::process::{Running, Start};
use curionav_runtime::robot_limits::Base;
use curionav_runtime::robot_service::RobotService;
use curionav_runtime::serve::serve_state;
use curionav_runtime::shutdown::Shutdown;
use curionav_runtime::topic::{Flow, Topic};
use curionav_schemas::{
    self as wire, Belief, Clock, CommandReason, Decision, Mission, MissionCommand, MissionEnd, MissionState,
    Odometry, Refusal, Scan, keys,
};
use tokio::sync::watch;

use crate::base_clock::{BaseClock, is_motion};
use crate::command_counts::CommandCounts;
use crate::lease::{Keeper, Standing};
use crate::mission_keys::MissionKeys;
use crate::sight_of_mission::SightOfMission;

/// A robot that is slower than this stands, m/s and rad/s.
const STANDING: f64 = 0.01;

struct Driver {
    service: RobotService,
    /// Bounds whatever a mission or a decision asks for.
    base: Base,
    missions: watch::Receiver<Option<Arc<Mission>>>,
    keys: Arc<MissionKeys>,
    /// What it has of the lease under which it drives.
    lease: watch::Receiver<Standing>,
    odometry: Latest<Odometry>,
    beliefs: Latest<Belief>,
    scans: Latest<Scan>,
    /// Those of further sensors, which the guard alone looks at.
    further: FurtherScans,
    decisions: Latest<Decision>,
    commands: Topic<wire::Twist>,
    sight: SightOfMission,
    /// Shared with the queryable that tells which decision is followed.
    fence: watch::Sender<DecisionFence>,
    drive: Drive,
    /// Run and revision that it has reported ready for.
    begun: (u64, u64),
    /// How the clock of a base goes whose time is not that of a simulation.
    clock: Option<BaseClock>,
    /// Whether that was as it should at the newest tick.
    clock_is_right: bool,
    counts: CommandCounts,
}

/// Drives one robot until `shutdown`; `on_ready` is called once it takes missions.
pub fn run(start: Start<'_>) -> Running<'_> {
    Box::pin(async move {
        let Start { config, session, fields, mut shutdown, on_ready } = start;
        let service = tokio::select! {
            () = shutdown.requested() => return Ok(()),
            service = RobotService::with_control(keys::DRIVER, config, session) => service?,
        };
        let (mission_sender, missions) = watch::channel(None);
        let refused = service.counts.refused.clone();
        let mission_keys =
            Arc::new(MissionKeys::new(session, &config.robot, config.base()?, mission_sender)?);
        let _serving = mission_keys.serve(session, config, &refused)?;
        let mut keeper = Keeper::new(service.session_of("cmd"), config, Arc::clone(&mission_keys))?;
        tokio::select! {
            () = shutdown.requested() => return Ok(()),
            begun = keeper.begin() => begun?,
        }
        let (fence, last) = watch::channel(DecisionFence::default());
        let key = service.key("decision")?;
        let _last = serve_state(service.session_of("decision"), &key, &refused, move || {
            last.borrow().newest().cloned().ok_or_else(|| Refusal::NoDecision.into())
        })?;
        let lease = keeper.standing();
        let driver = Driver::new(service, config, fields, mission_keys, missions, lease, fence)?;
        let mut metrics = driver.service.metrics();
        driver.counts.register(&mut metrics, driver.missions.clone(), &driver.base);
        driver.sight.register(&mut metrics);
        let announced = driver.service.announce(metrics)?;
        on_ready(announced.metrics_address());
        let outcome = tokio::select! {
            served = driver.serve(shutdown) => served,
            lost = keeper.keep() => Err(lost),
        };
        keeper.release().await;
        outcome
    })
}

impl Driver {
    /// Has heard nothing yet.
    fn new(
        service: RobotService,
        config: &ServiceConfig,
        fields: &Fields,
        keys: Arc<MissionKeys>,
        missions: watch::Receiver<Option<Arc<Mission>>>,
        lease: watch::Receiver<Standing>,
        fence: watch::Sender<DecisionFence>,
    ) -> anyhow::Result<Self> {
        let base = config.base()?;
        Ok(Self {
            sight: SightOfMission::new(fields),
            base,
            missions,
            keys,
            lease,
            odometry: Latest::new(service.inbox("odom")?),
            beliefs: Latest::new(service.inbox("belief")?),
            scans: Latest::new(service.inbox("scan")?),
            further: service.further_scans()?,
            decisions: Latest::new(service.inbox("decision")?),
            commands: service.topic("cmd", Flow::Control)?,
            service,
            fence,
            drive: Drive::new(
                config.base()?,
                config.scanner,
                Guard::new(config.guard.clone(), config.zones.clone()),
            ),
            begun: (0, 0),
            clock: (!config.has_simulated_time()).then(BaseClock::default),
            clock_is_right: true,
            counts: CommandCounts::new(),
        })
    }

    async fn serve(mut self, mut shutdown: Shutdown) -> anyhow::Result<()> {
        loop {
            let wanted_by = self.lease.borrow().wanted_by.clone();
            if let Some(driver) = wanted_by.as_ref().filter(|_| self.stands()) {
                self.stop_in_silence();
                bail!("driver `{driver}` has asked to drive this robot: this one has stopped it and ends");
            }
            let asked_to_go = wanted_by_another(self.lease.clone(), wanted_by);
            let silence = self.silence();
            let begun = self.begun;
            let another = mission_that(self.missions.clone(), |m| (m.run, m.revision) != begun);
            tokio::select! {
                biased;
                () = shutdown.requested() => break,
                () = another => self.begin(),
                () = asked_to_go => {}
                odometry = self.odometry.next() => {
                    let Some(odometry) = odometry.cloned() else { break };
                    // When the run is over or another has begun, no answer of its ticks is awaited.
                    let run = self.missions.borrow().as_ref().map_or(0, |m| m.run);
                    let over = mission_that(self.missions.clone(), |m| m.run != run || m.is_over());
                    tokio::select! {
                        biased;
                        () = self.tick(odometry) => {}
                        () = over => {}
                        () = shutdown.requested() => break,
                    }
                }
                () = tokio::time::sleep(silence) => self.stop_in_silence(),
            }
        }
        self.stop_in_silence();
        Ok(())
    }

    fn mission(&self) -> Option<Arc<Mission>> {
        self.missions.borrow().clone()
    }

    /// Whether the robot stands, as far as this driver can tell.
    fn stands(&self) -> bool {
        let drives = self.mission().is_some_and(|mission| !mission.is_over());
        let is_slow = |odometry: &Odometry| odometry.v.abs() < STANDING && odometry.omega.abs() < STANDING;
        !drives || self.drive.newest_odometry().is_none_or(is_slow)
    }

    /// Why nothing may move the robot now, whatever is decided.
    fn barred(&self, mission: &Mission) -> Option<CommandReason> {
        let standing = self.lease.borrow();
        let lease = self.keys.standing().0;
        // In lockstep no time passes between a command and its tick.
        let is_stale = mission.order.clock == Clock::Realtime && !standing.is_fresh();
        if lease == 0 || standing.wanted_by.is_some() || is_stale {
            return Some(CommandReason::NoLease);
        }
        not_running(mission.state).or((!self.clock_is_right).then_some(CommandReason::BaseClockWrong))
    }

    /// After how long without odometry the base is told to stop: five ticks in real time; in lockstep time
    /// stands still.
    fn silence(&self) -> Duration {
        let mission = self.missions.borrow();
        let realtime = mission.as_ref().filter(|m| m.order.clock == Clock::Realtime);
        let seconds = realtime.map_or(3600.0, |m| 5.0 * m.order.tick_s / m.order.time_scale);
        Duration::from_secs_f64(seconds)
    }

    fn stop_in_silence(&mut self) {
        let Some(mission) = self.mission() else { return };
        let Some(odometry) = self.drive.newest_odometry().cloned() else { return };
        let stop = Command { twist: Twist::default(), reason: CommandReason::NoOdometry };
        self.publish(&mission, &odometry, &stop);
    }

    /// Takes in what belongs to a tick; gives its odometry, or in real time the newest.
    async fn take_in(&mut self, mission: &Mission, mut odometry: Odometry) -> Odometry {
        let clock = mission.order.clock;
        self.measured(&odometry);
        if clock == Clock::Realtime {
            for newer in self.odometry.drain() {
                self.measured(&newer);
                odometry = newer;
            }
            for belief in self.beliefs.drain() {
                self.drive.believed(belief);
            }
        }
        let tick = odometry.tick;
        if let Some(belief) = self.beliefs.of_tick(tick, clock).await {
            self.drive.believed(belief.clone());
        }
        // In lockstep every planning tick has its decision; in between, the last one stands. In real time
        // each one counts: an arbiter that was replaced but lives on must not hide its successor's.
        if clock == Clock::Realtime {
            for decision in self.decisions.drain() {
                self.admit(decision, odometry.stamp, clock);
            }
        } else {
            let plan_tick = tick - tick % u64::from(mission.order.plan_every.max(1));
            let decision = self.decisions.of_tick(plan_tick, clock).await.cloned();
            if let Some(decision) = decision {
                self.admit(decision, odometry.stamp, clock);
            }
        }
        odometry
    }

    async fn tick(&mut self, odometry: Odometry) {
        let Some(mission) = self.mission() else { return };
        let arrived = Instant::now();
        let clock = mission.order.clock;
        let odometry = self.take_in(&mission, odometry).await;
        let tick = odometry.tick;
        let scan = self.scans.of_tick(tick, clock).await.cloned();
        if mission.state == MissionState::Preparing {
            // Once it runs, only what is decided from then on leads to its goal.
            self.fence.send_modify(DecisionFence::lapse);
        }
        if let Some(reason) = self.barred(&mission) {
            self.sight.rest();
            let twist = self.drive.braking(&mission, &odometry);
            return self.publish(&mission, &odometry, &Command { twist, reason });
        }
        self.give_up(&mission);
        self.drive.see_further(self.further.newest());
        let fence = self.fence.borrow();
        let decision = fence.in_force();
        let stamps = [
            ("odom", Some(odometry.stamp)),
            ("scan", scan.as_ref().map(|s| s.stamp)),
            ("belief", self.drive.newest_belief().map(|b| b.stamp)),
            ("decision", decision.map(|d| d.stamp)),
        ];
        self.counts.tick(stamps, odometry.stamp, mission.order.time_scale);
        let map = self.sight.map_of(&mission);
        let (command, blind) = self.drive.command(&Now {
            mission: &mission,
            odometry: &odometry,
            scan: scan.as_ref(),
            refused: self.scans.refused(),
            map: map.as_deref(),
            decision,
        });
        drop(fence);
        self.sight.note(blind);
        self.publish(&mission, &odometry, &command);
        self.service.counts.record(arrived.elapsed());
    }

    /// A new run, or a new revision of this one. Nothing of a new run in lockstep can be on its way before all roles
    /// are ready, so all there is belongs to the one before; of a new revision nothing has to be forgotten. In real
    /// time a base goes on measuring, whatever the mission, and is told what to do each time.
    fn begin(&mut self) {
        let Some(mission) = self.mission() else { return };
        if self.begun.0 != mission.run {
            if mission.order.clock == Clock::Lockstep {
                self.odometry.clear();
            }
            self.forget();
        }
        self.begun = (mission.run, mission.revision);
        self.drive.begin(&mission);
        self.sight.begin(&mission);
        let readiness = self.service.readiness(mission.revision, &Ok(()));
        if let Err(reject) = self.keys.change(|current| current.readiness(readiness)) {
            tracing::warn!(%reject, "the mission changed before the driver was ready");
        }
    }

    /// Forgets what belongs to a clock that is over, but not which decision the next one has to outrank.
    fn forget(&mut self) {
        self.beliefs.clear();
        self.scans.clear();
        self.further.clear();
        self.decisions.clear();
        self.clock.iter_mut().for_each(BaseClock::clear);
        self.drive.forget();
        self.sight.rest();
        self.fence.send_modify(DecisionFence::lapse);
    }

    /// Ends the mission if odometry has made a step that the base cannot: where the robot is is then not known. The
    /// odometry of a simulated base errs as its scenario says.
    fn check_motion(&self, odometry: &Odometry) {
        let Some(mission) = self.mission().filter(|mission| !mission.is_over()) else { return };
        if self.base == Base::Simulated {
            return;
        }
        let robot = convert::robot_model(&mission.order.robot_model);
        let Some(before) = self.drive.odometry_before(odometry.tick) else { return };
        if is_motion(before, odometry, &robot) {
            return;
        }
        tracing::error!(
            tick = odometry.tick,
            "odometry has made a step that the base cannot: the robot is lost"
        );
        self.finish(&mission, MissionEnd::Lost);
    }

    /// Ends the mission if the arbiter has given it up. The robot stands by then.
    fn give_up(&self, mission: &Mission) {
        let end = self.fence.borrow().in_force().and_then(given_up);
        if let Some(end) = end {
            self.finish(mission, end);
        }
    }

    fn finish(&self, mission: &Mission, end: MissionEnd) {
        let command = MissionCommand::Finish { revision: mission.revision, end };
        if let Err(reject) = self.keys.change(|current| current.command(command)) {
            tracing::warn!(%reject, "the mission goes on");
        }
    }

    /// Takes note of odometry. A base that was restarted in mid-run begins at tick 0 again, and so does its clock.
    fn measured(&mut self, odometry: &Odometry) {
        let newest = self.drive.newest_odometry().map(|odometry| odometry.tick);
        if newest.is_some_and(|newest| has_started_over(newest, odometry.tick)) {
            tracing::warn!(tick = odometry.tick, ?newest, "the base has started over");
            self.forget();
        }
        if let Some(clock) = &mut self.clock {
            let was_right = self.clock_is_right;
            self.clock_is_right = clock.heard(odometry.stamp, Instant::now());
            if was_right && !self.clock_is_right {
                tracing::warn!(stamp = odometry.stamp, "the base's clock jumps, crawls or stands");
            }
        }
        self.check_motion(odometry);
        self.drive.measured(odometry.clone());
    }

    fn admit(&mut self, decision: Decision, now: f64, clock: Clock) {
        self.fence.send_if_modified(|fence| fence.admit(decision, now, clock));
    }

    fn publish(&mut self, mission: &Mission, odometry: &Odometry, command: &Command) {
        let decision = self.fence.borrow().newest().map_or((0, 0), |d| (d.epoch, d.seq));
        let (lease, _) = self.keys.standing();
        self.counts.command(command.reason);
        let told = self.drive.tell(mission, odometry, command, Grounds { lease, decision });
        self.commands.publish(&told, mission.order.clock);
    }
}

/// Why the mission lets nothing move, if it does not run.
fn not_running(state: MissionState) -> Option<CommandReason> {
    match state {
        MissionState::Running => None,
        MissionState::Paused => Some(CommandReason::Paused),
        _ => Some(CommandReason::MissionNotRunning),
    }
}

/// Completes once another driver than `known` waits for the lease, or none does any more.
async fn wanted_by_another(mut lease: watch::Receiver<Standing>, known: Option<String>) {
    // What keeps the lease lives for as long as this service does: waiting for it cannot fail.
    let _ = lease.wait_for(|standing| standing.wanted_by != known).await;
}

/// Completes once the mission is such.
async fn mission_that(mut missions: watch::Receiver<Option<Arc<Mission>>>, such: impl Fn(&Mission) -> bool) {
    // The mission is served for as long as this service lives: waiting for it cannot fail.
    let _ = missions.wait_for(|m| m.as_deref().is_some_and(&such)).await;
}
