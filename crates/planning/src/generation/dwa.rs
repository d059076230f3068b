//! The anchor `dwa`: the dynamic window approach (Fox, Burgard and Thrun, 1997) with the critics of Nav2's DWB.
//!
//! Each cycle tries the pairs of speed and turn rate that the robot can reach within one planning step, and prefers the
//! arc that costs least. The critics are DWB's `PathAlign`, `GoalAlign`, `PathDist`, `GoalDist` and `BaseObstacle` with
//! its weights, for metres. Two things are better than there: distances to the goal are geodesic, and people are where
//! they are forecast to be at each moment, as for every planner here. `RotateToGoal` and `Oscillation` are left out: no
//! heading is asked at the goal, and the robot has no reverse gear.

use crate::collision::CollisionChecker;
use crate::generation::commanded::Commanded;
use crate::generation::{Generated, GenerationInput, Pace, Tree};
use crate::geometry::{Point2, Twist};
use crate::motion::step;
use crate::numerics::{exp, sin_cos};
use crate::occupancy::Detour;

/// Seconds between two looks at an arc.
const LOOK_S: f64 = 0.1;
/// Spacing of the shortest way, metres.
const SPACING_M: f64 = 0.1;

/// The candidates of one cycle.
pub fn generate(input: &GenerationInput<'_>, _: Option<Tree>, pace: &Pace<'_>) -> Generated {
    let params = &input.params.generation.dwa;
    let robot = input.robot;
    let (pose, now) = input.scene.belief.motion();
    let reach = robot.v_max * params.look_ahead + params.ahead + 1.0;
    let ways = input.ways_past(params.around);
    let way = ways.descend_for(pose.position(), SPACING_M, reach);
    let slowest = robot.limit(now, Twist { v: 0.0, omega: -robot.omega_max }, input.params.dt);
    let fastest = robot.limit(now, Twist { v: robot.v_max, omega: robot.omega_max }, input.params.dt);
    let count = params.samples;
    let share = |k: u32, a: f64, b: f64| a + (b - a) * f64::from(k) / f64::from(count - 1);
    let checker = input.checker();
    let mut arcs: Vec<(f64, Twist)> = Vec::with_capacity((count * count) as usize);
    for i in 0..count {
        if i > 0 && pace.is_over(Pace::GROWTH) {
            break;
        }
        for j in 0..count {
            let twist =
                Twist { v: share(i, slowest.v, fastest.v), omega: share(j, slowest.omega, fastest.omega) };
            arcs.push((cost(input, &checker, (&ways, &way), twist), twist));
        }
    }
    arcs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut offered = Commanded::new(input, params.offers);
    for (_, twist) in arcs.into_iter().filter(|(cost, _)| cost.is_finite()).take(params.offers as usize) {
        // The whole arc; or if the robot could not stop after it, one step of it, as the method's authors demand.
        for seconds in [params.look_ahead, input.params.dt] {
            offered.add(|time, _, _| if time < seconds { twist } else { Twist::default() });
        }
    }
    Generated { candidates: offered.into_candidates(), tree: Tree::default() }
}

/// What the arc costs; infinite if it comes nearer to something than the final check allows.
fn cost(
    input: &GenerationInput<'_>,
    checker: &CollisionChecker<'_>,
    (ways, way): (&Detour<'_>, &[Point2]),
    twist: Twist,
) -> f64 {
    let params = &input.params.generation.dwa;
    let people = &input.scene.people;
    let contact = input.robot.radius() + people.radius;
    let mut pose = input.scene.belief.pose;
    let mut time = 0.0;
    let mut nearest = f64::INFINITY;
    let here = pose.position();
    while time < params.look_ahead {
        (pose, time) = (step(pose, twist, LOOK_S), time + LOOK_S);
        nearest = nearest.min(checker.wall_gap(pose));
        for i in 0..people.len() {
            let gap = people.position_after(i, time).distance(pose.position()) - contact;
            nearest = nearest.min(gap - checker.gap_asked(i, time));
        }
        if nearest < 0.0 {
            return f64::INFINITY;
        }
    }
    // As in DWB, the point ahead no longer counts where it would lie beyond the goal.
    let ahead = if here.distance(input.goal) < 2.0 * params.ahead { 0.0 } else { params.ahead };
    let (sine, cosine) = sin_cos(pose.heading);
    let ahead = Point2::new(pose.x + ahead * cosine, pose.y + ahead * sine);
    let from_way = |p: Point2| way.iter().map(|w| w.distance(p)).fold(f64::INFINITY, f64::min);
    let place = |p: Point2| params.path * from_way(p) + params.goal * ways.at(p);
    place(pose.position()) + place(ahead) + params.obstacle * exp(-params.decay * nearest)
}
