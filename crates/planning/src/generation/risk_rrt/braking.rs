//! What a path is worth: the costs of nodes, and of braking after them, eight at a time.

use super::growth::Growth;
use super::time_tree::Node;
use crate::geometry::Pose2;
use crate::lanes::*;

/// The cost of every node for the goal, with distances as shares of `root_distance` metres.
pub(super) fn node_costs(growth: &Growth<'_>, root_distance: f64) -> Vec<f64> {
    let mut costs = Vec::with_capacity(growth.tree.nodes.len());
    for nodes in growth.tree.nodes.chunks(LANES) {
        let found = dispatch!(growth.level, simd => costs_of(simd, growth, nodes, root_distance));
        costs.extend_from_slice(&found[..nodes.len()]);
    }
    costs
}

/// The costs of up to eight nodes.
#[inline(always)]
fn costs_of<S: Simd>(simd: S, growth: &Growth<'_>, nodes: &[Node], root_distance: f64) -> [f64; LANES] {
    let [mut x, mut y, mut heading, mut risk] = [[0.0; LANES]; 4];
    for (lane, n) in nodes.iter().enumerate() {
        (x[lane], y[lane], heading[lane], risk[lane]) = (n.pose.x, n.pose.y, n.pose.heading, n.risk);
    }
    let [x, y, heading, risk] = [x, y, heading, risk].map(|of| f64x8::load_array(simd, of));
    let goal = growth.ground.input.goal;
    growth.weighing().node_costs([x, y, heading], risk, root_distance, goal).into()
}

/// The least cost of a pose while braking from each of `nodes`, infinite if there is none; `None` if braking takes
/// longer than the candidates do, or leads into a wall.
pub(super) fn braking_costs(growth: &Growth<'_>, nodes: &[usize], root_distance: f64) -> Vec<Option<f64>> {
    let tree = &growth.tree;
    let input = growth.ground.input;
    let steps_passed = ((input.scene.stamp - tree.stamp) / tree.dt + 1e-6).floor();
    let latest = steps_passed as u32 + input.params.steps as u32;
    let mut costs = Vec::with_capacity(nodes.len());
    for nodes in nodes.chunks(LANES) {
        let braking = dispatch!(growth.level, simd => {
            let mut braking = Braking::new(simd, growth, nodes);
            braking.drive(root_distance, latest);
            (0..nodes.len()).map(|lane| (!braking.fails[lane]).then_some(braking.best[lane])).collect::<Vec<_>>()
        });
        costs.extend(braking);
    }
    costs
}

/// Eight robots that brake side by side.
struct Braking<'a, S: Simd> {
    growth: &'a Growth<'a>,
    x: f64x8<S>,
    y: f64x8<S>,
    heading: f64x8<S>,
    cos: f64x8<S>,
    sin: f64x8<S>,
    v: f64x8<S>,
    omega: f64x8<S>,
    risk: f64x8<S>,
    depth: [u32; LANES],
    /// Those that still move.
    moves: [bool; LANES],
    /// Those that do not stop in time or clear of walls.
    fails: [bool; LANES],
    /// Least cost so far.
    best: f64x8<S>,
}

impl<'a, S: Simd> Braking<'a, S> {
    #[inline(always)]
    fn new(simd: S, growth: &'a Growth<'a>, nodes: &[usize]) -> Self {
        let at = |lane: usize| &growth.tree.nodes[nodes[lane.min(nodes.len() - 1)]];
        let [mut x, mut y, mut heading, mut cos, mut sin, mut v, mut omega, mut risk] = [[0.0; LANES]; 8];
        let mut depth = [0; LANES];
        let mut moves = [false; LANES];
        for lane in 0..LANES {
            let Node { pose, direction, twist, .. } = *at(lane);
            (x[lane], y[lane], heading[lane]) = (pose.x, pose.y, pose.heading);
            (cos[lane], sin[lane]) = (direction.cos, direction.sin);
            (v[lane], omega[lane]) = (twist.v, twist.omega);
            (risk[lane], depth[lane]) = (at(lane).risk, at(lane).depth);
            moves[lane] = lane < nodes.len() && (twist.v != 0.0 || twist.omega != 0.0);
        }
        let load = |of| f64x8::load_array(simd, of);
        Self {
            growth,
            x: load(x),
            y: load(y),
            heading: load(heading),
            cos: load(cos),
            sin: load(sin),
            v: load(v),
            omega: load(omega),
            risk: load(risk),
            depth,
            moves,
            fails: [false; LANES],
            best: f64x8::splat(simd, f64::INFINITY),
        }
    }

