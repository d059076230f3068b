//! Times the evaluators on the batch of the budgets: 2000 candidates of 56 states on a map of 350 000
//! cells, one core. Run with `cargo bench -p curionav-planning --bench evaluation`.

#![expect(clippy::print_stdout, reason = "a benchmark prints its figures")]

use std::sync::Arc;
use std::time::Instant;

use curionav_planning::candidates::CandidateSet;
use curionav_planning::evaluation::Evaluator;
use curionav_planning::evaluation::cpc::{CpcEvaluator, CpcParams, InformationField, InformationParams};
use curionav_planning::evaluation::distance::DistanceEvaluator;
use curionav_planning::evaluation::hccdm::{HccdmEvaluator, HccdmParams};
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::motion::{OdometryNoise, step};
use curionav_planning::occupancy::{GeodesicField, GridError, OccupancyGrid, StaticMap};
use curionav_planning::random::{rng, uniform};
use curionav_planning::scene::{Belief, People, Scene};
use curionav_planning::sensor::LaserModel;
use curionav_planning::states::{States, StatesError};

const CANDIDATES: usize = 2000;
const STATES: usize = 56;
const DT: f64 = 0.1;
const SIDE: usize = 592;
const RESOLUTION: f64 = 0.054;
const PEOPLE: usize = 40;
const REPEATS: usize = 31;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let map = StaticMap::new(map()?);
    let (scene, candidates) = (scene(), candidates()?);

    let started = Instant::now();
    let field = Arc::new(InformationField::new(&map, &LaserModel::default(), &InformationParams::default()));
    let built_ms = 1e3 * started.elapsed().as_secs_f64();
    println!("information field   {built_ms:8.1} ms to build");
    let started = Instant::now();
    let geodesic = Arc::new(GeodesicField::new(&map, Point2::new(28.0, 28.0), 0.3));
    println!("geodesic field      {:8.1} ms to build", 1e3 * started.elapsed().as_secs_f64());

    // One line per term.
    let evaluators: [(&str, Box<dyn Evaluator>); 3] = [
        ("cnc", Box::new(HccdmEvaluator { params: HccdmParams::default() })),
        ("cpc", Box::new(CpcEvaluator::new(field, OdometryNoise::default(), CpcParams::default()))),
        ("distance", Box::new(DistanceEvaluator::Geodesic(geodesic))),
    ];
    println!("{CANDIDATES} candidates x {STATES} states, {PEOPLE} people, median and least of {REPEATS}:");
    let mut total = 0.0;
    for (term, evaluator) in &evaluators {
        let (median, least, checksum) = time(evaluator.as_ref(), &scene, &candidates)?;
        println!("{:<18} {median:8.2} ms  {least:8.2} ms  (sum of costs {checksum:.6})", term);
        total += median;
    }
    println!("{:<18} {total:8.2} ms", "together");
    Ok(())
}

/// Median and least wall time of one evaluation, milliseconds, and the sum of its costs.
fn time(
    evaluator: &dyn Evaluator,
    scene: &Scene,
    candidates: &CandidateSet,
) -> Result<(f64, f64, f64), Box<dyn std::error::Error>> {
    let mut checksum = 0.0;
    let mut wall_ms = Vec::with_capacity(REPEATS);
    for _ in 0..REPEATS {
        let started = Instant::now();
        let costs = evaluator.evaluate(scene, candidates, &|| false)?;
        wall_ms.push(1e3 * started.elapsed().as_secs_f64());
        checksum = costs.iter().sum();
    }
    wall_ms.sort_by(f64::total_cmp);
    Ok((wall_ms[REPEATS / 2], wall_ms[0], checksum))
}

/// 32 m x 32 m of outer walls, 90 boxes of 0.5 to 2.5 m and nothing within 3 m of the robot.
fn map() -> Result<OccupancyGrid, GridError> {
    let mut cells = vec![0_i8; SIDE * SIDE];
    for i in 0..SIDE {
        for cell in [i, (SIDE - 1) * SIDE + i, i * SIDE, i * SIDE + SIDE - 1] {
            cells[cell] = 100;
        }
    }
    let mut r = rng(1, 0);
    for _ in 0..90 {
        let mut draw = |low: f64, high: f64| low + (high - low) * uniform(&mut r);
        let (x, y, w, h) = (draw(0.0, 29.0), draw(0.0, 29.0), draw(0.5, 2.5), draw(0.5, 2.5));
        let start = scene().belief.pose;
        let near = |c: f64, low: f64, size: f64| c > low - 3.0 && c < low + size + 3.0;
        if near(start.x, x, w) && near(start.y, y, h) {
            continue;
        }
        let cell = |metres: f64| (metres / RESOLUTION) as usize;
        for row in cell(y)..cell(y + h).min(SIDE) {
            cells[row * SIDE + cell(x)..row * SIDE + cell(x + w).min(SIDE)].fill(100);
        }
    }
    OccupancyGrid::new(SIDE, SIDE, RESOLUTION, Pose2::default(), cells)
}

/// A robot in the middle, 40 people around it.
fn scene() -> Scene {
    let mut r = rng(2, 0);
    let mut draws = |low: f64, high: f64| -> Vec<f64> {
        (0..PEOPLE).map(|_| low + (high - low) * uniform(&mut r)).collect()
    };
    let people = People {
        id: (0..PEOPLE as u32).collect(),
        x: draws(6.0, 26.0),
        y: draws(6.0, 26.0),
        vx: draws(-0.7, 0.7),
        vy: draws(-0.7, 0.7),
        radius: 0.25,
    };
    let belief = Belief {
        pose: Pose2::new(16.0, 16.0, 0.7),
        covariance: nalgebra::Matrix3::from_diagonal(&nalgebra::vector![0.1, 0.1, 0.02]),
        twist: Twist { v: 0.5, omega: 0.0 },
    };
    Scene { tick: 0, stamp: 0.0, belief, people, uncertain: true }
}

/// Smooth random drives: the turn rate wanders, the speed keeps to one value.
fn candidates() -> Result<CandidateSet, StatesError> {
    let start = scene().belief;
    let mut r = rng(3, 0);
    let mut states = States::default();
    for _ in 0..CANDIDATES {
        let mut pose = start.pose;
        let mut twist = Twist { v: 0.35 + 0.65 * uniform(&mut r), omega: uniform(&mut r) - 0.5 };
        for _ in 0..STATES {
            twist.omega = (twist.omega + 0.3 * (uniform(&mut r) - 0.5)).clamp(-1.0, 1.0);
            pose = step(pose, twist, DT);
            states.push(pose, twist);
        }
    }
    CandidateSet::new(STATES, DT, (0..CANDIDATES as u32).collect(), states)
}
