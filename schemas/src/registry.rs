//! The table of messages: name and size limit of each.

use crate::limits::{KIB, MAX_MAP_CELLS, MIB};
use crate::message::Message;
use crate::{
    Belief, CandidateSet, CycleReport, Decision, EvaluateRequest, GenerateReply, GenerateRequest,
    InjectRequest, Lease, LeaseRequest, Memory, Mission, MissionCommand, OccupancyGrid, Odometry, Particles,
    PauseReply, PauseRequest, People, Readiness, Reject, RunResult, RunStatus, Scan, Scene, Scores,
    ServiceStatus, Tree, Twist,
};

/// What is known of a message without its type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MessageInfo {
    /// [`Message::NAME`].
    pub name: &'static str,
    /// [`Message::ENCODING`].
    pub encoding: &'static str,
    /// [`Message::MAX_BYTES`].
    pub max_bytes: usize,
}

macro_rules! messages {
    ($($message:ident $name:literal $max_bytes:expr;)*) => {
        $(impl Message for $message {
            const NAME: &'static str = $name;
            const SCHEMA: &'static str = concat!("curionav.", $name, ".v1");
            const ENCODING: &'static str = concat!("application/cbor;curionav.", $name, ".v1");
            const MAX_BYTES: usize = $max_bytes;
        })*

        /// Every message of the contract.
        pub const MESSAGES: &[MessageInfo] = &[$(
            MessageInfo { name: $name, encoding: $message::ENCODING, max_bytes: $message::MAX_BYTES },
        )*];

        /// Decodes a message by name and encodes it again; `None` if no message has the name. For tools and tests that
        /// go over all messages.
        ///
        /// # Errors
        /// As [`Message::decode`].
        pub fn recode(name: &str, bytes: &[u8], encoding: Option<&str>) -> Option<Result<Vec<u8>, Reject>> {
            Some(match name {
                $($name => $message::decode(bytes, encoding).map(|message| message.encode()),)*
                _ => return None,
            })
        }
    };
}

// Each limit is what the limits of the parts add up to, or, for batches, what a batch of 2000 x 56 takes twice over:
// not all limits can be reached at once. All but an injection fit in 32 MiB, the largest message the routers of
// `deploy/` pass. A command takes every order that fits in a mission, and says its kind beside it.
messages! {
    Scan "scan" 64 * KIB;
    Odometry "odometry" KIB;
    People "people" 128 * KIB;
    Belief "belief" 2 * KIB;
    Particles "particles" 129 * KIB;
    Mission "mission" 256 * KIB;
    MissionCommand "mission_command" 257 * KIB;
    Readiness "readiness" 8 * KIB;
    Lease "lease" KIB;
    LeaseRequest "lease_request" KIB;
    PauseRequest "pause_request" KIB;
    PauseReply "pause_reply" KIB;
    Decision "decision" 128 * KIB;
    Twist "twist" 2 * KIB;
    Scene "scene" 168 * KIB;
    CandidateSet "candidate_set" 12 * MIB;
    Tree "tree" 3 * MIB;
    CycleReport "cycle_report" 20 * MIB;
    Memory "memory" 20 * MIB;
    GenerateRequest "generate_request" 4 * MIB;
    GenerateReply "generate_reply" 15 * MIB;
    EvaluateRequest "evaluate_request" 13 * MIB;
    Scores "scores" 64 * KIB;
    OccupancyGrid "occupancy_grid" 2 * MAX_MAP_CELLS + 4 * KIB;
    InjectRequest "inject_request" 64 * MIB;
    RunStatus "run_status" 32 * MIB - 4 * KIB;
    RunResult "run_result" 31 * MIB;
    ServiceStatus "service_status" 256 * KIB;
    Reject "reject" 4 * KIB;
}