    #[inline(always)]
    fn drive(&mut self, root_distance: f64, latest: u32) {
        let simd = self.x.simd;
        let ground = self.growth.ground;
        let weighing = self.growth.weighing();
        let mut free: [_; LANES] = std::array::from_fn(|lane| (self.pose(lane).position(), -1.0));
        while self.moves.contains(&true) {
            let from: [Pose2; LANES] = std::array::from_fn(|lane| self.pose(lane));
            self.brake();
            self.step();
            for lane in 0..LANES {
                if !self.moves[lane] {
                    continue;
                }
                self.depth[lane] += 1;
                let depth = self.depth[lane];
                let next = self.pose(lane);
                if depth > latest || !ground.checker.continue_wall_clear(&mut free[lane], from[lane], next) {
                    (self.moves[lane], self.fails[lane]) = (false, true);
                    continue;
                }
                if let Some(people) = &self.growth.people {
                    let here = people.at_with(simd, depth as usize, next.position());
                    self.risk[lane] = self.risk[lane].max(here);
                }
            }
            let pose = [self.x, self.y, self.heading];
            let costs = weighing.node_costs(pose, self.risk, root_distance, ground.input.goal);
            for lane in 0..LANES {
                if self.moves[lane] {
                    self.best[lane] = self.best[lane].min(costs[lane]);
                    self.moves[lane] = self.v[lane] != 0.0 || self.omega[lane] != 0.0;
                }
            }
        }
    }

    #[inline(always)]
    fn pose(&self, lane: usize) -> Pose2 {
        Pose2::new(self.x[lane], self.y[lane], self.heading[lane])
    }

    /// As [`super::control_lattice::ControlLattice::braked`].
    #[inline(always)]
    fn brake(&mut self) {
        let lattice = &self.growth.ground.lattice;
        let zero = f64x8::splat(self.x.simd, 0.0);
        let v = greater(self.v - lattice.robot.a_max * lattice.dt, zero);
        let wanted = self.v.simd_gt(0.0).select(self.omega * v / self.v, zero);
        let change = lattice.robot.alpha_max * lattice.dt;
        let low = self.omega - change;
        let high = self.omega + change;
        let least = wanted.simd_lt(low).select(low, wanted);
        (self.v, self.omega) = (v, least.simd_gt(high).select(high, least));
    }

