//! Where on the map one scan fits: correlative scan matching (Olson, "Real-time correlative scan matching", 2009) by
//! branch and bound over a pyramid of the likelihood field (Hess and others, "Real-time loop closure in 2D LIDAR SLAM",
//! 2016).
//!
//! A search takes many steps and may be spread over many calls. It finds the best poses in the order of their scores,
//! each apart from those before it.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use curionav_planning::geometry::{Direction, Point2, Pose2, wrap_angle};
use curionav_planning::occupancy::{Cell, OccupancyGrid};

use crate::likelihood_field::LikelihoodField;

/// Headings of a turn that are tried: two degrees apart.
const HEADINGS: usize = 180;
/// Between neighbouring headings, radians.
const TURN: f64 = std::f64::consts::TAU / HEADINGS as f64;
/// A pose is found to this fraction of the map at best, metres; finer maps are searched in blocks of cells.
const FINEST_M: f64 = 0.1;
/// The coarsest level has at most so many blocks.
const BLOCKS_MAX: usize = 2_000;
/// Poses nearer to each other than this are one, metres and radians.
const APART_M: f64 = 0.5;
/// See [`APART_M`].
const APART_RAD: f64 = 0.2;

/// Upper bounds of the likelihood field: at level `l`, the best score in a square of `2^l` cells.
pub(crate) struct Pyramid {
    width: i32,
    height: i32,
    /// From single cells upwards.
    levels: Vec<Vec<u8>>,
    /// How many cells left of and below each corner of the grid's cells are free.
    free: Vec<u32>,
    /// The first level that is searched to the end.
    finest: usize,
}

/// A place to search.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Region {
    Everywhere,
    /// Around a pose, as far as so many metres and radians.
    Around {
        pose: Pose2,
        metres: f64,
        radians: f64,
    },
}

/// When a search ends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// With so many poses.
    pub(crate) wanted: usize,
    /// Where all others fit less well than the best by this share of all that a scan can tell.
    pub(crate) behind: f64,
    /// After so many steps.
    pub(crate) steps: usize,
}

/// A block of poses: a square of `2^level` cells, and one heading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Node {
    /// No pose in it has a greater score.
    bound: u32,
    /// A finer one goes first.
    level: Reverse<u8>,
    heading: u16,
    row: i32,
    column: i32,
}

/// A search under way.
pub(crate) struct PoseSearch {
    region: Region,
    /// The heading whose coarsest blocks are offered next.
    next_heading: usize,
    /// Ends of the beams from the robot, in cells, for every heading.
    ends: Vec<Vec<(i32, i32)>>,
    queue: BinaryHeap<Node>,
    found: Vec<Pose2>,
    wanted: usize,
    /// Poses with a score that is less than the best by more than this are not looked for.
    behind: u32,
    /// The least bound that is of interest, known once the best is found.
    least: u32,
    /// Steps that are left.
    steps: usize,
}

impl Pyramid {
    pub(crate) fn new(field: &LikelihoodField, grid: &OccupancyGrid) -> Self {
        let width = grid.width();
        let height = grid.height();
        let mut levels = vec![field.quantised()];
        while (width >> (levels.len() - 1)) * (height >> (levels.len() - 1)) > BLOCKS_MAX {
            let side = 1 << (levels.len() - 1);
            levels.push(doubled(&levels[levels.len() - 1], width, height, side));
        }
        let mut free = vec![0; (width + 1) * (height + 1)];
        for row in 0..height {
            let mut along = 0;
            for column in 0..width {
                along += u32::from(grid.cell(grid.index(column, row)) == Cell::Free);
                let above = (row + 1) * (width + 1) + column + 1;
                free[above] = free[above - width - 1] + along;
            }
        }
        let mut finest = 0;
        while finest + 1 < levels.len() && grid.resolution() * f64::from(2 << finest) <= FINEST_M + 1e-9 {
            finest += 1;
        }
        Self { width: width as i32, height: height as i32, levels, free, finest }
    }

    /// The score of a block, an upper bound of those of its poses. None if the robot cannot be there.
    fn bound(&self, ends: &[(i32, i32)], level: usize, (column, row): (i32, i32)) -> Option<u32> {
        let side = 1 << level;
        if !self.has_free(column, row, side) {
            return None;
        }
        let scores = &self.levels[level];
        Some(ends.iter().map(|(dx, dy)| self.best_in(scores, column + dx, row + dy, side)).sum())
    }

