//! A path that a planner of Nav2 has found, for the robot to follow.

use curionav_planning::geometry::{Point2, Pose2, bearing, wrap_angle};
use curionav_planning::occupancy::Way;
use curionav_ros2::messages as ros;
use curionav_schemas::F64Array;
use curionav_schemas::limits::MAX_WAY_POINTS;

use crate::fault::Fault;
use crate::frames::planar;
use crate::tour::Destination;

/// The points of a path, at most as many as a mission has, the first and the last among them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GivenPath {
    points: Vec<Point2>,
    heading: f64,
}

/// Where a robot is beside its path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Beside {
    /// Which point of the path is nearest.
    pub(crate) index: usize,
    /// From there along the path to its end, metres.
    pub(crate) remaining: f64,
    /// How far the robot is to the left of the path, metres.
    pub(crate) left: f64,
    /// How far it is turned to the right of the path, radians.
    pub(crate) turned_right: f64,
}

impl GivenPath {
    /// Of a path in the frame `map`.
    ///
    /// # Errors
    /// If a pose is none, or the points are no way.
    pub(crate) fn of(path: &ros::Path, map: &str) -> Result<Self, Fault> {
        if path.header.frame_id != map {
            return Err(Fault::unknown_frame(&path.header.frame_id, map));
        }
        let poses = path.poses.iter().map(|pose| planar(&pose.pose)).collect::<Result<Vec<_>, _>>()?;
        let heading = poses.last().map_or(0.0, |pose| pose.heading);
        let mut points: Vec<Point2> = poses.iter().map(|pose| pose.position()).collect();
        points.dedup();
        let every = points.len().div_ceil(MAX_WAY_POINTS - 1).max(1);
        let last = points.len().saturating_sub(1);
        let kept = points.into_iter().enumerate().filter(|(at, _)| at.is_multiple_of(every) || *at == last);
        let mut points: Vec<Point2> = kept.map(|(_, point)| point).collect();
        // A planner whose robot is at the goal gives a single pose.
        if let [only] = points[..] {
            points.push(Point2::new(only.x + 1e-3, only.y));
        }
        let way = Way::new(points).map_err(|error| Fault::unusable(format!("the path {error}")))?;
        Ok(Self { points: way.points().to_vec(), heading })
    }

    /// Its end.
    pub(crate) fn destination(&self) -> Destination {
        (self.points[self.points.len() - 1], Some(self.heading))
    }

    /// As a mission has it.
    pub(crate) fn to_wire(&self) -> F64Array {
        self.points.iter().flat_map(|point| [point.x, point.y]).collect::<Vec<f64>>().into()
    }

    /// Where a robot at `here` is beside it.
    pub(crate) fn beside(&self, here: Pose2) -> Beside {
        let from = here.position();
        let distances = self.points.iter().map(|point| point.distance(from)).enumerate();
        let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1));
        let index = nearest.map_or(0, |(index, _)| index);
        let ahead = self.points[index..].windows(2).map(|pair| pair[0].distance(pair[1]));
        let first = index.min(self.points.len() - 2);
        let along = bearing(self.points[first], self.points[first + 1]);
        let off = Pose2::new(self.points[index].x, self.points[index].y, along).relative(here);
        Beside { index, remaining: ahead.sum(), left: off.y, turned_right: wrap_angle(along - here.heading) }
    }
}

#[cfg(test)]
mod tests {
    use curionav_ros2::messages::{Header, Path, PoseStamped};

    use super::*;
    use crate::drawing;

    fn path(poses: &[(f64, f64, f64)]) -> Path {
        let stamped = |&(x, y, heading): &(f64, f64, f64)| PoseStamped {
            header: Header::default(),
            pose: drawing::pose(Pose2::new(x, y, heading)),
        };
        let header = Header { frame_id: "map".into(), ..Header::default() };
        Path { header, poses: poses.iter().map(stamped).collect() }
    }

    #[test]
    fn a_robot_knows_how_far_along_and_beside_its_path_it_is() {
        let given =
            GivenPath::of(&path(&[(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 3.0, 1.5)]), "map").unwrap();
        let beside = given.beside(Pose2::new(1.9, 0.4, 0.2));
        assert_eq!((beside.index, beside.remaining), (1, 3.0));
        assert!((beside.left - 0.1).abs() < 1e-9, "{beside:?}");
        assert!((given.destination().1.unwrap() - 1.5).abs() < 1e-9);
        let beside = given.beside(Pose2::new(0.1, 0.4, 0.2));
        assert!((beside.left - 0.4).abs() < 1e-9 && (beside.turned_right + 0.2).abs() < 1e-9, "{beside:?}");
        assert_eq!(given.to_wire().to_vec(), [0.0, 0.0, 2.0, 0.0, 2.0, 3.0]);
    }

    #[test]
    fn a_long_path_is_thinned_and_keeps_its_ends() {
        let poses: Vec<_> = (0..4000).map(|i| (0.05 * f64::from(i), 0.0, 0.0)).collect();
        let given = GivenPath::of(&path(&poses), "map").unwrap();
        assert!(given.points.len() <= MAX_WAY_POINTS);
        assert_eq!((given.points[0].x, given.destination().0.x), (0.0, 0.05 * 3999.0));
    }

    #[test]
    fn a_path_of_one_pose_ends_there_and_one_of_none_or_elsewhere_is_refused() {
        let given = GivenPath::of(&path(&[(1.0, 1.0, 0.0)]), "map").unwrap();
        assert!(given.destination().0.distance(Point2::new(1.0, 1.0)) < 0.01);
        assert!(GivenPath::of(&path(&[]), "map").is_err());
        assert!(GivenPath::of(&path(&[(1.0, 1.0, 0.0)]), "odom").is_err());
    }
}
