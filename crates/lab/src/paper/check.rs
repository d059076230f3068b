//! Measures a finished scene against everything the paper and D16 and D17 ask of it.

use curionav_planning::geometry::{Point2, Pose2, bearing};
use curionav_planning::occupancy::{Cell, GeodesicField};

use super::observability::{Observability, look};
use super::patrol::points;
use super::report::{LEAST_HOLD, Report, RouteReport, Wanted};
use super::scene::{PaperScene, RouteKind};

/// Spacing of samples along ways, metres: about two cells.
const SPACING_M: f64 = 0.1;

/// Measures `scene`.
pub fn check(scene: &PaperScene) -> Report {
    let map = &scene.map;
    let grid = &*map.grid;
    let scenario = &scene.scenario;
    let (start, goal) = (scenario.robot.start.position(), scenario.robot.goal);
    let range = scenario.laser.range_max;
    let cells = |what| (0..grid.cells().len()).filter(|&i| grid.cell(i) == what).count();
    let landmark_cells = cells(Cell::Occupied);
    let geodesic = GeodesicField::new(map, goal, scenario.robot.model.radius());
    let mut direct_way = geodesic.descend(start, SPACING_M);
    direct_way.push(goal);
    let direct = length(&direct_way);
    let patrols: Vec<Point2> = scenario.walkers.iter().flat_map(|w| points(&w.route, SPACING_M)).collect();
    let to_patrols = |p: Point2| least(patrols.iter().map(|b| b.distance(p)));
    let of_walkers = |value: &dyn Fn(usize) -> f64| spread((0..scenario.walkers.len()).map(value));
    let obstacle = |p: Point2| map.to_obstacle.at(grid, p);
    let landmark = |p: Point2| map.to_occupied.at(grid, p);
    Report {
        known_cells: landmark_cells + cells(Cell::Free),
        landmark_cells,
        people: scenario.walkers.len(),
        laser_range: range,
        start_to_landmark: landmark(start),
        start_clearance: obstacle(start),
        start_turn: scenario
            .robot
            .start
            .relative(Pose2::new(goal.x, goal.y, bearing(start, goal)))
            .heading
            .abs(),
        goal_clearance: obstacle(goal),
        goal_to_landmark: landmark(goal),
        direct,
        direct_over_published: scene.published.map(|p| direct / p.shortest_m),
        direct_bare: length_where(&direct_way, |p| landmark(p) > range),
        direct_among_people: length_where(&direct_way, |p| to_patrols(p) < 1.5),
        ends_to_patrols: to_patrols(start).min(to_patrols(goal)),
        patrol_clearance: least(patrols.iter().map(|&p| obstacle(p))),
        patrol_lengths: of_walkers(&|i| length(&scenario.walkers[i].route)),
        speeds: of_walkers(&|i| scenario.walkers[i].speed),
        routes: scene.routes.iter().map(|r| measure(scene, r.kind, &r.way, &to_patrols)).collect(),
        direct_way,
        wanted: scene.published.map(|p| Wanted {
            known_cells: p.known_cells,
            landmark_cells: p.landmark_cells,
            people: p.people,
            laser_range: p.laser_range(),
        }),
    }
}

fn measure(
    scene: &PaperScene,
    kind: RouteKind,
    corners: &[Point2],
    to_patrols: &dyn Fn(Point2) -> f64,
) -> RouteReport {
    let way = points(corners, SPACING_M);
    let (map, grid) = (&scene.map, &scene.map.grid);
    let laser = &scene.scenario.laser;
    let sights: Vec<Observability> =
        way.windows(2).map(|w| look(map, laser, Pose2::new(w[0].x, w[0].y, bearing(w[0], w[1])))).collect();
    let held = sights.iter().position(|s| s.hold >= LEAST_HOLD).unwrap_or(sights.len());
    RouteReport {
        kind,
        length: length(&way),
        bare: length_where(&way, |p| map.to_occupied.at(grid, p) > laser.range_max),
        clearance: least(way.iter().map(|&p| map.to_obstacle.at(grid, p))),
        to_patrols: least(way.iter().map(|&p| to_patrols(p))),
        among_people: length_where(&way, |p| to_patrols(p) < 1.5),
        until_held: length(&way[..=held]),
        least_hold: least(sights[held..].iter().map(|s| s.hold)),
    }
}

fn length(way: &[Point2]) -> f64 {
    way.windows(2).map(|w| w[0].distance(w[1])).sum()
}

