use nalgebra::{Matrix2x3, Matrix3, Matrix3x2, Vector3};

use super::*;
use crate::geometry::{Pose2, Twist, wrap_angle};
use crate::motion;
use crate::occupancy::{OccupancyGrid, StaticMap};
use crate::random::{Rng, rng, standard_normal, uniform};
use crate::scene::{Belief, People};
use crate::sensor::LaserModel;

const DT: f64 = 0.3;

/// 30 m x 20 m at 0.1 m; occupied where `solid` says so of a cell's centre.
fn map(origin: Pose2, solid: impl Fn(f64, f64) -> bool) -> StaticMap {
    let cells = (0..300 * 200)
        .map(|i| {
            let (x, y) = (0.1 * f64::from(i % 300) + 0.05, 0.1 * f64::from(i / 300) + 0.05);
            if solid(x, y) { 100 } else { 0 }
        })
        .collect();
    StaticMap::new(OccupancyGrid::new(300, 200, 0.1, origin, cells).unwrap())
}

/// Walls of a corridor 4 m wide, a niche every 3 m.
fn corridor(x: f64, y: f64) -> bool {
    let depth = if x % 3.0 < 1.0 { 2.8 } else { 2.0 };
    (y - 10.0).abs() > depth
}

fn evaluator(map: &StaticMap, laser: LaserModel) -> CpcEvaluator {
    let field = InformationField::new(map, &laser, &InformationParams::default());
    CpcEvaluator::new(Arc::new(field), OdometryNoise::default(), CpcParams::default())
}

fn scene(covariance: Matrix3<f64>) -> Scene {
    let belief = Belief { pose: Pose2::default(), covariance, twist: Twist::default() };
    Scene { tick: 0, stamp: 0.0, belief, people: People::default(), uncertain: true }
}

fn uncertain() -> Scene {
    scene(Matrix3::new(0.15, 0.02, 0.01, 0.02, 0.1, -0.01, 0.01, -0.01, 0.03))
}

/// Candidates from start poses and the twist at each step.
fn drives(starts: &[Pose2], steps: usize, mut twist: impl FnMut(usize, usize) -> Twist) -> CandidateSet {
    let (mut x, mut y, mut heading, mut v, mut omega) = (vec![], vec![], vec![], vec![], vec![]);
    for (i, start) in starts.iter().enumerate() {
        let mut pose = *start;
        for k in 0..steps {
            let twist = twist(i, k);
            pose = motion::step(pose, twist, DT);
            x.push(pose.x);
            y.push(pose.y);
            heading.push(pose.heading);
            v.push(twist.v);
            omega.push(twist.omega);
        }
    }
    CandidateSet::new(steps, DT, (0..starts.len() as u32).collect(), x, y, heading, v, omega).unwrap()
}

fn straight(start: Pose2, v: f64) -> CandidateSet {
    drives(&[start], 20, |_, _| Twist { v, omega: 0.0 })
}

/// Random drives in and around the corridor.
fn wandering(r: &mut Rng, count: usize, steps: usize) -> CandidateSet {
    let starts: Vec<Pose2> = (0..count)
        .map(|_| Pose2::new(3.0 + 20.0 * uniform(r), 8.5 + 3.0 * uniform(r), 7.0 * uniform(r) - 3.5))
        .collect();
    drives(&starts, steps, |_, _| Twist { v: uniform(r), omega: 2.0 * uniform(r) - 1.0 })
}

fn zeta(evaluator: &CpcEvaluator, scene: &Scene, set: &CandidateSet) -> Vec<f64> {
    evaluator.evaluate(scene, set, &|| false).unwrap()
}

/// Matrices of one step in the map frame, written down as in the paper: A, B, K, M' and C with N' = I.
struct LinearStep {
    a: Matrix3<f64>,
    b: Matrix3x2<f64>,
    k: Matrix2x3<f64>,
    m: Matrix3<f64>,
    c: Matrix3<f64>,
}

