//! Times, vectors, poses and twists.

use crate::interface::Interface;

/// A message of a few poses, with the longest name of a frame.
const SMALL: usize = 8 << 10;

message! {
    /// A moment: of the robot's clock, which may be simulated.
    #[derive(Copy, Eq, PartialOrd, Ord)]
    Time;
    {
        /// Whole seconds.
        sec: i32,
        /// Nanoseconds after them, below 10^9.
        nanosec: u32,
    }
}

impl Time {
    /// In seconds.
    pub fn seconds(self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
    }

    /// In nanoseconds.
    pub fn nanoseconds(self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }

    /// Of nanoseconds; what 32 bits of seconds cannot hold becomes the nearest that they can.
    pub fn from_nanoseconds(nanoseconds: i64) -> Self {
        let seconds = nanoseconds.div_euclid(1_000_000_000);
        match i32::try_from(seconds) {
            Ok(sec) => Self { sec, nanosec: nanoseconds.rem_euclid(1_000_000_000) as u32 },
            Err(_) if seconds < 0 => Self { sec: i32::MIN, nanosec: 0 },
            Err(_) => Self { sec: i32::MAX, nanosec: 999_999_999 },
        }
    }
}

message! {
    /// A span of time.
    #[derive(Copy, Eq)]
    Duration;
    {
        /// Whole seconds.
        sec: i32,
        /// Nanoseconds after them.
        nanosec: u32,
    }
}

message! {
    /// Of when and in which frame something is.
    #[derive(Eq)]
    Header;
    {
        /// When.
        stamp: Time,
        /// Name of the frame.
        frame_id: String,
    }
}

message! {
    /// A place, m.
    #[derive(Copy)]
    Point;
    {
        /// Forward, or east.
        x: f64,
        /// To the left, or north.
        y: f64,
        /// Up.
        z: f64,
    }
}

message! {
    /// A direction with a length.
    #[derive(Copy)]
    Vector3;
    {
        /// Forward, or east.
        x: f64,
        /// To the left, or north.
        y: f64,
        /// Up.
        z: f64,
    }
}

message! {
    /// A rotation, of length 1.
    #[derive(Copy)]
    Quaternion;
    {
        /// Along x.
        x: f64,
        /// Along y.
        y: f64,
        /// Along z.
        z: f64,
        /// The real part.
        w: f64,
    }
}

message! {
    /// Place and rotation.
    #[derive(Copy)]
    Pose;
    {
        /// Where.
        position: Point,
        /// Turned how.
        orientation: Quaternion,
    }
}

message! {
    /// A pose in a frame.
    PoseStamped = "geometry_msgs/msg/PoseStamped" of Interface::new(
        "geometry_msgs/msg/PoseStamped",
        "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    ), at most SMALL;
    {
        /// When, and in which frame.
        header: Header,
        /// The pose.
        pose: Pose,
    }
}

message! {
    /// A pose and how well it is known.
    #[derive(Copy)]
    PoseWithCovariance;
    {
        /// The mean.
        pose: Pose,
        /// Covariance of (x, y, z, roll, pitch, yaw), row by row.
        covariance: [[f64; 6]; 6],
    }
}

message! {
    /// A pose in a frame and how well it is known.
    PoseWithCovarianceStamped = "geometry_msgs/msg/PoseWithCovarianceStamped" of Interface::new(
        "geometry_msgs/msg/PoseWithCovarianceStamped",
        "RIHS01_26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e",
    ), at most SMALL;
    {
        /// When, and in which frame.
        header: Header,
        /// The pose.
        pose: PoseWithCovariance,
    }
}

message! {
    /// Velocities in the robot's frame.
    #[derive(Copy)]
    Twist = "geometry_msgs/msg/Twist" of Interface::new(
        "geometry_msgs/msg/Twist",
        "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    ), at most SMALL;
    {
        /// m/s.
        linear: Vector3,
        /// rad/s.
        angular: Vector3,
    }
}

message! {
    /// Velocities with a stamp.
    TwistStamped = "geometry_msgs/msg/TwistStamped" of Interface::new(
        "geometry_msgs/msg/TwistStamped",
        "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    ), at most SMALL;
    {
        /// When, and in which frame.
        header: Header,
        /// The velocities.
        twist: Twist,
    }
}

message! {
    /// Velocities and how well they are known.
    #[derive(Copy)]
    TwistWithCovariance;
    {
        /// The mean.
        twist: Twist,
        /// Covariance of (x, y, z, roll, pitch, yaw), row by row.
        covariance: [[f64; 6]; 6],
    }
}
