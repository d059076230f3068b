//! One body among others: which of them it minds, and which velocity it takes.

use super::velocity_obstacle::{Body, VelocityObstacle};
use super::{HrvoParams, Velocity, choice};

/// The velocity `bodies[me]` takes, before limits of acceleration. `walls` come before all bodies.
pub(crate) fn velocity(
    me: usize,
    bodies: &[Body],
    walls: impl Iterator<Item = VelocityObstacle>,
    max_speed: f64,
    dt: f64,
    params: &HrvoParams,
) -> Velocity {
    let cone =
        |other: usize| VelocityObstacle::of_body(&bodies[me], &bodies[other], dt, params.uncertainty_offset);
    let obstacles: Vec<_> = walls.chain(neighbors(me, bodies, params).map(cone)).collect();
    choice::choose(bodies[me].preferred, max_speed, &obstacles)
}

/// The nearest others within reach, nearest first, the lower index of equals; only those that overlap
/// if any do: parting comes first. A scan, because a crowd is some forty people.
fn neighbors(me: usize, bodies: &[Body], params: &HrvoParams) -> impl Iterator<Item = usize> {
    let Body { position, radius, .. } = bodies[me];
    let reach = params.neighbor_distance * params.neighbor_distance;
    let others = bodies.iter().enumerate().filter(|(index, _)| *index != me);
    let mut near: Vec<(f64, usize)> = others
        .map(|(index, other)| (position.distance_squared(other.position), index))
        .filter(|(far, _)| *far < reach)
        .collect();
    let overlaps = |(far, index): &(f64, usize)| {
        let touch = radius + bodies[*index].radius;
        *far < touch * touch
    };
    if near.iter().any(overlaps) {
        near.retain(overlaps);
    }
    near.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    near.into_iter().take(params.max_neighbors as usize).map(|(_, index)| index)
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Point2;

    use super::*;

    fn minded(x: &[f64], max_neighbors: u32) -> Vec<usize> {
        let at = |&x: &f64| Body {
            position: Point2::new(x, 0.0),
            velocity: Velocity::zeros(),
            preferred: Velocity::zeros(),
            radius: 0.25,
            yields: true,
        };
        let bodies: Vec<Body> = x.iter().map(at).collect();
        neighbors(0, &bodies, &HrvoParams { max_neighbors, ..HrvoParams::default() }).collect()
    }

    #[test]
    fn the_nearest_within_reach_are_minded_nearest_first() {
        assert_eq!(minded(&[0.0, 4.0, -1.0, 5.1, 2.0], 10), [2, 4, 1]);
        assert_eq!(minded(&[0.0, 4.0, -1.0, 5.1, 2.0], 2), [2, 4]);
        assert_eq!(minded(&[0.0, 1.0, -1.0, 1.0], 2), [1, 2]);
    }

    #[test]
    fn those_who_overlap_are_minded_alone() {
        assert_eq!(minded(&[0.0, 0.6, 0.4, 1.0, -0.3], 10), [4, 2]);
    }
}
