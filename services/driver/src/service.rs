//! The driver on its robot.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use curionav_planning::geometry::Twist;
use curionav_runtime::convert;
use curionav_runtime::lockstep::{Latest, has_started_over};
use curionav_runtime::process::{Running, Start};
use curionav_runtime::robot_limits::Base;
use curionav_runtime::robot_service::{RobotService, is_over};
use curionav_runtime::serve::serve_state;
use curionav_runtime::shutdown::Shutdown;
use curionav_runtime::topic::{Flow, Topic};
use curionav_schemas::{
    self as wire, Belief, Clock, CommandReason, Decision, Mission, MissionState, Odometry, Refusal, Scan,
};
use tokio::sync::watch;

use crate::command_counts::CommandCounts;
use crate::control::{Inputs, braking, command, on_arrival};
use crate::decision_fence::{Admission, DecisionFence};
use crate::mission_keys::MissionKeys;

/// Ticks for which odometry and beliefs are remembered: longer than any decision is valid.
const REMEMBERED_TICKS: usize = 64;

struct Driver {
    service: RobotService,
    /// Bounds whatever a mission or a decision asks for.
    base: Base,
    missions: watch::Receiver<Option<Arc<Mission>>>,
    keys: Arc<MissionKeys>,
    odometry: Latest<Odometry>,
    beliefs: Latest<Belief>,
    scans: Latest<Scan>,
    decisions: Latest<Decision>,
    commands: Topic<wire::Twist>,
    /// Shared with the queryable that tells an arbiter which epoch it has to exceed.
    fence: watch::Sender<DecisionFence>,
    odometry_of: BTreeMap<u64, Odometry>,
    belief_of: BTreeMap<u64, Belief>,
    /// Tick of the last command, and the command.
    told: Option<(u64, Twist)>,
    /// Why the last command was given, and since which stamp every command has been given for this reason.
    reason: Option<(CommandReason, f64)>,
    /// Run and revision that it has reported ready for.
    begun: (u64, u64),
    counts: CommandCounts,
}

