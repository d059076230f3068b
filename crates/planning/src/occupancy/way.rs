//! A way that is given: what leaving it costs.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;
use std::sync::Arc;

use crate::geometry::Point2;
use crate::occupancy::OccupancyGrid;

/// So near to the way the robot counts as on it, metres: less than robots go aside for a person.
const ON: f64 = 0.25;
/// From so far on leaving costs no more, metres.
const OFF: f64 = 1.25;
/// What a metre counts as there. With walls beside it a metre counts for at most fifteen times that, which is less than
/// one through obstacles counts for, so that the robot rather leaves the way than pushes through.
const OFF_FACTOR: f64 = 3.0;

/// A way from the robot to its goal, as a planner outside has found it.
///
/// A metre on it is a metre to go, and a metre off it counts as up to three. So distance is progress along the way, a
/// robot that is aside comes back to it, and it goes around what stands on it. Two parts of the way that are near to
/// each other are joined by a short cut if what lies between them is longer than three times that cut.
#[derive(Debug, Clone, PartialEq)]
pub struct Way {
    points: Vec<Point2>,
    id: u64,
}

/// Why points are no way.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum WayError {
    /// There are fewer than two of them.
    #[error("has {0} points; a way has at least 2")]
    TooShort(usize),
    /// One of them is not finite.
    #[error("has a point that is no place, number {0}")]
    NoPlace(usize),
    /// It is longer than [`Way::LENGTH_MAX`].
    #[error("is {0:.0} m long; the most is {most:.0} m", most = Way::LENGTH_MAX)]
    TooLong(f64),
}

impl Way {
    /// Greatest length, metres: ten times across the largest map.
    pub const LENGTH_MAX: f64 = 2000.0;

    /// Through these points, the last of which is the goal.
    ///
    /// # Errors
    /// If they are fewer than two, one is not finite, or they lie too far apart.
    pub fn new(points: Vec<Point2>) -> Result<Self, WayError> {
        if points.len() < 2 {
            return Err(WayError::TooShort(points.len()));
        }
        if let Some(at) = points.iter().position(|p| !p.x.is_finite() || !p.y.is_finite()) {
            return Err(WayError::NoPlace(at));
        }
        let metres = points.windows(2).map(|pair| pair[0].distance(pair[1])).sum::<f64>();
        if metres > Self::LENGTH_MAX {
            return Err(WayError::TooLong(metres));
        }
        let mut hasher = DefaultHasher::new();
        for point in &points {
            [point.x.to_bits(), point.y.to_bits()].hash(&mut hasher);
        }
        // Zero stands for no way at all.
        Ok(Self { points, id: hasher.finish().max(1) })
    }

    /// Its points.
    pub fn points(&self) -> &[Point2] {
        &self.points
    }

    /// A number that other ways do not have.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// What a metre in each cell of a grid counts as, `[row, column]`.
    pub(super) fn on(&self, grid: &OccupancyGrid) -> OffWay {
        let mut factors = vec![OFF_FACTOR as f32; grid.cells().len()];
        let reach = (OFF / grid.resolution()).ceil() as usize + 1;
        for pair in self.points.windows(2) {
            let pieces = (pair[0].distance(pair[1]) / PIECE).ceil().max(1.0);
            for k in 0..pieces as u32 {
                let from = between(pair[0], pair[1], f64::from(k) / pieces);
                let to = between(pair[0], pair[1], f64::from(k + 1) / pieces);
                mark(&mut factors, grid, (from, to), reach);
            }
        }
        OffWay { id: self.id, factors: factors.into() }
    }
}

/// What a metre counts as in each cell of one map, for a robot that is to keep to a way.
#[derive(Debug, Clone, PartialEq)]
pub struct OffWay {
    pub(super) id: u64,
    factors: Arc<[f32]>,
}

impl OffWay {
    /// In the cell of this index.
    pub(super) fn factor(&self, index: usize) -> f64 {
        f64::from(self.factors[index])
    }

    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.factors)
    }
}

/// A part of a way is marked in pieces of so many metres: the cells around a long one would be most of the map.
const PIECE: f64 = 1.0;

/// The point at this share of the way from one point to another.
fn between(from: Point2, to: Point2, share: f64) -> Point2 {
    Point2::new(from.x + share * (to.x - from.x), from.y + share * (to.y - from.y))
}

/// Lowers the factors of the cells beside one part of a way.
fn mark(factors: &mut [f32], grid: &OccupancyGrid, (from, to): (Point2, Point2), reach: usize) {
    let (c0, r0) = grid.grid_from_map(from);
    let (c1, r1) = grid.grid_from_map(to);
    for row in around(r0, r1, reach, grid.height()) {
        for column in around(c0, c1, reach, grid.width()) {
            let metres = to_segment(grid.centre(column, row), from, to);
            let share = ((metres - ON) / (OFF - ON)).clamp(0.0, 1.0);
            let factor = (1.0 + share * (OFF_FACTOR - 1.0)) as f32;
            let index = grid.index(column, row);
            factors[index] = factors[index].min(factor);
        }
    }
}

