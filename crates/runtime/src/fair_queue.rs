//! A bounded queue shared fairly: of the robots that wait, the one that was served longest ago comes next. What cannot
//! be answered in time is refused at once, while the robot can still do something else.
//!
//! A robot that is refused has not been served, so it comes before the others the next time. In a pool that is too
//! small all robots so get about the same share, also when they ask in the same order in every cycle.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

/// Robots that are remembered: more than ask one replica. One more takes the place of the one served longest ago.
const ROBOTS_MAX: usize = 1024;
/// Weight of the newest time in the moving average of what an answer takes.
const NEWEST: f64 = 0.2;
/// The share of a question that is still to be computed, on average, when another one comes.
const HALF: f64 = 0.5;

/// By this share a robot counts as giving less time with every answer, and as giving more with every refusal for want
/// of it, as long as others give more: what it gave for one question, such as one that another replica has failed, must
/// not shut it out for good.
const LENIENCE: f64 = 0.05;

/// What one robot has waiting.
#[derive(Debug)]
struct Line<T> {
    /// When each came, its bytes, and itself.
    items: VecDeque<(Duration, usize, T)>,
    bytes: usize,
    place: Place,
}

/// Where a line stands: when its robot was served last, counted in turns, and when the line began.
type Place = (u64, u64);

/// What is known of a robot.
#[derive(Debug, Default)]
struct Robot {
    /// The turn in which it was served last, or in which it came first.
    served: u64,
    /// The time that its questions give.
    budget: Option<Duration>,
}

/// Items waiting, by who sent them.
#[derive(Debug)]
pub struct FairQueue<T> {
    lines: BTreeMap<String, Line<T>>,
    /// The robots with a line, the next one first.
    order: BTreeSet<(Place, String)>,
    robots: BTreeMap<String, Robot>,
    /// Turns and lines counted so far.
    turn: u64,
    waiting: usize,
    bytes: usize,
    limit: usize,
    bytes_max: usize,
    slots: usize,
    /// Items taken that are not done.
    at_work: usize,
    /// What an answer takes lately, seconds; zero until there has been one.
    usual: f64,
    /// The time that robots give lately, seconds.
    usual_budget: f64,
}

impl<T> FairQueue<T> {
    /// Nothing waits; at most `limit` items may, of `bytes_max` bytes together. `slots` of them are computed at once.
    pub fn new(slots: usize, limit: usize, bytes_max: usize) -> Self {
        Self {
            lines: BTreeMap::new(),
            order: BTreeSet::new(),
            robots: BTreeMap::new(),
            turn: 0,
            waiting: 0,
            bytes: 0,
            limit: limit.max(1),
            bytes_max,
            slots: slots.max(1),
            at_work: 0,
            usual: 0.0,
            usual_budget: 0.0,
        }
    }

