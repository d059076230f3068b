//! A costmap of Nav2 as one more sensor: the nearest occupied cell in each direction.

use curionav_ros2::messages as ros;
use curionav_schemas::Scan;
use nalgebra::{Isometry3, Point3};

use crate::fault::Fault;
use crate::frames::isometry;
use crate::sensor_config::SensorConfig;
use crate::surroundings::Surroundings;

/// What Nav2 publishes of a cell in which something stands. Cells that are only near to one have less.
const OCCUPIED: i8 = 100;

/// The nearest occupied cell in each direction from the robot, of those outside of its own disc of `radius` metres. Of
/// no other directions anything is known.
///
/// # Errors
/// If the costmap contradicts itself.
pub(crate) fn scan(
    said: &ros::OccupancyGrid,
    base_from_frame: &Isometry3<f64>,
    config: &SensorConfig,
    radius: f64,
) -> Result<Scan, Fault> {
    let width = said.info.width as usize;
    let resolution = f64::from(said.info.resolution);
    if width == 0 || width.checked_mul(said.info.height as usize) != Some(said.data.len()) {
        return Err(Fault::malformed("its width and height are not those of its cells"));
    }
    if !(resolution.is_finite() && resolution > 0.0) {
        return Err(Fault::malformed(format!("its resolution of {resolution} m is none")));
    }
    let ros::Point { x, y, z } = said.info.origin.position;
    let base_from_cells = base_from_frame * isometry([x, y, z], said.info.origin.orientation)?;
    let most = config.reach();
    let mut surroundings = Surroundings::unknown();
    for (index, _) in said.data.iter().enumerate().filter(|(_, cell)| **cell >= OCCUPIED) {
        let x = (index % width) as f64 + 0.5;
        let y = (index / width) as f64 + 0.5;
        let p = base_from_cells * Point3::new(x * resolution, y * resolution, 0.0);
        let metres = (p.x * p.x + p.y * p.y).sqrt();
        if metres >= radius && metres < most {
            surroundings.add(p.x, p.y);
        }
    }
    surroundings.scan(0.0, 0.0, most)
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Pose2;
    use nalgebra::Vector3;

    use super::*;
    use crate::drawing;

    fn config() -> SensorConfig {
        toml::from_str("name = \"costmap\"\nkind = \"costmap\"\ntopic = \"local_costmap/costmap\"").unwrap()
    }

    /// 3 m by 3 m at 0.1 m around the origin of odometry, with one occupied cell at (1.05, 0.05) and one that is near.
    fn costmap() -> ros::OccupancyGrid {
        let mut data = vec![0; 900];
        data[15 * 30 + 25] = 100;
        data[15 * 30 + 24] = 99;
        let info = ros::MapMetaData {
            resolution: 0.1,
            width: 30,
            height: 30,
            origin: drawing::pose(Pose2::new(-1.5, -1.5, 0.0)),
            ..Default::default()
        };
        ros::OccupancyGrid { info, data, ..Default::default() }
    }

    #[test]
    fn an_occupied_cell_is_seen_from_where_the_robot_is() {
        // The robot stands at (0, 1) in odometry, and looks along y: the cell is to its right and behind.
        let quarter = std::f64::consts::FRAC_PI_2;
        let odom_from_base = Isometry3::new(Vector3::new(0.0, 1.0, 0.0), Vector3::z() * quarter);
        let seen = scan(&costmap(), &odom_from_base.inverse(), &config(), 0.3).unwrap();
        let hits: Vec<(usize, f32)> =
            seen.ranges.iter().copied().enumerate().filter(|(_, range)| range.is_finite()).collect();
        let [(direction, range)] = hits[..] else { panic!("{hits:?}") };
        let angle = seen.angle_min + seen.angle_increment * direction as f64;
        assert!((f64::from(range) - 1.05_f64.hypot(0.95)).abs() < 0.01, "{range} m");
        let expected = (-1.05_f64).atan2(-0.95);
        assert!((angle - expected).abs() < 0.02, "{angle} rad and {expected} rad");
    }

    #[test]
    fn cells_under_the_robot_are_none_and_a_costmap_that_contradicts_itself_is_refused() {
        let above = Isometry3::translation(1.0, 0.0, 0.0).inverse();
        let seen = scan(&costmap(), &above, &config(), 0.3).unwrap();
        assert!(seen.ranges.iter().all(|range| !range.is_finite()));
        let short = ros::OccupancyGrid { data: vec![0; 10], ..costmap() };
        assert!(scan(&short, &above, &config(), 0.3).is_err());
        let mut flat = costmap();
        flat.info.resolution = 0.0;
        assert!(scan(&flat, &above, &config(), 0.3).is_err());
    }
}
