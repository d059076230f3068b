//! How fast the robot's time passes: at 10 Hz, or slower where this machine cannot keep that up.
//!
//! Many processes at 10 Hz need a share of a processor that a slow or busy machine does not have. Every claim about
//! them is about cycles and the robot's time, and holds at any pace.

use std::time::Duration;

/// Between two ticks of the robot's clock.
const TICK: Duration = Duration::from_millis(100);
/// The slowest pace is 1 / 2^3 of the wall clock's.
const HALVINGS_MAX: u32 = 3;

/// How fast the robot's time passes.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pace {
    /// It passes 2 to the power of this times as slowly as the wall clock's.
    halvings: u32,
    /// There is no further attempt.
    pub(crate) is_last: bool,
}

impl Pace {
    /// The full pace, halved so many times, or the slowest there is.
    pub(crate) fn halved(halvings: u32) -> Self {
        Self { halvings: halvings.min(HALVINGS_MAX), is_last: false }
    }

    pub(crate) fn is_slowest(self) -> bool {
        self.halvings == HALVINGS_MAX
    }

    /// The robot's time over that of the wall clock.
    pub(crate) fn speed(self) -> f64 {
        0.5_f64.powi(self.halvings as i32)
    }

    /// What takes `time` at 10 Hz on a machine that keeps that pace.
    pub(crate) fn scaled(self, time: Duration) -> Duration {
        time * 2_u32.pow(self.halvings)
    }

    /// Wall time between two ticks.
    pub(crate) fn tick(self) -> Duration {
        self.scaled(TICK)
    }
}
