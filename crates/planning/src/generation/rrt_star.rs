//! RRT* (Karaman and Frazzoli, 2011) over poses joined by Dubins paths: Alg. 1 with its slips repaired
//! (A22, A23), so that Parent and Rewire mean something (D14).
//!
//! Samples are points. A new node has the heading with which the shortest way from its parent arrives, so that ways
//! through it have no needless bends; its heading stays when it gets another parent.

use crate::parameters::Range;

use crate::collision::CollisionChecker;
use crate::generation::dubins::Dubins;
use crate::generation::neighbours::Neighbours;
use crate::generation::pace::Pace;
use crate::generation::pose_tree::PoseTree;
use crate::generation::tree::Tree;
use crate::geometry::{Direction, Facing, Point2, Pose2, Twist};
use crate::motion::step_facing;
use crate::numerics::{atan2, ln, sin_cos};
use crate::occupancy::OccupancyGrid;
use crate::random::{Rng, standard_normal, uniform};

crate::parameters! {
    /// Parameters of the tree.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct RrtStarParams {
        /// Samples drawn in one cycle: fixed, so that a slow machine grows the same tree.
        pub iterations: u32 [1.0, 10_000.0, "samples", "each is tried against the nodes around it, and a cycle must end"] = 300,
        /// Samples drawn besides when there is no tree to go on with.
        pub warm_up: u32 [0.0, 10_000.0, "samples", "each is tried against the nodes around it, and a cycle must end"] = 300,
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
        /// Share of samples around places where much is seen, drawn in proportion to what is (the baseline
        /// `risk-aware`).
        pub informative: f64 [in Range::SHARE] = 0.0,
        /// Standard deviation of such samples around their place, metres.
        pub informative_spread: f64 [0.0, 100.0, "m", "farther away other things are seen"] = 1.0,
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
    /// Places where much is seen, taken with their share.
    pub landmarks: &'a Landmarks,
}

/// Places with the worth of what is seen from them.
#[derive(Debug, Clone, Default)]
pub struct Landmarks {
    /// Sum of the worth of this place and all before it.
    places: Vec<(Point2, f64)>,
    total: f64,
}

impl Landmarks {
    /// Places with their worth; those of none are never drawn.
    pub fn new(places: impl Iterator<Item = (Point2, f64)>) -> Self {
        let mut landmarks = Self::default();
        for (place, worth) in places.filter(|(_, worth)| *worth > 0.0) {
            landmarks.total += worth;
            landmarks.places.push((place, landmarks.total));
        }
        landmarks
    }

    /// A point around a place that is drawn in proportion to its worth.
    fn draw(&self, spread: f64, rng: &mut Rng) -> Option<Point2> {
        let wanted = uniform(rng) * self.total;
        let (place, _) = self.places.get(self.places.partition_point(|(_, sum)| *sum <= wanted))?;
        let dx = standard_normal(rng);
        let dy = standard_normal(rng);
        Some(Point2::new(place.x + spread * dx, place.y + spread * dy))
    }
}

impl SampleSpace<'_> {
    /// One point of free space; `None` when twenty tries found none.
    fn draw(&self, params: &RrtStarParams, rng: &mut Rng) -> Option<Point2> {
        if !self.way.is_empty() && uniform(rng) < params.goal_bias {
            return Some(self.way[(uniform(rng) * self.way.len() as f64) as usize]);
        }
        if !self.landmarks.places.is_empty() && uniform(rng) < params.informative {
            let drawn = self.landmarks.draw(params.informative_spread, rng);
            return drawn.filter(|p| self.grid.is_drivable_at(*p));
        }
        (0..20).find_map(|_| {
            let r = self.radius * uniform(rng).sqrt();
            let (s, c) = sin_cos(std::f64::consts::TAU * uniform(rng));
            let p = Point2::new(self.centre.x + r * c, self.centre.y + r * s);
            self.grid.is_drivable_at(p).then_some(p)
        })
    }
}

/// Whether an edge keeps clear of walls: strides as long as the clearance allows. Around one of its ends, so many
/// metres are known to be free.
pub(super) fn clear(path: &Dubins, free: f64, checker: &CollisionChecker<'_>) -> bool {
    if path.length() <= free {
        return true;
    }
    path.walk(CollisionChecker::WALL_SPACING, |pose| {
        let spare = checker.wall_spare(pose);
        (spare >= 0.0).then_some(spare.max(CollisionChecker::WALL_SPACING))
    })
}

