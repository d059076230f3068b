//! A costmap of Nav2 as one more sensor: the nearest occupied cell in each direction.
//!
//! Nav2 sends all of a costmap when it begins and whenever it has moved, and between only the rectangle that has changed,
//! on a topic of its own. So a robot that stands hears of changes alone.

use std::ops::Range;

use curionav_ros2::messages as ros;
use curionav_schemas::Scan;
use nalgebra::{Isometry3, Point3};

use crate::fault::{Fault, FaultKind};
use crate::frames::isometry;
use crate::sensor_config::SensorConfig;
use crate::surroundings::Surroundings;

/// What Nav2 publishes of a cell in which something stands. Cells that are only near to one have less.
const OCCUPIED: i8 = 100;

/// The newest costmap, with what has changed since it came.
#[derive(Default)]
pub(crate) struct Costmap(Option<ros::OccupancyGrid>);

impl Costmap {
    /// Takes a new one.
    pub(crate) fn replace(&mut self, whole: ros::OccupancyGrid) -> ros::OccupancyGrid {
        self.0.insert(whole).clone()
    }

    /// Takes what has changed; nothing of it is kept if it does not fit.
    ///
    /// # Errors
    /// If no costmap has come yet, or the rectangle lies beyond it, is in another frame, or contradicts itself.
    pub(crate) fn update(&mut self, update: ros::OccupancyGridUpdate) -> Result<ros::OccupancyGrid, Fault> {
        let missing = || Fault::new(FaultKind::NotYet, "it changes a costmap that has not come");
        let kept = self.0.as_mut().ok_or_else(missing)?;
        if update.header.frame_id != kept.header.frame_id {
            return Err(Fault::malformed(format!(
                "it is in the frame `{}`, the costmap in `{}`",
                update.header.frame_id, kept.header.frame_id
            )));
        }
        let columns = within(update.x, update.width, kept.info.width);
        let rows = within(update.y, update.height, kept.info.height);
        let (Some(columns), Some(rows)) = (columns, rows) else {
            return Err(Fault::malformed("its rectangle lies beyond the costmap"));
        };
        if columns.len() * rows.len() != update.data.len() {
            return Err(Fault::malformed("its width and height are not those of its cells"));
        }
        if cells(&kept.info) != Some(kept.data.len()) {
            return Err(Fault::malformed("the costmap that it changes contradicts itself"));
        }
        let width = kept.info.width as usize;
        for (row, changed) in rows.zip(update.data.chunks_exact(columns.len())) {
            let start = row * width + columns.start;
            kept.data[start..start + columns.len()].copy_from_slice(changed);
        }
        kept.header.stamp = update.header.stamp;
        Ok(kept.clone())
    }
}

/// Where `count` cells from `from` on are among `all`.
fn within(from: i32, count: u32, all: u32) -> Option<Range<usize>> {
    let from = u32::try_from(from).ok()?;
    let to = from.checked_add(count)?;
    (count > 0 && to <= all).then_some(from as usize..to as usize)
}

/// How many cells a map has; none if there are none.
fn cells(info: &ros::MapMetaData) -> Option<usize> {
    (info.width as usize).checked_mul(info.height as usize).filter(|cells| *cells > 0)
}

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
    if cells(&said.info) != Some(said.data.len()) {
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
        let empty = ros::OccupancyGrid { info: ros::MapMetaData::default(), data: vec![], ..costmap() };
        assert!(scan(&empty, &above, &config(), 0.3).is_err());
        let mut flat = costmap();
        flat.info.resolution = 0.0;
        assert!(scan(&flat, &above, &config(), 0.3).is_err());
    }

    /// The same frame as the costmap: a box of 2 by 3 cells at column 10 and row 20, with one occupied cell.
    fn change() -> ros::OccupancyGridUpdate {
        let header = ros::Header { stamp: ros::Time { sec: 7, nanosec: 0 }, ..Default::default() };
        ros::OccupancyGridUpdate { header, x: 10, y: 20, width: 2, height: 3, data: vec![0, 0, 0, 100, 0, 0] }
    }

    #[test]
    fn a_change_alters_its_rectangle_alone_and_makes_the_costmap_newer() {
        let mut kept = Costmap::default();
        assert_eq!(kept.update(change()).unwrap_err().kind, FaultKind::NotYet);
        kept.replace(costmap());
        let changed = kept.update(change()).unwrap();
        let mut expected = costmap().data;
        expected[21 * 30 + 11] = 100;
        assert_eq!(changed.data, expected);
        assert_eq!(changed.header.stamp.sec, 7);
        let cleared = ros::OccupancyGridUpdate { data: vec![0; 6], ..change() };
        assert_eq!(kept.update(cleared).unwrap().data, costmap().data);
    }

    #[test]
    fn a_change_that_does_not_fit_alters_nothing() {
        let mut kept = Costmap::default();
        kept.replace(costmap());
        let elsewhere = ros::Header { frame_id: "map".to_owned(), ..Default::default() };
        let beyond = [
            ros::OccupancyGridUpdate { x: -1, ..change() },
            ros::OccupancyGridUpdate { x: 29, ..change() },
            ros::OccupancyGridUpdate { y: i32::MAX, height: u32::MAX, ..change() },
            ros::OccupancyGridUpdate { height: 4, ..change() },
            ros::OccupancyGridUpdate { width: 0, height: 0, data: vec![], ..change() },
            ros::OccupancyGridUpdate { header: elsewhere, ..change() },
        ];
        for change in beyond {
            assert_eq!(kept.update(change.clone()).unwrap_err().kind, FaultKind::Malformed, "{change:?}");
        }
        let nothing = ros::OccupancyGridUpdate { width: 1, height: 1, data: vec![0], ..change() };
        assert_eq!(kept.update(nothing).unwrap().data, costmap().data);
        kept.replace(ros::OccupancyGrid { data: vec![0; 10], ..costmap() });
        assert!(kept.update(change()).is_err(), "cells are missing");
    }
}
