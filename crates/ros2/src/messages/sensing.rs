//! What a laser says.

use super::geometry::Header;
use crate::interface::Interface;
use crate::limits::BEAMS;

message! {
    /// One sweep of a laser.
    LaserScan = "sensor_msgs/msg/LaserScan" of Interface::new(
        "sensor_msgs/msg/LaserScan",
        "RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828",
    ), at most 128 << 10;
    {
        /// When the first beam was sent, and the frame of the laser.
        header: Header,
        /// Angle of the first beam, rad.
        angle_min: f32,
        /// Angle of the last beam, rad.
        angle_max: f32,
        /// From one beam to the next, rad.
        angle_increment: f32,
        /// From one beam to the next, s.
        time_increment: f32,
        /// From one scan to the next, s.
        scan_time: f32,
        /// Lesser ranges mean nothing, m.
        range_min: f32,
        /// Greater ranges mean nothing, m.
        range_max: f32,
        /// Range of each beam, m; infinite if it hit nothing.
        ranges: Vec<f32> [BEAMS],
        /// Strength of each echo, or none.
        intensities: Vec<f32> [BEAMS],
    }
}
