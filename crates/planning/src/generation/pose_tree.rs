//! The tree of RRT* while it is searched.

use crate::generation::tree::Tree;
use crate::geometry::{Point2, Pose2};

/// A tree of poses, structure of arrays, one entry per node, map frame. Node 0 is the root; an empty tree has none.
///
/// Edges are not stored: each is rebuilt from the two nodes it joins, as the shortest Dubins path.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PoseTree {
    /// Metres.
    pub x: Vec<f64>,
    /// Metres.
    pub y: Vec<f64>,
    /// Radians.
    pub heading: Vec<f64>,
    /// Length of the way from the root, metres.
    pub cost: Vec<f64>,
    /// Index of each node's parent, [`Tree::NO_PARENT`] for a root.
    pub parent: Vec<u32>,
}

/// Which nodes hang on each node of a [`PoseTree`].
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

impl PoseTree {
    /// The tree that is only a root.
    pub fn rooted(root: Pose2) -> Self {
        Self {
            x: vec![root.x],
            y: vec![root.y],
            heading: vec![root.heading],
            cost: vec![0.0],
            parent: vec![Tree::NO_PARENT],
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
        Tree::parent_of(self.parent[node])
    }

    /// Appends a node and returns its index.
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

    /// The value that travels: a generator that goes on with it finds headings and costs anew, from where the robot
    /// then is.
    pub fn into_value(self) -> Tree {
        Tree::new(self.parent, [("x", self.x), ("y", self.y)])
    }

    /// The nodes that satisfy `keep` (as must all their ancestors), breadth first,
    /// so that every parent comes before its children.
    pub fn compact(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut kept = Self::with_room_for(self.len());
        if self.is_empty() {
            return kept;
        }
        let children = self.children();
        let mut order = Vec::with_capacity(self.len());
        order.push((0_usize, Tree::NO_PARENT));
        let mut next = 0;
        while next < order.len() {
            let (node, parent) = order[next];
            let index = kept.push(self.pose(node), self.cost[node], parent) as u32;
            order.extend(
                children.of(node).iter().filter(|&&c| keep(c as usize)).map(|&c| (c as usize, index)),
            );
            next += 1;
        }
        kept
    }
}

/// The nodes of a value whose tree was a [`PoseTree`].
#[derive(Debug, Clone, Copy, Default)]
pub struct Nodes<'a> {
    x: &'a [f64],
    y: &'a [f64],
    parent: &'a [u32],
}

impl<'a> Nodes<'a> {
    /// Those of `tree`, if it is of that kind.
    pub fn of(tree: &'a Tree) -> Option<Self> {
        let [x, y] = tree.columns(["x", "y"])?;
        let nodes = Self { x, y, parent: &tree.parent };
        ([x, y].iter().all(|column| column.len() == nodes.len())).then_some(nodes)
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.parent.len()
    }

    /// Whether there is not even a root.
    pub fn is_empty(&self) -> bool {
        self.parent.is_empty()
    }

    /// Position of a node.
    pub fn position(&self, node: usize) -> Point2 {
        Point2::new(self.x[node], self.y[node])
    }

    /// Parent of a node, `None` for a root.
    pub fn parent(&self, node: usize) -> Option<usize> {
        Tree::parent_of(self.parent[node])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compacting_drops_whole_branches() {
        // 0 - 1 - 2, and 3 under 0.
        let mut tree = PoseTree::rooted(Pose2::default());
        tree.push(Pose2::new(1.0, 0.0, 0.0), 1.0, 0);
        tree.push(Pose2::new(2.0, 0.0, 0.0), 2.0, 1);
        tree.push(Pose2::new(0.0, 1.0, 0.0), 1.5, 0);
        let kept = tree.compact(|n| n != 1);
        assert_eq!((kept.x.as_slice(), kept.y.as_slice()), (&[0.0, 0.0][..], &[0.0, 1.0][..]));
        assert_eq!(kept.parent, [Tree::NO_PARENT, 0]);
        let whole = tree.compact(|_| true);
        assert_eq!(whole.len(), 4);
        assert!(whole.into_value().is_sound());
    }

    #[test]
    fn nodes_are_those_of_a_value_of_this_kind_alone() {
        let value = PoseTree::rooted(Pose2::new(1.0, 2.0, 0.5)).into_value();
        let nodes = Nodes::of(&value).unwrap();
        assert_eq!((nodes.len(), nodes.position(0), nodes.parent(0)), (1, Point2::new(1.0, 2.0), None));
        let mut short = value.clone();
        short.parent.push(0);
        assert!(Nodes::of(&short).is_none());
        assert!(Nodes::of(&Tree::default()).is_none());
    }
}
