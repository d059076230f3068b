//! Which paths are worth timing, besides the branches of the tree.

use crate::collision::CollisionChecker;
use crate::generation::GenerationInput;
use crate::generation::path::Path;
use crate::generation::way_past::way_past;
use crate::geometry::{Point2, Pose2, Twist, bearing, wrap_angle};
use crate::motion::step;
use crate::numerics::sin_cos;

/// Directions of the straight ways tried when little else is free.
const FAN: u32 = 24;
/// Arcs offered beside the tree's branches, which tend to share their beginnings: an odd number, the
/// middle one straight.
const ARCS: u32 = 13;
/// How much of the way to the goal has to be free of people for a turn towards it to count, metres.
const BEGINNING: f64 = 1.2;
/// How far along a way it says which direction the way takes, metres.
const DIRECTION_AT: f64 = 0.4;
/// Spacing of the waypoints of a descent to the goal, metres.
const DESCENT: f64 = 0.2;
/// Spacing of the lattice on which a robot that has lost patience looks for a way past people, metres.
const PASSING: f64 = 0.06;
/// The same for one that does not get away from where it is.
const LEAVING: f64 = 0.03;

/// A path to be timed.
pub(super) struct Proposal {
    pub(super) path: Path,
    /// Whether the robot first turns on the spot until it faces the path.
    pub(super) turn_first: bool,
    /// Offered even if others are better: the way to the goal and what was decided before.
    pub(super) pinned: bool,
    /// Turning on the spot towards a way that lies behind: it counts as moving.
    pub(super) turns_to_goal: bool,
}

impl Proposal {
    pub(super) fn of(path: Path) -> Self {
        Self { path, turn_first: false, pinned: false, turns_to_goal: false }
    }

    fn pinned(path: Path) -> Self {
        Self { pinned: true, ..Self::of(path) }
    }
}

/// Proposes paths from where the robot is.
pub(super) struct Proposer<'a> {
    pub(super) input: &'a GenerationInput<'a>,
    pub(super) checker: &'a CollisionChecker<'a>,
    /// Greatest length of a path, metres.
    pub(super) reach: f64,
}