/// Drives one robot until `shutdown`; `on_ready` is called once it takes missions.
pub fn run(start: Start<'_>) -> Running<'_> {
    Box::pin(async move {
        let Start { config, session, mut shutdown, on_ready, .. } = start;
        let service = tokio::select! {
            () = shutdown.requested() => return Ok(()),
            service = RobotService::with_control("driver", config, session) => service?,
        };
        let base = config.base()?;
        let (mission_sender, missions) = watch::channel(None);
        let refused = service.counts.refused.clone();
        let keys = Arc::new(MissionKeys::new(session, &config.robot, base.clone(), mission_sender)?);
        let _serving = keys.serve(session, &config.robot, &refused)?;
        let (fence, last) = watch::channel(DecisionFence::default());
        let key = service.key("decision")?;
        let _last = serve_state(service.session_of("decision"), &key, &refused, move || {
            last.borrow().newest().cloned().ok_or_else(|| Refusal::NoDecision.into())
        })?;
        let driver = Driver {
            base,
            missions,
            keys,
            odometry: Latest::new(service.inbox("odom")?),
            beliefs: Latest::new(service.inbox("belief")?),
            scans: Latest::new(service.inbox("scan")?),
            decisions: Latest::new(service.inbox("decision")?),
            commands: service.topic("cmd", Flow::Control)?,
            service,
            fence,
            odometry_of: BTreeMap::new(),
            belief_of: BTreeMap::new(),
            told: None,
            reason: None,
            begun: (0, 0),
            counts: CommandCounts::new(),
        };
        let mut metrics = driver.service.metrics();
        driver.counts.register(&mut metrics, driver.missions.clone(), &driver.base);
        let announced = driver.service.announce(metrics)?;
        on_ready(announced.metrics_address());
        driver.serve(shutdown).await
    })
}

impl Driver {
    async fn serve(mut self, mut shutdown: Shutdown) -> anyhow::Result<()> {
        loop {
            let silence = self.silence();
            let begun = self.begun;
            let another = mission_that(self.missions.clone(), |m| (m.run, m.revision) != begun);
            tokio::select! {
                biased;
                () = shutdown.requested() => break,
                () = another => self.begin(),
                odometry = self.odometry.next() => {
                    let Some(odometry) = odometry.cloned() else { break };
                    // When the run is over or another has begun, no answer of its ticks is awaited.
                    let run = self.missions.borrow().as_ref().map_or(0, |m| m.run);
                    let over = mission_that(self.missions.clone(), |m| m.run != run || is_over(m));
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
        let Some((_, odometry)) = self.odometry_of.last_key_value() else { return };
        self.publish(&mission, &odometry.clone(), Twist::default(), CommandReason::NoOdometry);
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
                remember(&mut self.belief_of, belief.tick, belief);
            }
        }
        let tick = odometry.tick;
        if let Some(belief) = self.beliefs.of_tick(tick, clock).await {
            remember(&mut self.belief_of, belief.tick, belief.clone());
        }
        // In lockstep every planning tick has its decision; in between, the last one stands. In real time
        // each one counts: an arbiter that was replaced but lives on must not hide its successor's.
        if clock == Clock::Realtime {
            self.decisions.drain().into_iter().for_each(|decision| self.admit(decision));
        } else {
            let plan_tick = tick - tick % u64::from(mission.order.plan_every.max(1));
            let decision = self.decisions.of_tick(plan_tick, clock).await.cloned();
            decision.into_iter().for_each(|decision| self.admit(decision));
        }
        odometry
    }

    async fn tick(&mut self, odometry: Odometry) {
        let Some(mission) = self.mission() else { return };
        let arrived = Instant::now();
        let clock = mission.order.clock;
        let period = mission.order.tick_s;
        let odometry = self.take_in(&mission, odometry).await;
        let tick = odometry.tick;
        let scan = self.scans.of_tick(tick, clock).await.cloned();
        let robot = convert::robot_model(&mission.order.robot_model);
        let stopping = self.base.stopping(&robot);
        // In lockstep the base has carried out every command before it measures.
        let recent = self.told.filter(|(at, _)| clock == Clock::Realtime && at.saturating_add(1) >= tick);
        let on_its_way = recent.map(|(_, twist)| twist);
        if mission.state == MissionState::Preparing {
            // Once it runs, only what is decided from then on leads to its goal.
            self.fence.send_modify(DecisionFence::lapse);
        }
        if mission.state != MissionState::Running {
            let twist = braking(on_arrival(&odometry, on_its_way, &robot, period), &stopping, period);
            self.publish(&mission, &odometry, twist, CommandReason::MissionNotRunning);
            return;
        }
        let fence = self.fence.borrow();
        let decision = fence.in_force();
        let belief = self.belief_of.last_key_value().map(|(_, b)| b);
        let stamps = [
            ("odom", Some(odometry.stamp)),
            ("scan", scan.as_ref().map(|s| s.stamp)),
            ("belief", belief.map(|b| b.stamp)),
            ("decision", decision.map(|d| d.stamp)),
        ];
        self.counts.tick(stamps, odometry.stamp, mission.order.time_scale);
        let command = command(&Inputs {
            odometry: &odometry,
            belief: belief.and_then(|b| Some((b, self.odometry_of.get(&b.tick)?))),
            scan: scan.as_ref().and_then(|s| Some((s, self.odometry_of.get(&s.tick)?))),
            decision,
            made_from: decision.and_then(|d| self.belief_of.get(&d.tick)),
            robot: &robot,
            stopping: &stopping,
            ages: self.base.ages(),
            period,
            on_its_way,
        });
        drop(fence);
        self.publish(&mission, &odometry, command.twist, command.reason);
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
        let readiness = self.service.readiness(mission.revision, &Ok(()));
        if let Err(reject) = self.keys.change(|current| current.readiness(readiness)) {
            tracing::warn!(%reject, "the mission changed before the driver was ready");
        }
    }

    /// Forgets what belongs to a clock that is over, but not which decision the next one has to outrank.
    fn forget(&mut self) {
        self.beliefs.clear();
        self.scans.clear();
        self.decisions.clear();
        self.odometry_of.clear();
        self.belief_of.clear();
        self.told = None;
        self.reason = None;
        self.fence.send_modify(DecisionFence::lapse);
    }

    /// Takes note of odometry. A base that was restarted in mid-run begins at tick 0 again, and so does its clock.
    fn measured(&mut self, odometry: &Odometry) {
        let newest = self.odometry_of.last_key_value().map(|(tick, _)| *tick);
        if newest.is_some_and(|newest| has_started_over(newest, odometry.tick)) {
            tracing::warn!(tick = odometry.tick, ?newest, "the base has started over");
            self.forget();
        }
        remember(&mut self.odometry_of, odometry.tick, odometry.clone());
    }

    fn admit(&mut self, decision: Decision) {
        let id = (decision.epoch, decision.seq);
        let mut admission = Admission::Older;
        self.fence.send_if_modified(|fence| {
            admission = fence.admit(decision);
            admission == Admission::Admitted
        });
        if admission == Admission::OutOfReach {
            tracing::warn!(?id, "a decision refused: no arbiter has such an epoch");
            self.service.counts.refuse(&Refusal::EpochOutOfReach.at("epoch"));
        }
    }

    fn publish(&mut self, mission: &Mission, odometry: &Odometry, twist: Twist, reason: CommandReason) {
        let Odometry { tick, stamp, .. } = *odometry;
        // Whatever was computed above, nothing else reaches the base.
        let twist = self.base.clamp(twist, &convert::robot_model(&mission.order.robot_model));
        // A clock that has begun anew makes every reason a new one.
        let lasting = self.reason.filter(|(last, since)| *last == reason && *since <= stamp);
        let (_, since) = *self.reason.insert(lasting.unwrap_or((reason, stamp)));
        let (epoch, seq) = self.fence.borrow().newest().map_or((0, 0), |d| (d.epoch, d.seq));
        let command = wire::Twist { epoch, seq, tick, stamp, v: twist.v, omega: twist.omega, reason, since };
        self.counts.command(reason);
        self.commands.publish(&command, mission.order.clock);
        self.told = Some((tick, twist));
    }
}

/// Completes once the mission is such.
async fn mission_that(mut missions: watch::Receiver<Option<Arc<Mission>>>, such: impl Fn(&Mission) -> bool) {
    // The mission is served for as long as this service lives: waiting for it cannot fail.
    let _ = missions.wait_for(|m| m.as_deref().is_some_and(&such)).await;
}

/// Keeps the newest few. What is left of a clock that is over would count as newer for ever.
fn remember<T>(of: &mut BTreeMap<u64, T>, tick: u64, value: T) {
    if of.last_key_value().is_some_and(|(newest, _)| has_started_over(*newest, tick)) {
        of.clear();
    }
    of.insert(tick, value);
    while of.len() > REMEMBERED_TICKS {
        of.pop_first();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_remembered_is_the_newest_also_of_a_base_that_has_started_over() {
        let mut of = BTreeMap::new();
        (0..200).chain([197, 195]).for_each(|tick| remember(&mut of, tick, tick));
        assert_eq!((of.len(), of.last_key_value()), (REMEMBERED_TICKS, Some((&199, &199))));
        (0..3).for_each(|tick| remember(&mut of, tick, tick));
        assert_eq!(of.keys().copied().collect::<Vec<_>>(), [0, 1, 2]);
    }
}
