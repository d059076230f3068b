//! The anchor `hrvo-robot`: the robot as one agent among people who all avoid each other by hybrid reciprocal velocity
//! obstacles, on its shortest way ([`crate::hrvo`]; Snape et al., 2011).
//!
//! The law is one of bodies that can go in any direction, which a point ahead of the wheels' axis can: as by Snape et
//! al., that point is the body's centre, and its radius covers the robot around it. Each candidate is the law applied
//! over and over while people go on as they go; a person takes as much room as the final check asks.

use crate::collision::CollisionChecker;
use crate::generation::commanded::Commanded;
use crate::generation::{Generated, GenerationInput, Pace, Tree};
use crate::geometry::{Point2, Pose2, Twist};
use crate::hrvo::{Body, Velocity, VelocityObstacle, velocity};
use crate::numerics::sin_cos;
use crate::occupancy::Detour;

/// Farther off than this a wall is not felt, metres beyond the body.
const WALL_M: f64 = 1.0;

/// The candidates of one cycle.
pub fn generate(input: &GenerationInput<'_>, _: Option<Tree>, pace: &Pace<'_>) -> Generated {
    let params = &input.params.generation.hrvo_robot;
    let mut offered = Commanded::new(input, params.offers);
    let checker = input.checker();
    let ways = input.ways_past(params.around);
    for k in 0..params.offers {
        if k > 0 && pace.is_over(Pace::GROWTH) {
            break;
        }
        let max_speed = input.robot.v_max * (1.0 - f64::from(k) / f64::from(params.offers));
        offered.add(|time, pose, twist| command(input, (&checker, &ways), max_speed, (time, pose, twist)));
    }
    Generated { candidates: offered.into_candidates(), tree: Tree::default() }
}

/// What the law asks of the robot at `pose`, with people as they are after `time` seconds.
fn command(
    input: &GenerationInput<'_>,
    (checker, ways): (&CollisionChecker<'_>, &Detour<'_>),
    max_speed: f64,
    (time, pose, twist): (f64, Pose2, Twist),
) -> Twist {
    let params = &input.params.generation.hrvo_robot;
    let people = &input.scene.people;
    let here = pose.position();
    let (sine, cosine) = sin_cos(pose.heading);
    let forwards = Velocity::new(cosine, sine);
    let left = Velocity::new(-sine, cosine);
    let centre = Point2::new(here.x + params.lead * cosine, here.y + params.lead * sine);
    let way = ways.descend_for(here, 0.2, params.lead + params.ahead);
    let ahead = way.last().copied().filter(|p| p.distance(here) > params.lead + 0.2).unwrap_or(input.goal);
    let to_go = Velocity::new(ahead.x - centre.x, ahead.y - centre.y);
    let speed = max_speed.min((2.0 * input.robot.a_max * here.distance(input.goal)).sqrt());
    let preferred = if to_go.norm() > 1e-6 { to_go * (speed / to_go.norm()) } else { Velocity::zeros() };
    let me = Body {
        position: centre,
        velocity: forwards * twist.v + left * (twist.omega * params.lead),
        preferred,
        radius: input.robot.radius() + params.lead,
        yields: true,
    };
    let person = |i: usize| {
        let velocity = Velocity::new(people.vx[i], people.vy[i]);
        let radius = people.radius + checker.gap_asked(i, time);
        let position = people.position_after(i, time);
        // One who stands is taken for one who goes on standing.
        Body { position, velocity, preferred: velocity, radius, yields: velocity.norm() > 0.0 }
    };
    let bodies: Vec<Body> = std::iter::once(me).chain((0..people.len()).map(person)).collect();
    let wall = wall(input, here).into_iter();
    let chosen = velocity(0, &bodies, wall, max_speed, input.params.dt, &params.law);
    let along = chosen.dot(&forwards);
    let across = chosen.dot(&left);
    // It has no reverse gear: it turns to what lies behind, as fast as the law would have it go.
    let turn = if along < 0.0 { across.signum() * chosen.norm() } else { across };
    Twist { v: along.max(0.0), omega: turn / params.lead }
}

/// What the nearest wall forbids, if it is near: its direction is that in which the distance falls.
fn wall(input: &GenerationInput<'_>, here: Point2) -> Option<VelocityObstacle> {
    let map = input.map;
    let h = input.map.grid.resolution();
    let at =
        |dx: f64, dy: f64| map.to_obstacle.between_cells(&map.grid, Point2::new(here.x + dx, here.y + dy));
    let gap = at(0.0, 0.0) - input.robot.radius();
    let falls = Velocity::new(at(-h, 0.0) - at(h, 0.0), at(0.0, -h) - at(0.0, h));
    let towards = falls.try_normalize(1e-9).filter(|_| gap < WALL_M)?;
    let horizon = input.params.generation.hrvo_robot.law.wall_horizon_s;
    Some(VelocityObstacle::of_wall(towards, gap.max(0.0), horizon))
}
