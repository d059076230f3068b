//! What is known of the replicas: who may be given work, how fast each is, who has failed.
//!
//! A replica is given work once it has answered a question without candidates: then it is alive and has
//! derived what the mission needs. One that fails once loses that standing and is asked again
//! until it answers: warming up, probing and the circuit breaker are the same thing. Events and times in,
//! values out; nothing here waits.

use std::collections::BTreeMap;
use std::time::Duration;

use curionav_runtime::config::SLOTS_MAX;
use curionav_schemas::{Clock, keys};

use crate::lateness::Lateness;
use crate::slot_selection::{self, FreeSlot, own_order};

/// Between two probes of a replica that does not answer them.
const PROBE_PAUSE: Duration = Duration::from_millis(200);
/// The same after the first one, and twice as long after each: what is not prepared yet may be in a moment.
const FIRST_PAUSE: Duration = Duration::from_millis(10);
/// A replica that answers probes and fails questions is asked again after 0, 1, 2 and from then on 3 such pauses of real
/// time.
const PAUSES_MAX: u32 = 3;
/// The most of them for one that refuses one question after the other as overloaded: a second after a burst the robot is to
/// be nominal again.
const RESTS_MAX: u32 = 1;
/// Weight of the newest measurement in the moving average of speeds.
const NEWEST: f64 = 0.3;
/// No replica counts as slower than this share of the fastest: it would never be measured again.
const SLOWEST: f64 = 0.125;
/// By how much the best of late is forgotten with every answer.
const FORGOTTEN: f64 = 0.02;
/// However busy a pool is, a shard needs to compute no longer than so many times its way.
const BUSY_MAX: f64 = 4.0;
/// One batch in so many is asked by the arbiter, and as many after a question of a generator that came to nothing: how
/// long a question travels can be measured on the arbiter's alone.
const OWN: u64 = 64;
/// Questions in flight for each slot of a replica: one being computed, one that waits.
const IN_FLIGHT_PER_SLOT: u32 = 2;

/// Why an answer was of no use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// It refused, having too much to do: no fault of its own, but it gets less.
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
    slots: u32,
    /// Candidates a second on one slot, waiting for it included; zero until it has been measured.
    speed: f64,
    /// The same, the best of late: nothing else was in the way.
    unhindered: f64,
    /// Seconds a question and its answer travel, the best of late; infinite until it has been measured.
    way: f64,
    in_flight: u32,
    /// Questions it has failed since its last usable answer.
    failures: u32,
    /// Which of its role's refusals was its last, counted from 1; zero before it has refused.
    refused: u64,
    /// Probes it has failed since it was ready last.
    unanswered: u32,
    /// The batch of its role it had a part of last; zero before it has had any.
    batch: u64,
    /// Whether it takes questions that a generator forwards.
    takes_forwarded: bool,
}

