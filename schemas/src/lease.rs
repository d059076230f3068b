//! Who may drive a robot, and whether anything may.

use serde::{Deserialize, Serialize};

use crate::check::{checks, id, optional};

/// A driver that has not repeated its wish for so long may lose its lease, milliseconds of any clock that nothing sets.
/// Its own count begins when it asks and that of the base when the wish arrives, so the driver stops first.
pub const LEASE_MS: u64 = 1000;

/// Who may drive a robot. Its base grants this to one driver at a time, and obeys the commands of that one alone.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lease {
    /// Number of the grant, which the holder's commands carry; 0 if no driver holds it.
    pub lease: u64,
    /// Instance of the driver that holds it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holder: Option<String>,
    /// Instance of a driver that has asked the holder to go.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wanted_by: Option<String>,
    /// Whether the base lets no motion through until it is resumed.
    pub paused: bool,
}

checks! { lease: Lease {
    holder, wanted_by: optional(id);
}}

/// What a driver wants of the lease.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LeaseWish {
    /// To have or to keep it, if no other driver holds it.
    Hold,
    /// To have it once the driver that holds it has stopped the robot and gone.
    TakeOver,
    /// To give it up.
    Release,
}

/// A driver's wish, to its base; the reply is the [`Lease`] as it is then.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeaseRequest {
    /// Instance of the driver.
    pub driver: String,
    /// The grant that it has; 0 for none.
    pub lease: u64,
    /// What it wants.
    pub wish: LeaseWish,
    /// Whether the driver is paused: a base that was restarted learns it from here.
    pub paused: bool,
}

checks! { request: LeaseRequest {
    driver: id;
}}

/// A pause or its end; it reaches the base and every driver of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct PauseRequest {
    /// Whether the robot is to stand.
    pub paused: bool,
}

checks! { _request: PauseRequest {}}

/// The reply to a [`PauseRequest`] once it is obeyed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PauseReply {
    /// `driver`, or the role of the base.
    pub role: String,
    /// Which of that role.
    pub instance: String,
    /// The grant that a driver has or that a base obeys; 0 for none.
    pub lease: u64,
    /// Whether it is paused.
    pub paused: bool,
}

checks! { reply: PauseReply {
    role, instance: id;
}}
