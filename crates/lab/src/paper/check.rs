//! Measures a finished scene against everything the paper and D16 and D17 ask of it.

use std::fmt;

use curionav_planning::geometry::{Point2, Pose2, bearing};
use curionav_planning::occupancy::{Cell, GeodesicField};

use super::observability::{hold, look};
use super::patrol::points;
use super::route::{Route, RouteKind};
use super::scene::PaperScene;

/// Spacing of samples along ways, metres: about two cells.
const SPACING_M: f64 = 0.1;
/// Distance from people's patrols from which a way counts as free of people, metres (D16).
const AWAY_M: f64 = 2.5;
/// Distance from people's patrols up to which a way counts as among people, metres.
const AMONG_M: f64 = 1.5;
/// Beams on landmarks, weakest direction, that hold the pose: a wall across three degrees of view.
const LEAST_HOLD: f64 = 3.0;
const FAR: f64 = f64::INFINITY;

/// A property of a scene and the range it should be in; both ends belong to it.
#[derive(Debug, Clone)]
struct Property {
    what: String,
    value: f64,
    least: f64,
    most: f64,
}

/// What a scene turned out to be like: lengths in metres, speeds in m/s, angles in radians.
#[derive(Debug, Clone, Default)]
pub struct Report {
    properties: Vec<Property>,
}

impl Report {
    fn add(&mut self, what: impl Into<String>, value: f64, (least, most): (f64, f64)) {
        self.properties.push(Property { what: what.into(), value, least, most });
    }

    /// What the scene falls short of, one line each; empty when it is as it should be.
    pub fn faults(&self) -> Vec<String> {
        self.properties.iter().filter_map(Property::fault).collect()
    }
}

