//! Measures a finished scene against everything the paper and D16 and D17 ask of it.

use std::fmt;

use curionav_planning::geometry::{Point2, Pose2, bearing};
use curionav_planning::occupancy::{Cell, GeodesicField, StaticMap};

use super::beats::points;
use super::sight::{Sight, look};
use super::{PaperScene, RouteKind};

/// Spacing of samples along ways, metres: about two cells.
const SPACING_M: f64 = 0.1;
/// Distance from people's beats from which a way counts as free of people, metres (D16).
const AWAY_M: f64 = 2.5;
/// Beams on landmarks, weakest direction, that hold the pose: a wall across three degrees of view.
const LEAST_HOLD: f64 = 3.0;

/// What one route turned out to be like.
#[derive(Debug, Clone, PartialEq)]
pub struct RouteReport {
    /// What it is meant to be.
    pub kind: RouteKind,
    /// Metres.
    pub length: f64,
    /// Metres of it with no landmark within laser range.
    pub bare: f64,
    /// Least distance to walls and unknown space, metres.
    pub clearance: f64,
    /// Least distance to any beat, metres.
    pub to_beats: f64,
    /// Metres of it within 1.5 m of some beat.
    pub among_people: f64,
    /// Metres from the start until the laser, looking along the way, first holds the pose.
    pub until_held: f64,
    /// Least [`Sight::hold`] after that, up to the goal.
    pub least_hold: f64,
}

/// What a scene turned out to be like.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Free and occupied cells.
    pub known_cells: usize,
    /// Occupied cells.
    pub landmark_cells: usize,
    /// Scripted people.
    pub people: usize,
    /// Metres.
    pub laser_range: f64,
    /// Distance from the start to the nearest landmark, metres.
    pub start_to_landmark: f64,
    /// Distance from the start to walls and unknown space, metres.
    pub start_clearance: f64,
    /// Angle between the start's heading and the goal, radians.
    pub start_turn: f64,
    /// Distance from the goal to walls and unknown space, metres.
    pub goal_clearance: f64,
    /// Distance from the goal to the nearest landmark, metres.
    pub goal_to_landmark: f64,
    /// Length of the direct way, the shortest the robot's disc can take, metres.
    pub direct: f64,
    /// That length over the shortest in Table V; none for a scene of our own.
    pub direct_over_published: Option<f64>,
    /// Metres of the direct way with no landmark within laser range.
    pub direct_bare: f64,
    /// Metres of the direct way within 1.5 m of some beat.
    pub direct_among_people: f64,
    /// Least distance from a beat to start or goal, metres.
    pub ends_to_beats: f64,
    /// Least distance of a beat to walls and unknown space, metres.
    pub beat_clearance: f64,
    /// Shortest and longest beat, metres.
    pub beat_lengths: (f64, f64),
    /// Slowest and fastest walker, m/s.
    pub speeds: (f64, f64),
    /// The routes, in the scene's order.
    pub routes: Vec<RouteReport>,
    /// The direct way itself, a point about every 10 cm.
    pub direct_way: Vec<Point2>,
    wanted: Option<Wanted>,
}

/// Published numbers the report compares with.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Wanted {
    known_cells: usize,
    landmark_cells: usize,
    people: usize,
    laser_range: f64,
}