/// A tree while it grows.
pub struct RrtStar<'a> {
    params: &'a RrtStarParams,
    checker: &'a CollisionChecker<'a>,
    space: &'a SampleSpace<'a>,
    tree: PoseTree,
    neighbours: Neighbours,
    direction: Vec<Direction>,
    /// Radius of a disc around each node that is known to be free, metres.
    free: Vec<f64>,
    /// The newest child of each node, and the sibling that is next to it.
    first_child: Vec<u32>,
    next_sibling: Vec<u32>,
    /// Nodes near the one that is looked at, with their distances; kept for its memory, as are the next two.
    near: Vec<(f64, usize)>,
    order: Vec<(f64, usize)>,
    open: Vec<u32>,
}

impl<'a> RrtStar<'a> {
    /// Goes on with `tree`, which has a root, by samples from `space`.
    pub fn new(
        params: &'a RrtStarParams,
        checker: &'a CollisionChecker<'a>,
        space: &'a SampleSpace<'a>,
        tree: PoseTree,
    ) -> Self {
        let samples = (params.iterations + params.warm_up) as usize;
        let room = (tree.len() + samples).min(params.max_nodes as usize);
        let mut search = Self {
            params,
            checker,
            space,
            tree: PoseTree::with_room_for(room),
            neighbours: Neighbours::new(space.centre, space.radius, params.eta),
            direction: Vec::with_capacity(room),
            free: Vec::with_capacity(room),
            first_child: Vec::with_capacity(room),
            next_sibling: Vec::with_capacity(room),
            near: Vec::new(),
            order: Vec::new(),
            open: Vec::new(),
        };
        search.neighbours.reserve(room);
        for node in 0..tree.len() {
            search.add(tree.pose(node).into(), tree.cost[node], tree.parent[node]);
        }
        search
    }

    /// The tree, parents first.
    pub fn into_tree(self) -> PoseTree {
        self.tree.compact(|_| true)
    }

    fn add(&mut self, at: Facing, cost: f64, parent: u32) -> usize {
        let node = self.tree.push(at.pose, cost, parent);
        self.neighbours.push(at.pose.position());
        self.direction.push(at.direction);
        self.free.push(self.checker.wall_free(at.pose.position()));
        self.first_child.push(Tree::NO_PARENT);
        self.next_sibling.push(Tree::NO_PARENT);
        self.hang(node, parent);
        node
    }

    fn hang(&mut self, node: usize, parent: u32) {
        self.tree.parent[node] = parent;
        if let Some(first) = self.first_child.get_mut(parent as usize) {
            self.next_sibling[node] = std::mem::replace(first, node as u32);
        }
    }

    /// Takes a node off its parent.
    fn unhang(&mut self, node: usize) {
        let Some(parent) = self.tree.parent(node) else { return };
        let link = &mut self.first_child[parent];
        if *link as usize == node {
            *link = self.next_sibling[node];
            return;
        }
        let mut sibling = *link as usize;
        while self.next_sibling[sibling] as usize != node {
            sibling = self.next_sibling[sibling] as usize;
        }
        self.next_sibling[sibling] = self.next_sibling[node];
    }

    /// Alg. 1's loop: draws `iterations` samples and adds a node for each that can be reached.
    pub fn grow(&mut self, iterations: u32, rng: &mut Rng, pace: &Pace<'_>) {
        // The root has moved since the last cycle: what it now reaches directly hangs on it.
        self.neighbours.within(self.tree.position(0), self.params.eta, &mut self.near);
        self.rewire(0);
        for k in 0..iterations {
            if self.tree.len() >= self.params.max_nodes as usize
                || (k % 32 == 31 && pace.is_over(Pace::GROWTH))
            {
                break;
            }
            if let Some(sample) = self.space.draw(self.params, rng) {
                self.extend(sample);
            }
        }
    }

    /// Nearest, Steer, ObstacleFree, FindNearNeighbor, Parent, add, Rewire.
    fn extend(&mut self, sample: Point2) {
        let Some(nearest) = self.nearest(sample) else { return };
        let Some(steered) = self.steer(nearest, sample) else { return };
        if !self.checker.wall_clear(steered) {
            return;
        }
        let point = steered.position();
        let n = self.tree.len() as f64 + 1.0;
        let radius = (self.params.gamma * (ln(n) / n).sqrt()).min(self.params.eta);
        self.neighbours.within(point, radius, &mut self.near);
        let Some((parent, cost, at)) = self.best_parent(point, nearest) else { return };
        if self.is_crowded(&at) {
            return;
        }
        let new = self.add(at, cost, parent as u32);
        self.rewire(new);
    }

    fn facing(&self, node: usize) -> Facing {
        Facing { pose: self.tree.pose(node), direction: self.direction[node] }
    }

