//! Zones of a map, from masks as Nav2's costmap filters take them: keepout, and limits of speed.

use crate::occupancy::{Cell, OccupancyGrid};

/// What the values of a speed mask mean: `base + multiplier * value` per cent of a robot's greatest speed, as in Nav2's
/// `CostmapFilterInfo` of type 1. A value of 0, and unknown, limits nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedScale {
    /// Per cent.
    pub base: f64,
    /// Per cent for each unit of a cell's value.
    pub multiplier: f64,
}

/// Why a mask makes no zones of a map.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MaskError {
    /// Not one cell of the map lies in it.
    #[error("lies beside the map; give it an `origin` and a `resolution` in the frame of the map")]
    Beside,
    /// It marks cells, but none of the map.
    #[error("marks no cell of the map; compare its `origin` and `resolution` with those of the map")]
    MarksElsewhere,
    /// A value that stands for no share of a speed.
    #[error(
        "has a cell of value {value}, which means {percent} % of the greatest speed and must be from 1 to 100 %; \
         change the image, its `mode` (`scale` or `raw`), the base or the multiplier"
    )]
    Percent {
        /// The cell's value, 1 to 100.
        value: i8,
        /// What it would mean.
        percent: f64,
    },
}

impl OccupancyGrid {
    /// The map with the occupied cells of `mask` as keepout zones.
    ///
    /// The mask is a map of its own, with any origin and resolution. A cell of the map belongs to a zone if its centre
    /// lies in a marked cell of the mask, or the centre of one lies in it.
    ///
    /// # Errors
    /// The mask marks nothing of this map, although it is meant to, or lies beside it.
    pub fn with_keepout(&self, mask: &Self) -> Result<Self, MaskError> {
        let limit = |index: usize| if mask.cell(index) == Cell::Occupied { 0 } else { Self::NO_LIMIT };
        self.overlaid(mask, &(0..mask.cells().len()).map(limit).collect::<Vec<_>>())
    }

    /// The map with the cells of `mask` as speed zones, placed as those of [`Self::with_keepout`]. Limits are whole per
    /// cents, rounded down; where zones overlap, the least counts.
    ///
    /// # Errors
    /// As for [`Self::with_keepout`], and for a value that is no share of a speed.
    pub fn with_speed_limits(&self, mask: &Self, scale: SpeedScale) -> Result<Self, MaskError> {
        let limits: Result<Vec<u8>, MaskError> =
            mask.cells().iter().map(|value| scale.limit(*value)).collect();
        self.overlaid(mask, &limits?)
    }

    /// The map without its zones.
    #[must_use]
    pub fn without_zones(&self) -> Self {
        // No limits fit every grid.
        self.with_limits(Vec::new()).unwrap_or_else(|_| self.clone())
    }

    /// The map with `marks`, the limits in the cells of `mask`, besides those that it has.
    fn overlaid(&self, mask: &Self, marks: &[u8]) -> Result<Self, MaskError> {
        let mut limits: Vec<u8> = (0..self.cells().len()).map(|index| self.limit(index)).collect();
        let mut is_beside = true;
        let mut marked = 0;
        for (index, limit) in limits.iter_mut().enumerate() {
            if let Some((column, row)) = mask.locate(self.centre(index % self.width(), index / self.width()))
            {
                is_beside = false;
                let mark = marks[mask.index(column, row)];
                marked += usize::from(mark < Self::NO_LIMIT);
                *limit = mark.min(*limit);
            }
        }
        // A line of a fine mask may pass between the centres of a coarse map.
        for (index, mark) in marks.iter().enumerate().filter(|(_, mark)| **mark < Self::NO_LIMIT) {
            if let Some((column, row)) = self.locate(mask.centre(index % mask.width(), index / mask.width()))
            {
                is_beside = false;
                marked += 1;
                let limit = &mut limits[self.index(column, row)];
                *limit = (*mark).min(*limit);
            }
        }
        if is_beside {
            return Err(MaskError::Beside);
        }
        if marked == 0 && marks.iter().any(|mark| *mark < Self::NO_LIMIT) {
            return Err(MaskError::MarksElsewhere);
        }
        // There is one limit for each cell, and none is above 100.
        Ok(self.with_limits(limits).unwrap_or_else(|_| self.clone()))
    }
}

impl Default for SpeedScale {
    /// That of Nav2's example: a cell of value 30 takes 30 % away.
    fn default() -> Self {
        Self { base: 100.0, multiplier: -1.0 }
    }
}

