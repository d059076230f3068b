//! What stands in the messages of an action: its goal, result and feedback, and the names of goals.

use crate::cdr::Cdr;
use crate::interface::Interface;

/// Name of a goal, which its client invents.
pub type Uuid = [u8; 16];

/// The goal, result or feedback of an action, which stands in a message with the goal's name or status.
pub trait Part: Cdr {
    /// Name of the message around it, such as `nav2_msgs/action/NavigateToPose_SendGoal_Request`.
    const NAME: &'static str;
    /// What stands in keys: of a goal or result that of its service.
    const INTERFACE: Interface;
    /// Bytes of that message at most.
    const MAX_BYTES: usize;
}

/// Says of which message a type is a part, and what is known of that message.
macro_rules! part {
    ($name:ty = goal of $service:literal, $hash:literal, at most $most:expr) => {
        part! { @ $name, concat!($service, "_Request"), $service, $hash, $most }
    };
    ($name:ty = result of $service:literal, $hash:literal, at most $most:expr) => {
        part! { @ $name, concat!($service, "_Response"), $service, $hash, $most }
    };
    ($name:ty = feedback of $message:literal, $hash:literal, at most $most:expr) => {
        part! { @ $name, $message, $message, $hash, $most }
    };
    (@ $name:ty, $message:expr, $interface:literal, $hash:literal, $most:expr) => {
        impl $crate::messages::Part for $name {
            const NAME: &'static str = $message;
            const INTERFACE: $crate::interface::Interface =
                $crate::interface::Interface::new($interface, $hash);
            const MAX_BYTES: usize = $most;
        }
    };
}
pub(super) use part;

message! {
    /// The empty message, which ROS fills with one byte.
    #[derive(Copy, Eq)]
    Nothing;
    {
        /// Means nothing.
        structure_needs_at_least_one_member: u8,
    }
}
