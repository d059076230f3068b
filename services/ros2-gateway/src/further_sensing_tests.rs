use std::f64::consts::TAU;

use curionav_ros2::messages::PointField;
use curionav_schemas::{Pose, Validate};
use nalgebra::{Translation3, UnitQuaternion};

use super::*;
use crate::surroundings::DIRECTIONS;

const RADIUS: f64 = 0.3;

fn config(text: &str) -> SensorConfig {
    toml::from_str(&format!("name = \"s\"\ntopic = \"s\"\n{text}")).unwrap()
}

fn camera() -> SensorConfig {
    config("kind = \"cloud\"\nheight = [0.1, 1.0]")
}

/// Half a metre up and a fifth of a metre ahead, level.
fn mount() -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(0.2, 0.0, 0.5), UnitQuaternion::identity())
}

/// Points as a camera sends them that puts the three numbers last, in a point of 20 bytes.
fn of_points(points: &[[f32; 3]], is_bigendian: bool) -> ros::PointCloud2 {
    let field = |name: &str, offset| PointField {
        name: name.into(),
        offset,
        datatype: PointField::FLOAT32,
        count: 1,
    };
    let bytes = |number: &f32| if is_bigendian { number.to_be_bytes() } else { number.to_le_bytes() };
    let point = |point: &[f32; 3]| {
        let numbers = point.iter().flat_map(bytes);
        [0xff; 8].into_iter().chain(numbers).collect::<Vec<u8>>()
    };
    ros::PointCloud2 {
        height: 1,
        width: points.len() as u32,
        fields: vec![field("rgb", 0), field("z", 16), field("x", 8), field("y", 12)],
        is_bigendian,
        point_step: 20,
        row_step: 20 * points.len() as u32,
        data: points.iter().flat_map(point).collect(),
        ..ros::PointCloud2::default()
    }
}

/// Where beams of a scan end, in the robot's frame.
fn ends(scan: &Scan) -> Vec<Point2> {
    let laser = convert::pose(scan.laser);
    let end = |(beam, says): (usize, Beam)| {
        let Beam::Obstacle(metres) = says else { return None };
        let (sin, cos) = sin_cos(scan.angle_min + scan.angle_increment * beam as f64);
        Some(laser.transform(Point2::new(metres * cos, metres * sin)))
    };
    convert::beams(scan).enumerate().filter_map(end).collect()
}

#[test]
fn the_nearest_point_of_each_direction_within_the_heights_is_seen_where_it_is() {
    let nan = f32::NAN;
    // In the camera's frame: a table's edge, what lies behind it, the floor, the ceiling, and no point.
    let points = [[1.0, 0.3, 0.2], [2.0, 0.6, 0.0], [1.5, -1.0, -0.5], [1.5, -1.0, 1.5], [nan, nan, nan]];
    for is_bigendian in [false, true] {
        let scan = cloud(&of_points(&points, is_bigendian), &mount(), &camera(), RADIUS).unwrap();
        let ends = ends(&scan);
        assert_eq!(ends.len(), 1, "{ends:?}");
        assert!(ends[0].distance(Point2::new(1.2, 0.3)) < 0.01, "{ends:?}");
        let silent = scan.ranges.iter().filter(|range| range.is_nan()).count();
        assert_eq!((silent, scan.ranges.len()), (DIRECTIONS - 1, DIRECTIONS), "nothing else is free");
    }
}

#[test]
fn points_all_around_end_where_they_are_and_far_ones_leave_the_way_free() {
    let around: Vec<[f32; 3]> = (0..500)
        .map(|k| {
            let (sin, cos) = (TAU * f64::from(k) / 500.0).sin_cos();
            [(2.5 * cos) as f32, (2.5 * sin) as f32, 0.0]
        })
        .collect();
    let turned = Isometry3::new(Vector3::new(0.0, 0.4, 0.5), Vector3::z() * 2.0);
    let scan = cloud(&of_points(&around, false), &turned, &camera(), RADIUS).unwrap();
    let middle = Point2::new(0.0, 0.4);
    assert!(ends(&scan).len() >= 480);
    for end in ends(&scan) {
        assert!((end.distance(middle) - 2.5).abs() < 1e-3, "{end:?}");
    }
    let near_sighted = config("kind = \"cloud\"\nheight = [0.1, 1.0]\nrange = 2.0");
    let scan = cloud(&of_points(&around, false), &turned, &near_sighted, RADIUS).unwrap();
    assert!(ends(&scan).is_empty() && scan.ranges.contains(&2.0));
}

#[test]
fn a_camera_that_leans_is_turned_upright_and_sees_nothing_of_the_robot_itself() {
    // It looks down by 45 degrees: straight ahead of it, 0.4 m away along the slope, lies the robot's own rim.
    let leaning = Isometry3::new(Vector3::new(0.0, 0.0, 0.5), Vector3::y() * std::f64::consts::FRAC_PI_4);
    let points = [[0.35, 0.0, 0.0], [0.56, 0.0, 0.0]];
    let scan = cloud(&of_points(&points, false), &leaning, &camera(), RADIUS).unwrap();
    let ends = ends(&scan);
    assert_eq!(ends.len(), 1, "{ends:?}");
    assert!(ends[0].distance(Point2::new(0.396, 0.0)) < 0.01, "{ends:?}");
}

