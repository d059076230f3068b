//! The velocity that one body among others takes: the admissible one nearest to the preferred.

use super::velocity_obstacle::{Body, VelocityObstacle};
use super::{HrvoParams, Velocity};

/// The velocity `bodies[me]` takes, before limits of acceleration. `walls` come before all bodies.
pub fn velocity(
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
    choose(bodies[me].preferred, max_speed, &obstacles)
}

/// The nearest others within reach, nearest first, the lower index of equals; only those that overlap
/// if any do: parting comes first. A scan, because a crowd is some tens of people.
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
    let nearer = |(a, i): &(f64, usize), (b, j): &(f64, usize)| a.total_cmp(b).then(i.cmp(j));
    let most = params.max_neighbors as usize;
    if near.len() > most {
        near.select_nth_unstable_by(most, nearer);
        near.truncate(most);
    }
    near.sort_unstable_by(nearer);
    near.into_iter().map(|(_, index)| index)
}

/// The velocity of at most `max_speed` outside every obstacle that is nearest to `preferred`.
///
/// Candidates are the preferred velocity, its projections on the sides of obstacles, and where the sides
/// cross each other or the circle of the greatest speed; the nearest admissible velocity is always one of
/// them. When all are forbidden, obstacles give way in reverse order: taken is a candidate whose first
/// violated obstacle comes latest in the list, so sort it by urgency.
pub(super) fn choose(preferred: Velocity, max_speed: f64, obstacles: &[VelocityObstacle]) -> Velocity {
    let mut search = Search { preferred, obstacles, admissible: None, forbidden: None };
    let speed = preferred.norm();
    let clipped = if speed < max_speed { preferred } else { preferred * (max_speed / speed) };
    search.consider(clipped, [NONE; 2]);
    if search.admissible.is_some() {
        return clipped; // Nothing can be nearer.
    }
    let limit = max_speed * max_speed;
    for (i, obstacle) in obstacles.iter().enumerate() {
        for (side, inwards) in [(obstacle.right, 1.0), (obstacle.left, -1.0)] {
            let from_apex = preferred - obstacle.apex;
            let along = from_apex.dot(&side);
            let projection = obstacle.apex + side * along;
            let beyond = inwards * side.perp(&from_apex) > 0.0;
            if along > 0.0 && beyond && projection.norm_squared() < limit {
                search.consider(projection, [i, i]);
            }
            for crossing in circle_crossings(obstacle.apex, side, limit).into_iter().flatten() {
                search.consider(crossing, [NONE, i]);
            }
        }
    }
    for (i, first) in obstacles.iter().enumerate() {
        for (j, second) in obstacles.iter().enumerate().skip(i + 1) {
            for (a, b) in [
                (first.right, second.right),
                (first.left, second.right),
                (first.right, second.left),
                (first.left, second.left),
            ] {
                let crossing = ray_crossing(first.apex, a, second.apex, b);
                if let Some(crossing) = crossing.filter(|v| v.norm_squared() < limit) {
                    search.consider(crossing, [i, j]);
                }
            }
        }
    }
    let forced = search.forbidden.map(|(_, _, velocity)| velocity);
    search.admissible.map(|(_, velocity)| velocity).or(forced).unwrap_or_default()
}

/// Stands for "no obstacle" among those a candidate lies on.
const NONE: usize = usize::MAX;

/// The best candidates so far. The first of equals stays.
struct Search<'a> {
    preferred: Velocity,
    obstacles: &'a [VelocityObstacle],
    /// Nearest admissible one and its squared distance to the preferred velocity.
    admissible: Option<(f64, Velocity)>,
    /// Index of the first obstacle violated, squared distance, velocity: of the forbidden one to take if
    /// need be.
    forbidden: Option<(usize, f64, Velocity)>,
}

impl Search<'_> {
    /// Weighs a candidate that lies on the rims of the obstacles `on`; those are not asked.
    fn consider(&mut self, velocity: Velocity, on: [usize; 2]) {
        let far = (velocity - self.preferred).norm_squared();
        if self.admissible.is_some_and(|(least, _)| far >= least) {
            return;
        }
        let mut asked = self.obstacles.iter().enumerate().filter(|(i, _)| !on.contains(i));
        match asked.find(|(_, obstacle)| obstacle.holds(velocity)) {
            None => self.admissible = Some((far, velocity)),
            Some((first, _)) => {
                let better = |(index, least, _): (usize, f64, Velocity)| {
                    first > index || (first == index && far < least)
                };
                if self.forbidden.is_none_or(better) {
                    self.forbidden = Some((first, far, velocity));
                }
            }
        }
    }
}

