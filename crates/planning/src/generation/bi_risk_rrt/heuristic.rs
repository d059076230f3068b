//! What the reverse tree is for: while it searches, meeting the tree in time; then, a path to draw samples
//! around.

use super::params::BiRiskRrtParams;
use crate::generation::risk_rrt::{TimeTree, control_lattice::ControlLattice, time_tree::Node};
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
    /// Column of the value that tells forward nodes (0) from those of the reverse tree (1) and of the
    /// path (2).
    pub const COLUMN: &'static str = "side";
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
        let side = if self.is_found { 2.0 } else { 1.0 };
        let mut sides = vec![0.0; value.len()];
        let offset = value.len() as u32;
        let own = self.tree.to_value();
        for node in 0..own.len() {
            let parent = own.parent(node).map_or(Tree::NO_PARENT, |p| p as u32 + offset);
            value.push(own.pose(node), own.cost[node], parent);
            sides.push(side);
        }
        for (name, numbers) in own.extra {
            value.extra.entry(name).or_default().extend(numbers);
        }
        value.extra.insert(Self::COLUMN.to_owned(), sides);
    }

    /// Takes a value apart into the tree in time and the heuristic, if it is of that kind.
    pub fn split(
        value: &Tree,
        lattice: &ControlLattice<'_>,
        max_depth: u32,
        params: &BiRiskRrtParams,
    ) -> Option<(TimeTree, Self)> {
        let sides = value.extra.get(Self::COLUMN).filter(|sides| sides.len() == value.len())?;
        let first = sides.iter().position(|side| *side != 0.0)?;
        let side = sides[first];
        if !value.is_sound() || sides[first..].iter().any(|s| *s != side) {
            return None;
        }
        let forward = TimeTree::from_value(&part(value, 0, first)?, lattice, max_depth)?;
        let reverse = part(value, first, value.len())?;
        let reverse = TimeTree::from_value(&reverse, lattice, params.reverse_depth)?;
        let is_chain = reverse.nodes.iter().enumerate().all(|(k, n)| n.depth as usize == k);
        let is_found = side == 2.0 && is_chain;
        (side == 1.0 || is_found).then_some((forward, Self { tree: reverse, is_found }))
    }
}

/// Nodes `first..end` of a value as a value of one side, if no node's parent is outside.
fn part(value: &Tree, first: usize, end: usize) -> Option<Tree> {
    let mut part = Tree::default();
    for node in first..end {
        let parent = match value.parent(node) {
            Some(p) => p.checked_sub(first)? as u32,
            None => Tree::NO_PARENT,
        };
        part.push(value.pose(node), value.cost[node], parent);
    }
    let columns = value.extra.iter().filter(|(name, _)| *name != Heuristic::COLUMN);
    part.extra = columns.map(|(name, numbers)| (name.clone(), numbers[first..end].to_vec())).collect();
    Some(part)
}
