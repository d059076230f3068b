//! What goes wrong, drawn from a seed, and how it is done to processes.

use std::time::Duration;

use curionav_planning::random::{Rng, uniform};

use super::fleet::{Fleet, POOL, REPLICAS, is_tracked, robot};
use crate::pace::Pace;

/// Something that fails and is mended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Fault {
    /// A replica is killed, and started again.
    Killed(String),
    /// A replica stands still, and goes on.
    Hung(String),
    /// The router is killed, and started again where it was.
    Router,
    /// An arbiter is killed, and started again.
    Arbiter(String),
    /// A tracker is killed, and started again: meanwhile its robot knows of no one.
    Tracker(String),
    /// One replica more, which leaves again.
    LateJoiner(String),
    /// The whole pool: most of it killed, the rest standing still.
    MassLeave,
}

/// Kinds of faults.
pub(super) const KINDS: usize = 7;

/// A number below `n`.
pub(super) fn which(rng: &mut Rng, n: usize) -> usize {
    ((uniform(rng) * n as f64) as usize).min(n - 1)
}

/// A fault and how long it lasts.
#[derive(Debug, Clone)]
pub(super) struct Outage {
    pub(super) fault: Fault,
    pub(super) lasts: Duration,
}

impl Outage {
    /// Any fault of this kind, a number below [`KINDS`]. Replicas number 0, every driver, the arbiters of even robots
    /// and the tracker of the first are never killed, so that what they keep in memory can be seen to stay the same.
    pub(super) fn of_kind(kind: usize, rng: &mut Rng, robots: usize, pace: Pace) -> Self {
        let role = POOL[which(rng, POOL.len())];
        let fault = match kind {
            0 => Fault::Killed(format!("{role}-{}", 1 + which(rng, REPLICAS - 1))),
            1 => Fault::Hung(format!("{role}-{}", which(rng, REPLICAS))),
            2 => Fault::Router,
            3 => Fault::Arbiter(format!("arbiter-{}", robot(2 * which(rng, robots / 2) + 1))),
            4 => {
                let later: Vec<usize> = (1..robots).filter(|&robot| is_tracked(robot)).collect();
                Fault::Tracker(format!("tracker-{}", robot(later[which(rng, later.len())])))
            }
            5 => Fault::LateJoiner(format!("{role}-{REPLICAS}")),
            _ => Fault::MassLeave,
        };
        Self { fault, lasts: pace.scaled(Duration::from_secs_f64(0.3 + uniform(rng))) }
    }

    /// Does it, waits, and mends it.
    pub(super) fn happen(&self, fleet: &Fleet) {
        let wait = || std::thread::sleep(self.lasts);
        match &self.fault {
            Fault::Killed(name) | Fault::Arbiter(name) | Fault::Tracker(name) => {
                fleet.kill(name);
                wait();
                fleet.revive(name);
            }
            Fault::Hung(name) => {
                fleet.signal(name, "STOP");
                wait();
                fleet.signal(name, "CONT");
            }
            Fault::Router => {
                fleet.kill("router");
                wait();
                fleet.revive("router");
            }
            Fault::LateJoiner(name) => {
                fleet.revive(name);
                wait();
                fleet.kill(name);
            }
            Fault::MassLeave => mass_leave(fleet, wait),
        }
    }

    /// What kind it is.
    pub(super) fn kind(&self) -> &'static str {
        match self.fault {
            Fault::Killed(_) => "replica killed",
            Fault::Hung(_) => "replica hung",
            Fault::Router => "router killed",
            Fault::Arbiter(_) => "arbiter killed",
            Fault::Tracker(_) => "tracker killed",
            Fault::LateJoiner(_) => "late joiner",
            Fault::MassLeave => "mass leave",
        }
    }
}

fn mass_leave(fleet: &Fleet, wait: impl Fn()) {
    let killed: Vec<String> =
        POOL.iter().flat_map(|role| (1..REPLICAS).map(move |i| format!("{role}-{i}"))).collect();
    for role in POOL {
        fleet.signal(&format!("{role}-0"), "STOP");
    }
    killed.iter().for_each(|name| fleet.kill(name));
    wait();
    for role in POOL {
        fleet.signal(&format!("{role}-0"), "CONT");
    }
    fleet.revive_all(&killed);
}
