//! Any two drivers in any order: drivers that freeze, die and start, and messages that come late or not at all.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use curionav_planning::random::{Rng, rng, uniform};
use curionav_schemas::{Lease, LeaseRequest, LeaseWish};

use crate::lease::{Grants, LEASE};

/// Between two steps of the model.
const STEP: Duration = Duration::from_millis(10);
/// A driver asks about so often, steps.
const ASKS_EVERY: u64 = 20;
const NAMES: [&str; 3] = ["a", "b", "c"];

/// A driver as `services/driver/src/lease.rs` has it: it counts its lease from when it asked.
#[derive(Debug, Default)]
struct Driver {
    alive: bool,
    /// When it was started: what was asked by one before it is not answered to it.
    born: u64,
    /// It neither hears nor says anything until this step.
    frozen_until: u64,
    lease: u64,
    renewed: Option<Instant>,
    paused: bool,
    asks_at: u64,
    takes_over: bool,
}

impl Driver {
    fn drives(&self, now: Instant) -> bool {
        let is_fresh = self.renewed.is_some_and(|renewed| now.saturating_duration_since(renewed) < LEASE);
        self.alive && self.lease != 0 && is_fresh && !self.paused
    }
}

/// A message on its way: to the base, or an answer with the time at which its question was asked.
enum Sent {
    Wish(Asker, LeaseRequest),
    Answer(Asker, Option<Lease>),
}

/// Who asks, and when it did.
#[derive(Debug, Clone, Copy)]
struct Asker {
    which: usize,
    born: u64,
    asked: Instant,
}

struct Model {
    random: Rng,
    grants: Grants,
    drivers: [Driver; 3],
    sent: VecDeque<(u64, Sent)>,
    start: Instant,
    step: u64,
    /// Since when a pause that was confirmed holds.
    paused_since: Option<u64>,
}

impl Model {
    fn new(seed: u64) -> Self {
        let mut drivers: [Driver; 3] = Default::default();
        drivers[0].alive = true;
        let start = Instant::now();
        let random = rng(seed, 0);
        let grants = Grants::new(1000);
        Self { random, grants, drivers, sent: VecDeque::new(), start, step: 0, paused_since: None }
    }

    fn now(&self) -> Instant {
        self.start + STEP * u32::try_from(self.step).unwrap()
    }

    fn chance(&mut self, of: f64) -> bool {
        uniform(&mut self.random) < of
    }

    /// A message takes up to a second and a half; one in twenty is lost.
    fn send(&mut self, message: Sent) {
        if self.chance(0.05) {
            return;
        }
        let most = if self.chance(0.1) { 150.0 } else { 3.0 };
        let delay = (uniform(&mut self.random) * most) as u64;
        self.sent.push_back((self.step + delay, message));
    }

    fn disturb(&mut self) {
        let which = (uniform(&mut self.random) * 3.0) as usize;
        let kind = uniform(&mut self.random);
        let frozen = (uniform(&mut self.random) * 400.0) as u64;
        let driver = &mut self.drivers[which];
        if kind < 0.4 {
            driver.frozen_until = self.step + frozen;
        } else if kind < 0.6 {
            *driver = Driver::default();
        } else if !driver.alive {
            *driver = Driver { alive: true, born: self.step, takes_over: kind > 0.8, ..Driver::default() };
        }
    }

    fn asks(&mut self, which: usize) {
        let now = self.now();
        let driver = &mut self.drivers[which];
        if !driver.alive || driver.frozen_until > self.step || driver.asks_at > self.step {
            return;
        }
        driver.asks_at = self.step + ASKS_EVERY;
        let wish = if driver.takes_over && driver.lease == 0 { LeaseWish::TakeOver } else { LeaseWish::Hold };
        let request =
            LeaseRequest { driver: NAMES[which].into(), lease: driver.lease, wish, paused: driver.paused };
        let asker = Asker { which, born: driver.born, asked: now };
        self.send(Sent::Wish(asker, request));
    }

    fn arrives(&mut self, message: Sent) {
        let now = self.now();
        match message {
            Sent::Wish(asker, request) => {
                let answer = self.grants.ask(&request, now).ok();
                self.send(Sent::Answer(asker, answer));
            }
            Sent::Answer(asker, answer) => {
                let driver = &mut self.drivers[asker.which];
                if driver.frozen_until > self.step {
                    self.sent.push_back((driver.frozen_until, Sent::Answer(asker, answer)));
                    return;
                }
                match answer {
                    _ if !driver.alive || driver.born != asker.born => {}
                    Some(granted) => {
                        if granted.lease != driver.lease {
                            driver.paused |= granted.paused;
                        }
                        driver.lease = granted.lease;
                        driver.renewed = Some(asker.asked);
                    }
                    None if driver.lease != 0 => *driver = Driver::default(),
                    None => {}
                }
            }
        }
    }

    /// The base and every driver that hears it pause; it is confirmed if the holder is among them.
    fn pause(&mut self) {
        let now = self.now();
        self.grants.pause(true, now);
        let holder = self.grants.number();
        let step = self.step;
        let hears = |driver: &&mut Driver| driver.alive && driver.frozen_until <= step;
        let mut obeyed = holder == 0;
        for driver in self.drivers.iter_mut().filter(hears) {
            driver.paused = true;
            obeyed |= driver.lease == holder;
        }
        if obeyed {
            self.paused_since.get_or_insert(self.step);
        }
    }

    fn advance(&mut self) {
        self.step += 1;
        if self.chance(0.02) {
            self.disturb();
        }
        if self.chance(0.003) {
            self.pause();
        }
        (0..3).for_each(|which| self.asks(which));
        let waiting = std::mem::take(&mut self.sent);
        for (due, message) in waiting {
            if due <= self.step { self.arrives(message) } else { self.sent.push_back((due, message)) }
        }
    }
}

#[test]
fn in_a_thousand_courses_of_events_one_driver_at_most_drives_and_none_while_paused() {
    let mut confirmed = 0;
    let mut drove = 0_u64;
    for seed in 0..1000 {
        let mut model = Model::new(seed);
        for _ in 0..1500 {
            model.advance();
            let now = model.now();
            let obeyed = model.grants.number();
            let driving: Vec<&Driver> = model.drivers.iter().filter(|d| d.drives(now)).collect();
            assert!(driving.len() <= 1, "seed {seed}, step {}: {driving:?}", model.step);
            assert!(
                driving.iter().all(|driver| driver.lease == obeyed),
                "seed {seed}, step {}: the base obeys {obeyed}, not {driving:?}",
                model.step
            );
            let is_paused = model.paused_since.is_some();
            assert!(!is_paused || driving.is_empty(), "seed {seed}, step {}: {driving:?}", model.step);
            drove += driving.len() as u64;
        }
        confirmed += u32::from(model.paused_since.is_some());
    }
    assert!(confirmed > 500 && drove > 100_000, "{confirmed} pauses, {drove} steps driven");
}
