//! Memories whose report has not come yet.

use std::collections::{BTreeMap, VecDeque};

use curionav_schemas::Memory;

/// Memories of one robot that may wait: a report that was lost never comes.
const OF_ROBOT_MAX: usize = 64;

/// What each robot's cycles began with, oldest first.
#[derive(Debug, Default)]
pub(super) struct Waiting(BTreeMap<String, VecDeque<Memory>>);

impl Waiting {
    /// Keeps a memory; the oldest one of its robot has to go if there are too many.
    pub(super) fn put(&mut self, memory: Memory) {
        let of_robot = self.0.entry(memory.robot.clone()).or_default();
        if of_robot.len() == OF_ROBOT_MAX {
            of_robot.pop_front();
        }
        of_robot.push_back(memory);
    }

    /// What this cycle began with, if it is here.
    pub(super) fn take(&mut self, robot: &str, epoch: u64, seq: u64) -> Option<Memory> {
        let of_robot = self.0.get_mut(robot)?;
        let index = of_robot.iter().position(|memory| (memory.epoch, memory.seq) == (epoch, seq))?;
        of_robot.remove(index)
    }
}

#[cfg(test)]
mod tests {
    use curionav_testing::golden;

    use super::*;

    #[test]
    fn the_oldest_of_the_same_robot_goes_first() {
        let memory = |robot: &str, epoch, seq| Memory { robot: robot.into(), epoch, seq, ..golden::memory() };
        let mut waiting = Waiting::default();
        // One that is first in the alphabet, and then many of another, which begins anew with a lower epoch.
        waiting.put(memory("a", 1, 1));
        waiting.put(memory("b", 9, 1));
        for seq in 1..=OF_ROBOT_MAX as u64 {
            waiting.put(memory("b", 2, seq));
        }
        assert!(waiting.take("a", 1, 1).is_some() && waiting.take("a", 1, 1).is_none());
        assert!(waiting.take("b", 9, 1).is_none());
        assert!((1..=OF_ROBOT_MAX as u64).all(|seq| waiting.take("b", 2, seq).is_some()));
    }
}