    /// As [`crate::motion::step`].
    #[inline(always)]
    fn step(&mut self) {
        let dt = self.growth.tree.dt;
        let turn = self.omega * dt;
        let half = turn * 0.5;
        let (sinc, bend) = library::sinc_cos(half);
        let chord = self.v * dt * sinc;
        let sin = half * sinc;
        self.x += chord * (self.cos * bend - self.sin * sin);
        self.y += chord * (self.sin * bend + self.cos * sin);
        self.heading = library::wrap_angle(self.heading + turn);
        (self.sin, self.cos) = library::sin_cos(self.heading);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generation::risk_rrt::growth::Ground;
    use crate::generation::tests::furnished;
    use crate::generation::{GenerationInput, GeneratorPart};
    use crate::geometry::{Point2, Twist};
    use crate::lanes::tests::levels;
    use crate::motion::{RobotModel, step};
    use crate::occupancy::GeodesicField;
    use crate::profile::Profile;
    use crate::random::{rng, uniform};
    use crate::scene::{Belief, People, Scene};

    /// [`braking_costs`] of one node, one number at a time.
    fn one_by_one(growth: &Growth<'_>, node: usize, root_distance: f64, latest: u32) -> Option<f64> {
        let ground = growth.ground;
        let Node { mut pose, mut twist, mut depth, mut risk, .. } = growth.tree.nodes[node];
        let mut best = f64::INFINITY;
        while twist != Twist::default() {
            twist = ground.lattice.braked(twist);
            depth += 1;
            let next = step(pose, twist, growth.tree.dt);
            if depth > latest || !ground.checker.segment_wall_clear(pose, next) {
                return None;
            }
            let here = growth.people.as_ref().map(|people| people.at(depth as usize, next.position()));
            risk = risk.max(here.unwrap_or_default());
            best = best.min(growth.weighing().node_cost(next, risk, root_distance, ground.input.goal));
            pose = next;
        }
        Some(best)
    }

    #[test]
    fn costs_are_those_of_one_node_after_the_other_bit_for_bit() {
        let map = furnished();
        let goal = Point2::new(14.0, 26.0);
        let geodesic = GeodesicField::new(&map, goal, 0.45);
        let mut params: GeneratorPart = Profile::default().generator_part();
        params.steps = 16;
        let quick = RobotModel { omega_max: 12.0, alpha_max: 30.0, ..RobotModel::default() };
        let mut stopped = 0;
        let mut failed = 0;
        let robots = [RobotModel::default(), quick.clone(), RobotModel::default(), quick.clone(), quick];
        for (seed, robot) in (1..).zip(robots) {
            let mut r = rng(seed, 0);
            let mut draw = |least: f64, most: f64| least + (most - least) * uniform(&mut r);
            let mut people = People { radius: 0.25, ..People::default() };
            for id in 0..20 * (seed as u32 % 2) {
                people.id.push(id);
                [&mut people.x, &mut people.y].into_iter().for_each(|of| of.push(draw(6.0, 20.0)));
                [&mut people.vx, &mut people.vy].into_iter().for_each(|of| of.push(draw(-0.7, 0.7)));
            }
            let covariance = nalgebra::Matrix3::identity() * 0.0025;
            let pose = Pose2::new(12.0, 11.0, 1.2);
            let twist = Twist { v: 0.6, omega: 0.0 };
            let belief = Belief { pose, covariance, twist };
            let scene = Scene::new(belief, people);
            let params = &params;
            let previous = None;
            let input = GenerationInput {
                params,
                map: &map,
                goal,
                geodesic: &geodesic,
                information: None,
                robot: &robot,
                scene: &scene,
                previous,
                seed,
            };
            let ground = Ground::new(&input);
            let mut growth = ground.growth(None);
            while growth.tree.nodes.len() < 700 {
                let target = Point2::new(draw(8.0, 16.0), draw(8.0, 16.0));
                growth.extend(target).unwrap();
            }
            let nodes = (0..700).collect::<Vec<_>>();
            let latest = params.steps as u32;
            let expected: Vec<_> = nodes.iter().map(|&n| one_by_one(&growth, n, 15.0, latest)).collect();
            stopped += expected.iter().flatten().count();
            failed += expected.iter().filter(|cost| cost.is_none()).count();
            let bits = |costs: &[Option<f64>]| costs.iter().map(|c| c.map(f64::to_bits)).collect::<Vec<_>>();
            for level in levels() {
                growth.level = level;
                let found = braking_costs(&growth, &nodes, 15.0);
                assert_eq!(bits(&found), bits(&expected), "seed {seed}, {level:?}");
                for (n, cost) in growth.tree.nodes.iter().zip(node_costs(&growth, 15.0)) {
                    let alone = growth.weighing().node_cost(n.pose, n.risk, 15.0, goal);
                    assert_eq!(cost.to_bits(), alone.to_bits(), "seed {seed}, {level:?}");
                }
            }
        }
        assert!(stopped > 500 && failed > 20, "both kinds: {stopped}, {failed}");
    }
}
