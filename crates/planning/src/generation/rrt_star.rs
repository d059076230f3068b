//! RRT* (Karaman and Frazzoli, 2011) over poses joined by Dubins paths: Alg. 1 with its slips repaired
//! (A22, A23), so that Parent and Rewire mean something (D14).
//!
//! Near neighbours come from a k-d tree. The nearest node is found by scanning the arrays, because its
//! distance looks at headings: what lies behind is far.

use crate::parameters::Range;

use crate::collision::CollisionChecker;
use crate::generation::dubins::Dubins;
use crate::generation::neighbours::Neighbours;
use crate::generation::tree::Tree;
use crate::geometry::{Point2, Pose2, Twist};
use crate::motion::step;
use crate::numerics::{atan2, ln, sin_cos};
use crate::occupancy::{Cell, OccupancyGrid};
use crate::random::{Rng, uniform};

crate::parameters! {
    /// Parameters of the tree.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct RrtStarParams {
        /// Samples drawn in one cycle: fixed, so that a slow machine grows the same tree.
        pub iterations: u32 [1.0, 10_000.0, "samples", "each looks at all nodes, and a cycle must end"] = 300,
        /// Samples drawn besides when there is no tree to go on with.
        pub warm_up: u32 [0.0, 10_000.0, "samples", "each looks at all nodes, and a cycle must end"] = 300,
        /// Most nodes a tree may have; beyond it the least promising leaves go first.
        pub max_nodes: u32 [1.0, 8000.0, "nodes", "the tree travels in every question to a generator"] = 800,
        /// Greatest length of one extension and of the neighbourhood, metres (RRT*'s eta).
        pub eta: f64 [0.05, 20.0, "m", "shorter extensions go nowhere, longer ones pass every doorway"] = 1.0,
        /// Turning radius of edges, metres: what the robot manages at 0.6 m/s with 1 rad/s.
        pub turning_radius: f64
            [0.05, 20.0, "m", "edges have arcs; a robot that turns on the spot is near the least"] = 0.6,
        /// Longest edge, metres. Below half a turning circle, so that no edge ever loops.
        pub max_edge: f64 [0.1, 20.0, "m", "an edge is checked for walls along its whole length"] = 1.5,
        /// RRT*'s gamma, metres: the neighbourhood is min(gamma sqrt(ln n / n), eta).
        pub gamma: f64 [0.01, 1000.0, "m", "below no node has neighbours, and eta limits it from above"] = 12.0,
        /// Share of samples taken on the shortest way to the goal.
        pub goal_bias: f64 [in Range::SHARE] = 0.05,
        /// A new node is refused when a node this near, metres, with nearly its heading exists already.
        pub spacing: f64 [0.01, 5.0, "m", "nodes in one place lead nowhere; nodes far apart miss doorways"] = 0.15,
        /// Room around the disc the robot can cover within the horizon that is sampled as well, metres.
        pub disc_margin: f64 [0.0, 50.0, "m", "farther than the horizon nothing that is sampled is used"] = 1.0,
    }
}

/// Where samples come from.
#[derive(Debug, Clone, Copy)]
pub struct SampleSpace<'a> {
    /// Only free cells of this grid are taken.
    pub grid: &'a OccupancyGrid,
    /// Centre of the disc.
    pub centre: Point2,
    /// Its radius, metres.
    pub radius: f64,
    /// Points of the shortest way to the goal, taken with the goal bias.
    pub way: &'a [Point2],
}

impl SampleSpace<'_> {
    /// One point of free space; `None` when twenty tries found none.
    fn draw(&self, goal_bias: f64, rng: &mut Rng) -> Option<Point2> {
        if !self.way.is_empty() && uniform(rng) < goal_bias {
            return Some(self.way[(uniform(rng) * self.way.len() as f64) as usize]);
        }
        (0..20).find_map(|_| {
            let r = self.radius * uniform(rng).sqrt();
            let (s, c) = sin_cos(std::f64::consts::TAU * uniform(rng));
            let p = Point2::new(self.centre.x + r * c, self.centre.y + r * s);
            (self.grid.at(p) == Cell::Free).then_some(p)
        })
    }
}

