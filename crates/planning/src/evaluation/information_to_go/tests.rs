use nalgebra::Matrix3;

use super::*;
use crate::evaluation::cpc::tests::{corridor, drives, map};
use crate::evaluation::cpc::{CpcParams, InformationField, InformationParams};
use crate::geometry::{Point2, Pose2, Twist};
use crate::motion::OdometryNoise;
use crate::occupancy::{OccupancyGrid, StaticMap};
use crate::scene::{Belief, People};
use crate::sensor::LaserModel;

const RADIUS: f64 = 0.3;

/// The covariance of a robot with these variances of position (x and y together), m2, and heading, rad2.
fn known_to(position: f64, heading: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&nalgebra::vector![0.5 * position, 0.5 * position, heading])
}

/// A robot that knows where it is.
fn sure() -> Matrix3<f64> {
    known_to(0.02, 0.002)
}

/// One that does not.
fn unsure() -> Matrix3<f64> {
    known_to(0.3, 0.02)
}

/// A hall of 40 m x 30 m at 0.1 m with walls at its rim alone.
fn hall() -> StaticMap {
    let solid = |c: usize, r: usize| c < 2 || r < 2 || c >= 398 || r >= 298;
    let cells = (0..400 * 300).map(|i| if solid(i % 400, i / 400) { 100 } else { 0 }).collect();
    StaticMap::new(OccupancyGrid::new(400, 300, 0.1, Pose2::default(), cells).unwrap())
}

fn seen(map: &StaticMap) -> Arc<InformationField> {
    Arc::new(InformationField::new(map, &LaserModel::default(), &InformationParams::default()))
}

fn field(map: &StaticMap, goal: Point2) -> InformationToGoField {
    // A good base: what is claimed of distances holds for this one.
    let noise = OdometryNoise {
        position_per_radian: 0.0001,
        heading_per_metre: 0.0005,
        heading_per_radian: 0.0012,
        ..OdometryNoise::default()
    };
    let params = InformationToGoParams::default();
    InformationToGoField::new(map, &seen(map), (goal, 0.5, RADIUS), &noise, 0.1, &params)
}

#[test]
fn where_landmarks_are_always_in_view_it_is_flat() {
    // A corridor with niches.
    let map = map(Pose2::default(), corridor);
    let field = field(&map, Point2::new(27.0, 10.0));
    let at: Vec<f64> = (3..27).map(|x| field.at(Point2::new(f64::from(x), 10.0), &sure())).collect();
    let (least, most) = at.iter().fold((f64::INFINITY, 0.0_f64), |(l, m), a| (l.min(*a), m.max(*a)));
    assert!(most - least < 0.05, "{least} to {most} m");
}

#[test]
fn a_robot_that_knows_less_has_a_longer_way_and_one_without_a_landmark_near_the_longest() {
    let map = hall();
    let field = field(&map, Point2::new(35.0, 3.0));
    for p in [Point2::new(20.0, 15.0), Point2::new(10.0, 12.0), Point2::new(25.0, 9.0)] {
        let costs: Vec<f64> =
            [0.02, 0.1, 0.15, 0.2, 0.3, 0.45].map(|v| field.at(p, &known_to(v, 0.01))).to_vec();
        assert!(costs.is_sorted(), "{p:?}: {costs:?}");
        assert!(costs[5] > costs[0] + 1.0, "{p:?}: {costs:?}");
    }
    let corner = Point2::new(38.0, 28.0);
    let middle = Point2::new(20.0, 15.0);
    assert!(field.at(middle, &unsure()) > field.at(corner, &unsure()) + 1.0);
}

