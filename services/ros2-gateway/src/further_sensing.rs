//! What further sensors see, from ROS to the scans that curionav has of them: seen from above, the nearest in each
//! direction.

use std::f64::consts::PI;

use curionav_planning::beam::Beam;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::{atan2, sin_cos};
use curionav_ros2::messages as ros;
use curionav_runtime::convert;
use curionav_schemas::Scan;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::fault::Fault;
use crate::sensor_config::SensorConfig;
use crate::surroundings::{Surroundings, beam, checked};

/// Angle between two beams of a cone or a rim, rad.
const STEP: f64 = 0.02;
/// A cone is no thinner, rad: what measures along a line has no angle.
const THINNEST: f64 = 0.02;
/// Cosine of how far a ranger may point up or down: 25 degrees.
const LEVEL: f64 = 0.9;

/// The nearest points of a cloud in each direction. Of no directions but those of points anything is known.
///
/// A point counts if it lies in the sensor's band of heights and outside of the robot's own disc of `radius` metres.
///
/// # Errors
/// If the cloud contradicts itself, has other numbers than these, or no point of it has a place.
pub(crate) fn cloud(
    said: &ros::PointCloud2,
    base_from_sensor: &Isometry3<f64>,
    config: &SensorConfig,
    radius: f64,
) -> Result<Scan, Fault> {
    let layout = Layout::of(said)?;
    let from = base_from_sensor.translation;
    let [low, high] = config.band();
    let mut surroundings = Surroundings::unknown();
    let mut count = 0;
    let mut placed = 0;
    for [x, y, z] in layout.points(&said.data) {
        count += 1;
        if !(x.is_finite() && y.is_finite() && z.is_finite()) {
            continue;
        }
        placed += 1;
        let p = base_from_sensor * Point3::new(f64::from(x), f64::from(y), f64::from(z));
        if p.z < low || p.z > high || p.x * p.x + p.y * p.y < radius * radius {
            continue;
        }
        surroundings.add(p.x - from.x, p.y - from.y);
    }
    if count > 0 && placed == 0 {
        return Err(Fault::unusable(format!("none of its {count} points has a place: it sees nothing")));
    }
    surroundings.scan(from.x, from.y, config.reach())
}

/// Where the coordinates of each point lie.
struct Layout {
    offsets: [usize; 3],
    point_step: usize,
    row_step: usize,
    width: usize,
    height: usize,
    is_bigendian: bool,
}

impl Layout {
    /// As a cloud describes itself.
    fn of(said: &ros::PointCloud2) -> Result<Self, Fault> {
        let step = u64::from(said.point_step);
        let mut offsets = [0; 3];
        for (offset, name) in offsets.iter_mut().zip(["x", "y", "z"]) {
            let field = said.fields.iter().find(|field| field.name == name);
            let field = field.ok_or_else(|| Fault::unusable(format!("its points have no field `{name}`")))?;
            if field.datatype != ros::PointField::FLOAT32 {
                let kind = field.datatype;
                let detail = format!("its field `{name}` has the type {kind}; only FLOAT32, 7, is read");
                return Err(Fault::unusable(detail));
            }
            if u64::from(field.offset) + 4 > step {
                let detail = format!("its field `{name}` lies beyond the {step} bytes of a point");
                return Err(Fault::malformed(detail));
            }
            *offset = field.offset as usize;
        }
        let row = u64::from(said.width) * step;
        let rows = u64::from(said.height);
        let row_step = u64::from(said.row_step);
        let needed =
            rows.saturating_sub(1).saturating_mul(row_step).saturating_add(if rows > 0 { row } else { 0 });
        if rows > 1 && row_step < row || needed > said.data.len() as u64 {
            let found = said.data.len();
            let detail =
                format!("{} x {} points of {step} bytes do not fit in {found}", said.width, said.height);
            return Err(Fault::malformed(detail));
        }
        Ok(Self {
            offsets,
            point_step: said.point_step as usize,
            row_step: said.row_step as usize,
            width: said.width as usize,
            height: if said.width == 0 { 0 } else { said.height as usize },
            is_bigendian: said.is_bigendian,
        })
    }

