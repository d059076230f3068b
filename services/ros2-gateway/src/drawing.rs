//! What the robot believes, plans and sees, from curionav to ROS.

use curionav_planning::geometry::Pose2;
use curionav_planning::numerics::sin_cos;
use curionav_ros2::limits::MARKERS;
use curionav_ros2::messages as ros;
use curionav_schemas::{Belief, CycleReport, Decision, ObstacleCells};

/// Markers vanish by themselves if no cycle renews them.
const LIFETIME: ros::Duration = ros::Duration { sec: 1, nanosec: 0 };
/// What markers are.
const CYLINDER: i32 = 3;
const LINE_STRIP: i32 = 4;
const CUBE_LIST: i32 = 6;
const DELETE_ALL: i32 = 3;
const LINE_WIDTH: f64 = 0.02;
const PERSON_HEIGHT: f64 = 1.7;
const OBSTACLE_HEIGHT: f64 = 0.5;

/// A pose in the plane.
pub(crate) fn pose(pose: Pose2) -> ros::Pose {
    let (z, w) = sin_cos(0.5 * pose.heading);
    ros::Pose {
        position: ros::Point { x: pose.x, y: pose.y, z: 0.0 },
        orientation: ros::Quaternion { x: 0.0, y: 0.0, z, w },
    }
}

/// A header.
pub(crate) fn header(stamp: ros::Time, frame: &str) -> ros::Header {
    ros::Header { stamp, frame_id: frame.to_owned() }
}

/// Where the robot believes it is, with the covariance of x, y and heading.
pub(crate) fn believed(belief: &Belief, header: ros::Header) -> ros::PoseWithCovarianceStamped {
    let mut covariance = [[0.0; 6]; 6];
    // x, y and yaw of x, y, z, roll, pitch, yaw.
    const PLACES: [usize; 3] = [0, 1, 5];
    for (i, number) in belief.covariance.iter().enumerate().take(9) {
        covariance[PLACES[i / 3]][PLACES[i % 3]] = *number;
    }
    let place = pose(Pose2::new(belief.x, belief.y, belief.heading));
    ros::PoseWithCovarianceStamped { header, pose: ros::PoseWithCovariance { pose: place, covariance } }
}

/// The transform from the map to odometry: where odometry began, if the robot is at `belief` now and odometry says
/// `odometry`.
pub(crate) fn map_from_odom(belief: &Belief, odometry: Pose2) -> Pose2 {
    let robot = Pose2::new(belief.x, belief.y, belief.heading);
    robot.compose(odometry.relative(Pose2::default()))
}

/// A transform in the plane.
pub(crate) fn transform(header: ros::Header, child: &str, at: Pose2) -> ros::TfMessage {
    let ros::Pose { position: p, orientation: rotation } = pose(at);
    let transform = ros::Transform { translation: ros::Vector3 { x: p.x, y: p.y, z: p.z }, rotation };
    ros::TfMessage {
        transforms: vec![ros::TransformStamped { header, child_frame_id: child.to_owned(), transform }],
    }
}

/// What is driven; nothing if the robot stops.
pub(crate) fn path(decision: &Decision, header: ros::Header) -> ros::Path {
    let states = decision.x.iter().zip(decision.y.iter()).zip(decision.heading.iter());
    let poses = states.map(|((x, y), heading)| ros::PoseStamped {
        header: header.clone(),
        pose: pose(Pose2::new(*x, *y, *heading)),
    });
    ros::Path { poses: poses.collect(), header: header.clone() }
}

fn marker(header: &ros::Header, ns: &str, id: usize, kind: i32, color: ros::ColorRgba) -> ros::Marker {
    ros::Marker {
        header: header.clone(),
        ns: ns.to_owned(),
        id: i32::try_from(id).unwrap_or(i32::MAX),
        r#type: kind,
        pose: pose(Pose2::default()),
        color,
        lifetime: LIFETIME,
        ..ros::Marker::default()
    }
}

/// What was drawn before goes.
fn fresh(header: &ros::Header) -> Vec<ros::Marker> {
    vec![ros::Marker { header: header.clone(), action: DELETE_ALL, ..ros::Marker::default() }]
}

/// The candidates of a cycle as lines: from green for the cheapest to red for the dearest, grey without a total, and
/// the chosen one blue and wide.
pub(crate) fn candidates(report: &CycleReport, header: &ros::Header) -> ros::MarkerArray {
    let set = &report.candidates;
    let count = set.count as usize;
    let steps = set.steps as usize;
    let costs = report.total.iter().copied();
    let (least, most) =
        costs.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), cost| (a.min(cost), b.max(cost)));
    let mut markers = fresh(header);
    for candidate in 0..count.min(MARKERS - 1) {
        let states = candidate * steps..(candidate + 1) * steps;
        let chosen = report.chosen.is_some_and(|chosen| chosen as usize == candidate);
        let color = match report.total_of(candidate) {
            _ if chosen => ros::ColorRgba { r: 0.1, g: 0.3, b: 1.0, a: 1.0 },
            Some(total) => {
                let share = ((total - least) / (most - least).max(1e-9)) as f32;
                ros::ColorRgba { r: share, g: 1.0 - share, b: 0.0, a: 0.6 }
            }
            None => ros::ColorRgba { r: 0.5, g: 0.5, b: 0.5, a: 0.3 },
        };
        let mut line = marker(header, "candidates", candidate, LINE_STRIP, color);
        line.scale.x = if chosen { 3.0 * LINE_WIDTH } else { LINE_WIDTH };
        let (Some(x), Some(y)) = (set.x.get(states.clone()), set.y.get(states)) else { break };
        line.points = x.iter().zip(y).map(|(x, y)| ros::Point { x: *x, y: *y, z: 0.0 }).collect();
        markers.push(line);
    }
    ros::MarkerArray { markers }
}

