//! What is known of the replicas: who may be given work, how fast each is, who has failed.
//!
//! A replica is given work once it has answered a question without candidates: then it is alive and has
//! derived what the mission needs. One that fails once loses that standing and is asked again
//! until it answers: warming up, probing and the circuit breaker are the same thing. Events and times in,
//! values out; nothing here waits.

use std::collections::BTreeMap;
use std::time::Duration;

use curionav_runtime::config::SLOTS_MAX;
use curionav_schemas::Clock;

use crate::lateness::Lateness;
use crate::slot_selection::{self, FreeSlot};

/// Between two probes of a replica that does not answer them.
const PROBE_PAUSE: Duration = Duration::from_millis(200);
/// A replica that answers probes and fails questions is asked again after 0, 1, 2 and from then on 3 such pauses of
/// real time.
const PAUSES_MAX: u32 = 3;
/// Weight of the newest measurement in the moving average of speeds.
const NEWEST: f64 = 0.3;
/// No replica counts as slower than this share of the fastest: it would never be measured again.
const SLOWEST: f64 = 0.125;
/// By how much the best of late is forgotten with every answer.
const FORGOTTEN: f64 = 0.02;
/// However busy a pool is, a shard needs to compute no longer than so many times its way.
const BUSY_MAX: f64 = 4.0;
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
    /// The batch of its role it had a part of last; zero before it has had any.
    batch: u64,
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

/// The replicas of every role.
#[derive(Debug, Default)]
pub struct Replicas {
    of: BTreeMap<String, BTreeMap<String, Replica>>,
    /// Batches each role has been given.
    batches: BTreeMap<String, u64>,
    lateness: BTreeMap<String, Lateness>,
}

