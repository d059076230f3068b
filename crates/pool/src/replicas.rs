//! What is known of the replicas: who may be given work, and who has failed.
//!
//! A replica is given work once it has answered a question without candidates: then it is alive and has
//! derived what the mission needs. One that fails once loses that standing and is asked again
//! until it answers: warming up, probing and the circuit breaker are the same thing. Events and times in,
//! values out; nothing here waits.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;
use std::time::Duration;

use curionav_runtime::config::SLOTS_MAX;
use curionav_schemas::{Clock, keys};

/// Between two probes of a replica that does not answer them.
const PROBE_PAUSE: Duration = Duration::from_millis(200);
/// The pause after the first probe, and twice as long after each: what is not prepared yet may be in a moment.
const FIRST_PAUSE: Duration = Duration::from_millis(10);
/// A replica that answers probes and fails questions is asked again after 0, 1, 2 and from then on 3 such pauses of
/// real time.
const PAUSES_MAX: u32 = 3;
/// The most pauses for one that refuses one question after the other as overloaded: a second after a burst the robot is
/// to be nominal again.
const RESTS_MAX: u32 = 1;
/// A replica computes at least this long on a shard of a batch that is split: a question costs it about 0.2 ms besides,
/// and four replicas that spend a quarter of their time on questions are worth three.
const SHARD_MIN: Duration = Duration::from_millis(2);
/// And on at least so many candidates, however slow it is: with less, a pool that has too much to do would do less
/// still.
const CANDIDATES_MIN: f64 = 16.0;
/// By this share the fastest scoring of late is forgotten with every answer.
const FORGOTTEN: f64 = 0.02;
/// Questions that may be asked twice, as a share of all questions. Asking a second replica each time would double the
/// load of a pool that is slow throughout, and it would never recover (Dean and Barroso, The tail at scale, 2013;
/// Bronson et al., Metastable failures in distributed systems, 2021).
const ASKED_TWICE: f64 = 0.05;
/// Questions that may be asked twice at once: the shards of one cycle that a lost replica leaves unanswered.
const ASKED_TWICE_AT_ONCE: f64 = 8.0;

/// Why an answer was of no use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// It refused, having too much to do: no fault of its own, but in real time it gets a rest.
    Overloaded,
    /// It is not prepared for this mission, or no longer.
    Cold,
    /// Late, silent, gone, or talking nonsense.
    Broken,
}

impl Failure {
    /// In one word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Overloaded => "overloaded",
            Self::Cold => "cold",
            Self::Broken => "broken",
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Standing {
    /// To be probed at this time.
    Due(Duration),
    /// A probe is on its way.
    Probed,
    /// May be given work.
    Ready,
    /// May be given work from this time on: it has refused too much.
    Rests(Duration),
}

#[derive(Debug, Clone)]
struct Replica {
    standing: Standing,
    /// Shards that it computes at once.
    slots: u32,
    /// Questions it has failed since its last usable answer.
    failures: u32,
    /// Which of its role's refusals was its last, counted from 1; zero before it has refused.
    refused: u64,
    /// Probes it has failed since it was ready last.
    unanswered: u32,
}

/// The replicas of one role.
#[derive(Debug)]
struct Role {
    replicas: BTreeMap<String, Replica>,
    /// Their names, as the robot prefers them.
    order: Vec<String>,
    /// How many of them are kept ready.
    wanted: usize,
    /// Questions that may still be asked twice.
    twice: f64,
    /// Batches that have been split.
    batches: usize,
    /// Candidates per second of one slot, the fastest of late; zero until an answer has been measured.
    speed: f64,
}

impl Default for Role {
    fn default() -> Self {
        Self {
            replicas: BTreeMap::new(),
            order: Vec::new(),
            wanted: 0,
            twice: ASKED_TWICE_AT_ONCE,
            batches: 0,
            speed: 0.0,
        }
    }
}

impl Role {
    fn is_ready(&self, instance: &str) -> bool {
        self.replicas.get(instance).is_some_and(|replica| replica.standing == Standing::Ready)
    }

