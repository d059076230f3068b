//! Odometry, maps, paths and the simulated clock.

use super::geometry::{Header, Pose, PoseStamped, PoseWithCovariance, Time, TwistWithCovariance};
use crate::interface::Interface;
use crate::limits::{CELLS, POSES};

message! {
    /// Dead reckoning.
    Odometry = "nav_msgs/msg/Odometry" of Interface::new(
        "nav_msgs/msg/Odometry",
        "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    ), at most 8 << 10;
    {
        /// When, and the frame of the pose.
        header: Header,
        /// The frame of the twist: the robot's.
        child_frame_id: String,
        /// Since the robot was switched on.
        pose: PoseWithCovariance,
        /// In the robot's frame.
        twist: TwistWithCovariance,
    }
}

message! {
    /// How a map lies.
    #[derive(Copy)]
    MapMetaData;
    {
        /// When it was loaded.
        map_load_time: Time,
        /// Side of a cell, m.
        resolution: f32,
        /// Cells along x.
        width: u32,
        /// Cells along y.
        height: u32,
        /// Of the outer corner of cell (0, 0).
        origin: Pose,
    }
}

message! {
    /// A map of cells.
    OccupancyGrid = "nav_msgs/msg/OccupancyGrid" of Interface::new(
        "nav_msgs/msg/OccupancyGrid",
        "RIHS01_8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7",
    ), at most CELLS + (8 << 10);
    {
        /// When, and the frame of the map.
        header: Header,
        /// How it lies.
        info: MapMetaData,
        /// The row of least y first: -1 unknown, else per cent occupied.
        data: Vec<i8> [CELLS],
    }
}

message! {
    /// What has changed on a map of cells: a rectangle of it.
    OccupancyGridUpdate = "map_msgs/msg/OccupancyGridUpdate" of Interface::new(
        "map_msgs/msg/OccupancyGridUpdate",
        "RIHS01_c4095b0be2e4363f8978a1570e0293ee093436f1e1c61d99b48502ac317025e8",
    ), at most CELLS + (8 << 10);
    {
        /// When, and the frame of the map.
        header: Header,
        /// Cells from the map's first column to the rectangle's.
        x: i32,
        /// Cells from the map's first row to the rectangle's.
        y: i32,
        /// Cells of the rectangle along x.
        width: u32,
        /// Cells of it along y.
        height: u32,
        /// The row of least y first, as on the map.
        data: Vec<i8> [CELLS],
    }
}

message! {
    /// A way.
    Path = "nav_msgs/msg/Path" of Interface::new(
        "nav_msgs/msg/Path",
        "RIHS01_1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b",
    ), at most 1 << 20;
    {
        /// When, and in which frame.
        header: Header,
        /// From start to end.
        poses: Vec<PoseStamped> [POSES],
    }
}

message! {
    /// The time of a simulation.
    #[derive(Copy)]
    Clock = "rosgraph_msgs/msg/Clock" of Interface::new(
        "rosgraph_msgs/msg/Clock",
        "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    ), at most 64;
    {
        /// Now.
        clock: Time,
    }
}