    /// The best score in the square whose lower left cell is this one.
    #[inline]
    fn best_in(&self, scores: &[u8], x: i32, y: i32, side: i32) -> u32 {
        // A square that reaches over the edge holds no more than the one at the edge.
        let is_on_map = x > -side && y > -side && x < self.width && y < self.height;
        if is_on_map { u32::from(scores[(y.max(0) * self.width + x.max(0)) as usize]) } else { 0 }
    }

    fn has_free(&self, column: i32, row: i32, side: i32) -> bool {
        let left = column.clamp(0, self.width);
        let bottom = row.clamp(0, self.height);
        let right = (column + side).clamp(0, self.width);
        let top = (row + side).clamp(0, self.height);
        let above = self.free_until(right, top) - self.free_until(left, top);
        above > self.free_until(right, bottom) - self.free_until(left, bottom)
    }

    fn free_until(&self, column: i32, row: i32) -> u32 {
        self.free[(row * (self.width + 1) + column) as usize]
    }
}

/// The level above one whose squares are `side` cells wide.
fn doubled(below: &[u8], width: usize, height: usize, side: usize) -> Vec<u8> {
    let mut along = below.to_vec();
    for row in 0..height {
        for column in 0..width.saturating_sub(side) {
            let here = row * width + column;
            along[here] = below[here].max(below[here + side]);
        }
    }
    let mut both = along.clone();
    for row in 0..height.saturating_sub(side) {
        for column in 0..width {
            let here = row * width + column;
            both[here] = along[here].max(along[here + side * width]);
        }
    }
    both
}

impl PoseSearch {
    /// Of the poses in `region` from which `ends` fit best, robot frame, `wanted`, with at most so many `steps`.
    pub(crate) fn new(ends: &[Point2], resolution: f64, region: Region, limits: Limits) -> Self {
        let Limits { wanted, behind, steps } = limits;
        // A beam tells at most 255.
        let behind = (behind * 255.0 * ends.len() as f64) as u32;
        let ends = (0..HEADINGS).map(|heading| cells_of(ends, TURN * heading as f64, resolution)).collect();
        let queue = BinaryHeap::new();
        Self { region, next_heading: 0, ends, queue, found: Vec::new(), wanted, behind, least: 0, steps }
    }

    /// Offers the coarsest blocks of one heading; how many those are.
    fn open(&mut self, pyramid: &Pyramid, grid: &OccupancyGrid) -> usize {
        let heading = self.next_heading;
        self.next_heading += 1;
        if !faces(grid, self.region, TURN * heading as f64) {
            return 0;
        }
        let level = pyramid.levels.len() - 1;
        let side = 1 << level;
        let (columns, rows) = blocks(pyramid, grid, self.region, side);
        let count = rows.clone().count() * columns.clone().count();
        for row in rows {
            for column in columns.clone() {
                self.offer(pyramid, heading, level, (column * side, row * side));
            }
        }
        count
    }

    fn offer(&mut self, pyramid: &Pyramid, heading: usize, level: usize, (column, row): (i32, i32)) {
        let Some(bound) = pyramid.bound(&self.ends[heading], level, (column, row)) else { return };
        if bound < self.least {
            return;
        }
        self.queue.push(Node { bound, level: Reverse(level as u8), heading: heading as u16, row, column });
    }

    /// Goes on for about so many steps. Whether it has ended.
    pub(crate) fn advance(&mut self, pyramid: &Pyramid, grid: &OccupancyGrid, steps: usize) -> bool {
        let mut left = steps.min(self.steps);
        self.steps -= left;
        while left > 0 && self.next_heading < HEADINGS {
            left = left.saturating_sub(self.open(pyramid, grid));
        }
        while left > 0 && self.found.len() < self.wanted {
            let Some(node) = self.queue.pop().filter(|node| node.bound >= self.least) else { return true };
            left = left.saturating_sub(self.split(pyramid, grid, node));
        }
        self.steps == 0 || self.found.len() >= self.wanted
    }

    /// Looks into the best block; how many others that has offered.
    fn split(&mut self, pyramid: &Pyramid, grid: &OccupancyGrid, node: Node) -> usize {
        let level = usize::from(node.level.0);
        let heading = usize::from(node.heading);
        let half = 0.5 * f64::from(1 << level);
        let centre = grid.map_from_grid(f64::from(node.column) + half, f64::from(node.row) + half);
        let facing = wrap_angle(grid.origin().heading + TURN * f64::from(node.heading));
        let pose = Pose2::new(centre.x, centre.y, facing);
        let reach = std::f64::consts::SQRT_2 * half * grid.resolution();
        if self.found.iter().any(|found| is_within(*found, pose, reach)) {
            return 1;
        }
        if level <= pyramid.finest {
            self.least = self.least.max(node.bound.saturating_sub(self.behind));
            self.found.push(pose);
            return 1;
        }
        let side = 1 << (level - 1);
        for (dx, dy) in [(0, 0), (side, 0), (0, side), (side, side)] {
            self.offer(pyramid, heading, level - 1, (node.column + dx, node.row + dy));
        }
        4
    }

