//! What programs say of themselves on `/diagnostics`.

use super::geometry::Header;
use crate::interface::Interface;
use crate::limits::{STATUSES, VALUES};

message! {
    /// A value and what it is of.
    #[derive(Eq)]
    KeyValue;
    {
        /// What it is of.
        key: String,
        /// The value.
        value: String,
    }
}

message! {
    /// How one part of the robot is.
    #[derive(Eq)]
    DiagnosticStatus;
    {
        /// 0 well, 1 a warning, 2 an error, 3 nothing is heard of it.
        level: u8,
        /// Which part.
        name: String,
        /// How it is, in words.
        message: String,
        /// Of which machine.
        hardware_id: String,
        /// Numbers of it.
        values: Vec<KeyValue> [VALUES],
    }
}

message! {
    /// How several parts of the robot are.
    #[derive(Eq)]
    DiagnosticArray = "diagnostic_msgs/msg/DiagnosticArray" of Interface::new(
        "diagnostic_msgs/msg/DiagnosticArray",
        "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    ), at most 4 << 20;
    {
        /// When.
        header: Header,
        /// One per component.
        status: Vec<DiagnosticStatus> [STATUSES],
    }
}