    /// The node from which the sample is reached on the shortest way, estimated: the straight line, plus
    /// turning towards it, plus most of a circle if it lies inside a turning circle.
    fn nearest(&self, sample: Point2) -> Option<usize> {
        let radius = self.params.turning_radius;
        self.neighbours.nearest(sample, |node, position| {
            let (ahead, left) = self.direction[node].ahead_and_left(position, sample);
            let squared = ahead * ahead + left * left;
            let distance = squared.sqrt();
            let circle = if squared < 2.0 * radius * left.abs() { 4.0 * radius } else { 0.0 };
            distance + radius * (1.0 - ahead / distance.max(1e-9)).max(0.0) + circle
        })
    }

    /// Whether a node so near and so directed exists that this one would add nothing.
    fn is_crowded(&self, at: &Facing) -> bool {
        let same = |node: usize| self.direction[node].dot(at.direction) > 0.9;
        self.near.iter().any(|&(distance, node)| distance < self.params.spacing && same(node))
    }

    /// The pose at most eta along the shortest way from node `from` to the sample; along a quarter of the turning
    /// circle that the sample lies in, if it lies in one.
    fn steer(&self, from: usize, sample: Point2) -> Option<Pose2> {
        let radius = self.params.turning_radius;
        let start = self.facing(from);
        if start.pose.position().distance(sample) < self.params.spacing {
            return None;
        }
        if let Some((path, _)) = Dubins::to_point(start, sample, radius) {
            return Some(path.at(path.length().min(self.params.eta)).pose);
        }
        let (ahead, left) = start.direction.ahead_and_left(start.pose.position(), sample);
        let angle = atan2(left, ahead).abs().min(std::f64::consts::FRAC_PI_2);
        let twist = Twist { v: 1.0, omega: left.signum() / radius };
        Some(step_facing(start, twist, (angle * radius).min(self.params.eta)).pose)
    }

    /// The parent that gives a point the least cost, with that cost and the pose with which its edge arrives; what may
    /// cost least is looked at first.
    fn best_parent(&mut self, point: Point2, nearest: usize) -> Option<(usize, f64, Facing)> {
        let cost = &self.tree.cost;
        self.order.clear();
        self.order.extend(self.near.iter().map(|&(d, node)| (cost[node] + d, node)));
        if !self.near.iter().any(|&(_, node)| node == nearest) {
            self.order.push((cost[nearest] + self.tree.position(nearest).distance(point), nearest));
        }
        let mut best: Option<(usize, f64, Facing)> = None;
        // Few are looked at, so to find each costs less than to sort all.
        let least = |order: &[(f64, usize)]| {
            let by_cost = |a: &(usize, &(f64, usize)), b: &(usize, &(f64, usize))| {
                a.1.0.total_cmp(&b.1.0).then(a.1.1.cmp(&b.1.1))
            };
            order.iter().enumerate().min_by(by_cost).map(|(index, _)| index)
        };
        while let Some(index) = least(&self.order) {
            let (least, node) = self.order.swap_remove(index);
            let bound = best.map_or(f64::INFINITY, |(_, cost, _)| cost);
            if least >= bound {
                break;
            }
            let way = Dubins::to_point(self.facing(node), point, self.params.turning_radius);
            let Some((path, end)) = way else { continue };
            let length = path.length();
            let is_better = length <= self.params.max_edge && cost[node] + length < bound;
            if is_better && clear(&path, self.free[node], self.checker) {
                best = Some((node, cost[node] + length, end));
            }
        }
        best
    }

    /// Hangs near nodes on `node` where that makes their way from the root shorter.
    fn rewire(&mut self, node: usize) {
        let near = std::mem::take(&mut self.near);
        for &(distance, other) in &near {
            let gain = self.tree.cost[other] - self.tree.cost[node];
            if other == node || distance + 1e-6 >= gain {
                continue;
            }
            let bound = gain.min(self.params.max_edge);
            let from = self.facing(node);
            let to = self.facing(other);
            let path = Dubins::shortest_within(from, to, self.params.turning_radius, bound);
            let Some(path) = path else { continue };
            let delta = self.tree.cost[node] + path.length() - self.tree.cost[other];
            if delta < -1e-6 && clear(&path, self.free[node].max(self.free[other]), self.checker) {
                self.unhang(other);
                self.hang(other, node as u32);
                self.shift_costs(other, delta);
            }
        }
        self.near = near;
    }

    /// Adds `delta` to the cost of a node and everything below it.
    fn shift_costs(&mut self, top: usize, delta: f64) {
        self.open.push(top as u32);
        while let Some(node) = self.open.pop() {
            self.tree.cost[node as usize] += delta;
            let mut child = self.first_child[node as usize];
            while child != Tree::NO_PARENT {
                self.open.push(child);
                child = self.next_sibling[child as usize];
            }
        }
    }
}