/// The rows or columns between two places, in cells, and `reach` more on both sides, of a grid that has `count`.
fn around(a: f64, b: f64, reach: usize, count: usize) -> Range<usize> {
    let first = (a.min(b).floor().max(0.0) as usize).saturating_sub(reach);
    let end = a.max(b).ceil().max(0.0) as usize + reach + 1;
    first..end.min(count)
}

/// Distance of a point to the part between two others, metres.
fn to_segment(p: Point2, from: Point2, to: Point2) -> f64 {
    let along = Point2::new(to.x - from.x, to.y - from.y);
    let squared = along.x * along.x + along.y * along.y;
    if squared <= 0.0 {
        return p.distance(from);
    }
    let share = ((p.x - from.x) * along.x + (p.y - from.y) * along.y) / squared;
    p.distance(between(from, to, share.clamp(0.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;
    use crate::occupancy::{CoarseFloor, GeodesicField, Obstacles, StaticMap};

    const START: Point2 = Point2 { x: 1.0, y: 5.0 };
    const GOAL: Point2 = Point2 { x: 11.0, y: 5.0 };

    /// A hall of 12 m by 10 m at 0.1 m.
    fn hall() -> StaticMap {
        StaticMap::new(OccupancyGrid::new(120, 100, 0.1, Pose2::default(), vec![0; 12_000]).unwrap())
    }

    /// A way that swings out to y = 7 m.
    fn bow() -> Way {
        let points = [(1.0, 5.0), (4.0, 7.0), (8.0, 7.0), (11.0, 5.0)];
        Way::new(points.map(|(x, y)| Point2::new(x, y)).into()).unwrap()
    }

    fn off(way: &Way, p: Point2) -> f64 {
        way.points.windows(2).map(|pair| to_segment(p, pair[0], pair[1])).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn the_shortest_way_is_the_one_that_is_given() {
        let map = hall();
        let straight = GeodesicField::new(&map, GOAL, 0.3).descend(START, 0.1);
        assert!(straight.iter().all(|p| (p.y - 5.0).abs() < 0.3));
        let way = bow();
        let field = GeodesicField::new(&map.along(&way), GOAL, 0.3);
        let driven = field.descend(START, 0.1);
        let farthest = driven.iter().map(|p| off(&way, *p)).fold(0.0, f64::max);
        assert!(farthest < 0.5, "{farthest} m off the way");
        // Progress along the way is what counts: its length, within the rounding of its corners.
        let length = 2.0 * 13_f64.sqrt() + 4.0;
        assert!((field.at(START) - length).abs() < 0.5, "{} m of {length} m", field.at(START));
    }

    #[test]
    fn leaving_the_way_costs_and_a_robot_aside_comes_back_to_it() {
        let map = hall().along(&bow());
        let field = GeodesicField::new(&map, GOAL, 0.3);
        let on = field.at(Point2::new(6.0, 7.0));
        let aside = field.at(Point2::new(6.0, 8.5));
        assert!(aside > on + 1.5, "{aside} m and {on} m");
        let back = field.descend(Point2::new(6.0, 9.0), 0.1);
        assert!(back.iter().any(|p| off(&bow(), *p) < 0.3 && p.x < 8.5), "it does not come back");
    }

    #[test]
    fn what_stands_on_the_way_is_gone_around() {
        let map = hall();
        let cells: Vec<u32> =
            (66..75).flat_map(|row| (58..62).map(move |column| row * 120 + column)).collect();
        let obstacles = Obstacles::of(cells);
        let along = map.along(&bow());
        let floor = CoarseFloor::new(&along, 0.45);
        let field = floor.past(&along, &along.with_obstacles(&obstacles), &obstacles, GOAL);
        let driven = field.descend(START, 0.1);
        assert!(driven.last().unwrap().distance(GOAL) < 0.5);
        assert!(!field.is_closed(START, 0.5));
        let hits = driven.iter().filter(|p| (5.8..6.2).contains(&p.x) && (6.6..7.5).contains(&p.y));
        assert_eq!(hits.count(), 0);
    }

    #[test]
    fn points_that_are_no_way_are_refused() {
        assert_eq!(Way::new(vec![START]), Err(WayError::TooShort(1)));
        assert_eq!(Way::new(vec![START, Point2::new(f64::NAN, 0.0)]), Err(WayError::NoPlace(1)));
        let long = Way::new(vec![START, Point2::new(3000.0, 0.0)]).unwrap_err();
        assert!(long.to_string().starts_with("is 2999 m long"), "{long}");
        // A way outside of the map is one that nothing leads along.
        let far = Way::new(vec![Point2::new(1e9, 0.0), Point2::new(1e9, 1.0)]).unwrap();
        assert!(hall().along(&far).off_way.is_some_and(|off| off.factor(0) > 2.9));
    }
}
