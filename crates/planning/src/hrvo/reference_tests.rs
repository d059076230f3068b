//! Step by step beside trajectories computed with the library of the method's authors.
//!
//! `reference/*.csv` are outputs of an unmodified build of that library, snape/HRVO (Apache-2.0) at tag v1.0.1, commit
//! b140a7daf2195020d0d25e9ee2b928698b161e6d, on the scenes that their first lines give. Its main branch is wrong since
//! commit c98cebb: there a velocity obstacle points away from the neighbour.

use crate::geometry::Point2;
use crate::random::{rng, uniform};

use super::{Body, HrvoParams, Velocity, velocity};

/// Their library counts in 32-bit floats: seven digits, some lost in differences and near-parallel rays.
const ROUNDING: f64 = 1e-5;

struct Reference {
    dt: f64,
    pref_speed: f64,
    max_speed: f64,
    radius: f64,
    params: HrvoParams,
    goals: Vec<Point2>,
    /// Each step's (position, velocity) of every agent.
    rows: Vec<Vec<(Point2, Velocity)>>,
}

fn reference(text: &str) -> Reference {
    let value = |name: &str| -> f64 {
        let field = text.lines().next().unwrap().split(' ').find_map(|f| f.strip_prefix(name)).unwrap();
        field.strip_prefix('=').unwrap().parse().unwrap()
    };
    let goal = |line: &str| {
        let numbers: Vec<f64> =
            line.split_once("goal ").unwrap().1.split(' ').map(|n| n.parse().unwrap()).collect();
        Point2::new(numbers[0], numbers[1])
    };
    let goals: Vec<Point2> = text.lines().filter(|l| l.starts_with("# agent")).map(goal).collect();
    let states: Vec<(Point2, Velocity)> = text
        .lines()
        .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()))
        .map(|line| {
            let n: Vec<f64> = line.split(',').map(|n| n.parse().unwrap()).collect();
            (Point2::new(n[3], n[4]), Velocity::new(n[5], n[6]))
        })
        .collect();
    let params = HrvoParams {
        neighbor_distance: value("neighborDist"),
        max_neighbors: value("maxNeighbors") as u32,
        goal_radius: value("goalRadius"),
        ..HrvoParams::default()
    };
    Reference {
        dt: value("dt"),
        pref_speed: value("prefSpeed"),
        max_speed: value("maxSpeed"),
        radius: value("radius"),
        params,
        rows: states.chunks(goals.len()).map(<[_]>::to_vec).collect(),
        goals,
    }
}

impl Reference {
    fn preferred(&self, agent: usize, at: Point2) -> Velocity {
        let goal = self.goals[agent];
        let way = Velocity::new(goal.x - at.x, goal.y - at.y);
        if way.norm() < self.pref_speed * self.dt { way / self.dt } else { way.normalize() * self.pref_speed }
    }

    /// The state of `step` as `agent` saw it in the library, which refreshes preferred velocities one agent
    /// after the other; every number moved by up to `noise`.
    fn seen_by(&self, agent: usize, step: usize, noise: f64, seed: u64) -> Vec<Body> {
        let mut r = rng(seed, 0);
        let mut any = || noise * (2.0 * uniform(&mut r) - 1.0);
        let row = &self.rows[step];
        let body = |i: usize| {
            let (position, velocity) = row[i];
            let preferred = match step.checked_sub(usize::from(i > agent)) {
                Some(at) => self.preferred(i, self.rows[at][i].0),
                None => Velocity::zeros(),
            };
            Body { position, velocity, preferred, radius: self.radius, yields: true }
        };
        let mut bodies: Vec<Body> = (0..row.len()).map(body).collect();
        for body in &mut bodies {
            body.position = Point2::new(body.position.x + any(), body.position.y + any());
            body.velocity += Velocity::new(any(), any());
        }
        bodies
    }

    /// How far the velocity chosen from the state of `step` is from the library's, m/s.
    fn deviation(&self, agent: usize, step: usize, noise: f64, seed: u64) -> f64 {
        let bodies = self.seen_by(agent, step, noise, seed);
        let chosen = velocity(agent, &bodies, std::iter::empty(), self.max_speed, self.dt, &self.params);
        (chosen - self.rows[step + 1][agent].1).norm()
    }
}

/// Every velocity of every step is the library's to rounding. In the symmetric circle, where candidates tie
/// while all stand or have just set off, its rounding decides: there one must be found within it.
#[test]
fn each_step_is_that_of_the_authors_library() {
    let headon = include_str!("reference/headon_offset.csv");
    let circle = include_str!("reference/circle8.csv");
    for (scene, text, steps, ties) in [("head-on", headon, 60, 0), ("circle", circle, 65, 4)] {
        let reference = reference(text);
        assert_eq!(reference.rows.len(), steps + 1);
        let mut tied = 0;
        for step in 0..steps {
            for agent in 0..reference.goals.len() {
                if reference.deviation(agent, step, 0.0, 0) < ROUNDING {
                    continue;
                }
                let mut tries = (0..200).map(|seed| reference.deviation(agent, step, 1e-6, seed));
                let least = tries.by_ref().fold(f64::INFINITY, f64::min);
                assert!(least < 1e-3, "{scene} step {step} agent {agent}: off by {least} m/s");
                tied += 1;
            }
        }
        assert!(tied <= ties, "{scene}: {tied} ties");
    }
}
