//! Claims about collision checks.

use super::*;
use crate::geometry::Twist;
use crate::occupancy::OccupancyGrid;
use crate::scene::{Belief, People};
use nalgebra::Matrix3;

/// 20 m x 20 m, free but for a wall along x = 15.
fn map() -> StaticMap {
    let mut cells = vec![0_i8; 200 * 200];
    for row in 0..200 {
        cells[row * 200 + 150] = 100;
    }
    StaticMap::new(OccupancyGrid::new(200, 200, 0.1, Pose2::default(), cells).unwrap())
}

fn scene(pose: Pose2, people: &[(f64, f64, f64, f64)]) -> Scene {
    let belief = Belief { pose, covariance: Matrix3::identity() * 0.01, twist: Twist::default() };
    let people = People {
        id: (0..people.len() as u32).map(|i| 10 + i).collect(),
        x: people.iter().map(|p| p.0).collect(),
        y: people.iter().map(|p| p.1).collect(),
        vx: people.iter().map(|p| p.2).collect(),
        vy: people.iter().map(|p| p.3).collect(),
        radius: 0.3,
        ..People::default()
    };
    Scene::new(belief, people)
}

/// Straight along +x from (5, 10) at `v` for 10 steps of 0.3 s.
fn straight(v: f64) -> States {
    states(&(1..=10).map(|k| (5.0 + v * 0.3 * f64::from(k), 10.0, 0.0)).collect::<Vec<_>>())
}

fn states(of: &[(f64, f64, f64)]) -> States {
    let mut states = States::default();
    of.iter().for_each(|&(x, y, heading)| states.push(Pose2::new(x, y, heading), Twist::default()));
    states
}

fn first(scene: &Scene, v: f64) -> Option<Collision> {
    let map = map();
    let robot = RobotModel::default();
    let c =
        CollisionChecker::new(&map, &robot, scene, ForecastParams::default(), &CollisionParams::default());
    c.first_collision(&straight(v), 0.3)
}

#[test]
fn a_wall_ahead_is_met_and_an_empty_hall_is_not() {
    let s = scene(Pose2::new(5.0, 10.0, 0.0), &[]);
    assert_eq!(first(&s, 1.0), None);
    // 9.4 m from the wall: reached at 3.2 m/s within 3 s
    let hit = first(&s, 3.3).unwrap();
    assert_eq!(hit.with, Obstacle::Wall);
    assert!(hit.time >= 8.0 * 0.3, "{hit:?}");
}

#[test]
fn a_person_who_is_known_badly_is_left_more_room_and_the_more_the_later() {
    let mut known = scene(Pose2::new(5.0, 10.0, 0.0), &[(9.0, 10.0, 0.0, 0.0), (9.0, 12.0, 0.0, 0.0)]);
    known.people.position_variance = vec![0.0, 0.04];
    known.people.velocity_variance = vec![0.0, 0.02];
    let map = map();
    let robot = RobotModel::default();
    let forecast = ForecastParams::default();
    let c = CollisionChecker::new(&map, &robot, &known, forecast, &CollisionParams::default());
    let without = scene(Pose2::new(5.0, 10.0, 0.0), &[(9.0, 10.0, 0.0, 0.0)]);
    let exact = CollisionChecker::new(&map, &robot, &without, forecast, &CollisionParams::default());
    for t in [0.0, 0.3, 1.5] {
        assert_eq!(c.person_gap(0, t), exact.person_gap(0, t));
    }
    // 0.1 + 0.5 sqrt(0.01 + 0.01 + 0.04)
    assert!((c.person_gap(1, 0.0) - (0.1 + 0.5 * 0.06_f64.sqrt())).abs() < 1e-12);
    assert!(c.person_gap(1, 0.6) - c.person_gap(0, 0.6) > 0.0 && c.person_gap(1, 0.6) > c.person_gap(1, 0.0));
}

#[test]
fn people_who_stand_stay_where_they_are_and_a_robot_that_does_not_get_away_goes_close_by() {
    // Too slow to walk, towards the robot's way, and one who walks.
    let slow = (7.0, 10.85, 0.0, -0.09);
    let mut s = scene(Pose2::new(5.0, 10.0, 0.0), &[slow, (9.0, 12.0, 0.5, 0.0)]);
    let map = map();
    let robot = RobotModel::default();
    let new =
        |params: CollisionParams| CollisionChecker::new(&map, &robot, &s, ForecastParams::default(), &params);
    let walking = CollisionParams::default();
    let standing = CollisionParams { standing: 0.1, ..Default::default() };
    let hit = new(walking).first_collision(&straight(1.0), 0.3).unwrap();
    assert_eq!(hit.with, Obstacle::Person(10));
    let wide = new(standing);
    assert_eq!(wide.first_collision(&straight(1.0), 0.3), None);
    assert_eq!(wide.person_gap(0, 3.0), wide.person_gap(0, 0.0));
    assert!(wide.person_gap(1, 3.0) > wide.person_gap(1, 0.0));
    // 0.05 m and half of 0.1 m are asked of walls, and 0.03 m of a robot that has been in its place for long.
    let at_wall = Pose2::new(14.0, 10.0, 0.0);
    let patient = CollisionParams { tight_after: 3.0, ..standing };
    assert_eq!(new(patient).person_gap(0, 3.0), wide.person_gap(0, 3.0));
    let room = wide.wall_spare(at_wall);
    let gap = wide.person_gap(1, 0.3);
    s.in_place = 3.0;
    let tight = CollisionChecker::new(&map, &robot, &s, ForecastParams::default(), &patient);
    assert_eq!((tight.person_gap(0, 3.0), tight.person_gap(1, 0.3)), (CollisionChecker::GUARD, gap));
    assert!((tight.wall_spare(at_wall) - room - 0.07).abs() < 1e-9);
}

