//! Which free slots a batch goes to.
//!
//! Robots choose among replicas without knowing of each other. If they chose at random, some replicas would be shared
//! while others stand idle: with four robots per replica that costs a sixth of the pool. So a robot stays with the
//! slots of its last batch while they are about as fast as any other, and retries other slots sooner the faster they
//! were and the longer they have been idle. A robot that shares a busy replica finds an idle one that way, and a robot
//! that has found one stays.

use std::hash::{DefaultHasher, Hash, Hasher};

/// Candidates below which a batch is not cut further, whatever is known of the replicas: a query costs more than
/// scoring them.
const SHARD_MIN: f64 = 16.0;
/// How much faster another slot has to be than one that had the last batch.
const STAYING: f64 = 1.25;
/// Share of its speed by which a slot gains with every batch that goes elsewhere.
const CURIOSITY: f64 = 0.02;

/// One slot that is free, and how fast it is, in any unit.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeSlot {
    /// Whose slot.
    pub instance: String,
    /// Which of the free slots of this replica, from 0.
    pub slot: u32,
    /// Greater than zero.
    pub speed: f64,
    /// Candidates from which on a shard is worth its way; zero until it has been measured.
    pub worth: f64,
    /// Batches since its replica had a part of one, that one included: 1 if it had a part of the last.
    pub since: u64,
}

impl FreeSlot {
    /// What a part of a batch given to it promises; infinite if it has not been measured.
    fn promise(&self) -> f64 {
        if self.worth <= 0.0 {
            return f64::INFINITY;
        }
        let stays = if self.since == 1 { STAYING } else { 1.0 };
        self.speed * stays * (1.0 + CURIOSITY * self.since as f64)
    }
}

/// The slots worth asking for a batch of `count` candidates, the most promising first, one slot of each replica before
/// the second of any. Those that promise the same are in an order of `robot`'s own.
pub(crate) fn choose(mut slots: Vec<FreeSlot>, robot: &str, count: usize) -> Vec<FreeSlot> {
    let worth = shards_worth_asking(count, &slots);
    slots.sort_by(|a, b| {
        a.slot
            .cmp(&b.slot)
            .then(b.promise().total_cmp(&a.promise()))
            .then_with(|| own_order(robot, &a.instance).cmp(&own_order(robot, &b.instance)))
    });
    slots.truncate(worth);
    slots
}

/// Where a replica stands in an order of `robot`'s own. It does not depend on which others there are.
pub(crate) fn own_order(robot: &str, instance: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    (robot, instance).hash(&mut hasher);
    hasher.finish()
}

/// Into how many shards a batch is worth being cut.
fn shards_worth_asking(count: usize, slots: &[FreeSlot]) -> usize {
    let measured: Vec<f64> = slots.iter().map(|slot| slot.worth).filter(|worth| *worth > 0.0).collect();
    let mean = measured.iter().sum::<f64>() / measured.len().max(1) as f64;
    ((count as f64 / mean.max(SHARD_MIN)) as usize).max(1)
}

#[cfg(test)]
mod tests {
    use curionav_planning::random::{rng, uniform};

    use super::*;

    fn slot(instance: &str, speed: f64, worth: f64, since: u64) -> FreeSlot {
        FreeSlot { instance: instance.into(), slot: 0, speed, worth, since }
    }

    fn names(slots: &[FreeSlot]) -> Vec<&str> {
        slots.iter().map(|slot| slot.instance.as_str()).collect()
    }

    #[test]
    fn a_batch_is_cut_only_as_far_as_it_is_worth() {
        let slots = |worths: &[f64]| worths.iter().map(|w| slot("a", 1.0, *w, 1)).collect::<Vec<_>>();
        // No replica has been measured: 16 is the least.
        assert_eq!(shards_worth_asking(100, &slots(&[0.0, 0.0])), 6);
        assert_eq!(shards_worth_asking(15, &[]), 1);
        // 300 on average of the two that have.
        assert_eq!(shards_worth_asking(1000, &slots(&[200.0, 400.0, 0.0])), 3);
        assert_eq!(shards_worth_asking(100, &slots(&[3.0])), 6);
    }