    /// The replicas that may be given work, each as often as it has slots: all first slots come before any second one,
    /// and with each batch another replica comes first.
    fn slots(&self) -> Vec<String> {
        let mut ready: Vec<&String> = self.order.iter().filter(|instance| self.is_ready(instance)).collect();
        let begin = self.batches % ready.len().max(1);
        ready.rotate_left(begin);
        let mut slots: Vec<(u32, &String)> = Vec::new();
        for instance in ready {
            let count = self.replicas.get(instance).map_or(0, |replica| replica.slots);
            slots.extend((0..count).map(|slot| (slot, instance)));
        }
        slots.sort_by_key(|(slot, _)| *slot);
        slots.into_iter().map(|(_, instance)| instance.clone()).collect()
    }

    /// Those that are to be probed next, and when: the preferred ones, until they fail a probe, and as many others as
    /// are wanted beside those that are ready, those that have failed probes after the others.
    fn to_probe(&self) -> Vec<(&str, Duration)> {
        struct Due<'a> {
            is_preferred: bool,
            unanswered: u32,
            instance: &'a str,
            at: Duration,
        }
        let mut due = Vec::new();
        for (rank, instance) in self.order.iter().enumerate() {
            let Some(replica) = self.replicas.get(instance) else { continue };
            let Standing::Due(at) = replica.standing else { continue };
            let is_preferred = rank < self.wanted && replica.unanswered == 0;
            due.push(Due { is_preferred, unanswered: replica.unanswered, instance, at });
        }
        let taken = self.replicas.len() - due.len();
        due.sort_by_key(|one| (!one.is_preferred, one.unanswered));
        let preferred = due.iter().take_while(|one| one.is_preferred).count();
        due.truncate(preferred.max(self.wanted.saturating_sub(taken)));
        due.into_iter().map(|one| (one.instance, one.at)).collect()
    }
}

/// A replica to be probed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Probe {
    /// Generator or term.
    pub role: String,
    /// Which.
    pub instance: String,
}

/// For whom replicas are kept ready, and how many.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// The robot: each prefers other replicas.
    pub robot: &'a str,
    /// Replicas of the role that are kept ready.
    pub count: usize,
}

/// A part of a batch, and who is asked about it first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assignment {
    /// The replica.
    pub instance: String,
    /// Its candidates.
    pub range: Range<usize>,
}

/// The replicas of every role.
#[derive(Debug, Default)]
pub struct Replicas {
    of: BTreeMap<String, Role>,
}

impl Replicas {
    /// Takes over who is alive in a role: new ones are to be probed now, those gone are forgotten.
    pub fn update(&mut self, role: &str, alive: &[String], wanted: Wanted<'_>, now: Duration) {
        let role = self.of.entry(role.to_owned()).or_default();
        role.order = alive.to_vec();
        // Rendezvous hashing: who comes and goes changes the order of no other two.
        role.order.sort_by_cached_key(|instance| own_order(wanted.robot, instance));
        role.wanted = wanted.count;
        role.replicas.retain(|instance, _| alive.contains(instance));
        for instance in alive {
            role.replicas.entry(instance.clone()).or_insert_with(|| Replica {
                standing: Standing::Due(now),
                slots: 1,
                failures: 0,
                refused: 0,
                unanswered: 0,
            });
        }
    }

    /// The replicas to probe now; each counts as being probed from here on.
    pub fn take_due(&mut self, now: Duration) -> Vec<Probe> {
        let mut due = Vec::new();
        for (name, role) in &self.of {
            for (instance, at) in role.to_probe() {
                if at <= now {
                    due.push(Probe { role: name.clone(), instance: instance.to_owned() });
                }
            }
        }
        for Probe { role, instance } in &due {
            if let Some(replica) = self.find(role, instance) {
                replica.standing = Standing::Probed;
            }
        }
        due
    }

