//! A bounded queue shared fairly: one line for each robot, served in turn.

use std::collections::{BTreeMap, VecDeque};

/// What one robot has waiting.
#[derive(Debug)]
struct Line<T> {
    items: VecDeque<(usize, T)>,
    bytes: usize,
}

impl<T> Default for Line<T> {
    fn default() -> Self {
        Self { items: VecDeque::new(), bytes: 0 }
    }
}

/// Items waiting, by who sent them.
#[derive(Debug)]
pub struct FairQueue<T> {
    lines: BTreeMap<String, Line<T>>,
    /// The robots with a line; the first is served next.
    turns: VecDeque<String>,
    waiting: usize,
    bytes: usize,
    limit: usize,
    bytes_max: usize,
}

impl<T> FairQueue<T> {
    /// Nothing waits; at most `limit` items may, of `bytes_max` bytes together.
    pub fn new(limit: usize, bytes_max: usize) -> Self {
        let (lines, turns) = (BTreeMap::new(), VecDeque::new());
        Self { lines, turns, waiting: 0, bytes: 0, limit: limit.max(1), bytes_max }
    }

    /// Adds an item of `robot`, of so many bytes, at the end of its line. While the queue is full items must go, and are
    /// given back: the newest of the line that has most, if that one has more than its share, else this item.
    pub fn push(&mut self, robot: &str, bytes: usize, item: T) -> Vec<T> {
        let mut refused = Vec::new();
        if bytes > self.bytes_max {
            return vec![item];
        }
        loop {
            let has_room = self.waiting < self.limit;
            if has_room && self.bytes.saturating_add(bytes) <= self.bytes_max {
                break;
            }
            // By what there is too much of.
            let share = |line: &Line<T>| if has_room { line.bytes } else { line.items.len() };
            let own = self.lines.get(robot).map_or(0, share) + if has_room { bytes } else { 1 };
            // Of equal lines the one of the least name.
            let longest = self.lines.iter().max_by(|a, b| share(a.1).cmp(&share(b.1)).then(b.0.cmp(a.0)));
            let longest = longest.filter(|(_, line)| own < share(line)).map(|(robot, _)| robot.clone());
            let Some(gone) = longest.and_then(|robot| self.take_newest(&robot)) else {
                refused.push(item);
                return refused;
            };
            refused.push(gone);
        }
        let line = self.lines.entry(robot.to_owned()).or_default();
        if line.items.is_empty() {
            self.turns.push_back(robot.to_owned());
        }
        line.items.push_back((bytes, item));
        line.bytes += bytes;
        self.waiting += 1;
        self.bytes += bytes;
        refused
    }

    fn take_newest(&mut self, robot: &str) -> Option<T> {
        let line = self.lines.get_mut(robot)?;
        let (bytes, item) = line.items.pop_back()?;
        line.bytes -= bytes;
        if line.items.is_empty() {
            self.lines.remove(robot);
            self.turns.retain(|turn| turn != robot);
        }
        self.waiting -= 1;
        self.bytes -= bytes;
        Some(item)
    }

    /// The next item: the oldest of the robot whose turn it is.
    pub fn pop(&mut self) -> Option<T> {
        let robot = self.turns.pop_front()?;
        let line = self.lines.get_mut(&robot)?;
        let (bytes, item) = line.items.pop_front()?;
        line.bytes -= bytes;
        if line.items.is_empty() {
            self.lines.remove(&robot);
        } else {
            self.turns.push_back(robot);
        }
        self.waiting -= 1;
        self.bytes -= bytes;
        Some(item)
    }

    /// How many items wait.
    pub fn waiting(&self) -> usize {
        self.waiting
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robots_are_served_in_turn_each_in_its_own_order() {
        let mut queue = FairQueue::new(16, 1000);
        for (robot, item) in [("a", 1), ("a", 2), ("a", 3), ("b", 4), ("c", 5), ("b", 6)] {
            assert!(queue.push(robot, 1, item).is_empty());
        }
        let served: Vec<i32> = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(served, [1, 4, 5, 2, 6, 3]);
        assert!(queue.waiting() == 0 && queue.lines.is_empty());
    }

    #[test]
    fn a_full_queue_refuses_the_robot_that_has_more_than_a_share() {
        let mut queue = FairQueue::new(4, 1000);
        for item in 0..4 {
            assert!(queue.push("greedy", 1, item).is_empty());
        }
        assert_eq!(queue.push("greedy", 1, 4), [4]);
        assert_eq!(queue.push("modest", 1, 5), [3]);
        assert_eq!(queue.push("modest", 1, 6), [2]);
        // Two each: the next is refused, whichever sends it.
        assert_eq!(queue.push("modest", 1, 7), [7]);
        assert_eq!(queue.push("greedy", 1, 8), [8]);
        assert_eq!(queue.push("third", 1, 9), [1]);
        assert_eq!(queue.waiting(), 4);
    }

    #[test]
    fn the_line_of_a_robot_that_is_served_for_good_takes_no_room() {
        let mut queue = FairQueue::new(2, 1000);
        for robot in 0..1000 {
            queue.push(&format!("robot-{robot}"), 1, robot);
            queue.pop();
        }
        assert!(queue.lines.is_empty() && queue.turns.is_empty() && queue.pop().is_none());
    }

    #[test]
    fn a_queue_that_is_full_of_bytes_refuses_the_robot_that_has_most_of_them() {
        let mut queue = FairQueue::new(100, 100);
        assert!(queue.push("large", 40, 1).is_empty());
        assert!(queue.push("large", 40, 2).is_empty());
        assert!(queue.push("small", 10, 3).is_empty());
        // No room for 90 more, and nothing that would make it.
        assert_eq!(queue.push("other", 90, 4), [4]);
        assert_eq!(queue.push("small", 20, 5), [2]);
        assert_eq!(queue.push("large", 1000, 6), [6]);
        let left: Vec<i32> = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!((left, queue.bytes), (vec![1, 3, 5], 0));
    }

    #[test]
    fn many_items_must_go_for_a_large_one_of_a_robot_that_has_little() {
        let mut queue = FairQueue::new(100, 100);
        (0..10).for_each(|item| assert!(queue.push("greedy", 10, item).is_empty()));
        assert_eq!(queue.push("modest", 25, 10), [9, 8, 7]);
        assert_eq!(queue.waiting(), 8);
    }
}
