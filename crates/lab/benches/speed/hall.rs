//! The scene of the budgets: a map of 350,000 cells, 40 people, and as many candidates as are asked for.

use std::sync::Arc;

use curionav_planning::candidates::CandidateSet;
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::motion::step;
use curionav_planning::nalgebra::{Matrix3, Vector3};
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
use curionav_planning::random::{rng, uniform};
use curionav_planning::scene::{Belief, People, Scene};
use curionav_planning::states::States;

/// Cells along the map's side, and their side in metres: 32 m x 32 m.
const SIDE: usize = 592;
const RESOLUTION: f64 = 0.054;
const PEOPLE: usize = 40;
/// In the middle of the map.
const START: Pose2 = Pose2::new(16.0, 16.0, 0.7);
/// In its upper right corner.
pub(crate) const GOAL: Point2 = Point2::new(28.0, 28.0);

/// Outer walls, 90 boxes of 0.5 to 2.5 m, and nothing within 3 m of the robot.
pub(crate) fn grid() -> anyhow::Result<OccupancyGrid> {
    let mut cells = vec![0_i8; SIDE * SIDE];
    for i in 0..SIDE {
        for cell in [i, (SIDE - 1) * SIDE + i, i * SIDE, i * SIDE + SIDE - 1] {
            cells[cell] = 100;
        }
    }
    let mut r = rng(1, 0);
    for _ in 0..90 {
        let mut draw = |low: f64, high: f64| low + (high - low) * uniform(&mut r);
        let x = draw(0.0, 29.0);
        let y = draw(0.0, 29.0);
        let w = draw(0.5, 2.5);
        let h = draw(0.5, 2.5);
        let near = |c: f64, low: f64, size: f64| c > low - 3.0 && c < low + size + 3.0;
        if near(START.x, x, w) && near(START.y, y, h) {
            continue;
        }
        let cell = |metres: f64| (metres / RESOLUTION) as usize;
        for row in cell(y)..cell(y + h).min(SIDE) {
            cells[row * SIDE + cell(x)..row * SIDE + cell(x + w).min(SIDE)].fill(100);
        }
    }
    Ok(OccupancyGrid::new(SIDE, SIDE, RESOLUTION, Pose2::default(), cells)?)
}

/// The map with its distance fields.
pub(crate) fn map() -> anyhow::Result<Arc<StaticMap>> {
    Ok(Arc::new(StaticMap::new(grid()?)))
}

/// A robot in the middle that is not sure where it is, and 40 people around it.
pub(crate) fn scene() -> Scene {
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
        ..People::default()
    };
    let covariance = Matrix3::from_diagonal(&Vector3::new(0.1, 0.1, 0.02));
    let belief = Belief { pose: START, covariance, twist: Twist { v: 0.5, omega: 0.0 } };
    Scene { uncertain: true, ..Scene::new(belief, people) }
}

/// `count` smooth random drives of `steps` states, `dt` seconds apart: the turn rate wanders, the speed keeps to one
/// value.
pub(crate) fn candidates(count: usize, steps: usize, dt: f64) -> anyhow::Result<CandidateSet> {
    let mut r = rng(3, 0);
    let mut states = States::default();
    for _ in 0..count {
        let mut pose = START;
        let mut twist = Twist { v: 0.35 + 0.65 * uniform(&mut r), omega: uniform(&mut r) - 0.5 };
        for _ in 0..steps {
            twist.omega = (twist.omega + 0.3 * (uniform(&mut r) - 0.5)).clamp(-1.0, 1.0);
            pose = step(pose, twist, dt);
            states.push(pose, twist);
        }
    }
    Ok(CandidateSet::new(steps, dt, (0..count as u32).collect(), states)?)
}