    /// When the next probe is due.
    pub fn next_due(&self) -> Option<Duration> {
        self.of.values().flat_map(Role::to_probe).map(|(_, at)| at).min()
    }

    /// Those of `role` that may be given work, the ones that the robot prefers first. Of those kept ready, one that has
    /// refused a question as overloaded comes after the others: where all have too much to do, each robot goes from one
    /// to the other, and it makes no difference how many robots prefer the same.
    pub fn preferred(&self, role: &str) -> Vec<String> {
        let Some(role) = self.of.get(role) else { return Vec::new() };
        let mut ready: Vec<String> = role.order.iter().filter(|i| role.is_ready(i)).cloned().collect();
        // The others prepared for this robot only while one of these was away.
        let kept = ready.len().min(role.wanted);
        ready[..kept].sort_by_key(|instance| role.replicas.get(instance).map(|r| r.refused));
        ready
    }

    /// A probe has come back: with the replica's slots, or not.
    pub fn probed(&mut self, role: &str, instance: &str, slots: Option<u32>, now: Duration) {
        let Some(replica) = self.find(role, instance) else { return };
        match slots {
            Some(slots) => {
                replica.standing = Standing::Ready;
                replica.unanswered = 0;
                replica.slots = slots.clamp(1, SLOTS_MAX);
            }
            None => {
                let pause = FIRST_PAUSE * 2_u32.saturating_pow(replica.unanswered.min(16));
                replica.unanswered = replica.unanswered.saturating_add(1);
                replica.standing = Standing::Due(now + pause.min(PROBE_PAUSE));
            }
        }
    }

    /// A probe was refused because the replica has too much to do: it is alive, so nothing is held against it.
    pub fn put_off(&mut self, role: &str, instance: &str, now: Duration) {
        if let Some(replica) = self.find(role, instance) {
            replica.standing = Standing::Due(now + PROBE_PAUSE);
        }
    }

    /// Who is prepared for the mission, by name; those that rest from work too.
    pub fn ready(&self, role: &str) -> Vec<String> {
        let replicas = self.of.get(role).into_iter().flat_map(|role| &role.replicas);
        replicas
            .filter(|(_, replica)| matches!(replica.standing, Standing::Ready | Standing::Rests(_)))
            .map(|(instance, _)| instance.clone())
            .collect()
    }

    /// Ends the rest of those whose time is over; before work is given out.
    pub(crate) fn wake(&mut self, now: Duration) {
        for replica in self.of.values_mut().flat_map(|role| role.replicas.values_mut()) {
            if matches!(replica.standing, Standing::Rests(until) if until <= now) {
                replica.standing = Standing::Ready;
            }
        }
    }

    /// Splits a batch of `count` candidates evenly over the replicas that may be given work: one shard for each, then
    /// one more for each second slot, and so on. A batch that is too small for all goes to some of them in turn.
    pub fn split(&mut self, role: &str, count: usize) -> Vec<Assignment> {
        let Some(of_role) = self.of.get_mut(role) else { return Vec::new() };
        of_role.batches += 1;
        let mut instances = of_role.slots();
        let least = (of_role.speed * SHARD_MIN.as_secs_f64()).max(CANDIDATES_MIN);
        instances.truncate(((count as f64 / least) as usize).max(1));
        let shards = instances.len();
        let assigned = instances.into_iter().enumerate().map(|(index, instance)| Assignment {
            instance,
            range: index * count / shards..(index + 1) * count / shards,
        });
        assigned.collect()
    }