fn linearise(evaluator: &CpcEvaluator, set: &CandidateSet) -> Vec<LinearStep> {
    let gains = GainTable::new(set.dt());
    let mut due = 0.0;
    (0..set.steps())
        .map(|i| {
            let (v, omega, dt) = (set.v()[i], set.omega()[i], set.dt());
            let (s, c) = sin_cos(set.heading()[i] - 0.5 * omega * dt);
            let gain = gains.at(v);
            let k = Matrix2x3::new(gain.along, 0.0, 0.0, 0.0, gain.across, gain.heading)
                * Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
            due += (v * dt / evaluator.params.update_min_d)
                .max(omega.abs() * dt / evaluator.params.update_min_a)
                .max(dt / evaluator.params.update_max_interval);
            let seen = due >= 1.0 - 1e-9;
            due = if seen { (due - 1.0).min(1.0) } else { due };
            let j = evaluator.field.at(Pose2::new(set.x()[i], set.y()[i], set.heading()[i]));
            let eigen = j.symmetric_eigen();
            let root = Matrix3::from_diagonal(&eigen.eigenvalues.map(|l| l.max(0.0).sqrt()));
            LinearStep {
                a: Matrix3::new(1.0, 0.0, -v * dt * s, 0.0, 1.0, v * dt * c, 0.0, 0.0, 1.0),
                b: Matrix3x2::new(dt * c, 0.0, dt * s, 0.0, 0.0, dt),
                k,
                m: evaluator.noise.process_covariance(v * dt, omega * dt),
                c: root * eigen.eigenvectors.transpose() * if seen { 1.0 } else { 0.0 },
            }
        })
        .collect()
}

/// Kalman gain of eq. 10 and 11 with N' = I.
fn kalman_gain(step: &LinearStep, predicted: &Matrix3<f64>) -> Matrix3<f64> {
    let innovation = step.c * predicted * step.c.transpose() + Matrix3::identity();
    predicted * step.c.transpose() * innovation.try_inverse().unwrap()
}

/// Eqs. 10, 11, 14 and 15 as they are printed.
fn reference(steps: &[LinearStep], sigma_0: Matrix3<f64>) -> f64 {
    let (mut sigma, mut lambda, mut zeta) = (sigma_0, Matrix3::zeros(), 0.0);
    for step in steps {
        let predicted = step.a * sigma * step.a.transpose() + step.m;
        let seen = kalman_gain(step, &predicted) * step.c * predicted;
        sigma = predicted - seen;
        let closed = step.a - step.b * step.k;
        lambda = closed * lambda * closed.transpose() + seen;
        zeta += (lambda + sigma).trace();
    }
    zeta
}

#[test]
fn equals_the_equations_as_printed() {
    for (seed, lever) in [(1, Pose2::default()), (2, Pose2::new(0.25, -0.1, 0.3))] {
        let map = map(Pose2::new(-1.0, 2.0, 0.0), corridor);
        let evaluator = evaluator(&map, LaserModel { robot_from_laser: lever, ..LaserModel::default() });
        let set = wandering(&mut rng(seed, 0), 61, 40);
        for sigma_0 in [uncertain().belief.covariance, Matrix3::zeros()] {
            let fast = zeta(&evaluator, &scene(sigma_0), &set);
            for (i, &fast) in fast.iter().enumerate() {
                let slow = reference(&linearise(&evaluator, &set.slice(i..i + 1)), sigma_0);
                assert!((fast / slow - 1.0).abs() < 1e-9, "seed {seed}, candidate {i}: {fast} vs {slow}");
            }
        }
    }
}