/// Metres of the way whose pieces begin where `holds`.
fn length_where(way: &[Point2], holds: impl Fn(Point2) -> bool) -> f64 {
    way.windows(2).filter(|w| holds(w[0])).fold(0.0, |sum, w| sum + w[0].distance(w[1]))
}

fn least(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::INFINITY, f64::min)
}

fn spread(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::{CELL_M, SEED, SceneError, environment, environments, quickstart};

    /// Side of a cell if Table II's areas are taken literally, metres: a pixel at 72 dpi is 0.0353 cm.
    const LITERAL_CELL_M: f64 = 0.0254 / 0.72;

    #[test]
    fn every_scene_is_without_fault_for_many_seeds() {
        for seed in 0..10 {
            for scene in environments(seed).unwrap() {
                let report = check(&scene);
                assert!(report.faults().is_empty(), "{}, seed {seed}:\n{report}", scene.scenario.name);
            }
        }
    }

    #[test]
    fn every_number_of_table_2_holds_in_both_readings_of_the_scale() {
        let printed_areas = [378.30, 363.82, 272.21, 433.91, 420.14];
        for scene in environments(SEED).unwrap() {
            let (report, published) = (check(&scene), scene.published.unwrap());
            let found = (report.people, report.known_cells, report.landmark_cells);
            assert_eq!(found, (published.people, published.known_cells, published.landmark_cells));
            for cell in [CELL_M, LITERAL_CELL_M] {
                let range = report.laser_range / CELL_M * cell;
                let area = report.known_cells as f64 * cell * cell;
                let rate = 0.5 * std::f64::consts::PI * range * range / area;
                // The table prints hundredths of a percent.
                assert!((rate - published.laser_rate).abs() < 5e-5, "{}: {rate}", scene.scenario.name);
            }
            let area = report.known_cells as f64 * LITERAL_CELL_M * LITERAL_CELL_M;
            assert!(printed_areas.iter().any(|printed| (area / printed - 1.0_f64).abs() < 1e-4), "{area}");
        }
    }

    #[test]
    fn the_quick_start_is_without_fault_and_crosses_its_crowd() {
        for seed in 0..10 {
            let report = check(&quickstart(seed).unwrap());
            assert!(report.faults().is_empty(), "seed {seed}:\n{report}");
            assert!(report.direct > 9.0 && report.direct < 12.0 && report.direct_bare < 1e-9);
            assert!(report.direct_among_people > 1.0 && report.ends_to_patrols > 1.5);
        }
    }

    #[test]
    fn the_seed_moves_people_but_not_walls() {
        let (a, b) = (environment(4, "s2", 1).unwrap(), environment(4, "s2", 2).unwrap());
        assert_eq!(a.map.grid.hash(), b.map.grid.hash());
        assert_ne!(a.scenario.walkers, b.scenario.walkers);
        assert_eq!(a.scenario, environment(4, "s2", 1).unwrap().scenario);
    }

    #[test]
    fn each_violation_is_noticed() {
        let good = environment(4, "s2", 1).unwrap();
        let faults_after = |change: &dyn Fn(&mut PaperScene)| {
            let mut scene = good.clone();
            change(&mut scene);
            check(&scene).faults().join("; ")
        };
        let lane = good.routes.iter().find(|r| r.kind == RouteKind::Landmarks).unwrap().way[2];
        for (change, fault) in [
            (
                &(|s: &mut PaperScene| s.scenario.robot.start.x += 4.0) as &dyn Fn(&mut PaperScene),
                "start to landmarks",
            ),
            (&|s| s.scenario.robot.goal.x = 33.2, "goal to walls"),
            (&|s| s.scenario.laser.range_max = 6.0, "laser range"),
            (&|s| s.scenario.walkers[0].route[0] = lane, "distance from patrols of the Landmarks route"),
            (&|s| s.scenario.walkers[0].speed = 1.3, "fastest walker"),
            (&|s| s.scenario.walkers.truncate(20), "20 people, not 27"),
            (&|s| s.routes.truncate(2), "no route of kind Landmarks"),
            (&|s| s.routes[2].way = s.routes[1].way.clone(), "distance from patrols of the Landmarks route"),
            (&|s| s.routes[0].way = s.routes[2].way.clone(), "bare part of the Bare route"),
            (&|s| s.routes[1].way = s.routes[2].way.clone(), "among people of the Crowded route"),
        ] {
            let found = faults_after(change);
            assert!(found.contains(fault), "{fault}: {found}");
        }
    }

    #[test]
    fn scenes_the_paper_does_not_have_are_refused() {
        assert!(matches!(environment(5, "s1", 1), Err(SceneError::Unpublished { .. })));
    }
}
