//! What lasers, cameras, rangers and bumpers say.

use super::geometry::Header;
use crate::interface::Interface;
use crate::limits::{BEAMS, CLOUD_BYTES, FIELDS};

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

message! {
    /// Where a number of each point of a cloud lies, and what it is called.
    #[derive(Eq)]
    PointField;
    {
        /// `x`, `y`, `z`, or anything else.
        name: String,
        /// Bytes from the beginning of a point.
        offset: u32,
        /// Type of number: [`PointField::FLOAT32`] and others.
        datatype: u8,
        /// Numbers of this type in a row.
        count: u32,
    }
}

impl PointField {
    /// A number of single precision.
    pub const FLOAT32: u8 = 7;
}

message! {
    /// Points as the fields say, row by row.
    PointCloud2 = "sensor_msgs/msg/PointCloud2" of Interface::new(
        "sensor_msgs/msg/PointCloud2",
        "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
    ), at most CLOUD_BYTES + (128 << 10);
    {
        /// When they were measured, and the frame in which they lie.
        header: Header,
        /// Rows; 1 of points in no order.
        height: u32,
        /// Points of a row.
        width: u32,
        /// What a point has.
        fields: Vec<PointField> [FIELDS],
        /// Whether numbers begin with their highest byte.
        is_bigendian: bool,
        /// Bytes of a point.
        point_step: u32,
        /// Bytes of a row.
        row_step: u32,
        /// All rows.
        data: Vec<u8> [CLOUD_BYTES],
        /// Whether every point has a place.
        is_dense: bool,
    }
}

message! {
    /// What is nearest in a cone, along the x axis of its frame.
    Range = "sensor_msgs/msg/Range" of Interface::new(
        "sensor_msgs/msg/Range",
        "RIHS01_b42b62562e93cbfe9d42b82fe5994dfa3d63d7d5c90a317981703f7388adff3a",
    ), at most 8 << 10;
    {
        /// When, and the frame of the sensor.
        header: Header,
        /// 0 for sound, 1 for infrared light.
        radiation_type: u8,
        /// Angle of the cone, rad.
        field_of_view: f32,
        /// What is nearer is not measured, m.
        min_range: f32,
        /// What is farther is not measured, m.
        max_range: f32,
        /// Distance, m; infinite if there is nothing, and minus infinity if something is nearer than measured.
        range: f32,
        /// Variance of the distance, m2; 0 if it is not known.
        variance: f32,
    }
}

message! {
    /// As [`Range`] is in humble.
    RangeHumble = "sensor_msgs/msg/Range" of Interface::new(
        "sensor_msgs/msg/Range",
        "RIHS01_9430b1915b94d4268ff903679e8ecd09b6a67d331bd028738ec1eeb592891ebd",
    ), at most 8 << 10;
    {
        /// When, and the frame of the sensor.
        header: Header,
        /// 0 for sound, 1 for infrared light.
        radiation_type: u8,
        /// Angle of the cone, rad.
        field_of_view: f32,
        /// What is nearer is not measured, m.
        min_range: f32,
        /// What is farther is not measured, m.
        max_range: f32,
        /// Distance, m.
        range: f32,
    }
}

impl From<RangeHumble> for Range {
    fn from(said: RangeHumble) -> Self {
        let RangeHumble { header, radiation_type, field_of_view, min_range, max_range, range } = said;
        Self { header, radiation_type, field_of_view, min_range, max_range, range, variance: 0.0 }
    }
}

message! {
    /// Yes or no, such as whether a bumper is pressed.
    #[derive(Copy, Eq)]
    Bool = "std_msgs/msg/Bool" of Interface::new(
        "std_msgs/msg/Bool",
        "RIHS01_feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9",
    ), at most 1 << 10;
    {
        /// `true` is yes.
        data: bool,
    }
}
