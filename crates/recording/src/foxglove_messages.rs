//! What has a schema of Foxglove's: poses, paths, transforms, grids, scans and logs. Frames: `map`, and one named
//! after each robot, which stands where the robot believes it is.

use curionav_planning::beam::Beam;
use curionav_planning::numerics::sin_cos;
use curionav_runtime::convert;
use curionav_schemas::{self as wire, Action, words};
use foxglove::messages::{
    FrameTransform, Grid, LaserScan, Log, PackedElementField, Pose, PoseInFrame, PosesInFrame, Quaternion,
    Timestamp, Vector2, Vector3, log, packed_element_field,
};

pub(super) const MAP_FRAME: &str = "map";
/// What stands for an unknown cell of a grid, where 0 is free and 100 occupied.
const UNKNOWN: u8 = 255;

pub(super) fn timestamp(time: u64) -> Option<Timestamp> {
    const SECOND: u64 = 1_000_000_000;
    Some(Timestamp::new(u32::try_from(time / SECOND).unwrap_or(u32::MAX), (time % SECOND) as u32))
}

fn rotation(heading: f64) -> Option<Quaternion> {
    let (z, w) = sin_cos(heading / 2.0);
    Some(Quaternion { x: 0.0, y: 0.0, z, w })
}

pub(super) fn pose(x: f64, y: f64, z: f64, heading: f64) -> Option<Pose> {
    Some(Pose { position: Some(Vector3 { x, y, z }), orientation: rotation(heading) })
}

pub(super) fn transform(robot: &str, belief: &wire::Belief, time: u64) -> FrameTransform {
    FrameTransform {
        timestamp: timestamp(time),
        parent_frame_id: MAP_FRAME.into(),
        child_frame_id: robot.into(),
        translation: Some(Vector3 { x: belief.x, y: belief.y, z: 0.0 }),
        rotation: rotation(belief.heading),
    }
}

/// Where the robot believes it is.
pub(super) fn believed(belief: &wire::Belief, time: u64) -> PoseInFrame {
    PoseInFrame {
        timestamp: timestamp(time),
        frame_id: MAP_FRAME.into(),
        pose: pose(belief.x, belief.y, 0.0, belief.heading),
    }
}

/// Where the robot may be. The schema has no place for weights.
pub(super) fn particles(particles: &wire::Particles, time: u64) -> PosesInFrame {
    let wire::Particles { x, y, heading, .. } = particles;
    let poses = x.iter().zip(y.iter()).zip(heading.iter());
    poses_in_frame(poses.map(|((x, y), heading)| [*x, *y, *heading].map(f64::from)), time)
}

pub(super) fn path(decision: &wire::Decision, time: u64) -> PosesInFrame {
    let wire::Decision { x, y, heading, .. } = decision;
    let poses = x.iter().zip(y.iter()).zip(heading.iter());
    poses_in_frame(poses.map(|((x, y), heading)| [*x, *y, *heading]), time)
}

fn poses_in_frame(poses: impl Iterator<Item = [f64; 3]>, time: u64) -> PosesInFrame {
    PosesInFrame {
        timestamp: timestamp(time),
        frame_id: MAP_FRAME.into(),
        poses: poses.filter_map(|[x, y, heading]| pose(x, y, 0.0, heading)).collect(),
    }
}

/// What the laser sees, in the robot's frame. The schema knows detections and no greatest range: a beam that hit
/// nothing is infinitely long, which is drawn nowhere, where `range_max` would be drawn as a wall. A beam that says
/// nothing is no number.
pub(super) fn scan(robot: &str, scan: &wire::Scan, time: u64) -> LaserScan {
    let last = scan.ranges.len().saturating_sub(1) as f64;
    let wire::Pose { x, y, heading } = scan.laser;
    LaserScan {
        timestamp: timestamp(time),
        frame_id: robot.into(),
        pose: pose(x, y, 0.0, heading),
        start_angle: scan.angle_min,
        end_angle: scan.angle_min + last * scan.angle_increment,
        ranges: convert::beams(scan)
            .map(|beam| match beam {
                Beam::Silent => f64::NAN,
                Beam::Obstacle(metres) => metres,
                Beam::Free(_) => f64::INFINITY,
            })
            .collect(),
        intensities: Vec::new(),
    }
}

pub(super) fn grid(map: &wire::OccupancyGrid, time: u64) -> Grid {
    let cells: Vec<u8> = map.cells.iter().map(|cell| u8::try_from(*cell).unwrap_or(UNKNOWN)).collect();
    let wire::Pose { x, y, heading } = map.origin;
    Grid {
        timestamp: timestamp(time),
        frame_id: MAP_FRAME.into(),
        pose: pose(x, y, 0.0, heading),
        column_count: map.width,
        cell_size: Some(Vector2 { x: map.resolution, y: map.resolution }),
        row_stride: map.width,
        cell_stride: 1,
        fields: vec![PackedElementField {
            name: "occupancy".into(),
            offset: 0,
            r#type: packed_element_field::NumericType::Uint8 as i32,
        }],
        data: cells.into(),
    }
}

pub(super) fn line(robot: &str, level: log::Level, message: String, time: u64) -> Log {
    Log { timestamp: timestamp(time), level: level as i32, message, name: robot.into(), ..Log::default() }
}

pub(super) fn decided(robot: &str, decision: &wire::Decision, time: u64) -> Log {
    let healthy = decision.action == Action::Follow && decision.degraded.is_empty();
    let level = if healthy { log::Level::Info } else { log::Level::Warning };
    let mut message = words::say("action", &decision.action);
    if let (Action::Follow, Some(id)) = (decision.action, decision.candidate) {
        message += &format!(" candidate {id}");
    }
    message += &format!(": {}", words::say("reason", &decision.reason));
    if !decision.degraded.is_empty() {
        message += &format!("; degraded: {}", words::say_all("degradation", &decision.degraded));
    }
    line(robot, level, message, time)
}
