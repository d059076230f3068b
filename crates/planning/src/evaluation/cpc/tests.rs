use nalgebra::Matrix3;

use super::reference_tests::linearise;
use super::*;
use crate::geometry::{Pose2, Twist};
use crate::motion;
use crate::numerics::sin_cos;
use crate::occupancy::{OccupancyGrid, StaticMap};
use crate::random::{Rng, rng, uniform};
use crate::scene::{Belief, People};
use crate::sensor::LaserModel;
use crate::states::States;

pub(super) const DT: f64 = 0.3;

/// 30 m x 20 m at 0.1 m; occupied where `solid` says so of a cell's centre.
pub(in crate::evaluation) fn map(origin: Pose2, solid: impl Fn(f64, f64) -> bool) -> StaticMap {
    let cells = (0..300 * 200)
        .map(|i| {
            let x = 0.1 * f64::from(i % 300) + 0.05;
            let y = 0.1 * f64::from(i / 300) + 0.05;
            if solid(x, y) { 100 } else { 0 }
        })
        .collect();
    StaticMap::new(OccupancyGrid::new(300, 200, 0.1, origin, cells).unwrap())
}

/// Walls of a corridor 4 m wide, a niche every 3 m.
pub(in crate::evaluation) fn corridor(x: f64, y: f64) -> bool {
    let depth = if x % 3.0 < 1.0 { 2.8 } else { 2.0 };
    (y - 10.0).abs() > depth
}

pub(super) fn evaluator(map: &StaticMap, laser: LaserModel) -> CpcEvaluator {
    let field = InformationField::new(map, &laser, &InformationParams::default());
    CpcEvaluator::new(Arc::new(field), OdometryNoise::default(), CpcParams::default())
}

pub(super) fn scene(covariance: Matrix3<f64>) -> Scene {
    let belief = Belief { pose: Pose2::default(), covariance, twist: Twist::default() };
    Scene { uncertain: true, ..Scene::new(belief, People::default()) }
}

pub(super) fn uncertain() -> Scene {
    scene(Matrix3::new(0.15, 0.02, 0.01, 0.02, 0.1, -0.01, 0.01, -0.01, 0.03))
}

/// Candidates from start poses and the twist at each step.
pub(in crate::evaluation) fn drives(
    starts: &[Pose2],
    steps: usize,
    mut twist: impl FnMut(usize, usize) -> Twist,
) -> CandidateSet {
    let mut states = States::default();
    for (i, start) in starts.iter().enumerate() {
        let mut pose = *start;
        for k in 0..steps {
            let twist = twist(i, k);
            pose = motion::step(pose, twist, DT);
            states.push(pose, twist);
        }
    }
    CandidateSet::new(steps, DT, (0..starts.len() as u32).collect(), states).unwrap()
}

fn straight(start: Pose2, v: f64) -> CandidateSet {
    drives(&[start], 20, |_, _| Twist { v, omega: 0.0 })
}

/// Random drives in and around the corridor.
pub(super) fn wandering(r: &mut Rng, count: usize, steps: usize) -> CandidateSet {
    let starts: Vec<Pose2> = (0..count)
        .map(|_| Pose2::new(3.0 + 20.0 * uniform(r), 8.5 + 3.0 * uniform(r), 7.0 * uniform(r) - 3.5))
        .collect();
    drives(&starts, steps, |_, _| Twist { v: uniform(r), omega: 2.0 * uniform(r) - 1.0 })
}