    /// The poses found so far, the best first.
    pub(crate) fn found(self) -> Vec<Pose2> {
        self.found
    }
}

/// Whether all of a block around `pose` that reaches so far is near a pose that was found. At the finest level blocks
/// are small, so nearly all that are not apart are.
fn is_within(found: Pose2, pose: Pose2, reach: f64) -> bool {
    found.position().distance(pose.position()) + reach <= APART_M
        && wrap_angle(found.heading - pose.heading).abs() <= APART_RAD
}

/// Where points of the robot's frame are in cells from the robot, for a robot that faces this way on the grid.
fn cells_of(ends: &[Point2], heading: f64, resolution: f64) -> Vec<(i32, i32)> {
    let facing = Direction::of(heading);
    ends.iter().map(|end| cell_of(*end, facing, resolution)).collect()
}

fn cell_of(end: Point2, facing: Direction, resolution: f64) -> (i32, i32) {
    let Direction { cos, sin } = facing;
    let x = (cos * end.x - sin * end.y) / resolution;
    let y = (sin * end.x + cos * end.y) / resolution;
    (x.round() as i32, y.round() as i32)
}

/// The columns and rows of blocks in a region.
fn blocks(
    pyramid: &Pyramid,
    grid: &OccupancyGrid,
    region: Region,
    side: i32,
) -> (std::ops::RangeInclusive<i32>, std::ops::RangeInclusive<i32>) {
    let last = ((pyramid.width - 1) / side, (pyramid.height - 1) / side);
    let Region::Around { pose, metres, .. } = region else { return (0..=last.0, 0..=last.1) };
    let (column, row) = grid.grid_from_map(pose.position());
    let reach = metres / grid.resolution();
    (
        block_of(column - reach, side, last.0)..=block_of(column + reach, side, last.0),
        block_of(row - reach, side, last.1)..=block_of(row + reach, side, last.1),
    )
}

fn block_of(cells: f64, side: i32, last: i32) -> i32 {
    ((cells / f64::from(side)).floor() as i32).clamp(0, last)
}