/// The people, crowds and obstacles of a cycle: a column per person, a flat disc of one standard deviation per crowd,
/// and cubes.
pub(crate) fn crowd(report: &CycleReport, header: &ros::Header) -> ros::MarkerArray {
    let mut markers = fresh(header);
    markers.extend(report.obstacles.as_ref().map(|cells| obstacles(cells, header)));
    let people = &report.scene.people;
    for (i, (x, y)) in people.x.iter().zip(people.y.iter()).enumerate() {
        let colour = ros::ColorRgba { r: 1.0, g: 0.6, b: 0.0, a: 0.8 };
        let mut column = marker(header, "people", i, CYLINDER, colour);
        stand(&mut column, (*x, *y), PERSON_HEIGHT, 2.0 * people.radius);
        markers.push(column);
    }
    for (i, crowd) in report.crowds.iter().enumerate() {
        let a = (0.2 + 0.6 * crowd.weight).min(0.8) as f32;
        let mut disc = marker(header, "crowds", i, CYLINDER, ros::ColorRgba { r: 0.9, g: 0.1, b: 0.1, a });
        stand(&mut disc, (crowd.x, crowd.y), LINE_WIDTH, 2.0 * crowd.sigma.sqrt());
        markers.push(disc);
    }
    markers.truncate(MARKERS);
    ros::MarkerArray { markers }
}

/// What the robot has seen and is on no map, as cubes in one marker.
fn obstacles(cells: &ObstacleCells, header: &ros::Header) -> ros::Marker {
    let colour = ros::ColorRgba { r: 0.5, g: 0.4, b: 0.1, a: 0.9 };
    let mut cubes = marker(header, "obstacles", 0, CUBE_LIST, colour);
    cubes.scale = ros::Vector3 { x: cells.side, y: cells.side, z: OBSTACLE_HEIGHT };
    let centres = cells.x.iter().zip(cells.y.iter());
    let points =
        centres.map(|(x, y)| ros::Point { x: (*x).into(), y: (*y).into(), z: 0.5 * OBSTACLE_HEIGHT });
    cubes.points = points.collect();
    cubes
}

/// Puts a cylinder on the floor, metres.
fn stand(cylinder: &mut ros::Marker, (x, y): (f64, f64), height: f64, width: f64) {
    cylinder.pose.position = ros::Point { x, y, z: 0.5 * height };
    cylinder.scale = ros::Vector3 { x: width, y: width, z: height };
}

#[cfg(test)]
mod tests {
    use curionav_ros2::message::Message;
    use curionav_testing::golden;

    use super::*;
    use crate::frames::planar;

    fn in_map() -> ros::Header {
        header(ros::Time { sec: 3, nanosec: 4 }, "map")
    }

    #[test]
    fn everything_drawn_can_be_sent() {
        let report = golden::cycle_report();
        let drawn = candidates(&report, &in_map());
        assert_eq!(drawn.markers.len(), 1 + report.candidates.count as usize);
        assert!(drawn.encode().is_ok());
        let drawn = crowd(&report, &in_map());
        assert_eq!(drawn.markers.len(), 1 + report.scene.people.id.len() + report.crowds.len());
        assert!(drawn.encode().is_ok() && path(&report.decision, in_map()).encode().is_ok());
    }

    #[test]
    fn map_and_odometry_together_say_where_the_robot_is() {
        let (belief, odometry) = (golden::belief(), Pose2::new(3.0, -1.0, 0.4));
        let robot = map_from_odom(&belief, odometry).compose(odometry);
        let Belief { x, y, heading, .. } = belief;
        assert!(
            (robot.x - x).abs() < 1e-12
                && (robot.y - y).abs() < 1e-12
                && (robot.heading - heading).abs() < 1e-12
        );
        let sent = believed(&belief, in_map());
        assert!((planar(&sent.pose.pose).unwrap().heading - heading).abs() < 1e-12);
        let c = sent.pose.covariance;
        let (wanted, found) = (&belief.covariance, [c[0][0], c[0][1], c[1][1], c[5][0], c[5][5]]);
        assert_eq!(found, [wanted[0], wanted[1], wanted[4], wanted[6], wanted[8]]);
    }
}
