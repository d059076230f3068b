//! Names and hashes of types, and the distributions of ROS 2.

/// A distribution of ROS 2 that is spoken to. The wire differs in the hashes of types, in the feedback and result of
/// navigation, and in whether velocities carry a stamp by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Distribution {
    /// May 2022. It has no hashes of types.
    Humble,
    /// May 2024.
    Jazzy,
    /// May 2025.
    Kilted,
    /// May 2026.
    Lyrical,
}

impl Distribution {
    /// All of them, in the order of their appearance.
    pub const ALL: [Self; 4] = [Self::Humble, Self::Jazzy, Self::Kilted, Self::Lyrical];

    /// Its name as it stands in configurations.
    pub fn name(self) -> &'static str {
        match self {
            Self::Humble => "humble",
            Self::Jazzy => "jazzy",
            Self::Kilted => "kilted",
            Self::Lyrical => "lyrical",
        }
    }

    /// Whether controllers of this distribution take velocities with a stamp (`TwistStamped`) by default.
    pub fn stamps_velocities(self) -> bool {
        self >= Self::Kilted
    }
}

/// What stands in keys as hash where the distribution has none.
const NO_HASH: &str = "TypeHashNotSupported";

/// The type of a topic or service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interface {
    /// Package, kind and name: `sensor_msgs/msg/LaserScan`.
    pub name: &'static str,
    /// Its hash of version 1 (REP 2016), with the prefix `RIHS01_`.
    hash: &'static str,
}

impl Interface {
    /// A type with its hash.
    pub(crate) const fn new(name: &'static str, hash: &'static str) -> Self {
        Self { name, hash }
    }

    /// Its name as DDS has it, which stands in keys: `sensor_msgs::msg::dds_::LaserScan_`.
    pub fn dds(&self) -> String {
        match self.name.rsplit_once('/') {
            Some((package, name)) => format!("{}::dds_::{name}_", package.replace('/', "::")),
            None => format!("{}_", self.name),
        }
    }

    /// Its hash as it stands in keys of a distribution.
    pub fn hash(&self, distribution: Distribution) -> &'static str {
        if distribution == Distribution::Humble { NO_HASH } else { self.hash }
    }
}
