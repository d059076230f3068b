//! What CPC predicts the localiser to know, against what it then knows.

use std::sync::Arc;

use curionav_localization::LocalizerParams;
use curionav_planning::candidates::CandidateSet;
use curionav_planning::evaluation::cpc::{CpcEvaluator, CpcParams, InformationField, InformationParams};
use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::motion::step;
use curionav_planning::sensor::LaserModel;
use curionav_planning::states::States;
use nalgebra::{Matrix3, Vector3};

use crate::course::untold;
use crate::simulation::{DT, NOISE, Robot, hall};

/// Ticks per state of a candidate, and states.
const TICKS: usize = 3;
const STEPS: usize = 13;
/// Ticks at rest before.
const SETTLING: usize = 40;

#[test]
fn what_is_predicted_along_a_way_is_what_the_localiser_then_knows() {
    let map = hall(20.0, 8.0, &[(9.0, 0.0, 9.4, 3.0)]);
    let field = InformationField::new(&map, &LaserModel::default(), &InformationParams::default());
    let evaluator = CpcEvaluator::new(Arc::new(field), NOISE, CpcParams::default());
    let sigma = Matrix3::from_diagonal(&Vector3::new(0.04, 0.04, 0.01));
    let cases = [
        ("at rest before a wall", Pose2::new(16.5, 4.0, 0.0), 0.0, 0.0),
        ("head-on at a wall", Pose2::new(13.0, 4.0, 0.0), 0.8, 0.0),
        ("along a wall", Pose2::new(2.0, 2.0, 0.0), 0.8, 0.0),
        ("in a bend", Pose2::new(12.0, 2.0, 0.3), 0.6, 0.3),
        ("slowly", Pose2::new(13.0, 4.0, 0.0), 0.3, 0.0),
    ];
    for (name, start, v, omega) in cases {
        let twist = Twist { v, omega };
        let mut states = States::default();
        for k in 1..=STEPS {
            states.push(step(start, twist, (k * TICKS) as f64 * DT), twist);
        }
        let set = CandidateSet::new(STEPS, TICKS as f64 * DT, vec![0], states).unwrap();
        let [mut predicted, mut believed, mut error] = [Matrix3::zeros(); 3];
        let runs = 40_u32;
        for seed in 1..=u64::from(runs) {
            let mut robot = Robot::new(&map, start, seed);
            let mut localizer = untold(&map, &LocalizerParams::default(), seed);
            let off = robot.drawn(&sigma);
            localizer.initialise(Pose2::new(start.x + off.x, start.y + off.y, start.heading + off.z), &sigma);
            // A filter that has just been started takes a whole scan at once.
            let mut estimate = robot.tick(&mut localizer);
            for _ in 0..SETTLING {
                robot.drive(Twist::default());
                estimate = robot.tick(&mut localizer);
            }
            predicted += evaluator.predicted(&estimate.covariance, &set, 0)[STEPS - 1] / f64::from(runs);
            for _ in 0..STEPS * TICKS {
                robot.drive(twist);
                estimate = robot.tick(&mut localizer);
            }
            let e = Vector3::new(
                estimate.pose.x - robot.truth.x,
                estimate.pose.y - robot.truth.y,
                estimate.pose.heading - robot.truth.heading,
            );
            believed += estimate.covariance / f64::from(runs);
            error += e * e.transpose() / f64::from(runs);
        }
        let sd = |m: &Matrix3<f64>| [0, 1, 2].map(|i| m[(i, i)].sqrt());
        println!(
            "{name}: predicted {:.3?}, believed {:.3?}, errors {:.3?}",
            sd(&predicted),
            sd(&believed),
            sd(&error)
        );
        for (predicted, believed) in sd(&predicted).into_iter().zip(sd(&believed)) {
            let ratio = predicted / believed;
            assert!((0.6..1.45).contains(&ratio), "{name}: {predicted} predicted, {believed} believed");
        }
    }
}
