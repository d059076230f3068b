//! Paths that clients ask for and that are not driven: the shortest ways on the map for this robot.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use curionav_planning::geometry::{Point2, Pose2, bearing};
use curionav_planning::occupancy::{GeodesicField, OccupancyGrid, StaticMap};
use curionav_ros2::limits::POSES;
use curionav_ros2::messages::Uuid;
use tokio::sync::mpsc;

use crate::action_kind::Failure;
use crate::tour::Destination;

/// Paths that are looked for at a time; who asks for more is refused.
const UNDER_WAY: usize = 4;
/// Between two poses of a path, metres, unless it is longer than [`POSES`] of them.
const SPACING: f64 = 0.05;

/// A path that was found, or why none was.
pub(crate) struct PathMade {
    /// The goal that asked for it.
    pub(crate) id: Uuid,
    /// Its poses, or why there are none, also in words.
    pub(crate) outcome: Result<Vec<Pose2>, (Failure, String)>,
    /// How long it took.
    pub(crate) took: Duration,
}

/// A map whose fields are derived when the first path is asked for.
struct LazyMap {
    grid: OccupancyGrid,
    fields: OnceLock<StaticMap>,
}

/// Looks for paths on threads of their own.
pub(crate) struct PathPlanner {
    map: Option<Arc<LazyMap>>,
    /// What the robot keeps from walls, and how near to a goal it must fit, metres.
    radius: f64,
    tolerance: f64,
    under_way: usize,
    made: mpsc::Sender<PathMade>,
}

impl PathPlanner {
    /// For a robot of this radius that comes within `tolerance` of its goals, metres; paths come out of the receiver.
    pub(crate) fn new(radius: f64, tolerance: f64) -> (Self, mpsc::Receiver<PathMade>) {
        let (made, received) = mpsc::channel(UNDER_WAY);
        (Self { map: None, radius, tolerance, under_way: 0, made }, received)
    }

    /// Later paths are on this map.
    pub(crate) fn on(&mut self, grid: OccupancyGrid) {
        self.map = Some(Arc::new(LazyMap { grid, fields: OnceLock::new() }));
    }

    /// Whether one more path can be looked for.
    pub(crate) fn has_room(&self) -> bool {
        self.map.is_some() && self.under_way < UNDER_WAY
    }

    /// Looks for a path from `start` through `goals`.
    pub(crate) fn begin(&mut self, id: Uuid, start: Point2, goals: Vec<Destination>) {
        let Some(map) = self.map.clone() else { return };
        self.under_way += 1;
        let made = self.made.clone();
        let robot = Robot { radius: self.radius, tolerance: self.tolerance };
        tokio::task::spawn_blocking(move || {
            let began = Instant::now();
            let outcome =
                path(map.fields.get_or_init(|| StaticMap::new(map.grid.clone())), &robot, start, &goals);
            // A gateway that ends wants no paths.
            let _ = made.blocking_send(PathMade { id, outcome, took: began.elapsed() });
        });
    }

    /// A path has come out.
    pub(crate) fn taken(&mut self) {
        self.under_way = self.under_way.saturating_sub(1);
    }
}

struct Robot {
    radius: f64,
    tolerance: f64,
}

/// The shortest way from `start` through `goals`, one after the other, with the heading of the way at each pose and
/// that of the last goal at its end.
fn path(
    map: &StaticMap,
    robot: &Robot,
    start: Point2,
    goals: &[Destination],
) -> Result<Vec<Pose2>, (Failure, String)> {
    let Some((last, heading)) = goals.last() else {
        return Err((Failure::NoPoses, "no pose is given".into()));
    };
    check_start(map, start)?;
    let mut points = vec![start];
    let mut from = start;
    for (goal, _) in goals {
        check_goal(map, robot, *goal)?;
        let field = GeodesicField::new(map, *goal, robot.radius + GeodesicField::PLANNING_MARGIN);
        let way = field.descend(from, SPACING);
        if way.is_empty() {
            return Err((Failure::NoPath, format!("no way leads to ({:.2}, {:.2})", goal.x, goal.y)));
        }
        points.extend(way.into_iter().skip(1));
        points.push(*goal);
        from = *goal;
    }
    let mut kept = thinned(points);
    kept.dedup_by(|next, before| next.distance(*before) < 1e-6);
    let headings = kept.windows(2).map(|pair| bearing(pair[0], pair[1]));
    let mut poses: Vec<Pose2> =
        kept.iter().zip(headings).map(|(at, heading)| Pose2::new(at.x, at.y, heading)).collect();
    let end = heading.or_else(|| poses.last().map(|pose| pose.heading)).unwrap_or_default();
    poses.push(Pose2::new(last.x, last.y, end));
    Ok(poses)
}

