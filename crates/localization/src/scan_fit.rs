//! Whether a scan contradicts the estimate: the difference between a lost robot and a crowded one.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::StaticMap;

/// What the beams of one scan say about a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct ScanFit {
    /// Beams that end near a mapped obstacle with nothing in between.
    pub(crate) agree: usize,
    /// Beams that would have had to pass through a mapped obstacle. No person can cause them. A beam that ends in the
    /// open counts as neither: a person may stand there, or the pose is wrong.
    pub(crate) through: usize,
}

impl ScanFit {
    /// Sorts beams from `laser` (its pose seen from the robot) to `ends` (robot frame) at `pose`.
    /// `tolerance` metres before its end a beam may touch obstacles, and within them it agrees.
    pub(crate) fn of(map: &StaticMap, pose: Pose2, laser: Pose2, ends: &[Point2], tolerance: f64) -> Self {
        let mut fit = Self::default();
        let from = pose.transform(laser.position());
        for &end in ends {
            let to = pose.transform(end);
            if passes_through(map, from, to, tolerance) {
                fit.through += 1;
            } else if distance(map, to) <= tolerance {
                fit.agree += 1;
            }
        }
        fit
    }

    /// Of the beams that people cannot explain, the share that agrees; None when there are none.
    pub(crate) fn share(&self) -> Option<f64> {
        let telling = self.agree + self.through;
        (telling > 0).then(|| self.agree as f64 / telling as f64)
    }
}

fn distance(map: &StaticMap, p: Point2) -> f64 {
    map.grid.locate(p).map_or(f64::INFINITY, |(c, r)| map.to_occupied.cell(map.grid.index(c, r)))
}

/// Whether the way from `from` to `tolerance` before `to` crosses an occupied cell: steps as long as
/// the distance field says nothing can be met.
fn passes_through(map: &StaticMap, from: Point2, to: Point2, tolerance: f64) -> bool {
    let length = from.distance(to);
    let cell = map.grid.resolution();
    let mut travelled = 0.0;
    while travelled < length - tolerance {
        let d = distance(map, from.toward(to, travelled / length));
        if d < 0.5 * cell {
            return true;
        }
        travelled += (d - cell).max(0.5 * cell);
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_planning::occupancy::OccupancyGrid;

    #[test]
    fn people_shorten_beams_and_only_a_wrong_pose_lengthens_them() {
        // 6 m x 6 m, a wall at x = 4.0..4.1
        let cells = (0..60 * 60).map(|i| if i % 60 == 40 { 100 } else { 0 }).collect();
        let map = StaticMap::new(OccupancyGrid::new(60, 60, 0.1, Pose2::default(), cells).unwrap());
        let pose = Pose2::new(2.0, 3.0, 0.0);
        let fit = |range: f64| ScanFit::of(&map, pose, Pose2::default(), &[Point2::new(range, 0.0)], 0.3);
        assert_eq!(fit(2.0), ScanFit { agree: 1, through: 0 });
        assert_eq!(fit(1.0), ScanFit { agree: 0, through: 0 });
        assert_eq!(fit(3.0), ScanFit { agree: 0, through: 1 });
        assert_eq!(fit(1.0).share(), None);
        // off the map behind the wall
        assert_eq!(fit(9.0).through, 1);
    }
}
