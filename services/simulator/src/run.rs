//! Playing one scenario, tick by tick.

use std::collections::BTreeMap;
use std::pin::pin;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use curionav_crowdsim::World;
use curionav_crowdsim::outcome::Outcome;
use curionav_in_process::Prepared;
use curionav_in_process::judge::{Judge, Standing, is_given_up, outcome_of};
use curionav_in_process::sensed::{Sensed, sense};
use curionav_planning::geometry::Twist;
use curionav_runtime::command::Commander;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::fields::Fields;
use curionav_runtime::lease::BaseLease;
use curionav_runtime::lockstep::{LOCKSTEP_PATIENCE, Latest};
use curionav_runtime::query::AskError;
use curionav_runtime::serve::ServeCounts;
use curionav_runtime::topic::{Flow, Inbox, Topic};
use curionav_schemas::{
    self as wire, Belief, Clock, Decision, Mission, MissionCommand, MissionEnd, MissionOrder, MissionState,
    Odometry, Refusal, Reject, RunResult, Scan, keys,
};
use zenoh::Session;

use crate::crowd::LiveCrowd;

/// How long the driver may take to accept a mission.
const DRIVER_TIMEOUT: Duration = Duration::from_secs(10);
/// How long the services may take to prepare: fetch the map, derive fields, warm the pool.
const READY_TIMEOUT: Duration = Duration::from_secs(90);
/// How long the answers to the tick that ends a mission may take; if others ended it, there may be none.
const LAST_ANSWERS: Duration = Duration::from_millis(500);
/// The simulated base stops by itself without a command for this long, seconds: its own watchdog.
const COMMAND_AGE_MAX: f64 = 0.3;

/// The role of simulators.
pub(crate) const SIMULATOR: &str = "simulator";

/// The streams of one robot.
pub(crate) struct Streams {
    /// How the driver is told what to do.
    commander: Commander,
    /// Which driver the base obeys, and whether it is paused.
    lease: Arc<BaseLease>,
    missions: Arc<Inbox<Mission>>,
    beliefs: Latest<Belief>,
    decisions: Latest<Decision>,
    commands: Latest<wire::Twist>,
    scans: Topic<Scan>,
    odometry: Topic<Odometry>,
    people: Topic<wire::People>,
    /// Those of the tracker, if the run has one.
    tracked: Latest<wire::People>,
    crowd: LiveCrowd,
    /// When each service was last heard of, in real time.
    heard: BTreeMap<&'static str, Instant>,
}

/// Takes the tick, the seconds of the run and the metres to the goal.
pub(crate) type Progress<'a> = &'a (dyn Fn(u64, f64, f64) + Send + Sync);

impl Streams {
    /// Those of the robot of `config` and of a live crowd; what they refuse is added to `counts`.
    pub(crate) fn new(
        session: &Session,
        config: &ServiceConfig,
        lease: Arc<BaseLease>,
        crowd: LiveCrowd,
        counts: &Arc<ServeCounts>,
    ) -> anyhow::Result<Self> {
        let robot = &config.robot;
        let people = keys::robot(robot, "people")?;
        Ok(Self {
            commander: Commander::new(session, robot, &config.identity(SIMULATOR)?),
            missions: Arc::new(Inbox::counted(session, &keys::robot(robot, "mission")?, counts)?),
            beliefs: Latest::new(Inbox::counted(session, &keys::robot(robot, "belief")?, counts)?),
            decisions: Latest::new(Inbox::counted(session, &keys::robot(robot, "decision")?, counts)?),
            commands: Latest::new(lease.commands(Inbox::counted(
                session,
                &keys::robot(robot, "cmd")?,
                counts,
            )?)),
            lease,
            scans: Topic::new(session, &keys::robot(robot, "scan")?, Flow::Sensor)?,
            odometry: Topic::new(session, &keys::robot(robot, "odom")?, Flow::Sensor)?,
            people: Topic::new(session, &people, Flow::Sensor)?,
            tracked: Latest::new(Inbox::counted(session, &people, counts)?),
            crowd,
            heard: BTreeMap::new(),
        })
    }

    /// Plays `prepared` to its end.
    pub(crate) async fn play(
        &mut self,
        prepared: Prepared,
        fields: &Fields,
        progress: Progress<'_>,
    ) -> Result<RunResult, MissionEnd> {
        let Prepared { mut world, order, profile, .. } = prepared;
        let begun = self.begin(order).await;
        if begun.is_err() {
            // What never began must not begin later, when nothing watches it.
            if let Err(error) = self.request(&MissionCommand::Cancel).await {
                tracing::debug!(%error, "nothing to cancel");
            }
        }
        let mut mission = begun?;
        let mut judge = Judge::new(mission.order.plan_every);
        let outcome = self.ticks(&mut world, &mut mission, &mut judge, progress).await;
        let end = match &outcome {
            Ok(Outcome::Reached) => MissionEnd::Reached,
            Ok(Outcome::Timeout) => MissionEnd::Timeout,
            Ok(Outcome::Lost) => MissionEnd::Lost,
            Ok(Outcome::NoWay) => MissionEnd::NoWayToGoal,
            Err(end) => end.clone(),
        };
        // The robot must not go on driving once its run is no longer judged.
        if let Err(error) = self.request(&MissionCommand::Finish { revision: mission.revision, end }).await {
            tracing::warn!(%error, "the driver did not take the end of the mission");
        }
        judge.finish(&world, &mission, &profile.name, outcome?, fields).map_err(failed)
    }