/// Whether a robot that faces this way on the grid is in the region.
fn faces(grid: &OccupancyGrid, region: Region, heading: f64) -> bool {
    match region {
        Region::Everywhere => true,
        Region::Around { pose, radians, .. } => {
            wrap_angle(grid.origin().heading + heading - pose.heading).abs() <= radians
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::LocalizerParams;
    use crate::surfaces::Surfaces;
    use curionav_planning::occupancy::StaticMap;
    use curionav_planning::random::{rng, uniform};

    /// 8 m x 6 m in cells of 0.1 m, turned by 0.4 rad: walls all around and some blocks.
    fn map() -> StaticMap {
        let cell = |i: usize| {
            let column = i % 80;
            let row = i / 80;
            let is_rim = column == 0 || row == 0 || column == 79 || row == 59;
            let is_block = (20..24).contains(&column) && row > 30 || (50..60).contains(&column) && row == 20;
            if is_rim || is_block { 100 } else { 0 }
        };
        let cells = (0..80 * 60).map(cell).collect();
        StaticMap::new(OccupancyGrid::new(80, 60, 0.1, Pose2::new(3.0, -1.0, 0.4), cells).unwrap())
    }

    /// The robot at a cell with one of the headings, and where the beams that it sends in all directions end.
    fn seen(map: &StaticMap, column: usize, row: usize, heading: usize) -> (Pose2, Vec<Point2>) {
        let centre = map.grid.centre(column, row);
        let pose = Pose2::new(centre.x, centre.y, wrap_angle(0.4 + TURN * heading as f64));
        let end = |k: usize| {
            let Direction { cos, sin } = Direction::of(0.1 * k as f64);
            let on_way = |metres: &f64| {
                map.grid.at(pose.transform(Point2::new(metres * cos, metres * sin))) == Cell::Occupied
            };
            let metres = (0..1000).map(|step| 0.01 * f64::from(step)).find(on_way).unwrap();
            Point2::new(metres * cos, metres * sin)
        };
        (pose, (0..62).map(end).collect())
    }

    fn pyramid(map: &StaticMap) -> Pyramid {
        let field = LikelihoodField::new(&Surfaces::new(map), 10.0, &LocalizerParams::default());
        Pyramid::new(&field, &map.grid)
    }

    #[test]
    fn a_search_finds_the_pose_that_the_best_of_all_poses_is_near() {
        let map = map();
        let mut pyramid = pyramid(&map);
        // A small map has two levels only; with five the bounds have something to do.
        while pyramid.levels.len() < 5 {
            let side = 1 << (pyramid.levels.len() - 1);
            let next = doubled(&pyramid.levels[pyramid.levels.len() - 1], 80, 60, side);
            pyramid.levels.push(next);
        }
        let mut random = rng(5, 0);
        for _ in 0..5 {
            let column = 2 + (uniform(&mut random) * 16.0) as usize;
            let row = 2 + (uniform(&mut random) * 55.0) as usize;
            let heading = (uniform(&mut random) * 180.0) as usize;
            let (truth, ends) = seen(&map, column, row, heading);
            let limits = Limits { wanted: 1, behind: 0.1, steps: 10_000_000 };
            let mut search = PoseSearch::new(&ends, 0.1, Region::Everywhere, limits);
            // However the steps are portioned.
            while !search.advance(&pyramid, &map.grid, 137) {}
            let best = score(&pyramid, &search, best_of_all(&pyramid, &search));
            let found = search.found[0];
            let (column, row) = map.grid.locate(found.position()).unwrap();
            let turned = wrap_angle(found.heading - 0.4) / TURN;
            let place = (turned.round().rem_euclid(180.0) as usize, column as i32, row as i32);
            assert_eq!(score(&pyramid, &search, place), best);
            assert!(found.position().distance(truth.position()) < 0.3, "{found:?} {truth:?}");
            assert!(wrap_angle(found.heading - truth.heading).abs() < 0.08);
        }
    }

    fn score(pyramid: &Pyramid, search: &PoseSearch, place: (usize, i32, i32)) -> u32 {
        pyramid.bound(&search.ends[place.0], 0, (place.1, place.2)).unwrap_or(0)
    }

    fn best_of_all(pyramid: &Pyramid, search: &PoseSearch) -> (usize, i32, i32) {
        let places =
            (0..HEADINGS).flat_map(|h| (0..60).flat_map(move |row| (0..80).map(move |c| (h, c, row))));
        places.max_by_key(|place| score(pyramid, search, *place)).unwrap()
    }

    #[test]
    fn poses_found_are_apart_and_in_the_region() {
        let map = map();
        let pyramid = pyramid(&map);
        let (truth, ends) = seen(&map, 10, 40, 30);
        let region = Region::Around { pose: truth, metres: 1.0, radians: 0.5 };
        let limits = Limits { wanted: 20, behind: 1.0, steps: 10_000_000 };
        let mut search = PoseSearch::new(&ends, 0.1, region, limits);
        while !search.advance(&pyramid, &map.grid, 1000) {}
        let found = search.found();
        assert!(found.len() > 3, "{found:?}");
        for (k, pose) in found.iter().enumerate() {
            // Blocks that reach into the region count.
            assert!(pose.position().distance(truth.position()) < 2.0, "{pose:?}");
            let is_apart = |other: &Pose2| !is_within(*other, *pose, 0.08);
            assert!(found[..k].iter().all(is_apart), "{found:?}");
        }
        let nearest = found[0].position().distance(truth.position());
        assert!(nearest < 0.3, "{nearest}");
    }

    #[test]
    fn a_bound_is_no_less_than_any_score_below_it() {
        let map = map();
        let pyramid = pyramid(&map);
        let (_, ends) = seen(&map, 40, 30, 77);
        let search =
            PoseSearch::new(&ends, 0.1, Region::Everywhere, Limits { wanted: 1, behind: 0.1, steps: 1 });
        let level = pyramid.levels.len() - 1;
        let side = 1 << level;
        for heading in (0..HEADINGS).step_by(30) {
            for (column, row) in [(0, 0), (8 * side, 4 * side), (2 * side, 10 * side)] {
                let Some(bound) = pyramid.bound(&search.ends[heading], level, (column, row)) else {
                    continue;
                };
                for below in 0..side * side {
                    let place = (heading, column + below % side, row + below / side);
                    assert!(score(&pyramid, &search, place) <= bound);
                }
            }
        }
    }
}