/// No more points than a message holds, the first and the last among them.
fn thinned(points: Vec<Point2>) -> Vec<Point2> {
    let every = points.len().div_ceil(POSES - 1).max(1);
    let last = points.len() - 1;
    let is_kept = |(at, _): &(usize, Point2)| at.is_multiple_of(every) || *at == last;
    points.into_iter().enumerate().filter(is_kept).map(|(_, point)| point).collect()
}

fn check_start(map: &StaticMap, start: Point2) -> Result<(), (Failure, String)> {
    let Point2 { x, y } = start;
    if map.grid.locate(start).is_none() {
        return Err((
            Failure::StartOutside,
            format!("the path begins at ({x:.2}, {y:.2}), outside of the map"),
        ));
    }
    if !map.grid.is_drivable_at(start) {
        return Err((
            Failure::StartOccupied,
            format!("the path begins at ({x:.2}, {y:.2}), where no floor is free"),
        ));
    }
    Ok(())
}

fn check_goal(map: &StaticMap, robot: &Robot, goal: Point2) -> Result<(), (Failure, String)> {
    let Point2 { x, y } = goal;
    let Some(room) = map.most_room(goal, robot.tolerance) else {
        return Err((Failure::GoalOutside, format!("the goal ({x:.2}, {y:.2}) lies outside of the map")));
    };
    if room < robot.radius || !map.grid.is_drivable_at(goal) {
        return Err((Failure::GoalOccupied, format!("the robot does not fit at the goal ({x:.2}, {y:.2})")));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROBOT: Robot = Robot { radius: 0.2, tolerance: 0.2 };

    /// 10 m x 6 m at 0.1 m, with a wall at x = 5 that leaves a gap of 1 m above.
    fn map(has_gap: bool) -> StaticMap {
        let is_wall = |i: usize| i % 100 == 50 && !(has_gap && i / 100 >= 50);
        let cells = (0..6000).map(|i| if is_wall(i) { 100 } else { 0 }).collect();
        StaticMap::new(OccupancyGrid::new(100, 60, 0.1, Pose2::default(), cells).unwrap())
    }

    fn to(x: f64, y: f64) -> Destination {
        (Point2::new(x, y), Some(1.0))
    }

    #[test]
    fn a_path_leads_around_the_wall_through_each_pose_and_ends_as_asked() {
        let start = Point2::new(1.0, 1.0);
        let poses = path(&map(true), &ROBOT, start, &[to(3.0, 2.0), to(9.0, 1.0)]).unwrap();
        assert!(poses[0].position().distance(start) < 1e-9);
        let through = |p: Point2| poses.iter().any(|pose| pose.position().distance(p) < 0.06);
        assert!(through(Point2::new(3.0, 2.0)));
        let crossing = poses.iter().find(|pose| pose.x > 5.0).unwrap();
        assert!(crossing.y > 5.0, "{crossing:?}");
        let end = poses.last().unwrap();
        assert!(end.position().distance(Point2::new(9.0, 1.0)) < 1e-9 && end.heading == 1.0);
        assert!(poses.windows(2).all(|pair| pair[0].position().distance(pair[1].position()) < 0.11));
    }

    #[test]
    fn a_path_that_cannot_be_has_the_reason_that_nav2_tells_apart() {
        let start = Point2::new(1.0, 1.0);
        let failure = |map: &StaticMap, start: Point2, goals: &[Destination]| {
            path(map, &ROBOT, start, goals).unwrap_err().0
        };
        let open = map(true);
        assert_eq!(failure(&map(false), start, &[to(9.0, 1.0)]), Failure::NoPath);
        assert_eq!(failure(&open, start, &[to(90.0, 1.0)]), Failure::GoalOutside);
        assert_eq!(failure(&open, start, &[to(5.05, 1.0)]), Failure::GoalOccupied);
        assert_eq!(failure(&open, Point2::new(-3.0, 1.0), &[to(9.0, 1.0)]), Failure::StartOutside);
        assert_eq!(failure(&open, Point2::new(5.05, 1.0), &[to(9.0, 1.0)]), Failure::StartOccupied);
        assert_eq!(failure(&open, start, &[]), Failure::NoPoses);
    }

    #[test]
    fn a_long_path_has_no_more_poses_than_a_message_holds() {
        let long = (0..20_000).map(|i| Point2::new(f64::from(i), 0.0)).collect();
        let kept = thinned(long);
        assert!(kept.len() <= POSES && kept[0].x == 0.0 && kept[kept.len() - 1].x == 19_999.0);
    }
}
