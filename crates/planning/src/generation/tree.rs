//! The search tree as a value that travels between cycles and services (D15).

use std::collections::BTreeMap;

use crate::geometry::{Point2, Pose2};

/// A tree of poses, structure of arrays, one entry per node, map frame. Node 0 is the root, and every
/// parent comes before its children; an empty tree has no root. A generator that searches from both ends
/// has a second root.
///
/// Edges are not stored: a generator rebuilds each from the two nodes it joins (RRT*: the shortest
/// Dubins path; Risk-RRT: the arc of the node's twist), which is deterministic and keeps the value small.
///
/// [`Self::extra`] tells the kinds of trees apart: a generator goes on with a tree that has exactly the
/// columns it writes itself, and starts afresh from any other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tree {
    /// Metres.
    pub x: Vec<f64>,
    /// Metres.
    pub y: Vec<f64>,
    /// Radians.
    pub heading: Vec<f64>,
    /// Length of the way from the root, metres; what else it means is the generator's.
    pub cost: Vec<f64>,
    /// Index of each node's parent, [`Tree::NO_PARENT`] for a root.
    pub parent: Vec<u32>,
    /// Further arrays of one number per node that some generator needs, by name.
    pub extra: BTreeMap<String, Vec<f64>>,
}

/// Which nodes hang on each node of a [`Tree`].
#[derive(Debug, Clone)]
pub struct Children {
    /// Where those of each node end in `nodes`.
    end: Vec<u32>,
    nodes: Vec<u32>,
}

impl Children {
    /// Those of one node, ascending.
    pub fn of(&self, node: usize) -> &[u32] {
        let start = if node == 0 { 0 } else { self.end[node - 1] as usize };
        &self.nodes[start..self.end[node] as usize]
    }
}

impl Tree {
    /// A root's entry in [`Self::parent`].
    pub const NO_PARENT: u32 = u32::MAX;

    /// The tree that is only a root.
    pub fn rooted(root: Pose2) -> Self {
        Self {
            x: vec![root.x],
            y: vec![root.y],
            heading: vec![root.heading],
            cost: vec![0.0],
            parent: vec![Self::NO_PARENT],
            extra: BTreeMap::new(),
        }
    }

    /// An empty one with room for `nodes`.
    pub(super) fn with_room_for(nodes: usize) -> Self {
        Self {
            x: Vec::with_capacity(nodes),
            y: Vec::with_capacity(nodes),
            heading: Vec::with_capacity(nodes),
            cost: Vec::with_capacity(nodes),
            parent: Vec::with_capacity(nodes),
            extra: BTreeMap::new(),
        }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there is not even a root.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Pose of a node.
    pub fn pose(&self, node: usize) -> Pose2 {
        Pose2::new(self.x[node], self.y[node], self.heading[node])
    }

    /// Position of a node.
    pub fn position(&self, node: usize) -> Point2 {
        Point2::new(self.x[node], self.y[node])
    }

    /// Parent of a node, `None` for a root.
    pub fn parent(&self, node: usize) -> Option<usize> {
        let p = self.parent[node];
        (p != Self::NO_PARENT).then_some(p as usize)
    }

    /// Appends a node without touching [`Self::extra`] and returns its index.
    pub fn push(&mut self, pose: Pose2, cost: f64, parent: u32) -> usize {
        self.x.push(pose.x);
        self.y.push(pose.y);
        self.heading.push(pose.heading);
        self.cost.push(cost);
        self.parent.push(parent);
        self.len() - 1
    }

    /// Children of every node, ascending.
    pub fn children(&self) -> Children {
        let mut end = vec![0; self.len()];
        let parents = || (0..self.len()).filter_map(|node| Some((self.parent(node)?, node)));
        parents().for_each(|(parent, _)| end[parent] += 1);
        let mut sum = 0;
        for end in &mut end {
            // For now each ends where it begins.
            sum += std::mem::replace(end, sum);
        }
        let mut nodes = vec![0; sum as usize];
        for (parent, node) in parents() {
            nodes[end[parent] as usize] = node as u32;
            end[parent] += 1;
        }
        Children { end, nodes }
    }

    /// Whether the columns of [`Self::extra`] are exactly these, given in alphabetical order.
    pub fn has_columns(&self, names: &[&str]) -> bool {
        self.extra.keys().eq(names)
    }

    /// Whether it is what a tree that came from elsewhere must be: arrays of one finite number per node, and every
    /// parent before its children.
    pub fn is_sound(&self) -> bool {
        let mut arrays = [&self.x, &self.y, &self.heading, &self.cost].into_iter().chain(self.extra.values());
        let is_whole = |array: &Vec<f64>| array.len() == self.len() && array.iter().all(|v| v.is_finite());
        let comes_first = |(node, &parent)| parent == Self::NO_PARENT || (parent as usize) < node;
        arrays.all(is_whole)
            && self.parent.len() == self.len()
            && self.parent.iter().enumerate().all(comes_first)
    }

    /// The nodes that hang on the first root and satisfy `keep` (as must all their ancestors), breadth first,
    /// so that every parent comes before its children.
    pub fn compact(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut kept = Self::with_room_for(self.len());
        if self.is_empty() {
            return kept;
        }
        let children = self.children();
        let mut order = Vec::with_capacity(self.len());
        order.push((0_usize, Self::NO_PARENT));
        let mut next = 0;
        while next < order.len() {
            let (node, parent) = order[next];
            let index = kept.push(self.pose(node), self.cost[node], parent) as u32;
            order.extend(
                children.of(node).iter().filter(|&&c| keep(c as usize)).map(|&c| (c as usize, index)),
            );
            next += 1;
        }
        for (name, values) in &self.extra {
            kept.extra.insert(name.clone(), order.iter().map(|&(node, _)| values[node]).collect());
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0 - 1 - 2, and 3 under 0.
    fn small() -> Tree {
        let mut t = Tree::rooted(Pose2::default());
        t.push(Pose2::new(1.0, 0.0, 0.0), 1.0, 0);
        t.push(Pose2::new(2.0, 0.0, 0.0), 2.0, 1);
        t.push(Pose2::new(0.0, 1.0, 0.0), 1.5, 0);
        t.extra.insert("risk".to_owned(), vec![0.0, 0.1, 0.2, 0.3]);
        t
    }

    #[test]
    fn compacting_drops_whole_branches_and_keeps_extra_arrays_aligned() {
        let t = small().compact(|n| n != 1);
        assert_eq!(t.len(), 2);
        assert_eq!(t.extra["risk"], vec![0.0, 0.3]);
        assert!(t.is_sound());
        assert!(small().compact(|_| true).is_sound());
    }

    #[test]
    fn broken_trees_are_refused() {
        let mut t = small();
        t.parent[1] = 2;
        assert!(!t.is_sound());
        let mut t = small();
        t.heading[2] = f64::NAN;
        assert!(!t.is_sound());
        let mut t = small();
        t.extra.insert("depth".to_owned(), vec![1.0]);
        assert!(!t.is_sound());
        assert!(Tree::default().is_sound());
    }
}
