//! The fast propagation against the equations as they are printed, and those against simulation.

use nalgebra::{Matrix2x3, Matrix3, Matrix3x2, Vector3};

use super::tests::{corridor, drives, evaluator, map, scene, uncertain, wandering, zeta};
use super::*;
use crate::geometry::{Pose2, Twist};
use crate::numerics::sin_cos;
use crate::random::{rng, standard_normal};
use crate::sensor::LaserModel;

/// Matrices of one step in the map frame, written down as in the paper: A, B, K, M' and C with N' = I.
pub(super) struct LinearStep {
    a: Matrix3<f64>,
    b: Matrix3x2<f64>,
    k: Matrix2x3<f64>,
    m: Matrix3<f64>,
    pub(super) c: Matrix3<f64>,
}

pub(super) fn linearise(evaluator: &CpcEvaluator, set: &CandidateSet) -> Vec<LinearStep> {
    let gains = GainTable::new(set.dt());
    let mut moved = 0.0_f64;
    let mut waited = 0.0_f64;
    (0..set.steps())
        .map(|i| {
            let v = set.all_states().v[i];
            let omega = set.all_states().omega[i];
            let dt = set.dt();
            let (s, c) = sin_cos(set.all_states().heading[i] - 0.5 * omega * dt);
            let gain = lqr::tests::at(&gains, v);
            let k = Matrix2x3::new(gain.along, 0.0, 0.0, 0.0, gain.across, gain.heading)
                * Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
            let params = evaluator.params;
            moved += (v * dt / params.update_min_d).max(omega.abs() * dt / params.update_min_a);
            waited += dt / params.update_max_interval;
            let mut worth = 0.0;
            if moved.max(waited) >= 1.0 - 1e-9 {
                worth = moved.max(params.rest_credit);
                (moved, waited) = (0.0, (waited - 1.0).max(0.0));
            }
            let j = evaluator.field.at(set.all_states().pose(i));
            let eigen = j.symmetric_eigen();
            let root = Matrix3::from_diagonal(&eigen.eigenvalues.map(|l| l.max(0.0).sqrt()));
            LinearStep {
                a: Matrix3::new(1.0, 0.0, -v * dt * s, 0.0, 1.0, v * dt * c, 0.0, 0.0, 1.0),
                b: Matrix3x2::new(dt * c, 0.0, dt * s, 0.0, 0.0, dt),
                k,
                m: evaluator.noise.process_covariance(v * dt, omega * dt),
                c: root * eigen.eigenvectors.transpose() * worth.sqrt(),
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
    let mut sigma = sigma_0;
    let mut lambda = Matrix3::zeros();
    let mut zeta = 0.0;
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
                let slow = reference(&linearise(&evaluator, &set.pick([i])), sigma_0);
                assert!((fast / slow - 1.0).abs() < 1e-9, "seed {seed}, candidate {i}: {fast} vs {slow}");
            }
        }
    }
}

#[test]
fn zeta_is_the_spread_of_simulated_closed_loops() {
    let map = map(Pose2::default(), corridor);
    let evaluator = evaluator(&map, LaserModel::default());
    let steps = 24;
    let runs = 40_000;
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
    let root_0 = root(scene.belief.covariance);
    let seed = 11;
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
        let mut error = root_0 * draw();
        let mut estimate = Vector3::zeros();
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