/// Measures `scene`.
pub fn check(scene: &PaperScene) -> Report {
    let map = StaticMap::new(scene.grid.clone());
    let scenario = &scene.scenario;
    let (start, goal) = (scenario.robot.start.position(), scenario.robot.goal);
    let range = scenario.laser.range_max;
    let cells = |what| (0..scene.grid.cells().len()).filter(|&i| scene.grid.cell(i) == what).count();
    let landmark_cells = cells(Cell::Occupied);
    let geodesic = GeodesicField::new(&scene.grid, &map.to_obstacle, goal, scenario.robot.model.radius());
    let mut direct_way = geodesic.descend(&scene.grid, start, SPACING_M);
    direct_way.push(goal);
    let direct = length(&direct_way);
    let beats: Vec<Point2> = scenario.walkers.iter().flat_map(|w| points(&w.route, SPACING_M)).collect();
    let to_beats = |p: Point2| least(beats.iter().map(|b| b.distance(p)));
    let of_walkers = |value: &dyn Fn(usize) -> f64| spread((0..scenario.walkers.len()).map(value));
    let obstacle = |p: Point2| map.to_obstacle.at(&scene.grid, p);
    let landmark = |p: Point2| map.to_occupied.at(&scene.grid, p);
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
        direct_among_people: length_where(&direct_way, |p| to_beats(p) < 1.5),
        ends_to_beats: to_beats(start).min(to_beats(goal)),
        beat_clearance: least(beats.iter().map(|&p| obstacle(p))),
        beat_lengths: of_walkers(&|i| length(&scenario.walkers[i].route)),
        speeds: of_walkers(&|i| scenario.walkers[i].speed),
        routes: scene.routes.iter().map(|r| measure(scene, &map, r.kind, &r.way, &to_beats)).collect(),
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
    map: &StaticMap,
    kind: RouteKind,
    corners: &[Point2],
    to_beats: &dyn Fn(Point2) -> f64,
) -> RouteReport {
    let way = points(corners, SPACING_M);
    let laser = &scene.scenario.laser;
    let sights: Vec<Sight> =
        way.windows(2).map(|w| look(map, laser, Pose2::new(w[0].x, w[0].y, bearing(w[0], w[1])))).collect();
    let held = sights.iter().position(|s| s.hold >= LEAST_HOLD).unwrap_or(sights.len());
    RouteReport {
        kind,
        length: length(&way),
        bare: length_where(&way, |p| map.to_occupied.at(&scene.grid, p) > laser.range_max),
        clearance: least(way.iter().map(|&p| map.to_obstacle.at(&scene.grid, p))),
        to_beats: least(way.iter().map(|&p| to_beats(p))),
        among_people: length_where(&way, |p| to_beats(p) < 1.5),
        until_held: length(&way[..=held]),
        least_hold: least(sights[held..].iter().map(|s| s.hold)),
    }
}

impl Report {
    /// What the scene falls short of, one line each; empty when it is as it should be.
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        let mut within = |what: &str, value: f64, least: f64, most: f64| {
            if !(value >= least && value <= most) {
                faults.push(format!("{what} is {value:.3}, not between {least:.3} and {most:.3}"));
            }
        };
        let far = f64::INFINITY;
        within("distance from goal to walls", self.goal_clearance, 1.0, far);
        within("distance from goal to the nearest landmark", self.goal_to_landmark, 0.0, self.laser_range);
        within("distance of beats to walls", self.beat_clearance, 0.3, far);
        within("slowest walker", self.speeds.0, 0.3, 1.0);
        within("fastest walker", self.speeds.1, 0.3, 1.0);
        within("turn from start to goal", self.start_turn, 0.0, 0.8);
        if let Some(wanted) = self.wanted {
            let same = |what: &str, found: usize, wanted: usize| {
                (found != wanted).then(|| format!("{found} {what}, not {wanted}"))
            };
            within("laser range", self.laser_range, wanted.laser_range - 1e-3, wanted.laser_range + 1e-3);
            within(
                "length of the direct way over Table V's",
                self.direct_over_published.unwrap_or(0.0),
                0.90,
                0.95,
            );
            within(
                "distance from start to landmarks",
                self.start_to_landmark,
                self.laser_range + 1.0,
                self.laser_range + 4.0,
            );
            within("distance from start to unknown space", self.start_clearance, 1.0, far);
            within("bare part of the direct way", self.direct_bare, 8.0, far);
            within("crowded part of the direct way", self.direct_among_people, 4.0, far);
            within("distance from beats to start and goal", self.ends_to_beats, AWAY_M, far);
            within("shortest beat", self.beat_lengths.0, 4.0, 10.0);
            within("longest beat", self.beat_lengths.1, 4.0, 10.0);
            for route in &self.routes {
                route.compare(self.direct, &mut within);
            }
            faults.extend(same("known cells", self.known_cells, wanted.known_cells));
            faults.extend(same("landmark cells", self.landmark_cells, wanted.landmark_cells));
            faults.extend(same("people", self.people, wanted.people));
            for kind in [RouteKind::Bare, RouteKind::Crowded, RouteKind::Landmarks] {
                if !self.routes.iter().any(|r| r.kind == kind) {
                    faults.push(format!("there is no route of kind {kind:?}"));
                }
            }
        }
        faults
    }
}