    /// Who takes a question that all of `asked` have failed: for generators, which prepare for each goal, the one that
    /// the robot prefers; for evaluators the next one after the last that was asked, so that the shards of a lost
    /// replica do not all go to the same one.
    pub fn spare(&self, role: &str, asked: &[String]) -> Option<String> {
        if keys::generates(role) {
            return self.preferred(role).into_iter().find(|instance| !asked.contains(instance));
        }
        let role = self.of.get(role)?;
        let last = asked.last().and_then(|last| role.order.iter().position(|instance| instance == last));
        let (before, after) = role.order.split_at(last.unwrap_or(0));
        let mut in_turn = after.iter().chain(before);
        in_turn.find(|instance| role.is_ready(instance) && !asked.contains(instance)).cloned()
    }

    /// A question of `role` goes out for the first time: now and then one more may be asked twice.
    pub(crate) fn count_question(&mut self, role: &str) {
        if let Some(role) = self.of.get_mut(role) {
            role.twice = (role.twice + ASKED_TWICE).min(ASKED_TWICE_AT_ONCE);
        }
    }

    /// Whether a question that is late, or was refused as overloaded, may be asked of a second replica. Each such
    /// permission is counted.
    pub(crate) fn may_ask_twice(&mut self, role: &str) -> bool {
        let Some(role) = self.of.get_mut(role).filter(|role| role.twice >= 1.0) else { return false };
        role.twice -= 1.0;
        true
    }

    /// A usable answer: what the replica has failed before is forgiven. It has computed `count` candidates in `busy`.
    pub fn answered(&mut self, role: &str, instance: &str, count: usize, busy: Duration) {
        let Some(role) = self.of.get_mut(role) else { return };
        if count > 0 {
            let speed = count as f64 / busy.as_secs_f64().max(1e-6);
            role.speed = speed.max((1.0 - FORGOTTEN) * role.speed);
        }
        if let Some(replica) = role.replicas.get_mut(instance) {
            replica.failures = 0;
        }
    }

    /// No usable answer. An overloaded replica goes on, and in real time is left alone for a while if it refuses one
    /// question after the other: a pool that is too small must not spend its time on refusals. A broken one is only
    /// probed until it answers: a second question would be another cycle's that comes to harm, and if all was well the
    /// answer is here before the next cycle.
    ///
    /// In real time either is left alone the longer the more often it has failed. In lockstep the robot waits for those
    /// that work, and how fast its time passes must not matter.
    pub fn failed(&mut self, role: &str, instance: &str, failure: Failure, now: Duration, clock: Clock) {
        let of_role = self.of.get(role).into_iter().flat_map(|role| role.replicas.values());
        let refused = 1 + of_role.map(|replica| replica.refused).max().unwrap_or_default();
        let Some(replica) = self.find(role, instance) else { return };
        let pauses = if clock == Clock::Realtime { replica.failures.min(PAUSES_MAX) } else { 0 };
        match failure {
            Failure::Overloaded => {
                replica.refused = refused;
                if replica.standing == Standing::Ready {
                    replica.standing = Standing::Rests(now + PROBE_PAUSE * pauses.min(RESTS_MAX));
                    replica.failures = replica.failures.saturating_add(1);
                }
            }
            Failure::Cold | Failure::Broken
                if matches!(replica.standing, Standing::Ready | Standing::Rests(_)) =>
            {
                replica.standing = Standing::Due(now + PROBE_PAUSE * pauses);
                replica.failures = replica.failures.saturating_add(1);
            }
            Failure::Cold | Failure::Broken => {}
        }
    }

    /// Replicas remembered: never more than are alive.
    pub fn known(&self) -> usize {
        self.of.values().map(|role| role.replicas.len()).sum()
    }

    fn find(&mut self, role: &str, instance: &str) -> Option<&mut Replica> {
        self.of.get_mut(role)?.replicas.get_mut(instance)
    }
}

/// Where a replica stands in an order of `robot`'s own. It does not depend on which others there are.
fn own_order(robot: &str, instance: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    (robot, instance).hash(&mut hasher);
    hasher.finish()
}

#[cfg(test)]
#[path = "replicas_tests.rs"]
mod tests;