    #[test]
    fn a_robot_stays_until_another_slot_is_clearly_faster_or_has_long_not_been_tried() {
        let first = |other: f64, since: u64| {
            let slots = vec![slot("other", other, 50.0, since), slot("own", 100.0, 50.0, 1)];
            choose(slots, "r", 60)[0].instance.clone()
        };
        assert_eq!(first(100.0, 2), "own");
        assert_eq!(first(120.0, 2), "own");
        assert_eq!(first(130.0, 2), "other");
        assert_eq!(first(100.0, 15), "other");
        // One that was half as fast is tried again as well, later.
        assert_eq!(first(50.0, 60), "own");
        assert_eq!(first(50.0, 90), "other");
    }

    #[test]
    fn what_has_not_been_measured_comes_first_and_every_replica_before_a_second_slot() {
        let second = FreeSlot { slot: 1, ..slot("a", 100.0, 50.0, 1) };
        let slots =
            vec![slot("a", 100.0, 50.0, 1), second, slot("b", 10.0, 50.0, 2), slot("new", 100.0, 0.0, 9)];
        assert_eq!(names(&choose(slots.clone(), "r", 1000)), ["new", "a", "b", "a"]);
        assert_eq!(names(&choose(slots, "r", 50)), ["new"]);
    }

    #[test]
    fn robots_that_know_nothing_begin_at_different_replicas() {
        let slots: Vec<FreeSlot> = (0..8).map(|i| slot(&format!("cpc-{i}"), 1.0, 0.0, 0)).collect();
        let first = |i: usize| choose(slots.clone(), &format!("robot-{i}"), 16)[0].instance.clone();
        let used: std::collections::BTreeSet<String> = (0..32).map(first).collect();
        assert!(used.len() >= 6, "{used:?}");
    }

    /// Robots and replicas, each robot with one batch in flight; what the replicas computed of what they could have.
    fn used(replicas: usize, robots: usize) -> f64 {
        let (mut random, batches) = (rng(1000, 0), 20_000);
        let mut free_at = vec![0.0_f64; replicas];
        // Of each robot and replica: speed and the batch it last had.
        let mut known = vec![vec![(0.0, 0_u64); replicas]; robots];
        let mut had = vec![0_u64; robots];
        let mut due: Vec<(f64, usize)> = (0..robots).map(|r| (1e-3 * r as f64, r)).collect();
        let (mut computed, mut now) = (0.0, 0.0);
        for _ in 0..batches {
            let next = (0..robots).min_by(|a, b| due[*a].0.total_cmp(&due[*b].0)).unwrap();
            now = due[next].0;
            let slots = (known[next].iter().enumerate())
                .map(|(i, (speed, last))| {
                    let worth = if *speed > 0.0 { 100.0 } else { 0.0 };
                    FreeSlot {
                        instance: i.to_string(),
                        slot: 0,
                        speed: *speed,
                        worth,
                        since: had[next] + 1 - last,
                    }
                })
                .collect();
            let chosen: usize = choose(slots, &next.to_string(), 16)[0].instance.parse().unwrap();
            had[next] += 1;
            // Ten times as long as the way, and as uneven as batches of many kinds.
            let takes = -10.0 * (1.0 - uniform(&mut random)).ln();
            let begins = free_at[chosen].max(now + 0.5);
            free_at[chosen] = begins + takes;
            computed += takes;
            let speed = 1.0 / (free_at[chosen] - now);
            let (old, last) = &mut known[next][chosen];
            *old = if *old > 0.0 { *old + 0.3 * (speed - *old) } else { speed };
            *last = had[next];
            due[next].0 = free_at[chosen] + 0.5;
        }
        computed / (now * replicas as f64)
    }

    #[test]
    fn robots_that_do_not_know_of_each_other_leave_no_replica_idle() {
        for replicas in [2, 4, 8] {
            // Turn by turn it would be 0.83.
            let used = used(replicas, 4 * replicas);
            assert!(used > 0.93, "{replicas} replicas: {used:.3}");
        }
    }
}