/// Where the ray crosses the circle around the origin whose squared radius is `limit`.
fn circle_crossings(apex: Velocity, side: Velocity, limit: f64) -> [Option<Velocity>; 2] {
    let offset = apex.perp(&side);
    let discriminant = limit - offset * offset;
    if discriminant <= 0.0 {
        return [None; 2];
    }
    let middle = -apex.dot(&side);
    let half = discriminant.sqrt();
    [middle + half, middle - half].map(|t| (t >= 0.0).then(|| apex + side * t))
}

fn ray_crossing(p: Velocity, a: Velocity, q: Velocity, b: Velocity) -> Option<Velocity> {
    let d = a.perp(&b);
    if d == 0.0 {
        return None;
    }
    let s = (q - p).perp(&b) / d;
    let t = (q - p).perp(&a) / d;
    (s >= 0.0 && t >= 0.0).then(|| p + a * s)
}

#[cfg(test)]
mod tests {
    use crate::geometry::Point2;
    use crate::random::{rng, uniform};

    use super::*;

    #[test]
    fn the_preferred_velocity_is_taken_when_it_is_free_and_clipped_when_too_fast() {
        assert_eq!(choose(Velocity::new(0.6, 0.0), 1.0, &[]), Velocity::new(0.6, 0.0));
        let clipped = choose(Velocity::new(3.0, 4.0), 1.0, &[]);
        assert!((clipped - Velocity::new(0.6, 0.8)).norm() < 1e-12);
    }

    #[test]
    fn a_wall_is_walked_along() {
        let wall = VelocityObstacle::of_wall(Velocity::new(0.0, 1.0), 0.05, 0.5);
        let v = choose(Velocity::new(0.6, 0.6), 1.0, &[wall]);
        assert!((v - Velocity::new(0.6, 0.1)).norm() < 1e-12, "{v:?}");
    }

    #[test]
    fn when_all_is_forbidden_the_last_obstacle_gives_way() {
        // walls that leave nothing: y at most -0.2 and y at least 0.2
        let above = VelocityObstacle::of_wall(Velocity::new(0.0, 1.0), -0.1, 0.5);
        let below = VelocityObstacle::of_wall(Velocity::new(0.0, -1.0), -0.1, 0.5);
        let v = choose(Velocity::new(0.5, 0.0), 1.0, &[above, below]);
        assert!((v - Velocity::new(0.5, -0.2)).norm() < 1e-12, "{v:?}");
        let v = choose(Velocity::new(0.5, 0.0), 1.0, &[below, above]);
        assert!((v - Velocity::new(0.5, 0.2)).norm() < 1e-12, "{v:?}");
    }

    #[test]
    fn no_admissible_velocity_of_a_fine_grid_is_nearer() {
        for seed in 0..60 {
            let mut r = rng(seed, 0);
            let mut any = |scale: f64| scale * (2.0 * uniform(&mut r) - 1.0);
            let mut body = || {
                let velocity = Velocity::new(any(1.0), any(1.0));
                let position = Point2::new(any(4.0), any(4.0));
                Body { position, velocity, preferred: velocity, radius: 0.3, yields: true }
            };
            let me = body();
            let obstacles: Vec<_> =
                (0..6).map(|_| VelocityObstacle::of_body(&me, &body(), 0.1, 0.0)).collect();
            let chosen = choose(me.preferred, 1.5, &obstacles);
            let far = (chosen - me.preferred).norm();
            let admissible_grid = (-60..=60)
                .flat_map(|i| (-60..=60).map(move |j| Velocity::new(f64::from(i), f64::from(j)) * 0.025))
                .filter(|v| v.norm() < 1.5 && obstacles.iter().all(|o| !o.holds(*v)));
            let least = admissible_grid.map(|v| (v - me.preferred).norm()).fold(f64::INFINITY, f64::min);
            assert!(far <= least + 1e-9, "seed {seed}: {far} > {least}");
            // at most on the rims of two, on either side by rounding
            let inside = obstacles.iter().filter(|o| o.holds(chosen)).count();
            assert!(least.is_infinite() || inside <= 2, "seed {seed}");
        }
    }

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