/// The shortest edge between two poses, if it is short enough and keeps clear of walls.
pub fn edge(
    from: Pose2,
    to: Pose2,
    bound: f64,
    radius: f64,
    checker: &CollisionChecker<'_>,
) -> Option<Dubins> {
    let path = Dubins::shortest_within(from, to, radius, bound)?;
    clear(&path, checker).then_some(path)
}

/// Whether an edge keeps clear of walls: strides as long as the clearance allows.
fn clear(path: &Dubins, checker: &CollisionChecker<'_>) -> bool {
    path.walk(CollisionChecker::WALL_SPACING, |pose| {
        let spare = checker.wall_spare(pose);
        (spare >= 0.0).then_some(spare.max(CollisionChecker::WALL_SPACING))
    })
}

/// A tree while it grows.
pub struct RrtStar<'a> {
    params: &'a RrtStarParams,
    checker: &'a CollisionChecker<'a>,
    tree: Tree,
    neighbours: Neighbours,
    /// Cosine and sine of every heading.
    direction: Vec<(f64, f64)>,
    children: Vec<Vec<u32>>,
}

impl<'a> RrtStar<'a> {
    /// Goes on with `tree`, which has a root.
    pub fn new(params: &'a RrtStarParams, checker: &'a CollisionChecker<'a>, tree: Tree) -> Self {
        let direction = tree.heading.iter().map(|&h| turned(h)).collect();
        let children = tree.children();
        let neighbours = Neighbours::of(&tree.x, &tree.y);
        Self { params, checker, tree, neighbours, direction, children }
    }

    /// The tree as a value, parents first.
    pub fn into_tree(self) -> Tree {
        self.tree.compact(|_| true)
    }

    /// Alg. 1's loop: draws `iterations` samples and adds a node for each that can be reached.
    /// `should_stop` is asked now and then, for emergencies only: it makes the tree depend on the machine.
    pub fn grow(
        &mut self,
        space: &SampleSpace<'_>,
        iterations: u32,
        rng: &mut Rng,
        should_stop: &dyn Fn() -> bool,
    ) {
        // The root has moved since the last cycle: what it now reaches directly hangs on it.
        let near = self.neighbours.within(self.tree.position(0), self.params.eta);
        self.rewire(0, &near);
        for k in 0..iterations {
            if self.tree.len() >= self.params.max_nodes as usize || (k % 32 == 31 && should_stop()) {
                break;
            }
            if let Some(sample) = space.draw(self.params.goal_bias, rng) {
                self.extend(sample);
            }
        }
    }

    /// Nearest, Steer, ObstacleFree, FindNearNeighbor, Parent, add, Rewire.
    fn extend(&mut self, sample: Point2) {
        let nearest = self.nearest(sample);
        let Some((pose, arc)) = self.steer(nearest, sample) else { return };
        if !self.checker.wall_clear(pose) {
            return;
        }
        let n = self.tree.len() as f64 + 1.0;
        let radius = (self.params.gamma * (ln(n) / n).sqrt()).min(self.params.eta);
        let near = self.neighbours.within(pose.position(), radius);
        if self.crowded(pose, &near) {
            return;
        }
        let Some((parent, cost)) = self.best_parent(pose, nearest, arc, &near) else { return };
        let new = self.tree.push(pose, cost, parent as u32);
        self.neighbours.push(pose.position());
        self.direction.push(turned(pose.heading));
        self.children.push(Vec::new());
        self.children[parent].push(new as u32);
        self.rewire(new, &near);
    }

    /// The node from which the sample is reached on the shortest way, estimated: the straight line, plus
    /// turning towards it, plus most of a circle if it lies inside a turning circle.
    fn nearest(&self, sample: Point2) -> usize {
        let radius = self.params.turning_radius;
        let mut best = (f64::INFINITY, 0);
        for node in 0..self.tree.len() {
            let (dx, dy) = (sample.x - self.tree.x[node], sample.y - self.tree.y[node]);
            let (c, s) = self.direction[node];
            let (ahead, left) = (dx * c + dy * s, dy * c - dx * s);
            let squared = dx * dx + dy * dy;
            let distance = squared.sqrt();
            let mut way = distance + radius * (1.0 - ahead / distance.max(1e-9));
            if squared < 2.0 * radius * left.abs() {
                way += 4.0 * radius;
            }
            if way < best.0 {
                best = (way, node);
            }
        }
        best.1
    }

