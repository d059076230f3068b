//! What stands around a robot and is on no map: evidence by cell, in the frame of the odometry.
//!
//! A beam whose end neither the map nor a person explains is evidence for something at its end. A beam that goes
//! through a cell is evidence against anything there. So what stands is known after a few scans, what has gone is
//! forgotten after as many, and what is out of view is remembered. Only cells with evidence are kept, so that a scan
//! costs what is seen of things and no more (after the sensor model of Elfes, 1989, with counts in place of log-odds).

use std::collections::BTreeMap;

use curionav_planning::beam::Beam;
use curionav_planning::geometry::{Direction, Facing, Point2, wrap_angle};
use curionav_planning::numerics::atan2;

/// Side of a cell, metres.
const CELL: f64 = 0.05;

/// Cells with evidence that are kept, those that were seen last: 200 m of outlines. A message holds as many.
const CELLS_MAX: usize = 4096;

curionav_planning::parameters! {
    /// What counts as an obstacle.
    #[derive(Copy)]
    pub struct ObstacleParams {
        /// A cell becomes an obstacle with so many scans that show something there, less those that show nothing.
        pub needed: u32 [1.0, 100.0, "scans", "it is known after that"] = 4,
        /// Most scans that count: it stays an obstacle until as many show nothing.
        pub most: u32 [1.0, 1000.0, "scans", "it takes as many to forget it"] = 12,
        /// What is seen farther away along either axis is no evidence, metres.
        pub reach: f64 [1.0, 50.0, "m", "a planner looks no farther"] = 6.0,
        /// What has not been seen for so long is forgotten, seconds. A way that was closed is then tried again.
        pub memory: f64 [1.0, 3600.0, "s", "after an hour anything may have been moved"] = 60.0,
        /// A beam that ends so much behind a cell has gone through it, metres: the noise of ranges.
        pub behind: f64 [0.01, 1.0, "m", "more noise no laser has"] = 0.15,
    }
}

/// One scan, as it bears on obstacles.
#[derive(Debug, Clone, Copy)]
pub struct Look<'a> {
    /// Robot's clock, seconds.
    pub stamp: f64,
    /// The laser in the odometry's frame.
    pub laser: Facing,
    /// Bearing of the first beam, radians.
    pub angle_min: f64,
    /// From one beam to the next, radians; not 0.
    pub increment: f64,
    /// What each beam says.
    pub beams: &'a [Beam],
    /// Whether the map or a person explains the end of each.
    pub explained: &'a [bool],
}

#[derive(Debug, Clone, Copy)]
struct Evidence {
    /// Scans that show something here, less those that show nothing.
    scans: u32,
    /// When something was seen here last.
    seen: f64,
    /// Whether this is an obstacle. Once it is, it stays one until no scan is left that shows something.
    is_obstacle: bool,
}

impl Evidence {
    const NONE: Self = Self { scans: 0, seen: f64::NEG_INFINITY, is_obstacle: false };
}

/// All that is known of obstacles.
#[derive(Debug, Clone)]
pub struct Obstacles {
    params: ObstacleParams,
    /// By column and row.
    cells: BTreeMap<(i32, i32), Evidence>,
}

impl Obstacles {
    /// Knows of none yet.
    pub fn new(params: ObstacleParams) -> Self {
        Self { params, cells: BTreeMap::new() }
    }

    /// Forgets all, as after a restart of the base.
    pub fn restart(&mut self) {
        self.cells.clear();
    }

    /// Forgets what was seen last before `stamp`.
    pub fn forget_unseen(&mut self, stamp: f64) {
        self.cells.retain(|_, evidence| evidence.seen >= stamp);
    }

    /// Takes in a scan.
    pub fn see(&mut self, look: &Look<'_>) {
        self.forget(look);
        self.clear(look);
        self.mark(look);
    }

    /// Centres of the cells that are obstacles, odometry's frame, in a fixed order.
    pub fn occupied(&self) -> impl Iterator<Item = Point2> {
        self.cells.iter().filter(|(_, evidence)| evidence.is_obstacle).map(|(cell, _)| centre(*cell))
    }

    /// Forgets what was seen long ago, and more if there is more than can be kept.
    fn forget(&mut self, look: &Look<'_>) {
        let memory = self.params.memory;
        self.cells.retain(|_, evidence| look.stamp - evidence.seen <= memory);
        if self.cells.len() > CELLS_MAX {
            let mut seen: Vec<f64> = self.cells.values().map(|evidence| evidence.seen).collect();
            seen.sort_unstable_by(f64::total_cmp);
            let last = seen[seen.len() - CELLS_MAX];
            self.cells.retain(|_, evidence| evidence.seen > last);
        }
    }

    /// Takes evidence from the cells that beams have gone through.
    fn clear(&mut self, look: &Look<'_>) {
        let behind = self.params.behind;
        self.cells.retain(|cell, evidence| {
            if look.goes_through(centre(*cell), behind) {
                evidence.scans -= 1;
            }
            evidence.scans > 0
        });
    }

    /// Adds evidence where beams end on something that nothing explains: once for each cell.
    fn mark(&mut self, look: &Look<'_>) {
        let ObstacleParams { needed, most, reach, .. } = self.params;
        let robot = look.laser.pose.position();
        for (beam, says) in look.beams.iter().enumerate() {
            let Beam::Obstacle(range) = *says else { continue };
            let end = look.end(beam, range);
            let is_near = (end.x - robot.x).abs() <= reach && (end.y - robot.y).abs() <= reach;
            if look.explained[beam] || !is_near {
                continue;
            }
            let evidence = self.cells.entry(cell_of(end)).or_insert(Evidence::NONE);
            if evidence.seen < look.stamp {
                evidence.scans = (evidence.scans + 1).min(most);
                evidence.seen = look.stamp;
                evidence.is_obstacle |= evidence.scans >= needed;
            }
        }
    }
}

impl Look<'_> {
    fn end(&self, beam: usize, range: f64) -> Point2 {
        let direction =
            self.laser.direction.turned(Direction::of(self.angle_min + self.increment * beam as f64));
        let from = self.laser.pose.position();
        Point2::new(from.x + range * direction.cos, from.y + range * direction.sin)
    }

    /// Whether the beams on both sides of a point end behind it.
    fn goes_through(&self, p: Point2, behind: f64) -> bool {
        let (ahead, left) = self.laser.direction.ahead_and_left(self.laser.pose.position(), p);
        let range = (ahead * ahead + left * left).sqrt();
        let turn = wrap_angle(atan2(left, ahead) - self.angle_min);
        let turned = if self.increment * turn < 0.0 {
            turn + self.increment.signum() * std::f64::consts::TAU
        } else {
            turn
        };
        let place = turned / self.increment;
        let passes = |beam: f64| match self.beams.get(beam as usize) {
            Some(Beam::Obstacle(metres) | Beam::Free(metres)) => *metres > range + behind,
            Some(Beam::Silent) | None => false,
        };
        passes(place.floor()) && passes(place.ceil())
    }
}

fn cell_of(p: Point2) -> (i32, i32) {
    ((p.x / CELL).floor() as i32, (p.y / CELL).floor() as i32)
}

fn centre((column, row): (i32, i32)) -> Point2 {
    Point2::new((f64::from(column) + 0.5) * CELL, (f64::from(row) + 0.5) * CELL)
}

#[cfg(test)]
#[path = "obstacles_tests.rs"]
mod tests;
