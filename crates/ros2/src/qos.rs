//! Quality of service, as the text in liveliness tokens has it.

use std::fmt::{Display, Formatter};
use std::str::FromStr;

/// What a publisher offers or a subscriber asks for. Deadlines, lifespans and leases are read over: nothing here
/// depends on them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Qos {
    /// Whether everything arrives.
    pub reliable: bool,
    /// Whether a late subscriber is given what was sent before.
    pub transient_local: bool,
    /// Whether everything is kept until it has arrived.
    pub keep_all: bool,
    /// How many are kept otherwise.
    pub depth: u32,
}

impl Qos {
    /// Of most topics.
    pub const DEFAULT: Self = Self { reliable: true, transient_local: false, keep_all: false, depth: 10 };
    /// Of sensors: what is lost is not sent again.
    pub const SENSOR: Self = Self { reliable: false, depth: 5, ..Self::DEFAULT };
    /// Of what is sent once and holds until further notice: maps, static transforms, plans.
    pub const LATCHED: Self = Self { transient_local: true, depth: 1, ..Self::DEFAULT };
}

/// A text that says no quality of service.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("not a quality of service; one looks like `::,10:,:,:,,`")]
pub struct QosError;

/// The default is left out, and numbers are those of rmw: reliability 1 reliable, 2 best effort; durability 1 transient
/// local, 2 volatile; history 1 keep last, 2 keep all.
impl Display for Qos {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let reliability = if self.reliable { "" } else { "2" };
        let durability = if self.transient_local { "1" } else { "" };
        let history = if self.keep_all { "2" } else { "" };
        write!(f, "{reliability}:{durability}:{history},{}:,:,:,,", self.depth)
    }
}

impl FromStr for Qos {
    type Err = QosError;

    fn from_str(text: &str) -> Result<Self, QosError> {
        let mut parts = text.split(':');
        let mut part = || parts.next().ok_or(QosError);
        let reliability = part()?;
        let durability = part()?;
        let history = part()?;
        let deadline = part()?;
        let lifespan = part()?;
        let liveliness = part()?;
        let (history, depth) = history.split_once(',').ok_or(QosError)?;
        let times = [deadline, lifespan].iter().all(|time| time.matches(',').count() == 1);
        if !times || liveliness.matches(',').count() != 2 || parts.next().is_some() {
            return Err(QosError);
        }
        let is = |text: &str, wanted: u8| match text {
            "" => Ok(false),
            text => text.parse::<u8>().map(|number| number == wanted).map_err(|_| QosError),
        };
        Ok(Self {
            reliable: !is(reliability, 2)?,
            transient_local: is(durability, 1)?,
            keep_all: is(history, 2)?,
            depth: if depth.is_empty() { 0 } else { depth.parse().map_err(|_| QosError)? },
        })
    }
}
