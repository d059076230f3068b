//! The services there are, and what runs each.

use curionav_planning::terms;
use curionav_runtime::process::Service;
use curionav_schemas::keys;
use strum::{IntoStaticStr, VariantArray};

/// The services, in the order in which they are started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum Kind {
    /// Plays the scenario. As the base it grants the lease that a driver asks for when it starts.
    Simulator,
    /// Owns the mission and drives.
    Driver,
    /// Believes where the robot is.
    Localizer,
    /// Tracks the people around the robot.
    Tracker,
    /// Grows trees and offers their branches.
    Generator,
    /// Scores candidates under `cpc`.
    Cpc,
    /// Scores candidates under `cpc-occluded`.
    CpcOccluded,
    /// Scores candidates under `cnc`.
    Cnc,
    /// Asks and decides.
    Arbiter,
    /// Joins a robot of ROS 2.
    #[strum(serialize = "ros2-gateway")]
    Ros2Gateway,
}

impl Kind {
    /// Every kind, in the order in which they are started.
    pub const ALL: &[Self] = Self::VARIANTS;

    /// What one robot in one simulated world needs: all but the gateway to a real one.
    pub fn simulated() -> Vec<Self> {
        Self::ALL.iter().copied().filter(|kind| *kind != Self::Ros2Gateway).collect()
    }

    /// Whether it answers what an arbiter that is alone computes itself.
    pub fn is_of_pool(self) -> bool {
        self.name() == keys::GENERATOR || terms::NAMES.contains(&self.name())
    }

    /// The command that runs it; of a service with replicas also what they announce themselves as.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// What runs it.
    pub fn service(self) -> Service {
        match self {
            Self::Driver => curionav_driver::run,
            Self::Localizer => curionav_localizer::run,
            Self::Tracker => curionav_people_tracker::run,
            Self::Generator => curionav_trajectory_generator::run,
            Self::Cpc => curionav_cpc_evaluator::run,
            Self::CpcOccluded => curionav_cpc_evaluator::run_occluded,
            Self::Cnc => curionav_cnc_evaluator::run,
            Self::Arbiter => curionav_arbiter::run,
            Self::Simulator => curionav_simulator::run,
            Self::Ros2Gateway => curionav_ros2_gateway::run,
        }
    }
}
