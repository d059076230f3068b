//! The way past people where they are now, on a fine lattice around the robot (Dijkstra, 1959).
//!
//! The shortest way to the goal knows no people, and the branches of a tree that grows without them seldom lead through
//! what is left beside one who stands in a corridor, or between two who wait for the robot. That is often narrower than
//! the cells of the map, on which [`Detour`](crate::occupancy::Detour) finds the distance to go past people.

use crate::collision::CollisionChecker;
use crate::generation::GenerationInput;
use crate::geometry::{Point2, Pose2};
use crate::occupancy::Front;

/// Nodes from the robot to each side of the lattice.
const SIDE: i32 = 50;
/// Spacings from the robot to where a way ends.
const END: f64 = 45.0;
/// Where there is so much room beyond what is asked, more is no better, metres.
const ROOM: f64 = 0.15;
/// As how many metres one counts where there is no more room than is asked.
const TIGHT: f64 = 3.0;
/// Columns and rows to the nodes beside one.
const STEPS: [(i32, i32); 8] = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)];

/// The corners of the best way from the robot past people, as if all of them stayed where they are, with the room that
/// `checker` asks now. It ends at the goal, or 45 times `spacing` away where the shortest way goes on best. `None` if
/// people and walls enclose the robot more narrowly.
///
/// `spacing` is that of the lattice, metres: passages a few times wider than the robot needs are found.
pub(super) fn way_past(
    input: &GenerationInput<'_>,
    checker: &CollisionChecker<'_>,
    spacing: f64,
) -> Option<Vec<Point2>> {
    let centre = input.scene.belief.pose;
    let reach = f64::from(SIDE) * spacing * std::f64::consts::SQRT_2;
    let lattice = Lattice { centre, spacing, checker, people: checker.discs(reach).collect() };
    let tolerance = input.params.generation.candidates.goal_tolerance;
    let nodes = lattice.way(|p| input.geodesic.at(p), tolerance)?;
    Some(lattice.straightened(&nodes))
}

struct Lattice<'a> {
    /// Where the robot is, and the middle node.
    centre: Pose2,
    spacing: f64,
    checker: &'a CollisionChecker<'a>,
    /// Where people are, and how near the robot's centre may come to them.
    people: Vec<(Point2, f64)>,
}

impl Lattice<'_> {
    /// Room beyond what is asked of walls and people, metres; negative where the robot must not be.
    fn room(&self, p: Point2) -> f64 {
        let to_people = self.people.iter().map(|&(person, radius)| p.distance(person) - radius);
        to_people.fold(self.checker.wall_gap(Pose2 { x: p.x, y: p.y, ..self.centre }), f64::min)
    }

    /// Index of a node, unless it is outside.
    fn index(column: i32, row: i32) -> Option<usize> {
        let is_inside = column.abs() <= SIDE && row.abs() <= SIDE;
        is_inside.then_some(((row + SIDE) * (2 * SIDE + 1) + column + SIDE) as usize)
    }

    /// Column and row of a node, the robot's being 0.
    fn place(index: usize) -> (i32, i32) {
        let index = index as i32;
        let width = 2 * SIDE + 1;
        (index % width - SIDE, index / width - SIDE)
    }

    fn point(&self, index: usize) -> Point2 {
        let (column, row) = Self::place(index);
        let along = |start: f64, steps: i32| start + f64::from(steps) * self.spacing;
        Point2::new(along(self.centre.x, column), along(self.centre.y, row))
    }

    /// The nodes of the best way, without the robot's: metres count more where there is little room, and `to_go` from
    /// its end is added.
    fn way(&self, to_go: impl Fn(Point2) -> f64, tolerance: f64) -> Option<Vec<Point2>> {
        let here = self.centre.position();
        let nodes = ((2 * SIDE + 1) * (2 * SIDE + 1)) as usize;
        let mut metres = vec![f64::INFINITY; nodes];
        let mut before = vec![0; nodes];
        let mut rooms = vec![f64::NAN; nodes];
        let middle = Self::index(0, 0)?;
        metres[middle] = 0.0;
        let mut front = Front::new((std::f64::consts::SQRT_2 * TIGHT * self.spacing) as f32);
        front.push(0.0, middle);
        let mut best: Option<(f64, usize)> = None;
        while let Some((at, node)) = front.pop() {
            let so_far = metres[node];
            // It has been here before, by a shorter way.
            if at > so_far as f32 {
                continue;
            }
            if best.is_some_and(|(whole, _)| so_far >= whole) {
                break;
            }
            let p = self.point(node);
            let left = to_go(p);
            if left <= tolerance || p.distance(here) >= END * self.spacing {
                let whole = so_far + left;
                if whole.is_finite() && best.is_none_or(|(least, _)| whole < least) {
                    best = Some((whole, node));
                }
                continue;
            }
            let (column, row) = Self::place(node);
            for (right, up) in STEPS {
                let Some(next) = Self::index(column + right, row + up) else { continue };
                if rooms[next].is_nan() {
                    rooms[next] = self.room(self.point(next));
                }
                if rooms[next] < 0.0 {
                    continue;
                }
                let length = self.spacing * f64::from(right * right + up * up).sqrt();
                let factor = 1.0 + (TIGHT - 1.0) * (1.0 - rooms[next] / ROOM).max(0.0);
                let there = so_far + length * factor;
                if there < metres[next] {
                    (metres[next], before[next]) = (there, node);
                    front.push(there as f32, next);
                }
            }
        }
        let (_, end) = best?;
        let back = std::iter::successors(Some(end), |&node| Some(before[node]));
        let mut way: Vec<Point2> =
            back.take_while(|&node| node != middle).map(|node| self.point(node)).collect();
        way.reverse();
        Some(way)
    }

    /// The corners that are left if each straight stretch is as long as it can be.
    fn straightened(&self, nodes: &[Point2]) -> Vec<Point2> {
        let mut corners = Vec::new();
        let mut from = self.centre.position();
        let mut next = 0;
        while next < nodes.len() {
            let seen = (next..nodes.len()).rev().find(|&k| self.is_clear(from, nodes[k])).unwrap_or(next);
            from = nodes[seen];
            corners.push(from);
            next = seen + 1;
        }
        corners
    }

    /// Whether there is enough room on a straight stretch.
    fn is_clear(&self, from: Point2, to: Point2) -> bool {
        let pieces = (2.0 * from.distance(to) / self.spacing).ceil();
        (1..=pieces as usize).all(|k| self.room(from.toward(to, k as f64 / pieces)) >= 0.0)
    }
}