    /// Whether a node so near and so directed exists that this one would add nothing.
    fn crowded(&self, pose: Pose2, near: &[(usize, f64)]) -> bool {
        let (c, s) = turned(pose.heading);
        near.iter().any(|&(node, d)| {
            let (nc, ns) = self.direction[node];
            d < self.params.spacing && c * nc + s * ns > 0.9
        })
    }

    /// The pose at most eta along the arc that leaves `from` tangentially towards the sample, no
    /// tighter than the turning radius, and the arc's length.
    fn steer(&self, from: usize, sample: Point2) -> Option<(Pose2, f64)> {
        let (c, s) = self.direction[from];
        let (dx, dy) = (sample.x - self.tree.x[from], sample.y - self.tree.y[from]);
        let (ahead, left) = (c * dx + s * dy, -s * dx + c * dy);
        let squared = ahead * ahead + left * left;
        if squared < self.params.spacing * self.params.spacing {
            return None;
        }
        let tightest = 1.0 / self.params.turning_radius;
        let curvature = 2.0 * left / squared;
        let angle = atan2(left, ahead);
        let (curvature, length) = if ahead > 0.0 && curvature.abs() <= tightest {
            let length = if curvature.abs() < 1e-6 { ahead } else { 2.0 * angle / curvature };
            (curvature, length)
        } else {
            let quarter = std::f64::consts::FRAC_PI_2;
            (tightest * left.signum(), angle.abs().min(quarter) * self.params.turning_radius)
        };
        let length = length.min(self.params.eta);
        Some((step(self.tree.pose(from), Twist { v: 1.0, omega: curvature }, length), length))
    }

    /// The parent that gives `pose` the least cost, cheapest possible first.
    fn best_parent(
        &self,
        pose: Pose2,
        nearest: usize,
        arc: f64,
        near: &[(usize, f64)],
    ) -> Option<(usize, f64)> {
        let cost = &self.tree.cost;
        let mut order: Vec<(f64, usize)> = near.iter().map(|&(n, d)| (cost[n] + d, n)).collect();
        if !order.iter().any(|&(_, n)| n == nearest) {
            order.push((cost[nearest] + self.tree.position(nearest).distance(pose.position()), nearest));
        }
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        // The arc steered along is one way to get here; anything else has to be shorter.
        let mut best = (usize::MAX, cost[nearest] + arc + 1e-9);
        for (least, node) in order {
            if least >= best.1 {
                break;
            }
            let bound = (best.1 - cost[node]).min(self.params.max_edge);
            if let Some(path) = self.edge(self.tree.pose(node), pose, bound) {
                best = (node, cost[node] + path.length());
            }
        }
        (best.0 != usize::MAX).then_some(best)
    }

    /// Hangs neighbours on `node` where that makes their way from the root shorter.
    fn rewire(&mut self, node: usize, near: &[(usize, f64)]) {
        for &(other, distance) in near {
            let gain = self.tree.cost[other] - self.tree.cost[node];
            if other == node || distance + 1e-6 >= gain {
                continue;
            }
            let bound = gain.min(self.params.max_edge);
            let Some(path) = self.edge(self.tree.pose(node), self.tree.pose(other), bound) else { continue };
            let delta = self.tree.cost[node] + path.length() - self.tree.cost[other];
            if delta >= -1e-6 {
                continue;
            }
            if let Some(old) = self.tree.parent(other) {
                self.children[old].retain(|&c| c as usize != other);
            }
            self.tree.parent[other] = node as u32;
            self.children[node].push(other as u32);
            self.shift_costs(other, delta);
        }
    }

    /// Adds `delta` to the cost of a node and everything below it.
    fn shift_costs(&mut self, node: usize, delta: f64) {
        let mut stack = vec![node as u32];
        while let Some(n) = stack.pop() {
            self.tree.cost[n as usize] += delta;
            stack.extend_from_slice(&self.children[n as usize]);
        }
    }

    fn edge(&self, from: Pose2, to: Pose2, bound: f64) -> Option<Dubins> {
        edge(from, to, bound, self.params.turning_radius, self.checker)
    }
}

fn turned(heading: f64) -> (f64, f64) {
    let (s, c) = sin_cos(heading);
    (c, s)
}
