//! Nearest and FindNearNeighbor of Alg. 1: nodes in square cells that are halved as the tree grows.
//!
//! A k-d tree answers the same questions, the nearest by one radius after the other, as it knows no distance that looks
//! at headings. In a tree that gets a node with nearly every question, growth then takes three times as many
//! instructions.

use crate::geometry::Point2;

/// More nodes per cell than this, on the whole, and the cells are halved.
const CROWDED: usize = 4;
/// Most cells along a side of the square at first: a large square has few nodes in it.
const FIRST_CELLS: f64 = 64.0;
/// Share of a squared distance that is more than rounding may change.
const SLACK: f64 = 1e-9;
/// Ends the list of a cell's nodes.
const NONE: u32 = u32::MAX;

/// Positions of a growing tree's nodes.
pub(super) struct Neighbours {
    positions: Vec<Point2>,
    low: Point2,
    /// Of a cell, metres.
    side: f64,
    /// Cells along each side of the square.
    cells: usize,
    /// The newest node of each cell.
    newest: Vec<u32>,
    /// The node of the same cell before each.
    before: Vec<u32>,
}

impl Neighbours {
    /// No nodes yet. Most of them will lie within `radius` metres of `centre`, and most questions ask for those within
    /// `usual` metres.
    pub(super) fn new(centre: Point2, radius: f64, usual: f64) -> Self {
        let side = (0.5 * usual).max(2.0 * radius / FIRST_CELLS);
        let low = Point2::new(centre.x - radius, centre.y - radius);
        let cells = (2.0 * radius / side) as usize + 1;
        let newest = vec![NONE; cells * cells];
        Self { positions: Vec::new(), low, side, cells, newest, before: Vec::new() }
    }

    /// Makes room for `nodes` more.
    pub(super) fn reserve(&mut self, nodes: usize) {
        self.positions.reserve(nodes);
        self.before.reserve(nodes);
    }

    /// The next node.
    pub(super) fn push(&mut self, p: Point2) {
        self.positions.push(p);
        if self.positions.len() <= CROWDED * self.newest.len() {
            self.file(p);
            return;
        }
        (self.side, self.cells) = (0.5 * self.side, 2 * self.cells);
        self.newest = vec![NONE; self.cells * self.cells];
        self.before.clear();
        for node in 0..self.positions.len() {
            self.file(self.positions[node]);
        }
    }

    fn file(&mut self, p: Point2) {
        let (column, row) = self.cell(p);
        let newest = &mut self.newest[row * self.cells + column];
        let node = self.before.len() as u32;
        self.before.push(std::mem::replace(newest, node));
    }

    /// Column and row of the cell of a point, or of the nearest cell for a point outside the square. Two points are at
    /// least as far from each other as the points of the square next to them.
    fn cell(&self, p: Point2) -> (usize, usize) {
        let index = |at: f64| ((at / self.side).max(0.0) as usize).min(self.cells - 1);
        (index(p.x - self.low.x), index(p.y - self.low.y))
    }

    fn visit(&self, column: usize, row: usize, visit: &mut impl FnMut(usize, Point2)) {
        let mut node = self.newest[row * self.cells + column];
        while node != NONE {
            visit(node as usize, self.positions[node as usize]);
            node = self.before[node as usize];
        }
    }

    /// Puts the nodes within `radius` metres of `p` into `near`, with their distances. The order depends on the order
    /// in which nodes were added alone.
    pub(super) fn within(&self, p: Point2, radius: f64, near: &mut Vec<(f64, usize)>) {
        near.clear();
        let squared = radius * radius;
        let (left, bottom) = self.cell(Point2::new(p.x - radius, p.y - radius));
        let (right, top) = self.cell(Point2::new(p.x + radius, p.y + radius));
        for row in bottom..=top {
            for column in left..=right {
                self.visit(column, row, &mut |node, at| {
                    let d = at.distance_squared(p);
                    if d <= squared {
                        near.push((d.sqrt(), node));
                    }
                });
            }
        }
    }

    /// The node with the least `way` from `p`, which is never less than its distance from `p`; of equal ones the
    /// oldest.
    pub(super) fn nearest(&self, p: Point2, way: impl Fn(usize, Point2) -> f64) -> Option<usize> {
        let (column, row) = self.cell(p);
        let mut best: Option<(f64, usize)> = None;
        for ring in 0..self.cells {
            // A node of this ring is at least this far away.
            let least = (ring as f64 - 1.0) * self.side;
            if best.is_some_and(|(way, _)| way < least) {
                break;
            }
            let mut offer = |node: usize, at: Point2| {
                if best.is_some_and(|(way, _)| at.distance_squared(p) * (1.0 - SLACK) > way * way) {
                    return;
                }
                let way = way(node, at);
                if best.is_none_or(|(least, oldest)| way < least || (way == least && node < oldest)) {
                    best = Some((way, node));
                }
            };
            let span = |at: usize| at.saturating_sub(ring)..=(at + ring).min(self.cells - 1);
            for r in span(row) {
                let is_end = r.abs_diff(row) == ring;
                for c in span(column).filter(|c| is_end || c.abs_diff(column) == ring) {
                    self.visit(c, r, &mut offer);
                }
            }
        }
        best.map(|(_, node)| node)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{rng, uniform};

    #[test]
    fn finds_what_a_scan_finds_while_it_grows() {
        let mut rng = rng(7, 0);
        // A square of 6 m, for points in one of 8 m.
        let mut neighbours = Neighbours::new(Point2::new(4.0, 4.0), 3.0, 2.0);
        let first = neighbours.side;
        let mut near = Vec::new();
        for k in 0..2000 {
            let p = Point2::new(8.0 * uniform(&mut rng), 8.0 * uniform(&mut rng));
            let radius = 1.5 * uniform(&mut rng);
            neighbours.within(p, radius, &mut near);
            near.sort_unstable_by_key(|&(_, node)| node);
            let all = || neighbours.positions.iter().enumerate().map(|(i, q)| (q.distance(p), i));
            assert_eq!(near, all().filter(|(d, _)| *d <= radius).collect::<Vec<_>>(), "node {k}");
            // Nodes of odd index are a metre farther away than they look.
            let way = |node: usize, q: Point2| q.distance(p) + (node % 2) as f64;
            let expected = all().map(|(d, i)| (d + (i % 2) as f64, i)).min_by(|a, b| a.0.total_cmp(&b.0));
            assert_eq!(neighbours.nearest(p, way), expected.map(|(_, i)| i), "node {k}");
            neighbours.push(p);
        }
        assert!(neighbours.side < 0.5 * first, "the cells have not been halved twice: {} m", neighbours.side);
    }
}
