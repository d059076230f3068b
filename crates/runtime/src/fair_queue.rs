//! A bounded queue shared fairly: one line for each robot, served in turn.

use std::collections::{BTreeMap, VecDeque};

/// Items waiting, by who sent them.
#[derive(Debug)]
pub struct FairQueue<T> {
    lines: BTreeMap<String, VecDeque<T>>,
    /// The robots with a line; the first is served next.
    turns: VecDeque<String>,
    waiting: usize,
    limit: usize,
}

impl<T> FairQueue<T> {
    /// Nothing waits; at most `limit` items may.
    pub fn new(limit: usize) -> Self {
        Self { lines: BTreeMap::new(), turns: VecDeque::new(), waiting: 0, limit: limit.max(1) }
    }

    /// Adds an item of `robot` at the end of its line. When the queue is full one item must go, and is
    /// given back: the newest of the longest line if that one has more than its share, else this item.
    pub fn push(&mut self, robot: &str, item: T) -> Option<T> {
        let mut refused = None;
        if self.waiting >= self.limit {
            let own = self.lines.get(robot).map_or(0, VecDeque::len);
            // Of equally long lines the one of the least name.
            let longest = self.lines.iter_mut().max_by(|a, b| a.1.len().cmp(&b.1.len()).then(b.0.cmp(a.0)));
            let Some((_, line)) = longest.filter(|(_, line)| own + 1 < line.len()) else {
                return Some(item);
            };
            refused = line.pop_back();
            self.waiting -= 1;
        }
        let line = self.lines.entry(robot.to_owned()).or_default();
        if line.is_empty() {
            self.turns.push_back(robot.to_owned());
        }
        line.push_back(item);
        self.waiting += 1;
        refused
    }

    /// The next item: the oldest of the robot whose turn it is.
    pub fn pop(&mut self) -> Option<T> {
        let robot = self.turns.pop_front()?;
        let line = self.lines.get_mut(&robot)?;
        let item = line.pop_front();
        if line.is_empty() {
            self.lines.remove(&robot);
        } else {
            self.turns.push_back(robot);
        }
        self.waiting -= 1;
        item
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
        let mut queue = FairQueue::new(16);
        for (robot, item) in [("a", 1), ("a", 2), ("a", 3), ("b", 4), ("c", 5), ("b", 6)] {
            assert_eq!(queue.push(robot, item), None);
        }
        let served: Vec<i32> = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(served, [1, 4, 5, 2, 6, 3]);
        assert!(queue.waiting() == 0 && queue.lines.is_empty());
    }

    #[test]
    fn a_full_queue_refuses_the_robot_that_has_more_than_a_share() {
        let mut queue = FairQueue::new(4);
        for item in 0..4 {
            assert_eq!(queue.push("greedy", item), None);
        }
        assert_eq!(queue.push("greedy", 4), Some(4));
        assert_eq!(queue.push("modest", 5), Some(3));
        assert_eq!(queue.push("modest", 6), Some(2));
        // Two each: the next is refused, whichever sends it.
        assert_eq!(queue.push("modest", 7), Some(7));
        assert_eq!(queue.push("greedy", 8), Some(8));
        assert_eq!(queue.push("third", 9), Some(1));
        assert_eq!(queue.waiting(), 4);
    }

    #[test]
    fn the_line_of_a_robot_that_is_served_for_good_takes_no_room() {
        let mut queue = FairQueue::new(2);
        for robot in 0..1000 {
            queue.push(&format!("robot-{robot}"), robot);
            queue.pop();
        }
        assert!(queue.lines.is_empty() && queue.turns.is_empty() && queue.pop().is_none());
    }
}
