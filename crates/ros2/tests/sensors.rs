//! What sensors say is read as rosbags 0.11.9 has written it, which knows neither ROS nor this crate.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

use curionav_ros2::cdr::CdrFault;
use curionav_ros2::limits::CLOUD_BYTES;
use curionav_ros2::message::Message;
use curionav_ros2::messages::{Bool, PointCloud2, PointField, Range, RangeHumble};

/// Two rows of two points with x, y, z and a colour; one of them is no number.
const CLOUD: &str = "0001000007000000f40100000700000063616d657261000002000000020000000400000002000000780000000000\
000007000000010000000200000079000000040000000700000001000000020000007a00000008000000070000000100000004000000726762\
000c0000000600000001000000000000001000000020000000400000000000803f000080bf0000803e00000000000000400000003f0000403f\
000000000000c07f0000c07f0000c07f000000000000804000000000000040400000000000";
const RANGE: &str =
    "0001000007000000f40100000700000063616d65726100000000003f0ad7a33c000080400000a03f0000003f";
const RANGE_OF_HUMBLE: &str =
    "0001000007000000f40100000700000063616d65726100010000003f0ad7a33c000080400000a03f";
const PRESSED: &str = "0001000001";

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect()
}

#[test]
fn a_cloud_of_another_writer_is_read_and_written_alike() {
    let cloud = PointCloud2::decode(&bytes(CLOUD)).unwrap();
    assert_eq!((cloud.header.frame_id.as_str(), cloud.height, cloud.width), ("camera", 2, 2));
    let names: Vec<&str> = cloud.fields.iter().map(|field| field.name.as_str()).collect();
    assert_eq!((names, cloud.point_step, cloud.row_step), (vec!["x", "y", "z", "rgb"], 16, 32));
    let z = PointField { name: "z".into(), offset: 8, datatype: PointField::FLOAT32, count: 1 };
    assert_eq!((&cloud.fields[2], cloud.is_bigendian, cloud.is_dense), (&z, false, false));
    let second: Vec<f32> =
        cloud.data[16..28].chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    assert_eq!((second, cloud.data.len()), (vec![2.0, 0.5, 0.75], 64));
    assert_eq!(cloud.encode().unwrap(), bytes(CLOUD));
}

#[test]
fn a_range_has_a_variance_in_all_distributions_but_humble() {
    let range = Range::decode(&bytes(RANGE)).unwrap();
    assert_eq!((range.radiation_type, range.field_of_view, range.range), (0, 0.5, 1.25));
    assert_eq!((range.min_range, range.max_range, range.variance), (0.02, 4.0, 0.5));
    assert_eq!(range.encode().unwrap(), bytes(RANGE));
    let humble = RangeHumble::decode(&bytes(RANGE_OF_HUMBLE)).unwrap();
    assert_eq!(humble.encode().unwrap(), bytes(RANGE_OF_HUMBLE));
    assert_eq!(Range::from(humble), Range { radiation_type: 1, variance: 0.0, ..range });
    assert_eq!(Range::decode(&bytes(RANGE_OF_HUMBLE)).unwrap_err().to_string(), "variance: is cut short");
    assert_eq!(RangeHumble::decode(&bytes(RANGE)).unwrap_err().fault, CdrFault::Trailing(4));
}

#[test]
fn a_bumper_is_pressed_or_not_and_nothing_else() {
    assert_eq!(Bool::decode(&bytes(PRESSED)).unwrap(), Bool { data: true });
    assert_eq!(
        Bool::decode(&bytes("0001000002")).unwrap_err().to_string(),
        "data: is 2; a truth value is 0 or 1"
    );
}

#[test]
fn a_cloud_that_promises_more_than_it_brings_is_refused_by_its_numbers() {
    let mut payload = bytes(CLOUD);
    let length = payload.len() - 1 - 64 - 4;
    assert_eq!(payload[length..length + 4], 64_u32.to_le_bytes());
    payload[length..length + 4].copy_from_slice(&1_000_000_000_u32.to_le_bytes());
    let most = CLOUD_BYTES;
    let error = PointCloud2::decode(&payload).unwrap_err();
    assert_eq!((error.field, error.fault), ("data", CdrFault::TooLong { found: 1_000_000_000, most }));
    payload[length..length + 4].copy_from_slice(&1_000_000_u32.to_le_bytes());
    assert_eq!(PointCloud2::decode(&payload).unwrap_err().to_string(), "data: is cut short");
}