    async fn request(&self, request: &MissionCommand) -> Result<Mission, AskError> {
        self.commander.command_driver(request, self.lease.number(), DRIVER_TIMEOUT).await
    }

    /// Gives the mission to the driver and waits until every required role is ready for it.
    async fn begin(&mut self, order: MissionOrder) -> Result<Mission, MissionEnd> {
        while self.missions.try_next().is_some() {}
        let deadline = tokio::time::Instant::now() + DRIVER_TIMEOUT;
        let request = MissionCommand::Set { order: Box::new(order) };
        let accepted = loop {
            match self.request(&request).await {
                Ok(accepted) => break accepted,
                Err(AskError::Rejected(reject)) if !reject.why.is_transient() => {
                    return Err(MissionEnd::WorldFailed { reject });
                }
                Err(error) if tokio::time::Instant::now() > deadline => {
                    return Err(failed(format!("no driver takes the mission: {error}")));
                }
                Err(_) => tokio::time::sleep(Duration::from_millis(100)).await,
            }
        };
        let mut current = accepted.clone();
        let wait = async {
            while current.state == MissionState::Preparing {
                match self.missions.next().await {
                    Some(next) if next.run == accepted.run => current = next,
                    Some(_) => {}
                    None => return Err(failed("the session is closed")),
                }
            }
            Ok(())
        };
        let Ok(waited) = tokio::time::timeout(READY_TIMEOUT, wait).await else {
            let required = current.order.require.iter().map(String::as_str);
            let missing: Vec<&str> =
                required.filter(|role| !current.ready.iter().any(|r| r == role)).collect();
            let seconds = READY_TIMEOUT.as_secs();
            return Err(failed(format!("not ready within {seconds} s: {}", missing.join(", "))));
        };
        waited?;
        // What is here was said before any tick of this run.
        self.beliefs.clear();
        self.decisions.clear();
        self.commands.clear();
        self.tracked.clear();
        self.crowd.begin();
        self.heard.clear();
        ended(&current).map_or(Ok(current), Err)
    }

    async fn ticks(
        &mut self,
        world: &mut World,
        mission: &mut Mission,
        judge: &mut Judge,
        progress: Progress<'_>,
    ) -> Result<Outcome, MissionEnd> {
        let realtime = mission.order.clock == Clock::Realtime;
        let lease = mission.lease;
        let base = Arc::clone(&self.lease);
        let period = Duration::from_secs_f64(mission.order.tick_s / mission.order.time_scale);
        let mut pace = tokio::time::interval(period);
        pace.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        // What was said of the mission while a tick was under way counts from the next one on.
        let missions = Arc::clone(&self.missions);
        let mut said = None;
        loop {
            if realtime {
                pace.tick().await;
            }
            if base.number() != lease {
                return Err(failed(ANOTHER_DRIVES));
            }
            if let Some(newest) = std::iter::from_fn(|| missions.try_next()).last().or(said.take()) {
                *mission = newest;
            }
            if let Some(outcome) = outcome_of(mission).map_err(|end| *end)? {
                return Ok(outcome);
            }
            let people_known = tokio::select! {
                known = self.crowd.take_in(world, mission) => known.map_err(|e| failed(format!("{e:#}")))?,
                () = end_of_mission(&missions, &mut said) => continue,
            };
            let published = self.publish(world, mission.order.clock, people_known);
            published.map_err(|reject| MissionEnd::WorldFailed { reject })?;
            let answered = {
                let mut answers = pin!(self.answers(world, mission));
                let in_time = tokio::select! {
                    biased;
                    answers = &mut answers => Some(answers),
                    // A driver that was restarted knows nothing of the run, and would answer no tick of it.
                    () = another_drives(&base, lease) => return Err(failed(ANOTHER_DRIVES)),
                    () = end_of_mission(&missions, &mut said) => None,
                };
                match in_time {
                    Some(answers) => answers,
                    // What ended the mission is the answer to this tick, and counts, whichever comes first.
                    None => match tokio::time::timeout(LAST_ANSWERS, answers).await {
                        Ok(answers) => answers,
                        Err(_) => continue,
                    },
                }
            };
            let (belief, decisions, command) = answered.map_err(|e| failed(format!("{e:#}")))?;
            let Standing { to_go, outcome } = judge.tick(world, mission, belief, &decisions);
            progress(world.tick(), world.time(), to_go);
            if let Some(outcome) = outcome {
                return Ok(outcome);
            }
            // Whatever the driver says, a base that is paused brakes.
            world.step(if self.lease.paused_for().is_some() { Twist::default() } else { command });
            if !realtime && is_given_up(&decisions) {
                // The driver's word that the mission is over may come later than its command of this tick.
                let _ = tokio::time::timeout(LAST_ANSWERS, end_of_mission(&missions, &mut said)).await;
            }
        }
    }