impl SpeedScale {
    /// What a cell of this value allows, per cent.
    fn limit(self, value: i8) -> Result<u8, MaskError> {
        if value <= 0 {
            return Ok(OccupancyGrid::NO_LIMIT);
        }
        let percent = self.base + self.multiplier * f64::from(value);
        // A product of decimal numbers may fall short of the whole number that is meant.
        let whole = (percent + 1e-9).floor();
        if (1.0..=100.0).contains(&whole) {
            Ok(whole as u8)
        } else {
            Err(MaskError::Percent { value, percent })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point2, Pose2};
    use crate::occupancy::StaticMap;

    fn grid(width: usize, height: usize, resolution: f64, origin: Pose2, cells: Vec<i8>) -> OccupancyGrid {
        OccupancyGrid::new(width, height, resolution, origin, cells).unwrap()
    }

    /// 4 m by 2 m of free floor in cells of 0.1 m, its corner at (1, -1).
    fn floor() -> OccupancyGrid {
        grid(40, 20, 0.1, Pose2::new(1.0, -1.0, 0.0), vec![0; 800])
    }

    fn marked(map: &OccupancyGrid) -> usize {
        map.limits().iter().filter(|limit| **limit < 100).count()
    }

    #[test]
    fn a_keepout_zone_is_an_obstacle_that_beams_pass() {
        let map = StaticMap::new(floor());
        // The same floor, on which a block from x = 3 to 3.5 m is marked.
        let cells = (0..800).map(|i| if (20..25).contains(&(i % 40)) { 100 } else { 0 }).collect();
        let mask = grid(40, 20, 0.1, Pose2::new(1.0, -1.0, 0.0), cells);
        let kept = StaticMap::new(map.grid.with_keepout(&mask).unwrap());
        assert_eq!(marked(&kept.grid), 100);
        assert_eq!((kept.grid.cells(), &kept.to_occupied), (map.grid.cells(), &map.to_occupied));
        let before = Point2::new(2.05, 0.05);
        let inside = Point2::new(3.25, 0.05);
        assert!((kept.to_obstacle.at(&kept.grid, before) - 1.0).abs() < 1e-6);
        assert_eq!(kept.to_obstacle.at(&kept.grid, inside), 0.0);
        assert!(kept.grid.is_drivable_at(before) && !kept.grid.is_drivable_at(inside));
        assert_eq!(kept.grid.at(inside), Cell::Free);
        assert_ne!(kept.grid.hash(), map.grid.hash());
        assert_eq!(kept.grid.without_zones(), *map.grid);
    }

    #[test]
    fn masks_of_other_frames_mark_what_they_cover() {
        let map = floor();
        // A quarter turn: its columns run along y. Its only cell covers x from 2 to 3 m and y from -0.5 to 0.5 m.
        let turned = grid(1, 1, 1.0, Pose2::new(3.0, -0.5, std::f64::consts::FRAC_PI_2), vec![100]);
        let zone = map.with_keepout(&turned).unwrap();
        assert_eq!(marked(&zone), 100);
        assert!(
            !zone.is_drivable_at(Point2::new(2.05, -0.45)) && !zone.is_drivable_at(Point2::new(2.95, 0.45))
        );
        assert!(zone.is_drivable_at(Point2::new(1.95, 0.0)) && zone.is_drivable_at(Point2::new(2.5, 0.55)));
        // A line of 1 cm that passes between the centres of the map's cells.
        let line = (0..400 * 200).map(|i| if i % 400 == 202 { 100 } else { 0 }).collect();
        let fine = map.with_keepout(&grid(400, 200, 0.01, Pose2::new(1.0, -1.0, 0.0), line)).unwrap();
        assert_eq!(marked(&fine), 20);
        assert!(!fine.is_drivable_at(Point2::new(3.05, 0.0)));
    }

    #[test]
    fn values_of_a_speed_mask_are_shares_as_in_nav2_and_the_least_counts() {
        let map = floor();
        let mask = |values: [i8; 4]| grid(4, 1, 1.0, Pose2::new(1.0, -1.0, 0.0), values.to_vec());
        let limits = |map: &OccupancyGrid| [0, 10, 20, 30].map(|index| map.limit(index));
        let slow = map.with_speed_limits(&mask([30, 0, -1, 70]), SpeedScale::default()).unwrap();
        assert_eq!(limits(&slow), [70, 100, 100, 30]);
        let rising = SpeedScale { base: 0.0, multiplier: 0.7 };
        let slower = slow.with_speed_limits(&mask([30, 30, 0, 100]), rising).unwrap();
        assert_eq!(limits(&slower), [21, 21, 100, 30]);
        // What is kept out stays so.
        let kept = slower.with_keepout(&mask([0, 100, 0, 0])).unwrap();
        assert_eq!(limits(&kept), [21, 0, 100, 30]);
        let error = map.with_speed_limits(&mask([0, 100, 0, 0]), SpeedScale::default()).unwrap_err();
        assert_eq!(error, MaskError::Percent { value: 100, percent: 0.0 });
    }

    #[test]
    fn masks_that_mark_nothing_of_the_map_are_refused_and_empty_ones_change_nothing() {
        let map = floor();
        let beside = grid(10, 10, 0.1, Pose2::new(9.0, 9.0, 0.0), vec![100; 100]);
        assert_eq!(map.with_keepout(&beside), Err(MaskError::Beside));
        // It overlaps the map by its left half, and is marked in its right half.
        let cells = (0..20).map(|i| if i % 4 > 1 { 100 } else { 0 }).collect();
        let elsewhere = grid(4, 5, 0.2, Pose2::new(4.6, 0.0, 0.0), cells);
        assert_eq!(map.with_keepout(&elsewhere), Err(MaskError::MarksElsewhere));
        let empty = map.with_keepout(&floor()).unwrap();
        assert_eq!((empty.hash(), empty.limits().len()), (map.hash(), 0));
    }

    #[test]
    fn limits_that_do_not_fit_the_cells_are_refused() {
        assert!(floor().with_limits(vec![50; 799]).is_err());
        assert_eq!(floor().with_limits(vec![101; 800]), Err(crate::occupancy::GridError::Limit(101)));
        assert_ne!(floor().with_limits(vec![50; 800]).unwrap().hash(), floor().hash());
    }
}