    /// The coordinates of all points, in the sensor's frame.
    fn points<'a>(&'a self, data: &'a [u8]) -> impl Iterator<Item = [f32; 3]> + 'a {
        let row = self.width * self.point_step;
        let rows = (0..self.height).filter_map(move |at| data.get(at * self.row_step..)?.get(..row));
        let points = rows.flat_map(|row| row.chunks_exact(self.point_step));
        points.map(|point| self.offsets.map(|offset| self.number(point, offset)))
    }

    fn number(&self, point: &[u8], offset: usize) -> f32 {
        let bytes = point.get(offset..offset + 4).and_then(|bytes| bytes.try_into().ok());
        // A point is long enough, as `of` has seen.
        let bytes = bytes.unwrap_or([0xff; 4]);
        if self.is_bigendian { f32::from_be_bytes(bytes) } else { f32::from_le_bytes(bytes) }
    }
}

/// The scan of one more scanner without what lies within the robot's own disc of `radius` metres.
pub(crate) fn scan(mut scan: Scan, radius: f64) -> Scan {
    let laser = convert::pose(scan.laser);
    let least = scan.range_min.unwrap_or(0.0);
    for (beam, range) in scan.ranges.0.iter_mut().enumerate() {
        let Beam::Obstacle(metres) = Beam::of(*range, least, scan.range_max) else { continue };
        let (sin, cos) = sin_cos(scan.angle_min + scan.angle_increment * beam as f64);
        let end = laser.transform(Point2::new(metres * cos, metres * sin));
        if end.distance(Point2::default()) < radius {
            *range = f32::NAN;
        }
    }
    scan
}

/// What a ranger measures: the whole arc of its cone at that distance, or nothing in it as far as it measures.
///
/// # Errors
/// If the message describes no ranger or says nothing, or the ranger points up or down.
pub(crate) fn range(said: &ros::Range, base_from_sensor: &Isometry3<f64>) -> Result<Scan, Fault> {
    let ros::Range { field_of_view, min_range, max_range, range, .. } = *said;
    let numbers = [field_of_view, min_range, max_range];
    if !numbers.into_iter().all(f32::is_finite)
        || min_range < 0.0
        || max_range <= min_range
        || field_of_view < 0.0
    {
        return Err(Fault::malformed("its angle and ranges describe no ranger"));
    }
    if range.is_nan() {
        return Err(Fault::unusable("its range is no number"));
    }
    let along = base_from_sensor.rotation * Vector3::x();
    let level = along.xy().norm();
    if level < LEVEL {
        return Err(Fault::unusable("the ranger points up or down"));
    }
    let angle = f64::from(field_of_view).clamp(THINNEST, PI);
    let least = f64::from(min_range) * level;
    let most = f64::from(max_range) * level;
    // A range of 0 is as near as minus infinity: what fails says NaN.
    let metres = (f64::from(range) * level).clamp(least, most);
    let from = base_from_sensor.translation;
    let heading = atan2(along.y, along.x);
    checked(arc(Pose2::new(from.x, from.y, heading), angle, metres, most))
}

/// A pressed bumper: the rim of the robot's disc of `radius` metres, around the bumper's middle.
pub(crate) fn bumper(config: &SensorConfig, radius: f64) -> Scan {
    let (bearing, width) = config.rim();
    arc(Pose2::new(0.0, 0.0, bearing), width, radius, 2.0 * radius)
}

/// Beams on both sides of a direction that all end so far away.
fn arc(from: Pose2, angle: f64, metres: f64, most: f64) -> Scan {
    let gaps = (angle / STEP).ceil().max(1.0);
    Scan {
        tick: 0,
        stamp: 0.0,
        angle_min: -0.5 * angle,
        angle_increment: angle / gaps,
        range_min: None,
        range_max: most,
        laser: convert::pose_to_wire(from),
        ranges: vec![beam(metres, most).range(); gaps as usize + 1].into(),
    }
}

#[cfg(test)]
#[path = "further_sensing_tests.rs"]
mod tests;
