//! People that another program plays: taken in tick by tick, as they are published.
//!
//! With every tick the simulator says where the robot really is, on `world/{world}/robot`; the program that plays the
//! crowd answers with the people of that tick on `world/{world}/people`. In lockstep the tick waits for them.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::bail;
use curionav_crowdsim::World;
use curionav_crowdsim::scenario::PeopleKind;
use curionav_crowdsim::world::FIRST_LIVE_ID;
use curionav_planning::geometry::{Pose2, Twist};
use curionav_runtime::convert;
use curionav_runtime::lockstep::Latest;
use curionav_runtime::serve::ServeCounts;
use curionav_runtime::topic::{Flow, Inbox, Topic};
use curionav_schemas::limits::MAX_PEOPLE;
use curionav_schemas::{self as wire, Clock, Frame, Mission, Odometry, keys};
use zenoh::Session;

/// In lockstep the tick is announced again after this long: the program that plays the crowd may just have started.
const ANNOUNCE_PERIOD: Duration = Duration::from_millis(500);
/// In real time people are where they were last seen for so long, seconds; then it is not known where they are.
const AGE_MAX: f64 = 0.5;

/// The crowd of a world, as far as it comes from outside.
pub(crate) struct LiveCrowd {
    key: String,
    robot: Topic<Odometry>,
    people: Latest<wire::People>,
    counts: Arc<ServeCounts>,
    /// When the newest people came, in real time; at first, when the run began.
    heard: Instant,
    /// Whether any have come in this run.
    known: bool,
}

impl LiveCrowd {
    /// Follows the people published for `world`; what is refused is added to `counts`.
    pub(crate) fn new(session: &Session, world: &str, counts: &Arc<ServeCounts>) -> anyhow::Result<Self> {
        let key = keys::world(world, "people")?;
        Ok(Self {
            robot: Topic::new(session, &keys::world(world, "robot")?, Flow::Sensor)?,
            people: Latest::new(Inbox::counted(session, &key, counts)?),
            counts: Arc::clone(counts),
            key,
            heard: Instant::now(),
            known: false,
        })
    }

    /// Forgets the people of the run before.
    pub(crate) fn begin(&mut self) {
        self.people.clear();
        self.heard = Instant::now();
        self.known = false;
    }

    /// Puts the people of this tick into the world; in real time the newest. Whether it is known where people
    /// are: false while those of a live crowd are too old. Fails when no program plays the crowd any more.
    pub(crate) async fn take_in(&mut self, world: &mut World, mission: &Mission) -> anyhow::Result<bool> {
        if world.scenario().people.kind != PeopleKind::Live {
            return Ok(true);
        }
        self.announce(world, mission.order.clock);
        match mission.order.clock {
            Clock::Lockstep => self.of_this_tick(world).await.map(|()| true),
            Clock::Realtime => self.newest(world, mission.order.time_scale),
        }
    }

    async fn of_this_tick(&mut self, world: &mut World) -> anyhow::Result<()> {
        let tick = world.tick();
        let patience = world.scenario().people.live_patience_s;
        let began = Instant::now();
        let refused = self.counts.refused.total();
        loop {
            let people = self.people.of_tick(tick, Clock::Lockstep);
            if let Ok(Some(message)) = tokio::time::timeout(ANNOUNCE_PERIOD, people).await {
                let joined = join(message, world);
                return joined
                    .map_err(|reason| anyhow::anyhow!("people of tick {tick} on {}: {reason}", self.key));
            }
            if began.elapsed().as_secs_f64() >= patience {
                let refused = self.counts.refused.total() - refused;
                let unusable =
                    if refused > 0 { format!("; {refused} messages refused") } else { String::new() };
                bail!("no people for tick {tick} on {} within {patience} s{unusable}", self.key);
            }
            self.announce(world, Clock::Lockstep);
        }
    }

    fn newest(&mut self, world: &mut World, time_scale: f64) -> anyhow::Result<bool> {
        match self.people.drain().pop().map(|message| join(&message, world)) {
            Some(Ok(())) => (self.heard, self.known) = (Instant::now(), true),
            Some(Err(reason)) => {
                self.counts.refused.add(&["invalid"]);
                tracing::warn!(key = self.key, reason, "people not used");
            }
            None => {}
        }
        let age = self.heard.elapsed().as_secs_f64();
        let patience = world.scenario().people.live_patience_s;
        if age > patience {
            bail!("no people on {} for {patience} s", self.key);
        }
        Ok(self.known && age * time_scale <= AGE_MAX)
    }

    /// Says what tick it is and where the robot really is.
    fn announce(&self, world: &World, clock: Clock) {
        let truth = world.truth();
        let Pose2 { x, y, heading } = truth.pose;
        let Twist { v, omega } = truth.twist;
        let message = Odometry { tick: truth.tick, stamp: truth.time, x, y, heading, v, omega };
        self.robot.publish(&message, clock);
    }
}

/// Puts the people of a message into the world, if they can join those who are there.
fn join(message: &wire::People, world: &mut World) -> Result<(), String> {
    if message.frame != Frame::Map {
        return Err("frame must be `map`: a world knows no other".into());
    }
    let ids = &message.id.0;
    if let Some(id) = ids.iter().find(|id| **id > u32::MAX - FIRST_LIVE_ID) {
        return Err(format!("id {id} exceeds {}", u32::MAX - FIRST_LIVE_ID));
    }
    let mut seen = BTreeSet::new();
    if let Some(id) = ids.iter().find(|id| !seen.insert(**id)) {
        return Err(format!("id {id} stands twice"));
    }
    let others = world.people().id.iter().filter(|id| **id < FIRST_LIVE_ID).count();
    if others + ids.len() > MAX_PEOPLE {
        return Err(format!("{} people beside {others} others, at most {MAX_PEOPLE} in all", ids.len()));
    }
    world.replace_live_people(&convert::people(message, Pose2::default()));
    Ok(())
}
