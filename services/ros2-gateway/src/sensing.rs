//! What the robot senses, from ROS to curionav.

use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::occupancy::OccupancyGrid;
use curionav_ros2::messages as ros;
use curionav_runtime::convert;
use curionav_schemas::Scan;
use curionav_schemas::limits::MAX_MAP_CELLS;

use crate::config::Frames;
use crate::fault::Fault;
use crate::frames::{FrameTree, Mount, planar};

/// A scan of which a greater share of the beams is no number shows too little to drive by.
const BLIND_SHARE: f32 = 0.5;
/// How far the frame of odometry may lie from the robot's, m and rad.
const SAME_PLACE: f64 = 0.01;

/// A scan as curionav has it, of no tick yet. A range that is infinite, too great, or below what the scanner can
/// measure, counts as one that hit nothing, as ROS has it (REP 117); one that is minus infinity as one that hit
/// something at the least range. A beam that is no number says nothing, and counts as one that hit nothing too, but a
/// scan with many of them is refused.
///
/// # Errors
/// If the scan is none, if it is not known where the scanner is, or if the scanner leans.
pub(crate) fn scan(scan: &ros::LaserScan, frames: &FrameTree, base: &str) -> Result<Scan, Fault> {
    let angle_min = f64::from(scan.angle_min);
    let increment = f64::from(scan.angle_increment);
    let least = scan.range_min;
    let most = scan.range_max;
    if ![scan.angle_min, scan.angle_increment, least, most].into_iter().all(f32::is_finite)
        || least < 0.0
        || most <= least
    {
        return Err(Fault::malformed("the scan's angles and ranges describe no scanner"));
    }
    if scan.ranges.is_empty() {
        return Err(Fault::unusable("the scan has no beams"));
    }
    let lost = scan.ranges.iter().filter(|range| range.is_nan()).count();
    if lost as f32 > BLIND_SHARE * scan.ranges.len() as f32 {
        let detail = format!("{lost} of {} beams are no number: the scanner sees nothing", scan.ranges.len());
        return Err(Fault::unusable(detail));
    }
    let frame = &scan.header.frame_id;
    let found = frames.pose_in(base, frame).ok_or_else(|| Fault::unknown_frame(frame, base))?;
    let mount = Mount::of(&found);
    let mount =
        mount.ok_or_else(|| Fault::unusable(format!("the scanner `{frame}` leans: it is not planar")))?;
    let ranges = scan.ranges.iter().map(|range| match *range {
        range if range == f32::NEG_INFINITY => least,
        range if range >= least && range <= most => range,
        _ => most,
    });
    // Seen from above, a scanner that hangs turns the other way.
    let side = if mount.is_upside_down { -1.0 } else { 1.0 };
    Ok(Scan {
        tick: 0,
        stamp: 0.0,
        angle_min: side * angle_min,
        angle_increment: side * increment,
        range_max: f64::from(most),
        laser: convert::pose_to_wire(mount.pose),
        ranges: ranges.collect::<Vec<_>>().into(),
    })
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
            angle_increment: 0.25,
            range_min: 0.1,
            range_max: 10.0,
            ranges: ranges.to_vec(),
            ..ros::LaserScan::default()
        }
    }

    #[test]
    fn ranges_mean_what_ros_says_that_they_mean() {
        let said = said(&[f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 0.0, 12.0, 3.0]);
        let scan = scan(&said, &tree(LEVEL), "base_link").unwrap();
        assert_eq!(scan.ranges.to_vec(), [10.0, 0.1, 10.0, 10.0, 10.0, 3.0]);
        assert_eq!((convert::pose(scan.laser), scan.angle_min), (Pose2::new(0.2, 0.0, 0.0), -0.5));
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
        let upright = ends(&scan(&said, &up, "base_link").unwrap());
        let mut hanging = ends(&scan(&hung, &down, "base_link").unwrap());
        hanging.reverse();
        assert!(upright.iter().zip(&hanging).all(|(a, b)| a.distance(*b) < 1e-9), "{upright:?} {hanging:?}");
    }

    #[test]
    fn a_scan_that_cannot_be_used_is_refused_with_the_reason() {
        let tree = tree(LEVEL);
        let fault = |said: &ros::LaserScan| scan(said, &tree, "base_link").unwrap_err().to_string();
        let elsewhere = ros::LaserScan {
            header: Header { frame_id: "camera".into(), ..Header::default() },
            ..said(&[1.0])
        };
        assert_eq!(fault(&elsewhere), "no transform leads from the frame `camera` to `base_link`");
        assert!(fault(&said(&[f32::NAN, f32::NAN, 1.0])).starts_with("2 of 3 beams are no number"));
        assert!(fault(&said(&[])).contains("no beams"));
        assert!(fault(&ros::LaserScan { range_max: f32::NAN, ..said(&[1.0]) }).contains("no scanner"));
        let leaning = self::tree(Quaternion { x: 0.5, w: 0.75_f64.sqrt(), ..Quaternion::default() });
        assert!(scan(&said(&[1.0]), &leaning, "base_link").unwrap_err().to_string().contains("leans"));
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