#[test]
fn people_who_would_walk_into_the_robot_stop_before_it_where_that_is_counted_on() {
    let map = map();
    let robot = RobotModel::default();
    let here = Pose2::new(5.0, 10.0, 0.0);
    let params = CollisionParams { people_stop: true, ..CollisionParams::default() };
    let is_free = |s: &Scene, params: &CollisionParams, way: &States| {
        let forecast = ForecastParams::default();
        CollisionChecker::new(&map, &robot, s, forecast, params).first_collision(way, 0.3).is_none()
    };
    let standing = straight(0.0);
    let aside = states(&(1..=10).map(|k| (5.0, 10.0 + 0.1 * f64::from(k), 0.0)).collect::<Vec<_>>());
    let comes = scene(here, &[(7.5, 10.0, -1.0, 0.0)]);
    assert!(!is_free(&comes, &CollisionParams::default(), &standing));
    assert!(is_free(&comes, &params, &standing));
    assert!(is_free(&comes, &params, &aside));
    // It drives at the person, who only stops for a robot that is where it was.
    assert!(!is_free(&comes, &params, &straight(0.5)));
    // Others walk on as before: one who passes in front, and one who will touch the robot within half a second.
    let passes = scene(here, &[(6.2, 11.5, 0.0, -1.0)]);
    assert!(is_free(&passes, &params, &standing));
    assert!(!is_free(&passes, &params, &straight(0.8)));
    let touches = scene(here, &[(6.2, 10.0, -1.0, 0.0)]);
    assert!(!is_free(&touches, &params, &standing));
}

#[test]
fn people_are_met_where_they_will_be_not_where_they_are() {
    // stands on the way, but walks off to the side in time
    assert_eq!(first(&scene(Pose2::new(5.0, 10.0, 0.0), &[(7.0, 10.0, 0.0, 1.0)]), 1.0), None);
    // stays on the way: met after at most 2 m - contact
    let hit = first(&scene(Pose2::new(5.0, 10.0, 0.0), &[(7.0, 10.0, 0.0, 0.0)]), 1.0).unwrap();
    assert_eq!(hit.with, Obstacle::Person(10));
    assert!(hit.time > 0.5 && hit.time < 1.4, "{hit:?}");
    // crosses from the side and arrives at the same time
    let crossing = scene(Pose2::new(5.0, 10.0, 0.0), &[(6.5, 8.5, 0.0, 1.0)]);
    assert!(first(&crossing, 1.0).is_some());
}

#[test]
fn nothing_is_looked_for_beyond_the_horizon_however_long_the_trajectory() {
    // The robot has come within reach of the person after 1.3 s, of the wall after 9 s.
    let s = scene(Pose2::new(5.0, 10.0, 0.0), &[(7.0, 10.0, 0.0, 0.0)]);
    let map = map();
    let robot = RobotModel::default();
    let long = states(&(1..=57).map(|k| (5.0 + 0.3 * f64::from(k), 10.0, 0.0)).collect::<Vec<_>>());
    let first = |scene: &Scene, horizon: f64| {
        let params = CollisionParams { horizon, ..CollisionParams::default() };
        CollisionChecker::new(&map, &robot, scene, ForecastParams::default(), &params)
            .first_collision(&long, 0.3)
    };
    assert_eq!(first(&s, 0.9), None);
    assert_eq!(first(&s, 3.9).unwrap().with, Obstacle::Person(10));
    let alone = scene(Pose2::new(5.0, 10.0, 0.0), &[]);
    assert_eq!(first(&alone, CollisionParams::default().horizon), None);
    assert_eq!(first(&alone, 17.1).unwrap().with, Obstacle::Wall);
}

#[test]
fn an_impatient_robot_looks_less_far_ahead_for_people_and_as_far_for_walls() {
    let map = map();
    let robot = RobotModel::default();
    let params = CollisionParams { impatient_horizon: 0.9, ..CollisionParams::default() };
    let first = |impatient: bool, people: &[(f64, f64, f64, f64)], v: f64| {
        let scene = Scene { impatient, ..scene(Pose2::new(5.0, 10.0, 0.0), people) };
        CollisionChecker::new(&map, &robot, &scene, ForecastParams::default(), &params)
            .first_collision(&straight(v), 0.3)
    };
    // One is met after 1.3 s, one after 0.5 s, and the wall after 2.8 s.
    let far = [(7.0, 10.0, 0.0, 0.0)];
    assert_eq!(first(false, &far, 1.0).unwrap().with, Obstacle::Person(10));
    assert_eq!(first(true, &far, 1.0), None);
    assert_eq!(first(true, &[(6.1, 10.0, 0.0, 0.0)], 1.0).unwrap().with, Obstacle::Person(10));
    assert_eq!(first(true, &[], 3.3).unwrap().with, Obstacle::Wall);
}