impl Replicas {
    /// Takes over who is alive in a role: new ones are to be probed now, those gone are forgotten.
    pub fn update(&mut self, role: &str, alive: &[String], now: Duration) {
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
                batch: 0,
            });
        }
    }

    /// The replicas to probe now; each counts as being probed from here on.
    pub fn take_due(&mut self, now: Duration) -> Vec<Probe> {
        let mut due = Vec::new();
        for (role, replicas) in &mut self.of {
            for (instance, replica) in replicas {
                if matches!(replica.standing, Standing::Due(at) if at <= now) {
                    replica.standing = Standing::Probed;
                    due.push(Probe { role: role.clone(), instance: instance.clone() });
                }
            }
        }
        due
    }

    /// When the next probe is due.
    pub fn next_due(&self) -> Option<Duration> {
        let all = self.of.values().flat_map(BTreeMap::values);
        all.filter_map(|r| if let Standing::Due(at) = r.standing { Some(at) } else { None }).min()
    }

    /// A probe has come back: with the replica's slots, or not.
    pub fn probed(&mut self, role: &str, instance: &str, slots: Option<u32>, now: Duration) {
        let Some(replica) = self.find(role, instance) else { return };
        match slots {
            Some(slots) => {
                replica.standing = Standing::Ready;
                replica.slots = slots.clamp(1, SLOTS_MAX);
            }
            None => replica.standing = Standing::Due(now + PROBE_PAUSE),
        }
    }

    /// Who may be given work, in order.
    pub fn ready(&self, role: &str) -> Vec<String> {
        let ready = self.of.get(role).into_iter().flat_map(ready);
        ready.map(|(instance, _)| instance.clone()).collect()
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

    /// Who takes a question that others have failed: not one of `asked`, the least busy, the fastest.
    pub fn spare(&self, role: &str, asked: &[String]) -> Option<String> {
        let busy = |r: &Replica| f64::from(r.in_flight) / f64::from(r.slots);
        let free = |r: &Replica| r.in_flight < r.slots.saturating_mul(IN_FLIGHT_PER_SLOT);
        ready(self.of.get(role)?)
            .filter(|(instance, r)| free(r) && !asked.contains(instance))
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
        self.lateness(role).answered(busy + way);
        let Some(replica) = self.find(role, instance) else { return };
        replica.failures = 0;
        if count > 0 {
            let measured = count as f64 / busy.as_secs_f64().max(1e-6);
            let old = if replica.speed > 0.0 { replica.speed } else { measured };
            replica.speed = old + NEWEST * (measured - old);
            replica.unhindered = measured.max((1.0 - FORGOTTEN) * replica.unhindered);
            replica.way = way.as_secs_f64().min((1.0 + FORGOTTEN) * replica.way);
        }
    }

    /// No usable answer. An overloaded replica goes on, with less. A broken one is only probed until it answers: a
    /// second question would be another cycle's that comes to harm, and if all was well the answer is here before the
    /// next cycle.
    ///
    /// In real time it is left alone the longer the more often it has failed. In lockstep the robot waits for those
    /// that work, and how fast its time passes must not matter.
    pub fn failed(&mut self, role: &str, instance: &str, failure: Failure, now: Duration, clock: Clock) {
        let Some(replica) = self.find(role, instance) else { return };
        match failure {
            Failure::Overloaded => replica.speed *= 0.5,
            Failure::Cold | Failure::Broken if replica.standing == Standing::Ready => {
                let pauses = if clock == Clock::Realtime { replica.failures.min(PAUSES_MAX) } else { 0 };
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
mod tests {
    use super::*;

    const NOW: Duration = Duration::from_secs(7);
    const WAY: Duration = Duration::from_millis(1);

    fn ready(slots: &[(&str, u32)]) -> Replicas {
        let mut replicas = Replicas::default();
        let alive: Vec<String> = slots.iter().map(|s| s.0.to_owned()).collect();
        replicas.update("cpc", &alive, NOW);
        assert_eq!(replicas.take_due(NOW).len(), alive.len());
        for (instance, slots) in slots {
            replicas.probed("cpc", instance, Some(*slots), NOW);
        }
        replicas
    }

    /// Every free slot, by name.
    fn known_slots(replicas: &Replicas) -> Vec<(String, f64)> {
        let all = replicas.of.get("cpc").map(|of| free_slots(of, 1)).unwrap_or_default();
        all.into_iter().map(|slot| (slot.instance, slot.speed)).collect()
    }

    #[test]
    fn a_cold_replica_gets_nothing() {
        let mut replicas = Replicas::default();
        replicas.update("cpc", &["a".into()], NOW);
        assert!(known_slots(&replicas).is_empty() && replicas.spare("cpc", &[]).is_none());
        let probe = Probe { role: "cpc".into(), instance: "a".into() };
        assert_eq!(replicas.take_due(NOW), [probe]);
        assert!(replicas.take_due(NOW).is_empty() && known_slots(&replicas).is_empty());
        replicas.probed("cpc", "a", None, NOW);
        assert_eq!(replicas.next_due(), Some(NOW + PROBE_PAUSE));
        assert_eq!(replicas.take_due(NOW + PROBE_PAUSE).len(), 1);
        replicas.probed("cpc", "a", Some(1), NOW);
        assert_eq!(known_slots(&replicas).len(), 1);
    }

    #[test]
    fn work_in_flight_takes_slots() {
        let mut replicas = ready(&[("a", 1), ("b", 3)]);
        let names = |r: &Replicas| known_slots(r).into_iter().map(|slot| slot.0).collect::<Vec<_>>();
        assert_eq!(names(&replicas), ["a", "b", "b", "b"]);
        replicas.asked("cpc", "b");
        assert_eq!(names(&replicas), ["a", "b", "b"]);
        replicas.done("cpc", "b");
        replicas.asked("cpc", "a");
        assert_eq!(names(&replicas), ["b", "b", "b"]);
    }

    #[test]
    fn the_faster_gets_more_and_the_unmeasured_as_much_as_the_fastest() {
        let mut replicas = ready(&[("a", 1), ("b", 1), ("c", 1)]);
        replicas.answered("cpc", "a", 100, Duration::from_millis(10), WAY);
        replicas.answered("cpc", "b", 100, Duration::from_millis(40), WAY);
        let speeds: Vec<f64> = known_slots(&replicas).into_iter().map(|slot| slot.1).collect();
        assert_eq!(speeds, [10_000.0, 2500.0, 10_000.0]);
        // 2500 + 0.3 * (10 000 - 2500)
        replicas.answered("cpc", "b", 100, Duration::from_millis(10), WAY);
        assert!((known_slots(&replicas)[1].1 - 4750.0).abs() < 1e-9);
    }

    #[test]
    fn a_shard_is_worth_its_way_and_a_busy_replica_is_asked_less_often() {
        let mut replicas = ready(&[("a", 1)]);
        let worth = |replicas: &Replicas| free_slots(&replicas.of["cpc"], 1)[0].worth;
        assert_eq!(worth(&replicas), 0.0);
        // 1000 candidates in 10 ms are 100 in the 1 ms of the way.
        replicas.answered("cpc", "a", 1000, Duration::from_millis(10), WAY);
        assert!((worth(&replicas) - 100.0).abs() < 1e-9);
        // Now others are in the way: 10 000 a second instead of 100 000, of which 30 % count at once.
        replicas.answered("cpc", "a", 1000, Duration::from_millis(100), WAY);
        let (unhindered, speed) = (98_000.0, 73_000.0);
        assert!((worth(&replicas) - 1e-3 * unhindered * unhindered / speed).abs() < 1e-6);
        for _ in 0..10 {
            replicas.answered("cpc", "a", 1000, Duration::from_millis(100), WAY);
        }
        assert!(worth(&replicas) > 150.0 && worth(&replicas) < 400.0);
    }

    #[test]
    fn a_failure_ends_the_work_until_a_probe_is_answered() {
        for failure in [Failure::Broken, Failure::Cold] {
            let mut replicas = ready(&[("a", 1)]);
            replicas.failed("cpc", "a", failure, NOW, Clock::Realtime);
            assert!(replicas.ready("cpc").is_empty());
            assert_eq!(replicas.take_due(NOW).len(), 1);
            // What it is blamed for meanwhile is no reason to ask it again.
            replicas.failed("cpc", "a", failure, NOW, Clock::Realtime);
            assert!(replicas.take_due(NOW).is_empty());
            replicas.probed("cpc", "a", Some(1), NOW);
            assert_eq!(replicas.ready("cpc"), ["a"]);
        }
    }

    #[test]
    fn who_answers_probes_and_fails_questions_is_asked_less_and_less_often() {
        let mut replicas = ready(&[("a", 1)]);
        let fail = |replicas: &mut Replicas| {
            replicas.failed("cpc", "a", Failure::Broken, NOW, Clock::Realtime);
            let due = replicas.next_due().unwrap();
            assert_eq!(replicas.take_due(due).len(), 1);
            replicas.probed("cpc", "a", Some(1), due);
            (due - NOW).as_millis()
        };
        assert_eq!([0; 5].map(|_| fail(&mut replicas)), [0, 200, 400, 600, 600]);
        replicas.answered("cpc", "a", 100, Duration::from_millis(10), WAY);
        assert_eq!(fail(&mut replicas), 0);
    }

    #[test]
    fn an_overloaded_replica_is_only_given_less() {
        let mut replicas = ready(&[("a", 1), ("b", 1)]);
        for instance in ["a", "b"] {
            replicas.answered("cpc", instance, 100, Duration::from_millis(10), WAY);
        }
        for _ in 0..9 {
            replicas.failed("cpc", "a", Failure::Overloaded, NOW, Clock::Realtime);
        }
        assert_eq!(known_slots(&replicas), [("a".into(), 1250.0), ("b".into(), 10_000.0)]);
    }

    #[test]
    fn a_spare_is_another_and_the_least_busy() {
        let mut replicas = ready(&[("a", 1), ("b", 1), ("c", 1)]);
        replicas.asked("cpc", "b");
        assert_eq!(replicas.spare("cpc", &["a".into()]).as_deref(), Some("c"));
        assert_eq!(replicas.spare("cpc", &["a".into(), "c".into()]).as_deref(), Some("b"));
        replicas.asked("cpc", "b");
        assert_eq!(replicas.spare("cpc", &["a".into(), "c".into()]), None);
    }

    #[test]
    fn who_is_gone_is_forgotten() {
        let mut replicas = ready(&[("a", 1), ("b", 1)]);
        replicas.update("cpc", &["b".into()], NOW);
        replicas.probed("cpc", "a", Some(1), NOW);
        replicas.done("cpc", "a");
        assert_eq!((replicas.ready("cpc"), replicas.known()), (vec!["b".to_owned()], 1));
    }
}