impl Replica {
    /// Candidates that are computed while one question travels, and more the busier the replica is: every
    /// question costs it about as much as the way takes, whatever is in it, and a busy pool that spends its time
    /// on questions is a slow one. Batches for a pool that is idle are cut fine, for the sake of the latency.
    fn worth(&self) -> f64 {
        if self.speed <= 0.0 || !self.way.is_finite() {
            return 0.0;
        }
        let busy = (self.unhindered / self.speed).clamp(1.0, BUSY_MAX);
        self.way * self.unhindered * busy
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

/// The replicas of every role.
#[derive(Debug, Default)]
pub struct Replicas {
    of: BTreeMap<String, BTreeMap<String, Replica>>,
    /// The replicas of each role as the robot prefers them, and how many of them are kept ready.
    preferred: BTreeMap<String, (Vec<String>, usize)>,
    /// Batches each role has been given.
    batches: BTreeMap<String, u64>,
    lateness: BTreeMap<String, Lateness>,
    /// The first batch of each role that a generator may ask about.
    ahead_from: BTreeMap<String, u64>,
    /// Candidates of the last batch.
    last_batch: usize,
}

impl Replicas {
    /// Takes over who is alive in a role: new ones are to be probed now, those gone are forgotten.
    pub fn update(&mut self, role: &str, alive: &[String], wanted: Wanted<'_>, now: Duration) {
        let mut order = alive.to_vec();
        // Rendezvous hashing: who comes and goes changes the order of no other two.
        order.sort_by_cached_key(|instance| own_order(wanted.robot, instance));
        self.preferred.insert(role.to_owned(), (order, wanted.count));
        let replicas = self.of.entry(role.to_owned()).or_default();
        replicas.retain(|instance, _| alive.contains(instance));
        for instance in alive {
            replicas.entry(instance.clone()).or_insert_with(|| Replica {
                standing: Standing::Due(now),
                slots: 1,
                speed: 0.0,
                unhindered: 0.0,
                way: f64::INFINITY,
                in_flight: 0,
                failures: 0,
                refused: 0,
                unanswered: 0,
                batch: 0,
                takes_forwarded: false,
            });
        }
    }

    /// The replicas to probe now; each counts as being probed from here on.
    pub fn take_due(&mut self, now: Duration) -> Vec<Probe> {
        let mut due = Vec::new();
        for role in self.of.keys() {
            let at_once = self.candidates(role).into_iter().filter(|(_, at)| *at <= now);
            due.extend(
                at_once.map(|(instance, _)| Probe { role: role.clone(), instance: instance.to_owned() }),
            );
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
        self.of.keys().flat_map(|role| self.candidates(role)).map(|(_, at)| at).min()
    }

    /// Those that are to be probed next, and when: the preferred ones, until they fail a probe, and as many others as are
    /// wanted beside those that are ready, those that have failed probes after the others.
    fn candidates<'a>(&'a self, role: &str) -> Vec<(&'a str, Duration)> {
        let (Some(replicas), Some((order, wanted))) = (self.of.get(role), self.preferred.get(role)) else {
            return Vec::new();
        };
        let is_due = |(rank, instance): (usize, &'a String)| {
            let replica = replicas.get(instance)?;
            let Standing::Due(at) = replica.standing else { return None };
            let is_preferred = rank < *wanted && replica.unanswered == 0;
            Some((!is_preferred, replica.unanswered, instance.as_str(), at))
        };
        let mut due: Vec<_> = order.iter().enumerate().filter_map(is_due).collect();
        let taken = replicas.len() - due.len();
        due.sort_by_key(|(is_other, unanswered, ..)| (*is_other, *unanswered));
        let preferred = due.iter().take_while(|(is_other, ..)| !is_other).count();
        due.truncate(preferred.max(wanted.saturating_sub(taken)));
        due.into_iter().map(|(_, _, instance, at)| (instance, at)).collect()
    }

    /// Those of `role` that may be given work, the ones that the robot prefers first. Of those kept ready, one that has
    /// refused a question as overloaded comes after the others: where all have too much to do, each robot goes from one
    /// to the other, and it makes no difference how many robots prefer the same.
    pub fn preferred(&self, role: &str) -> Vec<String> {
        let (Some(replicas), Some((order, wanted))) = (self.of.get(role), self.preferred.get(role)) else {
            return Vec::new();
        };
        let of = |instance: &'_ String| replicas.get(instance);
        let is_ready = |i: &&String| of(i).is_some_and(|r| r.standing == Standing::Ready);
        let mut ready: Vec<String> = order.iter().filter(is_ready).cloned().collect();
        // The others prepared for this robot only while one of these was away.
        let kept = ready.len().min(*wanted);
        ready[..kept].sort_by_key(|instance| of(instance).map(|r| r.refused));
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

    /// Who may be given work, in order, those included that rest from it.
    pub fn ready(&self, role: &str) -> Vec<String> {
        let is_ready = |r: &Replica| matches!(r.standing, Standing::Ready | Standing::Rests(_));
        let ready = self.of.get(role).into_iter().flatten().filter(|(_, replica)| is_ready(replica));
        ready.map(|(instance, _)| instance.clone()).collect()
    }

    /// Ends the rest of those whose time is over; before work is given out.
    pub(crate) fn wake(&mut self, now: Duration) {
        for replica in self.of.values_mut().flat_map(BTreeMap::values_mut) {
            if matches!(replica.standing, Standing::Rests(until) if until <= now) {
                replica.standing = Standing::Ready;
            }
        }
    }

    /// The free slots that `robot`'s next batch of `count` candidates goes to, one a shard.
    pub fn choose_slots(&mut self, role: &str, robot: &str, count: usize) -> Vec<FreeSlot> {
        let batch = self.batches.entry(role.to_owned()).or_default();
        *batch += 1;
        let Some(replicas) = self.of.get_mut(role) else { return Vec::new() };
        let chosen = slot_selection::choose(free_slots(replicas, *batch), robot, count);
        for slot in &chosen {
            if let Some(replica) = replicas.get_mut(&slot.instance) {
                replica.batch = *batch;
            }
        }
        chosen
    }

    /// How many candidates the last batch had; zero before the first.
    pub fn last_batch(&self) -> usize {
        self.last_batch
    }

    /// The batch of a cycle has so many candidates.
    pub(crate) fn count_batch(&mut self, candidates: usize) {
        self.last_batch = candidates;
    }

    /// Says whether a replica takes questions that a generator forwards.
    pub(crate) fn takes_forwarded(&mut self, role: &str, instance: &str, takes_forwarded: bool) {
        if let Some(replica) = self.find(role, instance) {
            replica.takes_forwarded = takes_forwarded;
        }
    }

    /// Whether a generator may ask `role` about the next batch: if all that may get a part take its questions, and it is
    /// known how long a question to them travels.
    pub(crate) fn may_ask_ahead(&self, role: &str) -> bool {
        let next = self.next_batch(role);
        let is_turn = !next.is_multiple_of(OWN) && self.ahead_from.get(role).is_none_or(|from| *from <= next);
        let mut ready = self.of.get(role).into_iter().flat_map(ready).peekable();
        is_turn && ready.peek().is_some() && ready.all(|(_, r)| r.takes_forwarded && r.way.is_finite())
    }

    /// A question that a generator was to ask has come to nothing.
    pub(crate) fn failed_ahead(&mut self, role: &str) {
        self.ahead_from.insert(role.to_owned(), self.next_batch(role) + OWN);
    }

    /// The number of the batch that a role is given next.
    fn next_batch(&self, role: &str) -> u64 {
        self.batches.get(role).map_or(1, |batch| batch + 1)
    }

    /// Who takes a question that others have failed: not one of `asked`, the least busy, the fastest; of generators, which
    /// prepare for each goal, the one that the robot prefers.
    pub fn spare(&self, role: &str, asked: &[String]) -> Option<String> {
        let busy = |r: &Replica| f64::from(r.in_flight) / f64::from(r.slots);
        let free = |r: &Replica| r.in_flight < r.slots.saturating_mul(IN_FLIGHT_PER_SLOT);
        let replicas = self.of.get(role)?;
        let may_take = |instance: &String, r: &Replica| free(r) && !asked.contains(instance);
        if role == keys::GENERATOR {
            return self
                .preferred(role)
                .into_iter()
                .find(|i| replicas.get(i).is_some_and(|r| may_take(i, r)));
        }
        ready(replicas)
            .filter(|(instance, r)| may_take(instance, r))
            .min_by(|a, b| busy(a.1).total_cmp(&busy(b.1)).then(b.1.speed.total_cmp(&a.1.speed)))
            .map(|(instance, _)| instance.clone())
    }

    /// A question goes out.
    pub fn asked(&mut self, role: &str, instance: &str) {
        if let Some(replica) = self.find(role, instance) {
            replica.in_flight += 1;
        }
    }

    /// A question is over, however it ended.
    pub fn done(&mut self, role: &str, instance: &str) {
        if let Some(replica) = self.find(role, instance) {
            replica.in_flight = replica.in_flight.saturating_sub(1);
        }
    }

    /// When the answers of `role` are late, and whether they may be asked for twice.
    pub(crate) fn lateness(&mut self, role: &str) -> &mut Lateness {
        self.lateness.entry(role.to_owned()).or_default()
    }

    /// A usable answer: `count` candidates in `busy`, which travelled for `way` in all.
    pub fn answered(&mut self, role: &str, instance: &str, count: usize, busy: Duration, way: Duration) {
        self.answered_ahead(role, instance, count, busy, busy + way);
        if let Some(replica) = self.find(role, instance).filter(|_| count > 0) {
            replica.way = way.as_secs_f64().min((1.0 + FORGOTTEN) * replica.way);
        }
    }

    /// The same for an answer that was waited for during `waited`, of which it is not known what the way took.
    pub(crate) fn answered_ahead(
        &mut self,
        role: &str,
        instance: &str,
        count: usize,
        busy: Duration,
        waited: Duration,
    ) {
        self.lateness(role).answered(waited);
        let Some(replica) = self.find(role, instance) else { return };
        replica.failures = 0;
        if count > 0 {
            let measured = count as f64 / busy.as_secs_f64().max(1e-6);
            let old = if replica.speed > 0.0 { replica.speed } else { measured };
            replica.speed = old + NEWEST * (measured - old);
            replica.unhindered = measured.max((1.0 - FORGOTTEN) * replica.unhindered);
        }
    }

    /// No usable answer. An overloaded replica goes on, with less, and in real time is left alone for a while if it refuses
    /// one question after the other: a pool that is too small must not spend its time on refusals. A broken one is only probed until it answers: a
    /// second question would be another cycle's that comes to harm, and if all was well the answer is here before the
    /// next cycle.
    ///
    /// In real time either is left alone the longer the more often it has failed. In lockstep the robot waits for those
    /// that work, and how fast its time passes must not matter.
    pub fn failed(&mut self, role: &str, instance: &str, failure: Failure, now: Duration, clock: Clock) {
        let of_role = self.of.get(role).into_iter().flatten();
        let refused = 1 + of_role.map(|(_, replica)| replica.refused).max().unwrap_or_default();
        let Some(replica) = self.find(role, instance) else { return };
        let pauses = if clock == Clock::Realtime { replica.failures.min(PAUSES_MAX) } else { 0 };
        match failure {
            Failure::Overloaded => {
                replica.speed *= 0.5;
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
                // What it was before says nothing of what it will be when it is back.
                (replica.speed, replica.unhindered, replica.way) = (0.0, 0.0, f64::INFINITY);
            }
            Failure::Cold | Failure::Broken => {}
        }
    }

    /// Replicas remembered: never more than are alive.
    pub fn known(&self) -> usize {
        self.of.values().map(BTreeMap::len).sum()
    }

    fn find(&mut self, role: &str, instance: &str) -> Option<&mut Replica> {
        self.of.get_mut(role)?.get_mut(instance)
    }
}

/// The replicas that may be given work, in order.
fn ready(replicas: &BTreeMap<String, Replica>) -> impl Iterator<Item = (&String, &Replica)> {
    replicas.iter().filter(|(_, replica)| replica.standing == Standing::Ready)
}

/// Every slot of a role that may be given a part of its batch number `batch`.
fn free_slots(replicas: &BTreeMap<String, Replica>, batch: u64) -> Vec<FreeSlot> {
    let fastest = ready(replicas).map(|(_, r)| r.speed).fold(0.0, f64::max);
    // One that has not been measured gets as much as the fastest.
    let speed = |r: &Replica| match (r.speed > 0.0, fastest > 0.0) {
        (true, _) => r.speed.max(SLOWEST * fastest),
        (false, true) => fastest,
        (false, false) => 1.0,
    };
    ready(replicas)
        .flat_map(|(instance, r)| {
            (0..r.slots.saturating_sub(r.in_flight)).map(move |slot| FreeSlot {
                instance: instance.clone(),
                slot,
                speed: speed(r),
                worth: r.worth(),
                since: batch - r.batch,
            })
        })
        .collect()
}

#[cfg(test)]
#[path = "replicas_tests.rs"]
mod tests;