#[test]
fn zeta_is_the_spread_of_simulated_closed_loops() {
    let map = map(Pose2::default(), corridor);
    let evaluator = evaluator(&map, LaserModel::default());
    let (steps, runs) = (24, 40_000);
    // A slalom along the corridor, in view of its walls.
    let slalom = |n: usize| {
        drives(&[Pose2::new(4.0, 9.2, 0.5)], n, |_, k| Twist {
            v: 0.6 + 0.3 * f64::from(k as u32 % 3),
            omega: if k % 8 < 4 { -0.7 } else { 0.7 },
        })
    };
    let scene = uncertain();
    let model = linearise(&evaluator, &slalom(steps));
    let root = |m: Matrix3<f64>| m.cholesky().unwrap().l();
    let (root_0, seed) = (root(scene.belief.covariance), 11);
    let mut r = rng(seed, 0);
    let mut draw = || Vector3::from_fn(|_, _| standard_normal(&mut r));
    let mut squares = vec![0.0; steps];
    // The filter's gains do not depend on what is drawn.
    let mut sigma = scene.belief.covariance;
    let gains: Vec<Matrix3<f64>> = model
        .iter()
        .map(|step| {
            let predicted = step.a * sigma * step.a.transpose() + step.m;
            let gain = kalman_gain(step, &predicted);
            sigma = predicted - gain * step.c * predicted;
            gain
        })
        .collect();
    for _ in 0..runs {
        let (mut error, mut estimate) = (root_0 * draw(), Vector3::zeros());
        for (k, (step, gain)) in model.iter().zip(&gains).enumerate() {
            let control = -(step.b * step.k * estimate);
            error = step.a * error + control + root(step.m) * draw();
            estimate = step.a * estimate + control;
            let measured = step.c * error + draw();
            estimate += gain * (measured - step.c * estimate);
            squares[k] += error.norm_squared() / f64::from(runs);
        }
    }
    let mut before = 0.0;
    for (k, sampled) in squares.iter().enumerate() {
        let zeta = zeta(&evaluator, &scene, &slalom(k + 1))[0];
        let predicted = zeta - before;
        before = zeta;
        let off = sampled / predicted - 1.0;
        assert!(off.abs() < 0.03, "seed {seed}, step {k}: sampled {sampled}, predicted {predicted}");
    }
}

#[test]
fn zeta_falls_with_landmarks_and_only_through_feedback() {
    let rich = map(Pose2::default(), corridor);
    // one straight wall, on one side
    let poor = map(Pose2::default(), |_, y| y > 14.0);
    let none = map(Pose2::default(), |_, _| false);
    let set = straight(Pose2::new(5.0, 10.0, 0.0), 0.9);
    let scene = uncertain();
    let evaluators = [rich, poor, none].map(|map| evaluator(&map, LaserModel::default()));
    let [rich, poor, none] = evaluators.each_ref().map(|e| zeta(e, &scene, &set)[0]);
    assert!(rich < 0.95 * poor && poor < 0.95 * none, "rich {rich}, poor {poor}, none {none}");

    // With K = 0, Lambda + Sigma obeys P <- A P A^T + M', in which there is no C.
    let blind = GainTable::without_feedback();
    let [rich, poor, none] =
        evaluators.each_ref().map(|e| e.evaluate_with(&blind, &scene, &set, &|| false).unwrap()[0]);
    assert!((rich / none - 1.0).abs() < 1e-12 && (poor / none - 1.0).abs() < 1e-12, "{rich} {poor} {none}");
}

#[test]
fn zeta_is_lower_near_landmarks() {
    // posts along y = 4; two parallel drives, one 2 m from them and one out of range
    let map = map(Pose2::default(), |x, y| (y - 4.0).abs() < 0.15 && x % 1.5 < 0.3);
    let set = drives(&[Pose2::new(5.0, 6.0, 0.0), Pose2::new(5.0, 12.0, 0.0)], 20, |_, _| Twist {
        v: 0.9,
        omega: 0.0,
    });
    let costs = zeta(&evaluator(&map, LaserModel::default()), &uncertain(), &set);
    assert!(costs[0] < 0.9 * costs[1], "{costs:?}");
}