impl Proposer<'_> {
    /// The previous decision continued, the way past people if patience is lost, and the shortest `way` to the goal. If
    /// one of the two ways lies behind, it is also proposed after a turn on the spot.
    pub(super) fn goal_directed(&self, way: &[Point2]) -> Vec<Proposal> {
        let besides = self.input.params.generation.candidates.besides;
        let mut proposals = Vec::new();
        if besides.previous {
            proposals.extend(self.previous_continued());
        }
        if self.input.scene.impatient
            && let Some(past) = way_past(self.input, self.checker, PASSING)
        {
            let mut path = self.path(past);
            self.go_on_to_goal(&mut path, self.reach);
            let ahead = path.at(DIRECTION_AT);
            if self.lies_behind(ahead) {
                proposals.push(turned_to(&path, true));
            }
            proposals.push(Proposal::pinned(path));
        }
        if besides.shortest_way
            && let Some(&ahead) = way.get(way.len().min(4).wrapping_sub(1))
        {
            let path = self.path(way.iter().copied());
            if self.lies_behind(ahead) {
                proposals.push(turned_to(&path, !self.is_occupied(&path)));
            }
            proposals.push(Proposal::pinned(path));
        }
        proposals
    }

    /// What is left of the previous decision, and from its end on the shortest way.
    fn previous_continued(&self) -> Option<Proposal> {
        let previous = self.input.previous.filter(|poses| !poses.is_empty())?;
        let mut path = self.path(previous.iter().map(|pose| pose.position()));
        let rest = self.reach - path.length();
        if rest > Path::SPACING {
            self.go_on_to_goal(&mut path, rest);
        }
        Some(Proposal::pinned(path))
    }

    /// What is left of the previous decision alone, after a turn if it does not begin ahead.
    pub(super) fn rest_of_previous(&self) -> Option<Proposal> {
        let path = self.path(self.input.previous?.iter().map(|pose| pose.position()));
        let turn_first = self.is_to_be_turned_to(self.bearing_off(path.at(DIRECTION_AT)));
        Some(Proposal { turn_first, ..Proposal::pinned(path) })
    }

    /// The straight beginning of the way past people, for a robot that does not get away; nothing if there is no way.
    pub(super) fn out_of_here(&self) -> Option<Proposal> {
        let way = way_past(self.input, self.checker, LEAVING)?;
        let corner = *way.first()?;
        let turn_first = self.is_to_be_turned_to(self.bearing_off(corner));
        Some(Proposal { turn_first, ..Proposal::pinned(self.path([corner])) })
    }

    /// Arcs from the tightest left to the tightest right, evenly spaced in curvature.
    pub(super) fn arcs(&self) -> impl Iterator<Item = Proposal> {
        let turning_radius = self.input.params.generation.tree.turning_radius;
        let middle = f64::from(ARCS / 2);
        (0..ARCS).map(move |k| self.arc((middle - f64::from(k)) / (middle * turning_radius)))
    }

    fn arc(&self, curvature: f64) -> Proposal {
        let pose = self.pose();
        let twist = Twist { v: 1.0, omega: curvature };
        // Half a circle at most: more would come back to where others lead.
        let length = self.reach.min(std::f64::consts::PI / curvature.abs().max(1e-6));
        let count = (length / Path::SPACING) as usize;
        let points = (1..=count).map(|n| step(pose, twist, n as f64 * Path::SPACING).position());
        Proposal::of(self.until_wall(Path::new(pose.position(), points, length)))
    }

    /// Straight ways in all directions, the first towards the end of `way`.
    pub(super) fn fan(&self, way: &[Point2]) -> Vec<Proposal> {
        let pose = self.pose();
        let first = way.last().map_or(pose.heading, |&end| bearing(pose.position(), end));
        (0..FAN)
            .map(|k| self.straight(first + f64::from(k) * std::f64::consts::TAU / f64::from(FAN)))
            .collect()
    }

    fn straight(&self, angle: f64) -> Proposal {
        let pose = self.pose();
        let (sin, cos) = sin_cos(angle);
        let end = Point2::new(pose.x + self.reach * cos, pose.y + self.reach * sin);
        // Next to a person even a small turn has to come first.
        let turn_first = self.is_to_be_turned_to(wrap_angle(angle - pose.heading).abs());
        Proposal { turn_first, ..Proposal::of(self.until_wall(self.path([end]))) }
    }

    fn pose(&self) -> Pose2 {
        self.input.scene.belief.pose
    }

    fn path(&self, points: impl IntoIterator<Item = Point2>) -> Path {
        Path::new(self.pose().position(), points, self.reach)
    }

    /// Lets `path` go on from its end along the shortest way, of which it asks for `metres`.
    fn go_on_to_goal(&self, path: &mut Path, metres: f64) {
        path.extend(self.input.geodesic.descend_for(path.end(), DESCENT, metres), self.reach);
    }

    /// How far off the robot's heading a point lies, radians.
    fn bearing_off(&self, point: Point2) -> f64 {
        let pose = self.pose();
        wrap_angle(bearing(pose.position(), point) - pose.heading).abs()
    }

    /// Whether the robot turns on the spot before it drives to what lies `off` radians off its heading.
    fn is_to_be_turned_to(&self, off: f64) -> bool {
        off > self.input.params.generation.rollout.turn_until
    }

    /// Whether a way that leads to `ahead` first is offered after a turn on the spot as well.
    fn lies_behind(&self, ahead: Point2) -> bool {
        self.bearing_off(ahead) > self.input.params.generation.candidates.turn_from
    }

    /// Whether a person is in the way at the beginning of a path: turning to it leads nowhere yet.
    fn is_occupied(&self, path: &Path) -> bool {
        let people = &self.input.scene.people;
        let contact = self.input.robot.radius() + people.radius;
        let first = (BEGINNING / Path::SPACING) as usize;
        path.points()
            .iter()
            .take(first)
            .any(|p| (0..people.len()).any(|i| people.position(i).distance_squared(*p) < contact * contact))
    }

    /// The part of a path that keeps clear of walls.
    fn until_wall(&self, path: Path) -> Path {
        let heading = self.pose().heading;
        let clear = path.points()[1..]
            .iter()
            .take_while(|p| self.checker.wall_clear(Pose2::new(p.x, p.y, heading)))
            .count();
        Path::new(path.points()[0], path.points()[1..].iter().copied(), clear as f64 * Path::SPACING + 1e-6)
    }
}

fn turned_to(path: &Path, turns_to_goal: bool) -> Proposal {
    Proposal { turn_first: true, turns_to_goal, ..Proposal::pinned(path.clone()) }
}