impl RouteReport {
    fn compare(&self, direct: f64, within: &mut impl FnMut(&str, f64, f64, f64)) {
        let far = f64::INFINITY;
        let what = |property: &str| format!("{property} of the {:?} route", self.kind);
        // Half of a lane 2.5 m wide.
        within(
            &what("clearance"),
            self.clearance,
            if self.kind == RouteKind::Crowded { 0.45 } else { 1.25 },
            far,
        );
        match self.kind {
            RouteKind::Bare => {
                within(&what("bare part"), self.bare / self.length, 0.6, 1.0);
                within(&what("distance from beats"), self.to_beats, AWAY_M, far);
                within(&what("length over direct"), self.length / direct, 1.0, 1.25);
            }
            RouteKind::Crowded => {
                within(&what("part among people"), self.among_people, 8.0, far);
                within(&what("length over direct"), self.length / direct, 0.99, 1.1);
            }
            RouteKind::Landmarks => {
                within(&what("bare part"), self.bare, 0.0, 4.0);
                within(&what("distance from beats"), self.to_beats, AWAY_M, far);
                within(&what("length over direct"), self.length / direct, 1.0, 1.1);
                within(&what("way until the pose is held"), self.until_held, 0.0, 6.0);
                within(&what("least hold of the pose"), self.least_hold, LEAST_HOLD, far);
            }
        }
    }
}

fn length(way: &[Point2]) -> f64 {
    way.windows(2).map(|w| w[0].distance(w[1])).sum()
}

/// Metres of the way whose pieces begin where `holds`.
fn length_where(way: &[Point2], holds: impl Fn(Point2) -> bool) -> f64 {
    way.windows(2).filter(|w| holds(w[0])).map(|w| w[0].distance(w[1])).sum()
}

fn least(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::INFINITY, f64::min)
}

fn spread(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "  {} known cells, {} of them landmarks; {} people",
            self.known_cells, self.landmark_cells, self.people
        )?;
        writeln!(
            f,
            "  laser {:.3} m; start {:.2} m from landmarks, {:.2} m from the floor's edge",
            self.laser_range, self.start_to_landmark, self.start_clearance
        )?;
        writeln!(
            f,
            "  goal {:.2} m from landmarks, {:.2} m from the floor's edge",
            self.goal_to_landmark, self.goal_clearance
        )?;
        write!(
            f,
            "  direct way {:.2} m, {:.2} m bare, {:.2} m among people",
            self.direct, self.direct_bare, self.direct_among_people
        )?;
        match self.direct_over_published {
            Some(ratio) => writeln!(f, ", {ratio:.3} of the shortest in Table V")?,
            None => writeln!(f)?,
        }
        writeln!(
            f,
            "  beats {:.2} to {:.2} m long, {:.2} to {:.2} m/s, {:.2} m from the floor's edge, {:.2} m from start and goal",
            self.beat_lengths.0,
            self.beat_lengths.1,
            self.speeds.0,
            self.speeds.1,
            self.beat_clearance,
            self.ends_to_beats
        )?;
        for r in &self.routes {
            writeln!(
                f,
                "  {:?} route {:.2} m, {:.2} m bare, {:.2} m among people, {:.2} m from beats, clearance {:.2} m, held from {:.2} m on with at least {:.1} beams",
                r.kind, r.length, r.bare, r.among_people, r.to_beats, r.clearance, r.until_held, r.least_hold
            )?;
        }
        self.faults().iter().try_for_each(|fault| writeln!(f, "  fault: {fault}"))
    }
}
