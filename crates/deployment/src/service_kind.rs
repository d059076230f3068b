//! The services there are, and what runs each.

use curionav_runtime::process::Service;

/// The services there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Grows trees and offers their branches.
    Generator,
    /// Scores candidates under `cpc`.
    Cpc,
    /// Scores candidates under `cnc`.
    Cnc,
    /// Asks and decides.
    Arbiter,
    /// Believes where the robot is.
    Localizer,
    /// Owns the mission and drives.
    Driver,
    /// Plays the scenario.
    Simulator,
}

impl Kind {
    /// All of them, one each: what one robot in one simulated world needs.
    pub const ALL: [Self; 7] = [
        Self::Driver,
        Self::Localizer,
        Self::Generator,
        Self::Cpc,
        Self::Cnc,
        Self::Arbiter,
        Self::Simulator,
    ];

    /// The command that runs it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Generator => "generator",
            Self::Cpc => "cpc",
            Self::Cnc => "cnc",
            Self::Arbiter => "arbiter",
            Self::Localizer => "localizer",
            Self::Driver => "driver",
            Self::Simulator => "simulator",
        }
    }

    /// What runs it.
    pub fn service(self) -> Service {
        match self {
            Self::Generator => curionav_trajectory_generator::run,
            Self::Cpc => curionav_cpc_evaluator::run,
            Self::Cnc => curionav_cnc_evaluator::run,
            Self::Arbiter => curionav_arbiter::run,
            Self::Localizer => curionav_localizer::run,
            Self::Driver => curionav_driver::run,
            Self::Simulator => curionav_simulator::run,
        }
    }
}
