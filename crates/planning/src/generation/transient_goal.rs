//! The baseline `transient-goal`, after the paper's reference 8, whose behaviour is inferred from its title: a goal
//! nearby is chosen each cycle or kept, and a simple law drives to it.
//!
//! Goals lie on three arcs ahead. One is left out that a wall hides, or where a person is expected on arrival. The rest
//! cost their distance from a waypoint on the shortest way, the people around them then, and the change of direction; a
//! person who walks the same way ahead is worth following.

use crate::candidates::CandidateSet;
use crate::collision::CollisionChecker;
use crate::generation::commanded::Commanded;
use crate::generation::{Generated, GenerationInput, Pace, Tree};
use crate::geometry::{Point2, Pose2, Twist, bearing, wrap_angle};
use crate::numerics::{exp, sin_cos};
use crate::scene::People;
use crate::time_to_collision::time_to_collision;

/// Distances of goals, metres.
const DISTANCES_M: [f64; 3] = [1.0, 2.0, 3.0];
const BEARING_STEP: f64 = std::f64::consts::PI / 18.0;
/// How far ahead, and how nearly the same way, a person has to walk to be followed: metres, radians.
const FOLLOWED: (f64, f64) = (3.0, std::f64::consts::FRAC_PI_6);
/// Mean speed to a goal, as a share of the greatest.
const MEAN_SPEED: f64 = 0.6;

/// The column by which the goal is kept: x, y (m), and since when, seconds of the robot's clock.
const GOAL: &str = "goal";

/// The candidates of one cycle.
pub fn generate(input: &GenerationInput<'_>, tree: Option<Tree>, pace: &Pace<'_>) -> Generated {
    let params = &input.params.generation.transient_goal;
    let (pose, _) = input.scene.belief.motion();
    let here = pose.position();
    let way = input.geodesic.descend_for(here, 0.2, params.waypoint);
    let waypoint = if here.distance(input.goal) < params.waypoint { Some(&input.goal) } else { way.last() };
    let Some(&waypoint) = waypoint else {
        return Generated {
            candidates: CandidateSet::empty(input.params.steps, input.params.dt),
            tree: Tree::default(),
        };
    };
    let checker = input.checker();
    let kept = kept(tree.as_ref()).filter(|&(goal, since)| {
        let age = input.scene.stamp - since;
        (0.0..params.keep).contains(&age)
            && goal.distance(here) > params.reached
            && is_open(input, &checker, goal)
    });
    let old = kept.map(|(goal, _)| bearing(here, goal));
    let mut ranked: Vec<(f64, Point2)> =
        goals(input, &checker, waypoint).map(|goal| (cost(input, goal, waypoint, old), goal)).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut offered = Commanded::new(input, params.offers);
    let mut chosen = None;
    for (goal, since) in kept.into_iter().chain(ranked.into_iter().map(|(_, goal)| (goal, input.scene.stamp)))
    {
        if offered.is_full() || (chosen.is_some() && pace.is_over(Pace::GROWTH)) {
            break;
        }
        let radius = input.robot.radius();
        let people = &input.scene.people;
        if time_to_collision(pose, command(input, pose, goal), radius, people) < params.least_time {
            continue;
        }
        chosen = chosen.or(Some((goal, since)));
        offered.add(|_, pose, _| command(input, pose, goal));
    }
    let carried = |(goal, since): (Point2, f64)| Tree::new(Vec::new(), [(GOAL, vec![goal.x, goal.y, since])]);
    Generated { candidates: offered.into_candidates(), tree: chosen.map(carried).unwrap_or_default() }
}

/// The goal of the last cycle, and since when it is one.
pub(super) fn kept(tree: Option<&Tree>) -> Option<(Point2, f64)> {
    let [goal] = tree?.columns([GOAL])?;
    let &[x, y, since] = goal else { return None };
    Some((Point2::new(x, y), since))
}

/// Those in sight and free of people on arrival, and the goal itself if it is near.
fn goals<'a>(
    input: &'a GenerationInput<'a>,
    checker: &'a CollisionChecker<'a>,
    waypoint: Point2,
) -> impl Iterator<Item = Point2> + 'a {
    let pose = input.scene.belief.pose;
    let side = input.params.generation.transient_goal.bearings as i32;
    let on_arcs = DISTANCES_M.into_iter().flat_map(move |distance| {
        (-side..=side).map(move |k| {
            let (sine, cosine) = sin_cos(pose.heading + f64::from(k) * BEARING_STEP);
            Point2::new(pose.x + distance * cosine, pose.y + distance * sine)
        })
    });
    let last = Some(waypoint).filter(|w| *w == input.goal && w.distance(pose.position()) <= DISTANCES_M[2]);
    on_arcs.chain(last).filter(move |&goal| is_open(input, checker, goal))
}

/// Seconds until the robot is at the goal.
fn arrival(input: &GenerationInput<'_>, goal: Point2) -> f64 {
    input.scene.belief.pose.position().distance(goal) / (MEAN_SPEED * input.robot.v_max)
}

/// Whether no wall is between the robot and the goal, and no person there on arrival.
fn is_open(input: &GenerationInput<'_>, checker: &CollisionChecker<'_>, goal: Point2) -> bool {
    let pose = input.scene.belief.pose;
    let people = &input.scene.people;
    let contact = input.robot.radius() + people.radius;
    let t = arrival(input, goal);
    let to = Pose2::new(goal.x, goal.y, bearing(pose.position(), goal));
    (0..people.len()).all(|i| people.position_after(i, t).distance(goal) > contact)
        && checker.segment_wall_clear(pose, to)
}

fn cost(input: &GenerationInput<'_>, goal: Point2, waypoint: Point2, old: Option<f64>) -> f64 {
    let params = &input.params.generation.transient_goal;
    let people = &input.scene.people;
    let here = input.scene.belief.pose.position();
    let t = arrival(input, goal);
    let near = |i: usize| {
        let d = people.position_after(i, t).distance(goal) / params.people_sigma;
        exp(-0.5 * d * d)
    };
    let crowd: f64 = (0..people.len()).map(near).sum();
    let direction = bearing(here, goal);
    let change = old.map_or(0.0, |old| wrap_angle(direction - old).abs());
    let followed = (0..people.len()).any(|i| goes_ahead(people, i, here, direction, bearing(here, waypoint)));
    let follow = if followed { params.follow } else { 0.0 };
    goal.distance(waypoint) + params.people * crowd + params.change * change - follow
}

/// Whether a person is ahead in `direction` and walks towards `wanted`.
fn goes_ahead(people: &People, i: usize, here: Point2, direction: f64, wanted: f64) -> bool {
    let (far, angle) = FOLLOWED;
    let p = people.position(i);
    let course = bearing(Point2::default(), Point2::new(people.vx[i], people.vy[i]));
    p.distance(here) < far
        && people.speed(i) > 0.1
        && wrap_angle(bearing(here, p) - direction).abs() < angle
        && wrap_angle(course - wanted).abs() < angle
}

/// The law that drives to a goal: faster the farther it is, and slower the more it lies aside.
fn command(input: &GenerationInput<'_>, pose: Pose2, goal: Point2) -> Twist {
    let params = &input.params.generation.transient_goal;
    let off = wrap_angle(bearing(pose.position(), goal) - pose.heading);
    let speed = (params.speed_gain * pose.position().distance(goal)).min(input.robot.v_max);
    if pose.position().distance(goal) < 0.05 {
        return Twist::default();
    }
    Twist { v: speed * sin_cos(off).1.max(0.0), omega: params.turn_gain * off }
}
