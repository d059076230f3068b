//! Every term that is built in is held to what the registry says of it.

use std::sync::Arc;

use nalgebra::Matrix3;

use super::*;
use crate::candidates::CandidateSet;
use crate::evaluation::distance::DistanceMeasure;
use crate::geometry::{Point2, Pose2, Twist};
use crate::motion::{OdometryNoise, RobotModel};
use crate::occupancy::{OccupancyGrid, StaticMap};
use crate::profile::Profile;
use crate::scene::{Belief, People, Scene};
use crate::sensor::LaserModel;
use crate::states::States;

#[test]
fn every_term_is_built_from_any_profile() {
    let grid = OccupancyGrid::new(40, 40, 0.25, Pose2::default(), vec![0; 1600]).unwrap();
    let fields = Arc::new(StaticMap::new(grid));
    let task = Task {
        goal: Point2::new(5.0, 5.0),
        goal_heading: None,
        robot: RobotModel::default(),
        laser: LaserModel::default(),
        noise: OdometryNoise::default(),
    };
    for profile in [Profile::default(), Profile { distance: DistanceMeasure::Euclid, ..Profile::default() }] {
        for name in NAMES {
            assert!(matches!(evaluator(name, &profile, &task, &fields), Some(Ok(_))), "{name}");
        }
    }
    assert!(evaluator("view", &Profile::default(), &task, &fields).is_none());
}

#[test]
fn no_term_reads_a_column_that_it_does_not_declare() {
    // A wall, and pillars less than a metre beside each candidate.
    let is_solid = |c: usize, r: usize| c == 39 || c % 8 == 7 && r % 8 == 3;
    let cells = (0..1600).map(|cell| if is_solid(cell % 40, cell / 40) { 100 } else { 0 }).collect();
    let grid = OccupancyGrid::new(40, 40, 0.25, Pose2::default(), cells).unwrap();
    let fields = Arc::new(StaticMap::new(grid));
    let task = Task { goal: Point2::new(8.0, 8.0), ..Task::default() };
    let belief =
        Belief { pose: Pose2::default(), covariance: Matrix3::identity() * 0.04, twist: Twist::default() };
    // One near the way of each candidate.
    let people = People::walking(0.3, &[[3.0, 3.5, 0.2, -0.1], [1.5, 1.0, 0.0, 0.0], [6.0, 5.0, 0.0, 0.0]]);
    let scene = Scene { uncertain: true, ..Scene::new(belief, people) };
    let row = |scale: f64| (1..=20).map(|k| scale * f64::from(k)).collect::<Vec<f64>>();
    let all = States { x: row(0.3), y: row(0.29), heading: row(0.1), v: row(0.05), omega: row(0.03) };
    let candidates = CandidateSet::new(5, 0.3, vec![0, 1, 2, 3], all.clone()).unwrap();
    let mut profile = Profile::default();
    profile.risk.belief = true;
    for name in NAMES {
        let columns = columns(name);
        let only = |is_read: bool, column: &[f64]| if is_read { column.to_vec() } else { Vec::new() };
        let read = States {
            heading: only(columns.heading, &all.heading),
            v: only(columns.v, &all.v),
            omega: only(columns.omega, &all.omega),
            ..all.clone()
        };
        let read = CandidateSet::of_columns(columns, 5, 0.3, vec![0, 1, 2, 3], read).unwrap();
        let term = evaluator(name, &profile, &task, &fields).unwrap().unwrap();
        let cost = |set: &CandidateSet| term.evaluate(&scene, set, &|| false).unwrap();
        assert!(cost(&candidates).iter().all(|cost| *cost > 0.0), "{name}: nothing to tell apart");
        assert_eq!(cost(&read), cost(&candidates), "{name}");
    }
}

#[test]
fn every_profile_that_is_built_in_lists_terms_that_are() {
    for profile in Profile::names() {
        let terms = Profile::builtin(profile).unwrap().terms;
        assert!(terms.keys().all(|name| NAMES.contains(&name.as_str())), "{profile}: {terms:?}");
    }
}

#[test]
fn parameters_travel_unchanged() {
    struct ThereAndBack;
    impl Visitor for ThereAndBack {
        type Output = (toml::Table, toml::Table);
        fn visit<T: BuiltIn>(self) -> Self::Output {
            let sent = toml::Table::try_from(T::params(&Profile::default())).unwrap();
            let back: T::Params = sent.clone().try_into().unwrap();
            (sent, toml::Table::try_from(back).unwrap())
        }
    }
    for name in NAMES {
        let (sent, back) = visit(name, ThereAndBack).unwrap();
        assert_eq!(sent, back);
    }
}