#[test]
fn two_who_swap_places_within_one_step_still_meet() {
    let map = map();
    let robot = RobotModel::default();
    let s = scene(Pose2::new(5.0, 10.0, 0.0), &[(6.5, 10.0, -2.0, 0.0)]);
    let c = CollisionChecker::new(&map, &robot, &s, ForecastParams::default(), &CollisionParams::default());
    // states alone are far apart: robot 5 -> 8, person 6.5 -> 4.5 in one step of 1 s
    assert!(c.first_collision(&states(&[(8.0, 10.0, 0.0)]), 1.0).is_some());
}

#[test]
fn a_violated_margin_forbids_going_nearer_but_not_leaving() {
    // contact at 0.6 m; a person 0.65 m ahead is inside the margin
    let ahead = scene(Pose2::new(5.0, 10.0, 0.0), &[(5.65, 10.0, 0.0, 0.0)]);
    assert!(first(&ahead, 0.2).is_some());
    assert_eq!(first(&ahead, 0.0), None);
    let behind = scene(Pose2::new(5.0, 10.0, 0.0), &[(4.35, 10.0, 0.0, 0.0)]);
    assert_eq!(first(&behind, 0.2), None);
    // even when the estimate says contact
    let touching = scene(Pose2::new(5.0, 10.0, 0.0), &[(4.5, 10.0, 0.0, 0.0)]);
    assert_eq!(first(&touching, 0.2), None);
    // the same with the wall 0.4 m away on one side
    let by_wall = scene(Pose2::new(14.6, 10.0, 0.0), &[]);
    let map = map();
    let robot = RobotModel::default();
    let c =
        CollisionChecker::new(&map, &robot, &by_wall, ForecastParams::default(), &CollisionParams::default());
    assert_eq!(c.first_collision(&states(&[(14.4, 10.0, 0.0), (14.2, 10.0, 0.0)]), 0.3), None);
    assert!(c.first_collision(&states(&[(14.8, 10.0, 0.0)]), 0.3).is_some());
}

#[test]
fn a_long_robot_passes_lengthwise_where_its_circle_does_not() {
    let map = map();
    let vertices = [(-0.7, -0.25), (0.7, -0.25), (0.7, 0.25), (-0.7, 0.25)];
    let vertices = vertices.map(|(x, y)| Point2::new(x, y)).to_vec();
    let robot = RobotModel { footprint: Footprint::Polygon { vertices }, ..RobotModel::default() };
    // A person beside the way at 0.9 m: free lengthwise (0.25 + 0.3 + margins), hit when turned across.
    let s = scene(Pose2::new(5.0, 10.0, 0.0), &[(6.5, 10.9, 0.0, 0.0)]);
    let c = CollisionChecker::new(&map, &robot, &s, ForecastParams::default(), &CollisionParams::default());
    assert_eq!(c.first_collision(&straight(0.8), 0.3), None);
    assert!(c.first_collision(&states(&[(5.2, 10.0, 0.0), (6.5, 10.0, 1.57)]), 1.0).is_some());
    // The wall at x = 15: 0.45 m from the centre is enough alongside it, not facing it.
    assert!(c.wall_clear(Pose2::new(14.45, 10.0, std::f64::consts::FRAC_PI_2)));
    assert!(!c.wall_clear(Pose2::new(14.45, 10.0, 0.0)));
}

#[test]
fn following_on_a_persons_heels_does_not_stop_short() {
    let map = map();
    let robot = RobotModel::default();
    let s = scene(Pose2::new(5.0, 10.0, 0.0), &[(6.0, 10.0, 1.0, 0.0)]);
    let c = CollisionChecker::new(&map, &robot, &s, ForecastParams::default(), &CollisionParams::default());
    assert_eq!(c.first_collision(&straight(1.0), 0.3), None);
    // 0.3 m + 1 m of braking against a gap of 0.4 m
    assert!(
        !c.over(10, 0.3, f64::INFINITY).stops_short(straight(1.0).poses(0..10), robot.stopping_distance(1.0))
    );
    assert!(
        c.over(10, 0.3, f64::INFINITY).stops_short(straight(0.3).poses(0..10), robot.stopping_distance(0.3))
    );
}

#[test]
fn more_uncertainty_never_makes_a_trajectory_free() {
    for lateral in 0..20 {
        let y = 10.0 + 0.1 * f64::from(lateral);
        let mut s = scene(Pose2::new(5.0, 10.0, 0.0), &[(7.0, y, 0.0, 0.0)]);
        let sure = first(&s, 1.0).is_some();
        s.belief.covariance = Matrix3::identity() * 0.25;
        let unsure = first(&s, 1.0).is_some();
        assert!(unsure || !sure, "lateral {lateral}");
    }
}