#[test]
fn a_cloud_that_cannot_be_used_is_refused_with_the_reason() {
    let good = of_points(&[[1.0, 0.0, 0.0], [1.0, 0.1, 0.0]], false);
    let refused = |said: &ros::PointCloud2| cloud(said, &mount(), &camera(), RADIUS).unwrap_err().to_string();
    let with = |field: usize, change: fn(&mut PointField)| {
        let mut said = good.clone();
        change(&mut said.fields[field]);
        refused(&said)
    };
    assert_eq!(with(2, |x| x.name = "u".into()), "its points have no field `x`");
    assert!(with(1, |z| z.datatype = 8).starts_with("its field `z` has the type 8"));
    assert!(with(3, |y| y.offset = u32::MAX).starts_with("its field `y` lies beyond the 20 bytes"));
    let changed = |change: fn(&mut ros::PointCloud2)| {
        let mut said = good.clone();
        change(&mut said);
        refused(&said)
    };
    // A thousand million points, points or rows of no bytes, and rows that overlap.
    assert!(changed(|said| (said.width, said.height) = (100_000, 10_000)).ends_with("do not fit in 40"));
    assert!(changed(|said| (said.width, said.height) = (u32::MAX, u32::MAX)).ends_with("do not fit in 40"));
    assert!(changed(|said| said.point_step = 0).contains("lies beyond the 0 bytes"));
    assert!(changed(|said| (said.height, said.row_step) = (2, 0)).ends_with("do not fit in 40"));
    assert!(changed(|said| said.data.truncate(39)).ends_with("do not fit in 39"));
    let blank = of_points(&[[f32::NAN; 3]; 5], false);
    assert_eq!(refused(&blank), "none of its 5 points has a place: it sees nothing");
    let far = Isometry3::translation(9.0, 0.0, 0.5);
    assert!(cloud(&good, &far, &camera(), RADIUS).unwrap_err().to_string().contains("laser.distance"));
    // A filter may leave nothing.
    let empty = cloud(&of_points(&[], false), &mount(), &camera(), RADIUS).unwrap();
    assert!(ends(&empty).is_empty());
    let hollow = ros::PointCloud2 { width: 0, height: u32::MAX, ..good };
    assert!(cloud(&hollow, &mount(), &camera(), RADIUS).is_err(), "rows of nothing are no cloud");
}

fn ranger(range: f32) -> ros::Range {
    ros::Range { field_of_view: 0.5, min_range: 0.05, max_range: 3.0, range, ..ros::Range::default() }
}

#[test]
fn a_ranger_sees_the_arc_of_its_cone_or_free_floor() {
    let left = Isometry3::new(Vector3::new(0.0, 0.2, 0.1), Vector3::z() * std::f64::consts::FRAC_PI_2);
    let scan = range(&ranger(1.0), &left).unwrap();
    let ends = ends(&scan);
    assert!(
        ends.len() >= 25 && ends.iter().all(|end| (end.distance(Point2::new(0.0, 0.2)) - 1.0).abs() < 1e-6)
    );
    assert!(ends.iter().all(|end| end.x.abs() < 0.25 && end.y > 1.1), "{ends:?}");
    for far in [3.0, 4.0, f32::INFINITY] {
        let scan = range(&ranger(far), &left).unwrap();
        assert!(convert::beams(&scan).all(|beam| beam == Beam::Free(3.0)), "{far}");
    }
    for near in [0.01, 0.0, f32::NEG_INFINITY] {
        let scan = range(&ranger(near), &left).unwrap();
        assert!(convert::beams(&scan).all(|beam| matches!(beam, Beam::Obstacle(m) if m < 0.051)), "{near}");
    }
    assert!(range(&ranger(f32::NAN), &left).is_err());
    let wrong = ros::Range { max_range: 0.01, ..ranger(1.0) };
    assert!(range(&wrong, &left).is_err());
    let down = Isometry3::new(Vector3::zeros(), Vector3::y() * 1.2);
    assert_eq!(range(&ranger(1.0), &down).unwrap_err().to_string(), "the ranger points up or down");
    let line = ros::Range { field_of_view: 0.0, ..ranger(1.0) };
    assert!(range(&line, &left).is_ok());
}

#[test]
fn a_pressed_bumper_is_the_rim_of_the_robot_around_its_middle() {
    let left = config("kind = \"bumper\"\nbearing = 1.5708\nwidth = 0.8");
    let scan = bumper(&left, RADIUS);
    assert_eq!(scan.validate(), Ok(()));
    let ends = ends(&scan);
    assert!(
        ends.len() > 20 && ends.iter().all(|end| (end.distance(Point2::default()) - RADIUS).abs() < 1e-6)
    );
    assert!(ends.iter().all(|end| end.y > 0.27), "{ends:?}");
}

#[test]
fn a_further_scanner_does_not_see_the_robot_itself() {
    let seen = Scan { laser: Pose { x: 0.2, y: 0.0, heading: 0.0 }, ..arc(Pose2::default(), 0.2, 0.05, 5.0) };
    assert!(ends(&scan(seen, RADIUS)).is_empty());
    let seen = Scan { laser: Pose { x: 0.2, y: 0.0, heading: 0.0 }, ..arc(Pose2::default(), 0.2, 0.15, 5.0) };
    assert!(!ends(&scan(seen, RADIUS)).is_empty());
}
