//! One body among others: whom it minds and which velocity it takes.

use super::velocity_obstacle::{Body, VelocityObstacle};
use super::{HrvoParams, Velocity, choice};

/// Buffers of [`Self::velocity`], kept so that no step allocates.
#[derive(Debug, Clone, Default)]
pub struct Avoidance {
    /// (squared distance, index) of those minded, nearest first.
    neighbors: Vec<(f64, usize)>,
    obstacles: Vec<VelocityObstacle>,
}

impl Avoidance {
    /// The velocity `bodies[me]` takes, before limits of acceleration. `walls` come before everybody.
    pub fn velocity(
        &mut self,
        me: usize,
        bodies: &[Body],
        walls: &[VelocityObstacle],
        max_speed: f64,
        dt: f64,
        params: &HrvoParams,
    ) -> Velocity {
        self.find_neighbors(me, bodies, params);
        self.obstacles.clear();
        self.obstacles.extend_from_slice(walls);
        let cone = |&(_, other): &(f64, usize)| {
            VelocityObstacle::of_body(&bodies[me], &bodies[other], dt, params.uncertainty_offset)
        };
        self.obstacles.extend(self.neighbors.iter().map(cone));
        choice::choose(bodies[me].preferred, max_speed, &self.obstacles)
    }

    /// The nearest others within reach, nearest first, the lower index of equals; only those that overlap
    /// if anybody does: parting comes first. A scan, because a crowd is some forty people.
    fn find_neighbors(&mut self, me: usize, bodies: &[Body], params: &HrvoParams) {
        let at = bodies[me].position;
        let most = params.max_neighbors as usize;
        let reach = params.neighbor_distance * params.neighbor_distance;
        let mut overlapping = false;
        self.neighbors.clear();
        for (index, other) in bodies.iter().enumerate().filter(|(index, _)| *index != me) {
            let far = at.distance_squared(other.position);
            let touch = bodies[me].radius + other.radius;
            let overlaps = far < touch * touch;
            if far >= reach || (overlapping && !overlaps) {
                continue;
            }
            if overlaps && !overlapping {
                overlapping = true;
                self.neighbors.clear();
            }
            let place = self.neighbors.partition_point(|(nearer, _)| *nearer <= far);
            if place < most {
                self.neighbors.truncate(most - 1);
                self.neighbors.insert(place, (far, index));
            }
        }
    }
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
        let mut avoidance = Avoidance::default();
        avoidance.find_neighbors(0, &bodies, &HrvoParams { max_neighbors, ..HrvoParams::default() });
        avoidance.neighbors.iter().map(|(_, index)| *index).collect()
    }

    #[test]
    fn the_nearest_within_reach_are_minded_nearest_first() {
        assert_eq!(minded(&[0.0, 4.0, -1.0, 5.1, 2.0], 10), [2, 4, 1]);
        assert_eq!(minded(&[0.0, 4.0, -1.0, 5.1, 2.0], 2), [2, 4]);
        assert_eq!(minded(&[0.0, 1.0, -1.0, 1.0], 2), [1, 2]);
    }

    #[test]
    fn who_overlaps_is_minded_alone() {
        assert_eq!(minded(&[0.0, 0.6, 0.4, 1.0, -0.3], 10), [4, 2]);
    }
}
