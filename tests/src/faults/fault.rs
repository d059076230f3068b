//! What goes wrong, and when.

use std::time::Duration;

use curionav_planning::random::{Rng, uniform};

/// What answers look like that are none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Nonsense {
    /// Bytes of nothing.
    Bytes,
    /// A good answer, cut short.
    Cut,
    /// A good answer under another version of the contract.
    Version,
    /// The previous answer once more.
    Previous,
    /// One cost too few, or candidates in another shape.
    Shape,
    /// Costs that are no numbers.
    NotANumber,
}

const NONSENSE: [Nonsense; 6] = [
    Nonsense::Bytes,
    Nonsense::Cut,
    Nonsense::Version,
    Nonsense::Previous,
    Nonsense::Shape,
    Nonsense::NotANumber,
];

/// Of what epoch a decision is that no arbiter has made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Epoch {
    /// The greatest there is.
    Last,
    /// That of the decision obeyed, and the last one of it.
    Same,
}

/// One thing that is wrong. Replicas are named by their number, over all roles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Fault {
    /// Every link is slow (mean delay, seconds), loses and repeats messages (shares).
    Weather { delay: f64, loss: f64, repeated: f64 },
    /// A replica is gone, and starts again unprepared.
    Crash(usize),
    /// A replica stands still, and goes on.
    Hang(usize),
    /// A replica takes that many times as long.
    Slow(usize, f64),
    /// A replica answers nonsense.
    Garbage(usize, Nonsense),
    /// Every replica is gone.
    MassLeave,
    /// Every replica takes that many times as long.
    Overload(f64),
    /// Other robots ask every replica more than it can answer.
    Flood,
    /// The arbiter and the pool do not hear each other.
    NoPool,
    /// The arbiter and the robot do not hear each other.
    NoRobot,
    /// The arbiter is gone, and another starts in its place.
    ArbiterCrash,
    /// A second arbiter for the same robot.
    SecondArbiter,
    /// The localiser says nothing.
    NoLocalizer,
    /// The localiser says what it said before, over and over.
    OldBelief,
    /// Nothing says where people are.
    NoPeople,
    /// The driver is gone, and starts again knowing nothing.
    DriverCrash,
    /// The arbiters hear nothing of the driver, and the driver hears them.
    NoDriver,
    /// A decision that no arbiter has made reaches the driver.
    Foreign(Epoch),
}

impl Fault {
    /// Whether it concerns those who generate and evaluate, and the way to them, alone.
    pub(super) fn is_of_the_pool(&self) -> bool {
        matches!(
            self,
            Self::Weather { .. }
                | Self::Crash(_)
                | Self::Hang(_)
                | Self::Slow(..)
                | Self::Garbage(..)
                | Self::MassLeave
                | Self::Overload(_)
                | Self::Flood
                | Self::NoPool
        )
    }
}

/// A fault and its time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Episode {
    pub(super) fault: Fault,
    pub(super) from: Duration,
    pub(super) until: Duration,
}

/// Any fault, of a pool of so many replicas.
fn any(rng: &mut Rng, replicas: usize) -> Fault {
    let which = |rng: &mut Rng, n: usize| ((uniform(rng) * n as f64) as usize).min(n - 1);
    let replica = which(rng, replicas);
    match which(rng, 18) {
        0 => Fault::Weather {
            delay: 0.001 + 0.06 * uniform(rng),
            loss: 0.4 * uniform(rng),
            repeated: 0.3 * uniform(rng),
        },
        1 => Fault::Crash(replica),
        2 => Fault::Hang(replica),
        3 => Fault::Slow(replica, 2.0 + 40.0 * uniform(rng)),
        4 => Fault::Garbage(replica, NONSENSE[which(rng, NONSENSE.len())]),
        5 => Fault::MassLeave,
        6 => Fault::Overload(2.0 + 40.0 * uniform(rng)),
        7 => Fault::NoPool,
        8 => Fault::NoRobot,
        9 => Fault::ArbiterCrash,
        10 => Fault::SecondArbiter,
        11 => Fault::NoLocalizer,
        12 => Fault::OldBelief,
        13 => Fault::NoPeople,
        14 => Fault::Flood,
        15 => Fault::NoDriver,
        16 => Fault::Foreign([Epoch::Last, Epoch::Same][which(rng, 2)]),
        _ => Fault::DriverCrash,
    }
}

/// One to four faults, which may overlap, within the first twelve seconds.
pub(super) fn episodes(rng: &mut Rng, replicas: usize) -> Vec<Episode> {
    let count = 1 + (uniform(rng) * 4.0) as usize;
    (0..count)
        .map(|_| {
            let fault = any(rng, replicas);
            let from = Duration::from_secs_f64(1.0 + 7.0 * uniform(rng));
            let until = from + Duration::from_secs_f64(0.2 + 3.8 * uniform(rng));
            Episode { fault, from, until }
        })
        .collect()
}