#[test]
fn sharding_changes_no_cost() {
    let evaluator = evaluator(&map(Pose2::default(), corridor), LaserModel::default());
    let set = wandering(&mut rng(3, 0), 43, 13);
    let whole = zeta(&evaluator, &uncertain(), &set);
    for shards in 1..=43 {
        let mut pieces = Vec::new();
        for s in 0..shards {
            let shard = set.slice(s * 43 / shards..(s + 1) * 43 / shards);
            pieces.extend(zeta(&evaluator, &uncertain(), &shard));
        }
        let bits = |costs: &[f64]| costs.iter().map(|c| c.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&pieces), bits(&whole), "{shards} shards");
    }
}

#[test]
fn moving_the_world_moves_nothing() {
    let set = wandering(&mut rng(4, 0), 30, 25);
    let here = zeta(&evaluator(&map(Pose2::default(), corridor), LaserModel::default()), &uncertain(), &set);
    for shift in [Pose2::new(-12.3, 40.0, 0.0), Pose2::new(3.0, -7.0, 1.1), Pose2::new(0.5, 0.0, -2.8)] {
        let pose = |i: usize| shift.compose(Pose2::new(set.x()[i], set.y()[i], set.heading()[i]));
        let moved: Vec<Pose2> = (0..set.x().len()).map(pose).collect();
        let there = CandidateSet::new(
            set.steps(),
            set.dt(),
            set.id().to_vec(),
            moved.iter().map(|p| p.x).collect(),
            moved.iter().map(|p| p.y).collect(),
            moved.iter().map(|p| wrap_angle(p.heading)).collect(),
            set.v().to_vec(),
            set.omega().to_vec(),
        )
        .unwrap();
        let (s, c) = sin_cos(shift.heading);
        let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        let scene = scene(turn * uncertain().belief.covariance * turn.transpose());
        let costs = zeta(&evaluator(&map(shift, corridor), LaserModel::default()), &scene, &there);
        for (a, b) in here.iter().zip(&costs) {
            assert!((a / b - 1.0).abs() < 1e-6, "{a} vs {b} after {shift:?}");
        }
    }
}

#[test]
fn an_observation_is_credited_only_where_the_localiser_would_update() {
    let map = map(Pose2::default(), corridor);
    let evaluator = evaluator(&map, LaserModel::default());
    let start = Pose2::new(6.0, 10.0, 0.0);
    // At rest the scan is credited in the fourth step (1.2 s). What Sigma loses, Lambda takes over, and
    // the controller removes it from the fifth step on.
    let none = CpcEvaluator {
        params: CpcParams { update_max_interval: 1e9, ..CpcParams::default() },
        ..evaluator.clone()
    };
    let rest =
        |e: &CpcEvaluator, n: usize| zeta(e, &uncertain(), &drives(&[start], n, |_, _| Twist::default()))[0];
    assert!((rest(&none, 12) / (12.0 * uncertain().belief.uncertainty()) - 1.0).abs() < 1e-12);
    assert!((rest(&evaluator, 4) / rest(&none, 4) - 1.0).abs() < 1e-12);
    assert!(rest(&evaluator, 5) < 0.99 * rest(&none, 5));
    // 0.15 m a step: a scan every 0.2 m is three in four steps; 0.3 m a step: one a step.
    let credits = |travel: f64| -> Vec<bool> {
        let set = drives(&[start], 8, |_, _| Twist { v: travel / DT, omega: 0.0 });
        linearise(&evaluator, &set).iter().map(|s| s.c != Matrix3::zeros()).collect()
    };
    assert_eq!(credits(0.15), [false, true, true, true, false, true, true, true]);
    assert_eq!(credits(0.3), [true; 8]);
}

#[test]
fn a_spent_budget_stops_it() {
    let evaluator = evaluator(&map(Pose2::default(), corridor), LaserModel::default());
    let set = straight(Pose2::new(5.0, 10.0, 0.0), 0.5);
    assert_eq!(evaluator.evaluate(&uncertain(), &set, &|| true), Err(Stopped));
    assert_eq!(evaluator.evaluate(&uncertain(), &CandidateSet::empty(13, DT), &|| false), Ok(vec![]));
}
