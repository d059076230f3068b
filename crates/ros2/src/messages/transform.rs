//! Transforms between frames.

use super::geometry::{Header, Quaternion, Vector3};
use crate::interface::Interface;
use crate::limits::TRANSFORMS;

message! {
    /// Translation and rotation.
    #[derive(Copy)]
    Transform;
    {
        /// m.
        translation: Vector3,
        /// Of length 1.
        rotation: Quaternion,
    }
}

message! {
    /// The pose of a frame in another.
    TransformStamped;
    {
        /// When, and the frame in which the child lies.
        header: Header,
        /// The frame that lies there.
        child_frame_id: String,
        /// Its pose.
        transform: Transform,
    }
}

message! {
    /// The poses of several frames.
    TfMessage = "tf2_msgs/msg/TFMessage" of Interface::new(
        "tf2_msgs/msg/TFMessage",
        "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    ), at most 1 << 20;
    {
        /// One per pair of frames.
        transforms: Vec<TransformStamped> [TRANSFORMS],
    }
}
