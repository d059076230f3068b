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
    /// Columns of the value it becomes, besides the poses.
    pub const COLUMNS: [&'static str; 4] = ["omega", "risk", "time", "v"];

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
        let parent = self.nodes[node].parent;
        (parent != Tree::NO_PARENT).then_some(parent as usize)
    }

    /// Appends the child of `parent` that control number `control` leads to, and closes that control.
    pub fn push(&mut self, parent: usize, control: u32, twist: Twist, pose: Pose2, risk: f64) -> usize {
        let above = &mut self.nodes[parent];
        above.closed |= 1 << control;
        let (parent, depth, direction) = (parent as u32, above.depth + 1, Direction::of(pose.heading));
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

    /// The value that travels (D15).
    pub fn to_value(&self) -> Tree {
        let mut value = Tree::default();
        let mut columns: [Vec<f64>; 4] = Default::default();
        for (index, node) in self.nodes.iter().enumerate() {
            let travelled = self.parent(index).map_or(0.0, |p| value.cost[p] + node.twist.v * self.dt);
            value.push(node.pose, travelled, node.parent);
            let numbers = [node.twist.omega, node.risk, self.time(index), node.twist.v];
            columns.iter_mut().zip(numbers).for_each(|(column, number)| column.push(number));
        }
        value.extra = Self::COLUMNS.map(String::from).into_iter().zip(columns).collect();
        value
    }

    /// The tree of a value, if it is one that a generator with this lattice could have made: the right
    /// columns, one root, no node deeper than `max_depth`, and children a control away from their parents.
    /// A value from elsewhere can therefore lead nowhere the robot cannot go.
    pub fn from_value(value: &Tree, lattice: &ControlLattice<'_>, max_depth: u32) -> Option<Self> {
        if value.is_empty() || !value.has_columns(&Self::COLUMNS) || !value.is_sound() {
            return None;
        }
        let column = |name: &str| &value.extra[name];
        let (omega, risk, time, v) = (column("omega"), column("risk"), column("time"), column("v"));
        let twist = |node: usize| Twist { v: v[node], omega: omega[node] };
        let mut tree = Self::rooted(time[0], lattice.dt, value.pose(0), twist(0));
        tree.nodes.reserve(value.len());
        for node in 1..value.len() {
            let (parent, twist) = (value.parent(node)?, twist(node));
            let control = lattice.control(tree.nodes[parent].twist, twist)?;
            let pose = step_facing(tree.nodes[parent].facing(), twist, lattice.dt).pose;
            tree.push(parent, control, twist, pose, risk[node]);
            let on_time = (tree.time(node) - time[node]).abs() < 1e-6;
            if pose != value.pose(node) || !on_time || tree.nodes[node].depth > max_depth {
                return None;
            }
        }
        Some(tree)
    }
}
