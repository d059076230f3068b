//! The wire contract of curionav: messages, their CBOR encoding, and their limits.
//!
//! Every message is a CBOR map with text keys; keys a reader does not know are ignored. Arrays of numbers are
//! RFC 8746 typed arrays ([`mod@array`]), little-endian, so they go into NumPy or nalgebra without being parsed
//! number by number. Units are SI and radians unless a field's name says otherwise; poses are in the map frame
//! unless a field says otherwise.
//!
//! Bytes become a message in one way only, [`Message::decode`], which checks in this order: size, encoding
//! string, well-formedness (no allocation), structure, then shapes, limits and finite numbers. It never panics
//! and never allocates more than a small multiple of the bytes it was given.
//!
//! Deliberately absent: any transport, any clock, and any type of the planner. This crate imports no other
//! crate of curionav.

pub mod array;
mod belief;
mod candidates;
mod check;
mod decision;
mod evaluate;
mod generate;
pub mod keys;
mod lease;
pub mod limits;
mod map;
mod memory;
mod message;
mod mission;
mod mission_state;
mod model;
mod names;
mod reason;
mod registry;
mod reject;
mod report;
mod result;
mod scene;
mod sensing;
mod service;
mod tree;
mod wellformed;
pub mod words;
mod world;

pub use array::{F32Array, F64Array, I8Array, TypedSlice, U8Array, U32Array};
pub use belief::{Belief, Confidence, Health, Particles};
pub use candidates::{CandidateSet, CandidateShard, CandidateShardSlices};
pub use ciborium::Value;
pub use decision::{Action, Decision, Evaluated, Twist};
pub use evaluate::{EvaluateRequest, Scores};
pub use generate::{GenerateReply, GenerateRequest};
pub use lease::{LEASE_MS, Lease, LeaseRequest, LeaseWish, PauseReply, PauseRequest};
pub use map::{MapId, MapIdError, OccupancyGrid, hex};
pub use memory::{Memory, Place, Previous};
pub use message::{Message, Validate, encode};
pub use mission::{Mission, MissionCommand, MissionOrder, Readiness};
pub use mission_state::{Clock, MissionState};
pub use model::{Footprint, LaserModel, OdometryNoise, Pose, RobotModel};
pub use reason::{CommandReason, Degradation, MissionEnd, PreviousState, Reason, Rejection};
pub use registry::{MESSAGES, MessageInfo, recode};
pub use reject::{CborFault, Refusal, Reject};
pub use report::{Crowd, CycleReport, ObstacleCells, RejectedCandidate, TermReport, TermTime, Timings};
pub use result::{Contact, Cycles, Measures, Outcome, PeopleTrace, RunResult, Trace};
pub use scene::Scene;
pub use sensing::{Frame, Odometry, People, Scan};
pub use service::{Prepared, ServiceStatus};
pub use tree::{NO_PARENT, Tree};
pub use world::{InjectRequest, RunState, RunStatus};

/// The contract itself: all `*.cddl` files as one text. A message's rule has its name.
pub const CDDL: &str = concat!(
    include_str!("../0-basics.cddl"),
    include_str!("../decision.cddl"),
    include_str!("../mission.cddl"),
    include_str!("../planning.cddl"),
    include_str!("../sensing.cddl"),
    include_str!("../service.cddl"),
    include_str!("../world.cddl"),
);