impl Property {
    fn fault(&self) -> Option<String> {
        let Self { what, value, least, most } = self;
        if value >= least && value <= most {
            None
        } else if least == most {
            Some(format!("{value} {what}, not {most}"))
        } else {
            Some(format!("{what} is {value:.3}, not between {least:.3} and {most:.3}"))
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for property in &self.properties {
            writeln!(f, "  {} {:.3}", property.what, property.value)?;
        }
        self.faults().iter().try_for_each(|fault| writeln!(f, "  fault: {fault}"))
    }
}

/// Measures `scene`.
pub fn check(scene: &PaperScene) -> Report {
    let map = &scene.map;
    let grid = &*map.grid;
    let scenario = &scene.scenario;
    let start = scenario.robot.start.position();
    let goal = scenario.robot.goal;
    let range = scenario.laser.range_max;
    let cells = |what| (0..grid.cells().len()).filter(|&i| grid.cell(i) == what).count();
    let landmarks = cells(Cell::Occupied);
    let mut direct_way =
        GeodesicField::new(map, goal, scenario.robot.model.radius()).descend(start, SPACING_M);
    direct_way.push(goal);
    let direct = length(&direct_way);
    let patrols: Vec<Point2> = scenario.walkers.iter().flat_map(|w| points(&w.route, SPACING_M)).collect();
    let to_patrols = |p: Point2| least(patrols.iter().map(|b| b.distance(p)));
    let obstacle = |p: Point2| map.to_obstacle.at(grid, p);
    let landmark = |p: Point2| map.to_occupied.at(grid, p);
    let turn = scenario.robot.start.relative(Pose2::new(goal.x, goal.y, bearing(start, goal))).heading;

    let mut report = Report::default();
    report.add("distance from goal to walls", obstacle(goal), (1.0, FAR));
    report.add("distance from goal to the nearest landmark", landmark(goal), (0.0, range));
    report.add("distance of patrols to walls", least(patrols.iter().map(|&p| obstacle(p))), (0.3, FAR));
    let speeds = || scenario.walkers.iter().map(|w| w.speed);
    report.add("slowest walker", least(speeds()), (0.3, 1.0));
    report.add("fastest walker", most(speeds()), (0.3, 1.0));
    report.add("turn from start to goal", turn.abs(), (0.0, 0.8));
    // The rest is asked of the paper's scenes only.
    let published = scene.published;
    let wanted = |bounds| if published.is_some() { bounds } else { (0.0, FAR) };
    let exactly = |count: Option<usize>| count.map_or((0.0, FAR), |n| (n as f64, n as f64));
    report.add(
        "known cells",
        (landmarks + cells(Cell::Free)) as f64,
        exactly(published.map(|p| p.known_cells)),
    );
    report.add("landmark cells", landmarks as f64, exactly(published.map(|p| p.landmark_cells)));
    report.add("people", scenario.walkers.len() as f64, exactly(published.map(|p| p.people)));
    report.add("length of the direct way", direct, (0.0, FAR));
    if let Some(published) = published {
        let wanted = published.laser_range();
        report.add("laser range", range, (wanted - 1e-3, wanted + 1e-3));
        report.add("length of the direct way over Table V's", direct / published.shortest_m, (0.90, 0.95));
    }
    report.add("distance from start to landmarks", landmark(start), wanted((range + 1.0, range + 4.0)));
    report.add("distance from start to unknown space", obstacle(start), wanted((1.0, FAR)));
    let bare = length_where(&direct_way, |p| landmark(p) > range);
    report.add("bare part of the direct way", bare, wanted((8.0, FAR)));
    let crowded = length_where(&direct_way, |p| to_patrols(p) < AMONG_M);
    report.add("crowded part of the direct way", crowded, wanted((4.0, FAR)));
    let ends = to_patrols(start).min(to_patrols(goal));
    report.add("distance from patrols to start and goal", ends, wanted((AWAY_M, FAR)));
    let lengths = || scenario.walkers.iter().map(|w| length(&w.route));
    report.add("shortest patrol", least(lengths()), wanted((4.0, 10.0)));
    report.add("longest patrol", most(lengths()), wanted((4.0, 10.0)));
    for kind in [RouteKind::Bare, RouteKind::Crowded, RouteKind::Landmarks] {
        let routes: Vec<&Route> = scene.routes.iter().filter(|route| route.kind == kind).collect();
        report.add(format!("routes of kind {kind:?}"), routes.len() as f64, wanted((1.0, 1.0)));
        for route in routes {
            add_route(&mut report, scene, route, direct, &to_patrols);
        }
    }
    report
}

fn add_route(
    report: &mut Report,
    scene: &PaperScene,
    route: &Route,
    direct: f64,
    to_patrols: &dyn Fn(Point2) -> f64,
) {
    let way = points(&route.way, SPACING_M);
    let map = &scene.map;
    let grid = &scene.map.grid;
    let laser = &scene.scenario.laser;
    let all = length(&way);
    let bare = length_where(&way, |p| map.to_occupied.at(grid, p) > laser.range_max);
    let clearance = least(way.iter().map(|&p| map.to_obstacle.at(grid, p)));
    let away = least(way.iter().map(|&p| to_patrols(p)));
    let mut add = |property: &str, value: f64, bounds: (f64, f64)| {
        report.add(format!("{property} of the {:?} route", route.kind), value, bounds);
    };
    // Half of a lane 2.5 m wide.
    let lane = if route.kind == RouteKind::Crowded { 0.45 } else { 1.25 };
    add("clearance", clearance, (lane, FAR));
    match route.kind {
        RouteKind::Bare => {
            add("bare part", bare / all, (0.6, 1.0));
            add("distance from patrols", away, (AWAY_M, FAR));
            add("length over direct", all / direct, (1.0, 1.25));
        }
        RouteKind::Crowded => {
            add("part among people", length_where(&way, |p| to_patrols(p) < AMONG_M), (8.0, FAR));
            add("length over direct", all / direct, (0.99, 1.1));
        }
        RouteKind::Landmarks => {
            let pose = |w: &[Point2]| Pose2::new(w[0].x, w[0].y, bearing(w[0], w[1]));
            let holds: Vec<f64> = way.windows(2).map(|w| hold(&look(map, laser, pose(w)))).collect();
            let held = holds.iter().position(|hold| *hold >= LEAST_HOLD).unwrap_or(holds.len());
            add("bare part", bare, (0.0, 4.0));
            add("distance from patrols", away, (AWAY_M, FAR));
            add("length over direct", all / direct, (1.0, 1.1));
            add("way until the pose is held", length(&way[..=held]), (0.0, 6.0));
            add("least hold of the pose", least(holds[held..].iter().copied()), (LEAST_HOLD, FAR));
        }
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

fn most(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::NEG_INFINITY, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::{CELL_M, PUBLISHED, SEED, environment, environments, quickstart};

    fn value(report: &Report, what: &str) -> f64 {
        report.properties.iter().find(|p| p.what == what).unwrap().value
    }

    /// Env4 S2.
    fn hall(seed: u64) -> PaperScene {
        environment(&PUBLISHED[11], seed).unwrap()
    }

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
            let report = check(&scene);
            let published = scene.published.unwrap();
            let found = ["people", "known cells", "landmark cells"].map(|what| value(&report, what) as usize);
            assert_eq!(found, [published.people, published.known_cells, published.landmark_cells]);
            let [_, known_cells, _] = found.map(|count| count as f64);
            for cell in [CELL_M, LITERAL_CELL_M] {
                let range = value(&report, "laser range") / CELL_M * cell;
                let area = known_cells * cell * cell;
                let rate = 0.5 * std::f64::consts::PI * range * range / area;
                // The table prints hundredths of a percent.
                assert!((rate - published.laser_rate).abs() < 5e-5, "{}: {rate}", scene.scenario.name);
            }
            let area = known_cells * LITERAL_CELL_M * LITERAL_CELL_M;
            assert!(printed_areas.iter().any(|printed| (area / printed - 1.0_f64).abs() < 1e-4), "{area}");
        }
    }

    #[test]
    fn the_quick_start_is_without_fault_and_crosses_its_crowd() {
        for seed in 0..10 {
            let report = check(&quickstart(seed).unwrap());
            assert!(report.faults().is_empty(), "seed {seed}:\n{report}");
            assert!((9.0..12.0).contains(&value(&report, "length of the direct way")), "{report}");
            assert!(value(&report, "bare part of the direct way") < 1e-9, "{report}");
            assert!(value(&report, "crowded part of the direct way") > 1.0, "{report}");
            assert!(value(&report, "distance from patrols to start and goal") > 1.5, "{report}");
        }
    }

    #[test]
    fn the_seed_moves_people_but_not_walls() {
        let a = hall(1);
        let b = hall(2);
        assert_eq!(a.map.grid.hash(), b.map.grid.hash());
        assert_ne!(a.scenario.walkers, b.scenario.walkers);
        assert_eq!(a.scenario, hall(1).scenario);
    }

    #[test]
    fn each_violation_is_noticed() {
        let good = hall(1);
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
            (&|s| s.routes.truncate(2), "0 routes of kind Landmarks, not 1"),
            (&|s| s.routes[2].way = s.routes[1].way.clone(), "distance from patrols of the Landmarks route"),
            (&|s| s.routes[0].way = s.routes[2].way.clone(), "bare part of the Bare route"),
            (&|s| s.routes[1].way = s.routes[2].way.clone(), "among people of the Crowded route"),
        ] {
            let found = faults_after(change);
            assert!(found.contains(fault), "{fault}: {found}");
        }
    }
}
