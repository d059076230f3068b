//! What the robot senses, from ROS to curionav.

use curionav_planning::beam::Beam;
use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::occupancy::OccupancyGrid;
use curionav_ros2::messages as ros;
use curionav_runtime::convert;
use curionav_schemas::limits::MAX_MAP_CELLS;
use curionav_schemas::{Scan, Validate};

use crate::config::Frames;
use crate::fault::Fault;
use crate::frames::{FrameTree, Mount, planar};

/// How far `angle_max` may be off, steps of the scan: drivers of lasers count the beams or the gaps between them.
const ANGLE_MAX_SLACK: f64 = 1.01;
/// The beams of one scan take no longer, seconds.
const SWEEP_MAX_S: f64 = 1.0;
/// How far the frame of odometry may lie from the robot's, m and rad.
const SAME_PLACE: f64 = 0.01;

/// A scan as curionav has it, of no tick yet. [`Beam`] says what its ranges mean. At least `valid_share` of them have
/// to say anything.
///
/// # Errors
/// If the scan is none or contradicts itself, if it is not known where the scanner is, if the scanner leans, or if
/// too few beams say anything.
pub(crate) fn scan(
    scan: &ros::LaserScan,
    frames: &FrameTree,
    base: &str,
    valid_share: f64,
) -> Result<Scan, Fault> {
    let least = f64::from(scan.range_min);
    let most = f64::from(scan.range_max);
    is_coherent(scan)?;
    let beams = scan.ranges.iter().map(|range| Beam::of(*range, least, most));
    let speaking = beams.clone().filter(|beam| beam.speaks()).count();
    if (speaking as f64) < valid_share * scan.ranges.len() as f64 {
        let detail = format!("{speaking} of {} beams say anything: it sees too little", scan.ranges.len());
        return Err(Fault::unusable(detail));
    }
    let frame = &scan.header.frame_id;
    let found = frames.pose_in(base, frame).ok_or_else(|| Fault::unknown_frame(frame, base))?;
    let mount = Mount::of(&found);
    let mount =
        mount.ok_or_else(|| Fault::unusable(format!("the scanner `{frame}` leans: it is not planar")))?;
    // Seen from above, a scanner that hangs turns the other way.
    let side = if mount.is_upside_down { -1.0 } else { 1.0 };
    let wire = Scan {
        tick: 0,
        stamp: 0.0,
        angle_min: side * f64::from(scan.angle_min),
        angle_increment: side * f64::from(scan.angle_increment),
        range_min: Some(least),
        range_max: most,
        laser: convert::pose_to_wire(mount.pose),
        ranges: beams.map(Beam::range).collect::<Vec<_>>().into(),
    };
    wire.validate().map_err(|reject| Fault::unusable(reject.to_string()))?;
    Ok(wire)
}

/// Whether a scan's description of itself makes sense.
fn is_coherent(scan: &ros::LaserScan) -> Result<(), Fault> {
    let ros::LaserScan { angle_min, angle_max, angle_increment, range_min, range_max, .. } = *scan;
    let numbers = [angle_min, angle_max, angle_increment, range_min, range_max];
    if !numbers.into_iter().all(f32::is_finite) || range_min < 0.0 || range_max <= range_min {
        return Err(Fault::malformed("the scan's angles and ranges describe no scanner"));
    }
    let sweep = f64::from(scan.time_increment) * scan.ranges.len() as f64;
    if !(-SWEEP_MAX_S..=SWEEP_MAX_S).contains(&sweep) {
        let detail = format!("time_increment is {} s, so its beams take {sweep:.1} s", scan.time_increment);
        return Err(Fault::malformed(detail));
    }
    if scan.ranges.is_empty() {
        return Err(Fault::unusable("the scan has no beams"));
    }
    let gaps = (scan.ranges.len() - 1) as f64;
    let last = f64::from(angle_min) + f64::from(angle_increment) * gaps;
    if (f64::from(angle_max) - last).abs() > ANGLE_MAX_SLACK * f64::from(angle_increment).abs() {
        let beams = scan.ranges.len();
        let detail = format!("angle_max is {angle_max}, but {beams} beams end at {last:.3} rad");
        return Err(Fault::malformed(detail));
    }
    Ok(())
}