    /// What the sensors say; of people nothing if a tracker has to find them, or while it is not known where they are.
    fn publish(&self, world: &World, clock: Clock, people_known: bool) -> Result<(), Reject> {
        let Sensed { scan, odometry, people } = sense(world)?;
        if let Some(people) = people.filter(|_| people_known) {
            self.people.publish(&people, clock);
        }
        self.scans.publish(&scan, clock);
        self.odometry.publish(&odometry, clock);
        Ok(())
    }

    /// In lockstep the belief, decision and command of this very tick; in real time the newest.
    async fn answers(&mut self, world: &World, mission: &Mission) -> anyhow::Result<Answers> {
        let tick = world.tick();
        let clock = mission.order.clock;
        if clock == Clock::Realtime {
            let decisions = self.decisions.drain();
            let belief = self.beliefs.newest().cloned();
            let command = self.commands.newest();
            let fresh = command.filter(|c| (0.0..=COMMAND_AGE_MAX).contains(&(world.time() - c.stamp)));
            let command = fresh.map(twist);
            let believes = belief.as_ref().is_some_and(|b| world.time() - b.stamp < 1.0);
            let now = Instant::now();
            for (what, is_heard) in
                [(BELIEF, believes), (COMMAND, command.is_some()), (DECISION, !decisions.is_empty())]
            {
                let last = self.heard.entry(what).or_insert(now);
                if is_heard {
                    *last = now;
                }
                if now - *last > LOCKSTEP_PATIENCE {
                    bail!("no {what} for {} s", LOCKSTEP_PATIENCE.as_secs());
                }
            }
            return Ok((belief, decisions, command.unwrap_or_default()));
        }
        let silent =
            |what: &str| format!("no {what} for tick {tick} within {} s", LOCKSTEP_PATIENCE.as_secs());
        let belief = self.beliefs.of_tick(tick, clock).await.cloned();
        let belief = belief.with_context(|| silent(BELIEF))?;
        // Without them the robot would only stand, and no error would say why.
        if mission.order.requires(keys::TRACKER) {
            self.tracked.of_tick(tick, clock).await.with_context(|| silent(PEOPLE))?;
        }
        let mut decisions = Vec::new();
        if tick.is_multiple_of(u64::from(mission.order.plan_every)) {
            let decision = self.decisions.of_tick(tick, clock).await.cloned();
            decisions.push(decision.with_context(|| silent(DECISION))?);
        }
        let command = self.commands.of_tick(tick, clock).await.map(twist);
        Ok((Some(belief), decisions, command.with_context(|| silent(COMMAND))?))
    }
}

/// A belief, if there is one, the decisions, and what the base is to do.
type Answers = (Option<Belief>, Vec<Decision>, Twist);

/// What a run cannot do without.
const BELIEF: &str = "belief from the localizer";
const PEOPLE: &str = "people from the tracker";
const DECISION: &str = "decision from the arbiter";
const COMMAND: &str = "command from the driver";

const ANOTHER_DRIVES: &str = "the driver that had the mission drives the robot no more";
/// Between two looks at who drives, while a tick is awaited.
const LOOK: Duration = Duration::from_millis(100);

/// Completes once the base obeys another driver than that of this grant.
async fn another_drives(base: &BaseLease, lease: u64) {
    while base.number() == lease {
        tokio::time::sleep(LOOK).await;
    }
}

/// Why the run cannot go on, if its mission has ended.
fn ended(mission: &Mission) -> Option<MissionEnd> {
    mission.is_over().then(|| mission.end.clone().unwrap_or(MissionEnd::Cancelled))
}

fn failed(detail: impl ToString) -> MissionEnd {
    MissionEnd::WorldFailed { reject: Refusal::failed(detail).into() }
}

/// Completes when the mission has ended: its ticks are no longer answered.
async fn end_of_mission(missions: &Inbox<Mission>, said: &mut Option<Mission>) {
    while !said.as_ref().is_some_and(Mission::is_over) {
        match missions.next().await {
            Some(newest) => *said = Some(newest),
            None => std::future::pending().await,
        }
    }
}

fn twist(command: &wire::Twist) -> Twist {
    Twist { v: command.v, omega: command.omega }
}
