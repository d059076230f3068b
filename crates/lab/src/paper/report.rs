//! What a scene turned out to be like, and what it falls short of.

use std::fmt;

use curionav_planning::geometry::Point2;

use super::scene::RouteKind;

/// Distance from people's patrols from which a way counts as free of people, metres (D16).
const AWAY_M: f64 = 2.5;
/// Beams on landmarks, weakest direction, that hold the pose: a wall across three degrees of view.
pub(super) const LEAST_HOLD: f64 = 3.0;

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
    /// Least distance to any patrol, metres.
    pub to_patrols: f64,
    /// Metres of it within 1.5 m of some patrol.
    pub among_people: f64,
    /// Metres from the start until the laser, looking along the way, first holds the pose.
    pub until_held: f64,
    /// Least hold after that: beams that would meet a wall head-on across the weakest direction, up to the goal.
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
    /// Metres of the direct way within 1.5 m of some patrol.
    pub direct_among_people: f64,
    /// Least distance from a patrol to start or goal, metres.
    pub ends_to_patrols: f64,
    /// Least distance of a patrol to walls and unknown space, metres.
    pub patrol_clearance: f64,
    /// Shortest and longest patrol, metres.
    pub patrol_lengths: (f64, f64),
    /// Slowest and fastest walker, m/s.
    pub speeds: (f64, f64),
    /// The routes, in the scene's order.
    pub routes: Vec<RouteReport>,
    /// The direct way itself, a point about every 10 cm.
    pub direct_way: Vec<Point2>,
    pub(super) wanted: Option<Wanted>,
}

/// Published numbers the report compares with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wanted {
    pub(super) known_cells: usize,
    pub(super) landmark_cells: usize,
    pub(super) people: usize,
    pub(super) laser_range: f64,
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
        within("distance of patrols to walls", self.patrol_clearance, 0.3, far);
        if self.people > 0 {
            within("slowest walker", self.speeds.0, 0.3, 1.0);
            within("fastest walker", self.speeds.1, 0.3, 1.0);
        }
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
            within("distance from patrols to start and goal", self.ends_to_patrols, AWAY_M, far);
            within("shortest patrol", self.patrol_lengths.0, 4.0, 10.0);
            within("longest patrol", self.patrol_lengths.1, 4.0, 10.0);
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
                within(&what("distance from patrols"), self.to_patrols, AWAY_M, far);
                within(&what("length over direct"), self.length / direct, 1.0, 1.25);
            }
            RouteKind::Crowded => {
                within(&what("part among people"), self.among_people, 8.0, far);
                within(&what("length over direct"), self.length / direct, 0.99, 1.1);
            }
            RouteKind::Landmarks => {
                within(&what("bare part"), self.bare, 0.0, 4.0);
                within(&what("distance from patrols"), self.to_patrols, AWAY_M, far);
                within(&what("length over direct"), self.length / direct, 1.0, 1.1);
                within(&what("way until the pose is held"), self.until_held, 0.0, 6.0);
                within(&what("least hold of the pose"), self.least_hold, LEAST_HOLD, far);
            }
        }
    }
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
            "  patrols {:.2} to {:.2} m long, {:.2} to {:.2} m/s, {:.2} m from the floor's edge, {:.2} m from start and goal",
            self.patrol_lengths.0,
            self.patrol_lengths.1,
            self.speeds.0,
            self.speeds.1,
            self.patrol_clearance,
            self.ends_to_patrols
        )?;
        for r in &self.routes {
            writeln!(
                f,
                "  {:?} route {:.2} m, {:.2} m bare, {:.2} m among people, {:.2} m from patrols, clearance {:.2} m, held from {:.2} m on with at least {:.1} beams",
                r.kind,
                r.length,
                r.bare,
                r.among_people,
                r.to_patrols,
                r.clearance,
                r.until_held,
                r.least_hold
            )?;
        }
        self.faults().iter().try_for_each(|fault| writeln!(f, "  fault: {fault}"))
    }
}