    /// Adds an item of `robot`, of so many bytes, that comes `now`. Gives back what must go: while the queue is full
    /// the newest of the line that has most, if that one has more than its share, else this item; and what cannot be
    /// answered in the time that its robot gives.
    pub fn push(&mut self, robot: &str, bytes: usize, now: Duration, item: T) -> Vec<T> {
        let mut refused = Vec::new();
        if bytes > self.bytes_max {
            return vec![item];
        }
        self.meet(robot);
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
            let Some(gone) = longest.and_then(|robot| self.take(&robot, VecDeque::pop_back)) else {
                refused.push(item);
                return refused;
            };
            refused.push(gone);
        }
        self.turn += 1;
        let place = (self.robots.get(robot).map_or(0, |known| known.served), self.turn);
        let line = self.lines.entry(robot.to_owned()).or_insert_with(|| {
            self.order.insert((place, robot.to_owned()));
            Line { items: VecDeque::new(), bytes: 0, place }
        });
        line.items.push_back((now, bytes, item));
        line.bytes += bytes;
        self.waiting += 1;
        self.bytes += bytes;
        refused.extend(self.shed(now));
        refused
    }

    /// Remembers a robot that asks for the first time as one that has just been served: a new name is no advantage.
    fn meet(&mut self, robot: &str) {
        if self.robots.contains_key(robot) {
            return;
        }
        if self.robots.len() >= ROBOTS_MAX {
            let oldest = self.robots.iter().min_by_key(|(_, known)| known.served);
            let oldest = oldest.map(|(name, _)| name.clone());
            oldest.and_then(|name| self.robots.remove(&name));
        }
        self.robots.insert(robot.to_owned(), Robot { served: self.turn, budget: None });
    }

    /// Takes out what cannot be answered in time, as far as is known. What nothing is in the way of stays: else a
    /// replica that was slow once would never be found to be fast again.
    fn shed(&mut self, now: Duration) -> Vec<T> {
        let at_once = self.slots.saturating_sub(self.at_work);
        let mut kept = 0;
        let mut hopeless = Vec::new();
        for (_, robot) in &self.order {
            let came = self.lines.get(robot).and_then(|line| line.items.front()).map_or(now, |item| item.0);
            let ahead = (self.at_work as f64 * HALF + kept as f64) / self.slots as f64;
            let needs = now.saturating_sub(came).as_secs_f64() + self.usual * (ahead + 1.0);
            let budget = self.robots.get(robot).and_then(|known| known.budget);
            if kept >= at_once && budget.is_some_and(|budget| needs > budget.as_secs_f64()) {
                hopeless.push(robot.clone());
            } else {
                kept += 1;
            }
        }
        for robot in &hopeless {
            let budget = self.robots.get_mut(robot).and_then(|known| known.budget.as_mut());
            if let Some(budget) = budget.filter(|budget| budget.as_secs_f64() < self.usual_budget) {
                *budget = budget.mul_f64(1.0 + LENIENCE);
            }
        }
        hopeless.iter().filter_map(|robot| self.take(robot, VecDeque::pop_front)).collect()
    }

    /// Takes an item out of a robot's line, from one of its ends.
    fn take(
        &mut self,
        robot: &str,
        end: impl Fn(&mut VecDeque<(Duration, usize, T)>) -> Option<(Duration, usize, T)>,
    ) -> Option<T> {
        let line = self.lines.get_mut(robot)?;
        let (_, bytes, item) = end(&mut line.items)?;
        line.bytes -= bytes;
        if line.items.is_empty() {
            self.order.remove(&(line.place, robot.to_owned()));
            self.lines.remove(robot);
        }
        self.waiting -= 1;
        self.bytes -= bytes;
        Some(item)
    }

    /// The next item: the oldest of the robot that was served longest ago. It is at work until [`done`](Self::done).
    pub fn pop(&mut self) -> Option<T> {
        let (_, robot) = self.order.first()?.clone();
        let item = self.take(&robot, VecDeque::pop_front)?;
        self.turn += 1;
        self.at_work += 1;
        let turn = self.turn;
        // One that has been forgotten meanwhile stays so: their number is bounded where they are met.
        if let Some(known) = self.robots.get_mut(&robot) {
            known.served = turn;
        }
        if let Some(line) = self.lines.get_mut(&robot) {
            self.order.remove(&(line.place, robot.clone()));
            line.place = (turn, turn);
            self.order.insert((line.place, robot));
        }
        Some(item)
    }

    /// An item of `robot` is done. If it was work that was to be done in a time of `budget`, what it took tells how
    /// long others will wait; nothing is learnt from one that was refused.
    pub fn done(&mut self, robot: &str, took: Option<Duration>, budget: Option<Duration>) {
        self.at_work = self.at_work.saturating_sub(1);
        let Some(budget) = budget else { return };
        self.usual_budget += NEWEST * (budget.as_secs_f64() - self.usual_budget);
        if let Some(known) = self.robots.get_mut(robot) {
            let before = known.budget.unwrap_or_default().mul_f64(1.0 - LENIENCE);
            known.budget = Some(budget.max(before));
        }
        if let Some(took) = took.map(|took| took.as_secs_f64()) {
            let old = if self.usual > 0.0 { self.usual } else { took };
            self.usual = old + NEWEST * (took - old);
        }
    }

    /// How many items wait.
    pub fn waiting(&self) -> usize {
        self.waiting
    }
}

#[cfg(test)]
#[path = "fair_queue_tests.rs"]
mod tests;
