//! `lifecycle_msgs/srv/GetState`: whether a node is at work.

use crate::interface::Interface;

const GET_STATE: Interface = Interface::new(
    "lifecycle_msgs/srv/GetState",
    "RIHS01_800a0a5aae599782b02932de0caf563f6dc4e7e94b794eadde075ba2cbef9795",
);

message! {
    /// Asks for it. ROS gives a request without fields one byte, because C has no empty structures.
    #[derive(Copy, Eq)]
    GetStateRequest = "lifecycle_msgs/srv/GetState_Request" of GET_STATE, at most 1 << 10;
    {
        /// Without a meaning.
        structure_needs_at_least_one_member: u8,
    }
}

message! {
    /// A state of a node (`lifecycle_msgs/State`).
    #[derive(Eq)]
    LifecycleState;
    {
        /// 1 unconfigured, 2 inactive, 3 active, 4 finalized.
        id: u8,
        /// The same as a word.
        label: String,
    }
}

message! {
    /// The state of a node.
    #[derive(Eq)]
    GetStateResponse = "lifecycle_msgs/srv/GetState_Response" of GET_STATE, at most 1 << 10;
    {
        /// Now.
        current_state: LifecycleState,
    }
}
