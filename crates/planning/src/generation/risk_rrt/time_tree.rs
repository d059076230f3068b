//! The tree of Risk-RRT: nodes with a time, a twist and a risk.

use super::control_lattice::ControlLattice;
use crate::generation::tree::Tree;
use crate::geometry::{Direction, Facing, Pose2, Twist};
use crate::motion::step_facing;

/// One node: a pose at a moment, and the control that led there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Map frame.
    pub pose: Pose2,
    /// That of the pose's heading: everything that goes on from here needs it.
    pub direction: Direction,
    /// The control that led here, held for one step; of the root what the robot did there.
    pub twist: Twist,
    /// Index of the parent, [`Tree::NO_PARENT`] for the root.
    pub parent: u32,
    /// Steps from the root: also the index of the forecast its risk is read from.
    pub depth: u32,
    /// Greatest probability of collision on the way from the root, [0, 1].
    pub risk: f64,
    /// Controls that were tried, a bit each.
    pub closed: u128,
}

impl Node {
    /// The pose with its direction.
    pub fn facing(&self) -> Facing {
        Facing { pose: self.pose, direction: self.direction }
    }
}

/// Nodes, every parent before its children, the root first; never empty.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeTree {
    /// When the root is passed, seconds of the robot's clock.
    pub stamp: f64,
    /// Seconds between a node and its children.
    pub dt: f64,
    /// The nodes.
    pub nodes: Vec<Node>,
}

impl TimeTree {
    /// Columns of the value it becomes: the twist that led to each node (of the root what the robot did there), and the
    /// root's x, y, heading and time. All else follows from these.
    pub const COLUMNS: [&'static str; 3] = ["omega", "root", "v"];

    /// The tree that is only a root.
    pub fn rooted(stamp: f64, dt: f64, pose: Pose2, twist: Twist) -> Self {
        let direction = Direction::of(pose.heading);
        let root = Node { pose, direction, twist, parent: Tree::NO_PARENT, depth: 0, risk: 0.0, closed: 0 };
        Self { stamp, dt, nodes: vec![root] }
    }

    /// When a node is passed, seconds of the robot's clock.
    pub fn time(&self, node: usize) -> f64 {
        self.stamp + f64::from(self.nodes[node].depth) * self.dt
    }

    /// Parent of a node, `None` for the root.
    pub fn parent(&self, node: usize) -> Option<usize> {
        Tree::parent_of(self.nodes[node].parent)
    }

    /// Appends the child of `parent` that control number `control` leads to, and closes that control.
    pub fn push(&mut self, parent: usize, control: u32, twist: Twist, pose: Pose2, risk: f64) -> usize {
        let above = &mut self.nodes[parent];
        above.closed |= 1 << control;
        let parent = parent as u32;
        let depth = above.depth + 1;
        let direction = Direction::of(pose.heading);
        self.nodes.push(Node { pose, direction, twist, parent, depth, risk, closed: 0 });
        self.nodes.len() - 1
    }

    /// The nodes from the root's child to `node`.
    pub fn branch(&self, node: usize) -> Vec<usize> {
        let mut branch = Vec::with_capacity(self.nodes[node].depth as usize);
        let mut at = node;
        while let Some(parent) = self.parent(at) {
            branch.push(at);
            at = parent;
        }
        branch.reverse();
        branch
    }

    /// `node` and what hangs on it, `node` as the root: one step less deep for every step it was deep.
    pub fn subtree(&self, node: usize) -> Self {
        let mut index = vec![Tree::NO_PARENT; self.nodes.len()];
        let root = Node { parent: Tree::NO_PARENT, depth: 0, ..self.nodes[node] };
        let mut kept =
            Self { stamp: self.time(node), dt: self.dt, nodes: Vec::with_capacity(self.nodes.len()) };
        kept.nodes.push(root);
        index[node] = 0;
        for (old, n) in self.nodes.iter().enumerate().skip(node + 1) {
            let parent = n.parent;
            if parent == Tree::NO_PARENT || index[parent as usize] == Tree::NO_PARENT {
                continue;
            }
            index[old] = kept.nodes.len() as u32;
            let depth = n.depth - self.nodes[node].depth;
            kept.nodes.push(Node { parent: index[parent as usize], depth, ..*n });
        }
        kept
    }

    /// The value that travels (D15). Risks are left out: they are read anew in every cycle.
    pub fn to_value(&self) -> Tree {
        let mut value = Tree::default();
        self.append_to(&mut value);
        value
    }

    /// Adds its nodes to a value, after those that are there.
    pub(in crate::generation) fn append_to(&self, value: &mut Tree) {
        let first = value.parent.len() as u32;
        let move_on = |parent: u32| if parent == Tree::NO_PARENT { parent } else { first + parent };
        value.parent.extend(self.nodes.iter().map(|node| move_on(node.parent)));
        let mut extend = |name: &str, numbers: &mut dyn Iterator<Item = f64>| {
            value.columns.entry(name.to_owned()).or_default().extend(numbers);
        };
        extend("omega", &mut self.nodes.iter().map(|node| node.twist.omega));
        extend("v", &mut self.nodes.iter().map(|node| node.twist.v));
        let root = self.nodes[0].pose;
        extend("root", &mut [root.x, root.y, root.heading, self.stamp].into_iter());
    }

    /// The tree of a value, if it is one that a generator with this lattice could have made: the right columns, one
    /// root, no node deeper than `max_depth`, and children a control away from their parents. So a value from elsewhere
    /// can lead nowhere the robot cannot go.
    pub fn from_value(value: &Tree, lattice: &ControlLattice<'_>, max_depth: u32) -> Option<Self> {
        let [omega, root, v] = value.columns(Self::COLUMNS)?;
        let nodes = TimeNodes { parent: &value.parent, first: 0, omega, v, root };
        nodes.grown(lattice, max_depth)
    }
}

/// Nodes of a value that make one tree. Parents are counted from the beginning of the value, where the first of these
/// is node `first`.
pub(in crate::generation) struct TimeNodes<'a> {
    pub(in crate::generation) parent: &'a [u32],
    pub(in crate::generation) first: usize,
    pub(in crate::generation) omega: &'a [f64],
    pub(in crate::generation) v: &'a [f64],
    pub(in crate::generation) root: &'a [f64],
}

impl TimeNodes<'_> {
    /// The tree that they are of; `None` as for [`TimeTree::from_value`].
    pub(in crate::generation) fn grown(
        &self,
        lattice: &ControlLattice<'_>,
        max_depth: u32,
    ) -> Option<TimeTree> {
        let &[x, y, heading, stamp] = self.root else { return None };
        let count = self.parent.len();
        if count == 0 || self.parent[0] != Tree::NO_PARENT || [self.omega.len(), self.v.len()] != [count; 2] {
            return None;
        }
        let twist = |node: usize| Twist { v: self.v[node], omega: self.omega[node] };
        let mut tree = TimeTree::rooted(stamp, lattice.dt, Pose2::new(x, y, heading), twist(0));
        tree.nodes.reserve(count);
        for node in 1..count {
            let parent = (self.parent[node] as usize).checked_sub(self.first)?;
            let above = tree.nodes.get(parent)?;
            let twist = twist(node);
            let control = lattice.control(above.twist, twist)?;
            let pose = step_facing(above.facing(), twist, lattice.dt).pose;
            tree.push(parent, control, twist, pose, 0.0);
            if tree.nodes[node].depth > max_depth {
                return None;
            }
        }
        Some(tree)
    }
}
