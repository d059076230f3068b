//! A robot that was told nothing, and one that was carried off, find themselves.

use curionav_localization::{Localizer, LocalizerParams};
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::random::{rng, uniform};

use crate::course::*;
use crate::simulation::*;

/// 40 m x 20 m: sixteen rooms of 5 m x 8 m along a corridor, each with the same door and table. Two cupboards stand in
/// the corridor, and one room has a shelf.
fn office() -> StaticMap {
    let mut boxes = vec![(0.0, 8.4, 0.5, 8.6), (12.0, 8.6, 13.0, 9.1), (27.5, 10.9, 28.5, 11.4)];
    for room in 0..8 {
        let x = 5.0 * f64::from(room);
        for (wall, table) in [(8.4, 2.0), (11.4, 16.5)] {
            boxes.push((x + 0.5, wall, x + 3.0, wall + 0.2));
            boxes.push((x + 4.2, wall, x + 5.5, wall + 0.2));
            boxes.push((x + 1.5, table, x + 3.0, table + 0.8));
        }
        boxes.push((x - 0.1, 0.0, x + 0.1, 8.5));
        boxes.push((x - 0.1, 11.5, x + 0.1, 20.0));
    }
    boxes.push((35.5, 4.0, 36.0, 7.0));
    hall(40.0, 20.0, &boxes)
}

/// Ways of about 30 m that begin in different places.
fn ways(map: &StaticMap, count: u64) -> Vec<Vec<Point2>> {
    let mut random = rng(11, 0);
    let mut ways = Vec::new();
    while (ways.len() as u64) < count {
        let start = Point2::new(40.0 * uniform(&mut random), 20.0 * uniform(&mut random));
        let goal = Point2::new(40.0 * uniform(&mut random), 20.0 * uniform(&mut random));
        let is_roomy = |p: Point2| map.to_obstacle.at(&map.grid, p) > 0.7;
        if is_roomy(start) && is_roomy(goal) {
            let way = curionav_planning::occupancy::GeodesicField::new(map, goal, 0.4).descend(start, 0.1);
            if (280..320).contains(&way.len()) {
                ways.push(way);
            }
        }
    }
    ways
}

/// How a drive ended.
#[derive(Debug)]
struct Ending {
    is_right: bool,
    is_sure: bool,
    /// Share of the ticks in which it was sure of a place more than a metre off.
    wrongly_sure: f64,
}

fn drive(map: &StaticMap, way: &[Point2], mut localizer: Localizer, seed: u64) -> Ending {
    let mut robot = Robot::new(map, start_of(way), seed);
    let mut ticks = 0;
    let mut wrongly_sure = 0;
    let mut ending = Ending { is_right: false, is_sure: false, wrongly_sure: 0.0 };
    follow(&mut robot, way, |robot| {
        let estimate = robot.tick(&mut localizer);
        let error = estimate.pose.position().distance(robot.truth.position());
        ticks += 1;
        wrongly_sure += usize::from(estimate.health.converged && error > 1.0);
        ending.is_right = error < 0.5;
        ending.is_sure = estimate.health.converged;
    });
    ending.wrongly_sure = wrongly_sure as f64 / ticks as f64;
    ending
}

#[test]
fn among_like_rooms_a_robot_finds_itself_or_says_that_it_does_not_know() {
    let map = office();
    let mut right = 0;
    let mut sure_and_wrong = 0;
    for (seed, way) in ways(&map, 8).iter().enumerate() {
        let localizer = untold(&map, &LocalizerParams::default(), seed as u64);
        let ending = drive(&map, way, localizer, seed as u64);
        println!("seed {seed}: {ending:?}");
        right += usize::from(ending.is_right);
        sure_and_wrong += usize::from(ending.is_sure && !ending.is_right);
    }
    assert!(right >= 7 && sure_and_wrong == 0, "{right} right, {sure_and_wrong} sure and wrong");
}
