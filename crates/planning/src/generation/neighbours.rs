//! FindNearNeighbor of Alg. 1: which nodes lie within a radius, by a k-d tree that grows with the search.

use kiddo::{MutableKdTree, SquaredEuclidean};

use crate::geometry::Point2;

/// Positions of a growing tree's nodes, searched by radius.
#[derive(Default)]
pub(super) struct Neighbours {
    positions: Vec<Point2>,
    tree: MutableKdTree<f64, 2>,
    /// Nodes the k-d tree refuses because too many share a coordinate, as along a wall; few, so they are scanned.
    apart: Vec<u32>,
}

impl Neighbours {
    /// All nodes of a search tree, in order.
    pub(super) fn of(x: &[f64], y: &[f64]) -> Self {
        let mut all = Self::default();
        x.iter().zip(y).for_each(|(&x, &y)| all.push(Point2::new(x, y)));
        all
    }

    /// The next node.
    pub(super) fn push(&mut self, p: Point2) {
        let node = self.positions.len() as u32;
        self.positions.push(p);
        if self.tree.add(&[p.x, p.y], node).is_err() {
            self.apart.push(node);
        }
    }

    /// Nodes within `radius` metres of `p` and their distance, in index order. The k-d tree is asked for
    /// a little more and the comparison is made here, so that its own arithmetic decides nothing.
    pub(super) fn within(&self, p: Point2, radius: f64) -> Vec<(usize, f64)> {
        let squared = radius * radius;
        let point = [p.x, p.y];
        let search = self.tree.query(&point);
        let found = search.within::<SquaredEuclidean<f64>>(squared * (1.0 + 1e-9)).unsorted().execute();
        let mut near: Vec<(usize, f64)> = (found.iter().map(|f| f.item))
            .chain(self.apart.iter().copied())
            .filter_map(|node| {
                let d = self.positions[node as usize].distance_squared(p);
                (d <= squared).then(|| (node as usize, d.sqrt()))
            })
            .collect();
        near.sort_unstable_by_key(|&(node, _)| node);
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{rng, uniform};

    fn scan(positions: &[Point2], p: Point2, radius: f64) -> Vec<(usize, f64)> {
        let distances = positions.iter().enumerate().map(|(i, q)| (i, q.distance_squared(p)));
        distances.filter(|(_, d)| *d <= radius * radius).map(|(i, d)| (i, d.sqrt())).collect()
    }

    #[test]
    fn finds_what_a_scan_finds_while_it_grows() {
        let mut rng = rng(7, 0);
        let mut neighbours = Neighbours::default();
        for k in 0..600 {
            let p = Point2::new(8.0 * uniform(&mut rng), 8.0 * uniform(&mut rng));
            let radius = 1.5 * uniform(&mut rng);
            assert_eq!(neighbours.within(p, radius), scan(&neighbours.positions, p, radius), "node {k}");
            neighbours.push(p);
        }
        assert!(neighbours.apart.is_empty());
    }

    #[test]
    fn nodes_in_a_row_and_in_one_place_are_found_as_well() {
        // A row that grows at one end makes the k-d tree lopsided, and it rebuilds itself.
        let mut row = Neighbours::default();
        for i in 0..600 {
            row.push(Point2::new(0.01 * f64::from(i), 0.02 * f64::from(i)));
        }
        let middle = Point2::new(3.0, 6.1);
        assert_eq!(row.within(middle, 0.7), scan(&row.positions, middle, 0.7));

        let mut neighbours = Neighbours::default();
        (0..100).for_each(|i| neighbours.push(Point2::new(2.0, 0.05 * f64::from(i))));
        (0..100).for_each(|_| neighbours.push(Point2::new(3.0, 1.0)));
        let p = Point2::new(2.1, 1.0);
        assert!(!neighbours.apart.is_empty(), "this is the case the k-d tree refuses");
        assert_eq!(neighbours.within(p, 0.9), scan(&neighbours.positions, p, 0.9));
        assert_eq!(neighbours.within(p, 0.9).iter().filter(|(i, _)| *i >= 100).count(), 100);
    }
}