#[test]
fn an_uncertain_robot_is_drawn_to_the_nearer_of_rim_and_goal() {
    let map = hall();
    // The goal lies in the void; the way to go is the straight distance, as nothing is in between.
    let goal = Point2::new(20.0, 15.0);
    let field = field(&map, goal);
    let to_go = |p: Point2| p.distance(goal) + field.at(p, &unsure());
    // From 12 m on, the rim is worth its detour; the laser sees it from 6 m.
    let gained = |p: Point2, by: f64| to_go(p) - to_go(Point2::new(p.x + by, p.y + 0.8 * by));
    for near in [Point2::new(18.0, 13.5), Point2::new(14.0, 10.5), Point2::new(10.5, 8.7)] {
        let away = gained(near, -1.0);
        let toward = gained(near, 1.0);
        assert!(away < 0.0 && toward > 0.5, "{near:?}: {away} {toward}");
    }
    for far in [Point2::new(6.5, 5.5), Point2::new(7.5, 6.3), Point2::new(8.5, 7.1)] {
        let away = gained(far, -1.0);
        let toward = gained(far, 1.0);
        assert!(away > 0.5 && toward < 0.0, "{far:?}: {away} {toward}");
    }
}

#[test]
fn a_robot_that_is_uncertain_of_its_heading_pays_for_it_in_the_void_but_not_where_it_sees_a_wall() {
    let map = hall();
    let field = field(&map, Point2::new(20.0, 15.0));
    let more = |p: Point2| field.at(p, &known_to(0.05, 0.05)) - field.at(p, &known_to(0.05, 0.002));
    // The wall tells the heading, and with it what the heading's error has done to the position.
    let void = Point2::new(15.0, 15.0);
    let wall = Point2::new(3.0, 15.0);
    assert!(more(void) > 5.0 && more(wall) < 0.1, "{} and {} m", more(void), more(wall));
}

#[test]
fn to_know_the_heading_less_never_helps() {
    // A wall that has told the heading leaves a part of the position's error that the heading had not caused.
    let map = hall();
    let field = field(&map, Point2::new(20.0, 15.0));
    for p in (2..39).flat_map(|x| [2.0, 4.0, 6.0, 8.0, 15.0].map(|y| Point2::new(f64::from(x), y))) {
        for position in [0.03, 0.1, 0.3, 1.0] {
            let heading = [0.002, 0.01, 0.02, 0.05, 0.1, 0.2];
            let costs = heading.map(|heading| field.at(p, &known_to(position, heading)));
            assert!(costs.is_sorted_by(|a, b| *a <= b + 1e-5), "{p:?}, {position} m2: {costs:?}");
        }
    }
}

#[test]
fn where_no_way_leads_it_says_nothing() {
    let map = hall();
    let field = field(&map, Point2::new(35.0, 3.0));
    for p in [Point2::new(-50.0, 3.0), Point2::new(1e9, 0.0)] {
        assert_eq!(field.at(p, &unsure()), 0.0);
    }
    for broken in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
        assert!(field.at(Point2::new(20.0, 15.0), &known_to(broken, broken)).is_finite());
    }
}

#[test]
fn sharding_changes_no_cost() {
    let map = hall();
    let cpc = CpcEvaluator::new(seen(&map), OdometryNoise::default(), CpcParams::default());
    let term = InformationToGoEvaluator { field: Arc::new(field(&map, Point2::new(35.0, 3.0))), cpc };
    let starts: Vec<Pose2> = (0..20).map(|k| Pose2::new(12.0, 10.0, 0.3 * f64::from(k))).collect();
    let set = drives(&starts, 13, |i, _| Twist { v: 0.1 * (i % 9) as f64, omega: 0.05 * (i % 5) as f64 });
    let belief = Belief { pose: starts[0], covariance: Matrix3::identity() * 0.05, twist: Twist::default() };
    let people = People::default();
    let scene = Scene { uncertain: true, ..Scene::new(belief, people) };
    let whole = term.evaluate(&scene, &set, &|| false).unwrap();
    let shards = [0..1, 1..8, 8..20].map(|range| term.evaluate(&scene, &set.pick(range), &|| false).unwrap());
    assert_eq!(whole, shards.concat());
    assert!(whole.iter().any(|cost| *cost != whole[0]), "{whole:?}");
    assert!(term.evaluate(&scene, &set, &|| true).is_err());
}
