//! What the reverse tree is for: while it searches, meeting the tree in time; then, a path to draw samples
//! around.

use super::params::BiRiskRrtParams;
use crate::generation::risk_rrt::control_lattice::ControlLattice;
use crate::generation::risk_rrt::time_tree::{Node, TimeNodes, TimeTree};
use crate::generation::tree::Tree;
use crate::geometry::{Point2, Pose2, Twist, bearing};

/// The reverse search and what came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Heuristic {
    /// A tree that grows from the goal; once found, the way from there to where the trees met: a chain.
    pub tree: TimeTree,
    /// Whether the trees have met.
    pub is_found: bool,
}

impl Heuristic {
    /// Columns of the value of both trees, the tree in time first: those of a [`TimeTree`], whether a path is found (1)
    /// or not (0), and the risks of the second tree's nodes, which are not read anew.
    pub const COLUMNS: [&'static str; 5] = ["found", "omega", "risk", "root", "v"];
    /// Path nodes looked at for the one that the robot has come to.
    const WINDOW: usize = 10;

    /// A reverse tree that is only a root: at rest in the goal, facing the robot.
    pub fn rooted(goal: Point2, robot: Point2, dt: f64) -> Self {
        let root = Pose2::new(goal.x, goal.y, bearing(goal, robot));
        Self { tree: TimeTree::rooted(0.0, dt, root, Twist::default()), is_found: false }
    }

    /// Where it starts from.
    pub fn goal(&self) -> Point2 {
        self.tree.nodes[0].pose.position()
    }

    /// Keeps the way from the root to `node`, which is in reach of the tree in time.
    pub fn find(&mut self, node: usize) {
        let nodes = &self.tree.nodes;
        let on_the_way = self.tree.branch(node).into_iter().enumerate();
        let path = on_the_way.map(|(k, n)| Node { parent: k as u32, closed: 0, ..nodes[n] });
        self.tree.nodes = [nodes[0]].into_iter().chain(path).collect();
        self.is_found = true;
    }

    /// Drops the nodes of a found path that the robot at `p` has come past.
    pub fn pass(&mut self, p: Point2) {
        while self.is_found {
            let nodes = &self.tree.nodes;
            let first = nodes.len().saturating_sub(Self::WINDOW);
            let nearest = (first..nodes.len()).min_by(|&a, &b| {
                let distance = |n: usize| nodes[n].pose.position().distance_squared(p);
                distance(a).total_cmp(&distance(b))
            });
            match nearest {
                Some(n) if n + 1 < nodes.len() => self.tree.nodes.truncate(n + 1),
                _ => return,
            }
        }
    }

    /// Appends its nodes to the value of a tree in time.
    pub fn append_to(&self, value: &mut Tree) {
        self.tree.append_to(value);
        let found = vec![f64::from(u8::from(self.is_found))];
        let risks = self.tree.nodes.iter().map(|node| node.risk).collect();
        value.columns.extend([("found".to_owned(), found), ("risk".to_owned(), risks)]);
    }

    /// Takes a value apart into the tree in time and the heuristic, if it is of that kind.
    pub fn split(
        value: &Tree,
        lattice: &ControlLattice<'_>,
        max_depth: u32,
        params: &BiRiskRrtParams,
    ) -> Option<(TimeTree, Self)> {
        let [found, omega, risk, root, v] = value.columns(Self::COLUMNS)?;
        let first = 1 + value.parent.iter().skip(1).position(|&parent| parent == Tree::NO_PARENT)?;
        let is_found = match found {
            [0.0] => false,
            [1.0] => true,
            _ => return None,
        };
        let (root, second_root) = root.split_at(root.len() / 2);
        let (omega, second_omega) = omega.split_at_checked(first)?;
        let (v, second_v) = v.split_at_checked(first)?;
        let (parent, second_parent) = value.parent.split_at(first);
        let forward = TimeNodes { parent, first: 0, omega, v, root }.grown(lattice, max_depth)?;
        let second =
            TimeNodes { parent: second_parent, first, omega: second_omega, v: second_v, root: second_root };
        let mut tree = second.grown(lattice, params.reverse_depth)?;
        if risk.len() != tree.nodes.len() {
            return None;
        }
        tree.nodes.iter_mut().zip(risk).for_each(|(node, risk)| node.risk = *risk);
        let is_chain = tree.nodes.iter().enumerate().all(|(k, node)| node.depth as usize == k);
        (is_chain || !is_found).then_some((forward, Self { tree, is_found }))
    }
}