/// Pose and motion of odometry.
///
/// # Errors
/// If it is none, or of other frames.
pub(crate) fn odometry(
    odometry: &ros::Odometry,
    frames: &FrameTree,
    names: &Frames,
) -> Result<(Pose2, Twist), Fault> {
    let frame = &odometry.header.frame_id;
    let child = &odometry.child_frame_id;
    if *frame != names.odom {
        return Err(Fault::unknown_frame(frame, &names.odom));
    }
    if *child != names.base {
        let found =
            frames.pose_in(&names.base, child).ok_or_else(|| Fault::unknown_frame(child, &names.base))?;
        let is_same = Mount::of(&found).is_some_and(|mount| {
            let Pose2 { x, y, heading } = mount.pose;
            [x, y, heading].into_iter().all(|off| off.abs() < SAME_PLACE) && !mount.is_upside_down
        });
        if !is_same {
            let detail =
                format!("odometry is of the frame `{child}`, which is not where `{}` is", names.base);
            return Err(Fault::unusable(detail));
        }
    }
    let pose = planar(&odometry.pose.pose)?;
    let v = odometry.twist.twist.linear.x;
    let omega = odometry.twist.twist.angular.z;
    if [v, omega].into_iter().any(|number| !number.is_finite() || number.abs() > 1e3) {
        return Err(Fault::malformed(format!("{v} m/s and {omega} rad/s are no motion")));
    }
    Ok((pose, Twist { v, omega }))
}