pub(super) fn zeta(evaluator: &CpcEvaluator, scene: &Scene, set: &CandidateSet) -> Vec<f64> {
    evaluator.evaluate(scene, set, &|| false).unwrap()
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
    let blind = lqr::tests::without_feedback();
    let [rich, poor, none] = evaluators
        .each_ref()
        .map(|e| e.evaluate_with(&*e.field, &blind, Level::new(), &scene, &set, &|| false).unwrap()[0]);
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
            let shard = set.pick(s * 43 / shards..(s + 1) * 43 / shards);
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
        let mut moved = States::default();
        for i in 0..set.len() {
            let states = set.states(i);
            for (pose, twist) in (0..states.len()).map(|k| states.at(k)) {
                moved.push(shift.compose(pose), twist);
            }
        }
        let there = CandidateSet::new(set.steps(), set.dt(), set.id().to_vec(), moved).unwrap();
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
    // At rest the scan is credited in the fourth step (1.2 s), with a fiftieth of what it is worth after motion. What
    // Sigma loses, Lambda takes over, and the controller removes it from the fifth step on.
    let none = CpcEvaluator {
        params: CpcParams { update_max_interval: 1e9, ..CpcParams::default() },
        ..evaluator.clone()
    };
    let rest =
        |e: &CpcEvaluator, n: usize| zeta(e, &uncertain(), &drives(&[start], n, |_, _| Twist::default()))[0];
    assert!((rest(&none, 12) / (12.0 * uncertain().belief.uncertainty()) - 1.0).abs() < 1e-12);
    assert!((rest(&evaluator, 4) / rest(&none, 4) - 1.0).abs() < 1e-12);
    // To a belief that knows much already it is worth far less than a whole one.
    let known = scene(Matrix3::identity() * 1e-3);
    let resting = |params: CpcParams| {
        let evaluator = CpcEvaluator { params, ..evaluator.clone() };
        zeta(&evaluator, &known, &drives(&[start], 5, |_, _| Twist::default()))[0]
    };
    let gained =
        |rest_credit: f64| resting(none.params) - resting(CpcParams { rest_credit, ..evaluator.params });
    assert!(gained(0.02) > 0.0 && gained(0.02) < 0.2 * gained(1.0), "{} of {}", gained(0.02), gained(1.0));
    // 0.15 m a step: every other step a scan is due, and so is half of the next; 0.3 m a step: one and a half a step.
    let credits = |travel: f64| -> Vec<f64> {
        let set = drives(&[start], 8, |_, _| Twist { v: travel / DT, omega: 0.0 });
        let worth = |evaluator: &CpcEvaluator| -> Vec<f64> {
            linearise(evaluator, &set).iter().map(|s| s.c.norm_squared()).collect()
        };
        let every = CpcParams { update_min_d: travel, ..evaluator.params };
        let one = worth(&CpcEvaluator { params: every, ..evaluator.clone() });
        worth(&evaluator).iter().zip(one).map(|(worth, one)| worth / one).collect()
    };
    let is_near =
        |found: Vec<f64>, expected: [f64; 8]| found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9);
    assert!(is_near(credits(0.15), [0.0, 1.5, 0.0, 1.5, 0.0, 1.5, 0.0, 1.5]));
    assert!(is_near(credits(0.3), [1.5; 8]));
}

#[test]
fn a_spent_budget_stops_it() {
    let evaluator = evaluator(&map(Pose2::default(), corridor), LaserModel::default());
    let set = straight(Pose2::new(5.0, 10.0, 0.0), 0.5);
    assert_eq!(evaluator.evaluate(&uncertain(), &set, &|| true), Err(Stopped));
    assert_eq!(evaluator.evaluate(&uncertain(), &CandidateSet::empty(13, DT), &|| false), Ok(vec![]));
}

#[test]
fn a_lost_robot_loses_little_more_by_driving_on_where_the_trace_saturates() {
    let map = map(Pose2::default(), |_, _| false);
    let field = Arc::new(InformationField::new(&map, &LaserModel::default(), &InformationParams::default()));
    let of = |saturation: f64| {
        let params = CpcParams { saturation, ..CpcParams::default() };
        CpcEvaluator::new(Arc::clone(&field), OdometryNoise::default(), params)
    };
    let start = Pose2::new(10.0, 10.0, 0.0);
    // What driving costs more than standing, of a robot whose position has the variance `trace` in all.
    let of_driving = |saturation: f64, trace: f64| {
        let scene = scene(Matrix3::from_diagonal(&nalgebra::vector![0.5 * trace, 0.5 * trace, 0.001]));
        let cost = |v| of(saturation).evaluate(&scene, &straight(start, v), &|| false).unwrap()[0];
        cost(1.0) - cost(0.0)
    };
    assert!(of_driving(0.2, 1.0) < 0.1 * of_driving(0.2, 0.05));
    assert!(of_driving(0.0, 1.0) > 0.9 * of_driving(0.0, 0.05));
    assert!(of_driving(0.2, 1.0) > 0.0);
}
