//! People, as trackers publish them (`people_msgs`).

use super::geometry::{Header, Point};
use crate::interface::Interface;
use crate::limits::{PEOPLE, TAGS};

message! {
    /// One person. HuNavSim puts the yaw into `position.z` and the turn rate into `velocity.z`.
    Person;
    {
        /// The same for as long as the person is tracked.
        name: String,
        /// m.
        position: Point,
        /// m/s.
        velocity: Point,
        /// How certain the tracker is, 0 to 1.
        reliability: f64,
        /// Names of what is known besides.
        tagnames: Vec<String> [TAGS],
        /// What is known besides.
        tags: Vec<String> [TAGS],
    }
}

message! {
    /// Everyone who is seen.
    People = "people_msgs/msg/People" of Interface::new(
        "people_msgs/msg/People",
        "RIHS01_9ea98a5e58f833a9532957bca23a6b8006a12885d5a16c8ca41dd901d10c33b6",
    ), at most 1 << 20;
    {
        /// When, and in which frame.
        header: Header,
        /// All people that the detector sees.
        people: Vec<Person> [PEOPLE],
    }
}