/// A map.
///
/// # Errors
/// If it is none, or of another frame.
pub(crate) fn map(map: ros::OccupancyGrid, names: &Frames) -> Result<OccupancyGrid, Fault> {
    let frame = &map.header.frame_id;
    let info = &map.info;
    if *frame != names.map {
        return Err(Fault::unknown_frame(frame, &names.map));
    }
    let origin = planar(&info.origin)?;
    let cells = u64::from(info.width) * u64::from(info.height);
    if cells > MAX_MAP_CELLS as u64 {
        return Err(Fault::unusable(format!("the map has {cells} cells; the most is {MAX_MAP_CELLS}")));
    }
    if map.data.iter().any(|cell| !(-1..=100).contains(cell)) {
        return Err(Fault::malformed("a cell of the map is neither -1 nor 0 to 100"));
    }
    // 0.05 is not what single precision has for it; a map of a file has.
    let resolution = (f64::from(info.resolution) * 1e6).round() / 1e6;
    OccupancyGrid::new(info.width as usize, info.height as usize, resolution, origin, map.data)
        .map_err(|error| Fault::malformed(error.to_string()))
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Point2;
    use curionav_ros2::messages::{Header, Quaternion, TfMessage, Transform, TransformStamped, Vector3};

    use super::*;

    const LEVEL: Quaternion = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };

    fn tree(rotation: Quaternion) -> FrameTree {
        let transform = Transform { translation: Vector3 { x: 0.2, ..Vector3::default() }, rotation };
        let header = Header { frame_id: "base_link".into(), ..Header::default() };
        let laser = TransformStamped { header, child_frame_id: "laser".into(), transform };
        let mut tree = FrameTree::default();
        tree.take_in(&TfMessage { transforms: vec![laser] }, "odom").unwrap();
        tree
    }

    fn said(ranges: &[f32]) -> ros::LaserScan {
        ros::LaserScan {
            header: Header { frame_id: "laser".into(), ..Header::default() },
            angle_min: -0.5,
            angle_max: -0.75 + 0.25 * ranges.len() as f32,
            angle_increment: 0.25,
            range_min: 0.1,
            range_max: 10.0,
            ranges: ranges.to_vec(),
            ..ros::LaserScan::default()
        }
    }

    #[test]
    fn ranges_mean_what_every_reader_takes_them_for() {
        let said = said(&[f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 0.0, 12.0, 3.0, 0.05]);
        let scan = scan(&said, &tree(LEVEL), "base_link", 0.5).unwrap();
        let silent: Vec<usize> = (0..7).filter(|i| scan.ranges[*i].is_nan()).collect();
        assert_eq!(silent, [2, 3]);
        assert_eq!(scan.ranges[..2], [10.0, 0.1]);
        assert_eq!(scan.ranges[4..], [10.0, 3.0, 0.1]);
        assert_eq!((convert::pose(scan.laser), scan.angle_min), (Pose2::new(0.2, 0.0, 0.0), -0.5));
    }

    #[test]
    fn no_scan_that_sees_nothing_becomes_free_floor() {
        let free = |ranges: &[f32]| {
            let found = scan(&said(ranges), &tree(LEVEL), "base_link", 0.0).unwrap();
            found.ranges.iter().filter(|range| **range >= 10.0).count()
        };
        // All 0, all nearer than the scanner measures, half of them no number, all nearer than anything.
        assert_eq!([free(&[0.0; 8]), free(&[0.05; 8]), free(&[f32::NEG_INFINITY; 8])], [0; 3]);
        assert_eq!(free(&[f32::NAN, 10.0, f32::NAN, 10.0]), 2);
        let refused = |ranges: &[f32], share: f64| scan(&said(ranges), &tree(LEVEL), "base_link", share);
        assert!(refused(&[0.0; 8], 0.5).is_err() && refused(&[f32::NAN; 8], 0.01).is_err());
        assert!(refused(&[f32::NAN, 1.0, f32::NAN, 1.0], 0.5).is_ok());
    }

    #[test]
    fn a_scanner_that_hangs_sees_the_same_room() {
        let (up, down) = (tree(LEVEL), tree(Quaternion { x: 1.0, y: 0.0, z: 0.0, w: 0.0 }));
        let ends = |scan: &Scan| -> Vec<Point2> {
            let end = |(i, range): (usize, &f32)| {
                let (s, c) = (scan.angle_min + scan.angle_increment * i as f64).sin_cos();
                convert::pose(scan.laser).transform(Point2::new(f64::from(*range) * c, f64::from(*range) * s))
            };
            scan.ranges.iter().enumerate().map(end).collect()
        };
        // The same wall, once from the right to the left and once the other way.
        let said = said(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        let hung = ros::LaserScan { ranges: said.ranges.iter().rev().copied().collect(), ..said.clone() };
        let upright = ends(&scan(&said, &up, "base_link", 0.5).unwrap());
        let mut hanging = ends(&scan(&hung, &down, "base_link", 0.5).unwrap());
        hanging.reverse();
        assert!(upright.iter().zip(&hanging).all(|(a, b)| a.distance(*b) < 1e-9), "{upright:?} {hanging:?}");
    }

    #[test]
    fn a_scan_that_cannot_be_used_is_refused_with_the_reason() {
        let tree = tree(LEVEL);
        let fault = |said: &ros::LaserScan| scan(said, &tree, "base_link", 0.5).unwrap_err().to_string();
        let elsewhere = ros::LaserScan {
            header: Header { frame_id: "camera".into(), ..Header::default() },
            ..said(&[1.0])
        };
        assert_eq!(fault(&elsewhere), "no transform leads from the frame `camera` to `base_link`");
        assert!(fault(&said(&[f32::NAN, f32::NAN, 1.0])).starts_with("1 of 3 beams say anything"));
        assert!(fault(&said(&[])).contains("no beams"));
        let contradictory = ros::LaserScan { angle_max: 1.57, ..said(&[1.0; 3]) };
        assert_eq!(fault(&contradictory), "angle_max is 1.57, but 3 beams end at 0.000 rad");
        let degrees =
            ros::LaserScan { angle_min: -180.0, angle_max: 180.0, angle_increment: 1.0, ..said(&[1.0; 361]) };
        assert!(fault(&degrees).contains("361 beams that are 1 rad apart sweep 360 rad"));
        let still = ros::LaserScan { angle_max: -0.5, angle_increment: 0.0, ..said(&[1.0; 3]) };
        assert!(fault(&still).contains("3 beams that are 0 rad apart sweep 0 rad"));
        assert!(fault(&ros::LaserScan { range_max: f32::NAN, ..said(&[1.0]) }).contains("no scanner"));
        let leaning = self::tree(Quaternion { x: 0.5, w: 0.75_f64.sqrt(), ..Quaternion::default() });
        assert!(scan(&said(&[1.0]), &leaning, "base_link", 0.5).unwrap_err().to_string().contains("leans"));
    }

    #[test]
    fn odometry_of_another_frame_is_refused() {
        let names = Frames::default();
        let mut said = ros::Odometry {
            header: Header { frame_id: "odom".into(), ..Header::default() },
            child_frame_id: "base_link".into(),
            ..ros::Odometry::default()
        };
        said.pose.pose.orientation = LEVEL;
        assert!(odometry(&said, &tree(LEVEL), &names).is_ok());
        assert!(
            odometry(&ros::Odometry { child_frame_id: "wheel".into(), ..said.clone() }, &tree(LEVEL), &names)
                .is_err()
        );
        // The laser is joined to the base, but 0.2 m away.
        let other = ros::Odometry { child_frame_id: "laser".into(), ..said.clone() };
        assert!(
            odometry(&other, &tree(LEVEL), &names)
                .unwrap_err()
                .to_string()
                .contains("not where `base_link` is")
        );
        said.header.frame_id = "map".into();
        assert!(odometry(&said, &tree(LEVEL), &names).is_err());
        said.header.frame_id = "odom".into();
        said.twist.twist.linear.x = f64::NAN;
        assert!(odometry(&said, &tree(LEVEL), &names).is_err());
    }

    #[test]
    fn a_map_of_ros_is_the_map_of_its_file() {
        let mut said =
            ros::OccupancyGrid { data: vec![0, 100, -1, 50, 0, 0], ..ros::OccupancyGrid::default() };
        said.header.frame_id = "map".into();
        (said.info.width, said.info.height, said.info.resolution) = (3, 2, 0.05);
        said.info.origin.orientation = LEVEL;
        let grid = map(said.clone(), &Frames::default()).unwrap();
        let file = OccupancyGrid::new(3, 2, 0.05, Pose2::default(), said.data.clone()).unwrap();
        assert_eq!(grid.hash(), file.hash());
        said.data[0] = 101;
        assert!(map(said.clone(), &Frames::default()).is_err());
        said.data.truncate(5);
        assert!(map(said.clone(), &Frames::default()).is_err());
        (said.info.width, said.info.height) = (u32::MAX, u32::MAX);
        assert!(map(said, &Frames::default()).is_err());
    }
}
