//! Poses, models and maps.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::motion::{Footprint, OdometryNoise, RobotModel};
use curionav_planning::occupancy::OccupancyGrid;
use curionav_planning::sensor::LaserModel;
use curionav_schemas::{self as wire, MapId, Refusal, Reject};

/// A pose.
pub fn pose(p: wire::Pose) -> Pose2 {
    Pose2::new(p.x, p.y, p.heading)
}

/// A pose.
pub fn pose_to_wire(p: Pose2) -> wire::Pose {
    wire::Pose { x: p.x, y: p.y, heading: p.heading }
}

/// A robot model.
pub fn robot_model(m: &wire::RobotModel) -> RobotModel {
    let wire::RobotModel { ref footprint, v_max, a_max, omega_max, alpha_max, v_reverse } = *m;
    let footprint = match footprint {
        wire::Footprint::Disc { radius } => Footprint::Disc { radius: *radius },
        wire::Footprint::Polygon { x, y } => Footprint::Polygon {
            vertices: x.iter().zip(y.iter()).map(|(x, y)| Point2::new(*x, *y)).collect(),
        },
    };
    RobotModel { footprint, v_max, a_max, omega_max, alpha_max, v_reverse }
}

/// A robot model.
pub fn robot_model_to_wire(m: &RobotModel) -> wire::RobotModel {
    let RobotModel { ref footprint, v_max, a_max, omega_max, alpha_max, v_reverse } = *m;
    let footprint = match footprint {
        Footprint::Disc { radius } => wire::Footprint::Disc { radius: *radius },
        Footprint::Polygon { vertices } => wire::Footprint::Polygon {
            x: vertices.iter().map(|v| v.x).collect(),
            y: vertices.iter().map(|v| v.y).collect(),
        },
    };
    wire::RobotModel { footprint, v_max, a_max, omega_max, alpha_max, v_reverse }
}

/// A laser model.
pub fn laser(l: &wire::LaserModel) -> LaserModel {
    let wire::LaserModel { robot_from_laser, fov, beams, range_max, range_sigma } = *l;
    LaserModel { robot_from_laser: pose(robot_from_laser), fov, beams, range_max, range_sigma }
}

/// A laser model.
pub fn laser_to_wire(l: &LaserModel) -> wire::LaserModel {
    let LaserModel { robot_from_laser, fov, beams, range_max, range_sigma } = *l;
    let robot_from_laser = pose_to_wire(robot_from_laser);
    wire::LaserModel { robot_from_laser, fov, beams, range_max, range_sigma }
}

/// Odometry noise.
pub fn noise(n: &wire::OdometryNoise) -> OdometryNoise {
    let wire::OdometryNoise {
        position_per_metre,
        position_per_radian,
        heading_per_metre,
        heading_per_radian,
    } = *n;
    OdometryNoise { position_per_metre, position_per_radian, heading_per_metre, heading_per_radian }
}

/// Odometry noise.
pub fn noise_to_wire(n: &OdometryNoise) -> wire::OdometryNoise {
    let OdometryNoise { position_per_metre, position_per_radian, heading_per_metre, heading_per_radian } = *n;
    wire::OdometryNoise { position_per_metre, position_per_radian, heading_per_metre, heading_per_radian }
}

/// A map.
pub fn occupancy_grid(g: wire::OccupancyGrid) -> Result<OccupancyGrid, Reject> {
    let limits = g.limits.map_or_else(Vec::new, |limits| limits.0);
    OccupancyGrid::new(g.width as usize, g.height as usize, g.resolution, pose(g.origin), g.cells.0)
        .map_err(|e| Refusal::invalid(e).at("cells"))?
        .with_limits(limits)
        .map_err(|e| Refusal::invalid(e).at("limits"))
}

/// A map.
pub fn occupancy_grid_to_wire(g: &OccupancyGrid) -> wire::OccupancyGrid {
    wire::OccupancyGrid {
        width: g.width() as u32,
        height: g.height() as u32,
        resolution: g.resolution(),
        origin: pose_to_wire(g.origin()),
        cells: g.cells().into(),
        limits: (!g.limits().is_empty()).then(|| g.limits().into()),
        map: MapId(g.hash()),
    }
}

#[cfg(test)]
mod tests {
    use curionav_testing::golden;

    use super::*;

    #[test]
    fn maps_cross_the_wire_with_their_zones_and_names() {
        for sent in [golden::occupancy_grid(), golden::zoned_occupancy_grid()] {
            let grid = occupancy_grid(sent.clone()).unwrap();
            assert_eq!(MapId(grid.hash()), sent.map);
            assert_eq!(occupancy_grid_to_wire(&grid), sent);
        }
    }
}
