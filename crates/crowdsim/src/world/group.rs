//! Whether the robot is between people who are together.

use std::f64::consts::{PI, TAU};

use curionav_planning::crowd_cluster::{GroupParams, Linkage, crowd_clusters};
use curionav_planning::geometry::{Point2, bearing};
use curionav_planning::scene::People;

/// People nearer to each other than this, and almost as fast, are together, metres and m/s: found on the groups that
/// were annotated in films.
const TOGETHER_M: f64 = 1.5;
const TOGETHER_MPS: f64 = 0.4;
/// Farther away no one is in a group around the robot, metres.
const AROUND_M: f64 = 6.0;

/// Whether a disc meets the convex hull of the centres of people who are together: two or more, each nearer than 1.5 m
/// and within 0.4 m/s of another one.
pub(super) fn is_in_group(robot: Point2, radius: f64, people: &People) -> bool {
    let around = (0..people.len()).filter(|&i| people.position(i).distance(robot) < AROUND_M);
    let around: Vec<[f64; 4]> =
        around.map(|i| [people.x[i], people.y[i], people.vx[i], people.vy[i]]).collect();
    if around.len() < 2 {
        return false;
    }
    let near = People::walking(people.radius, &around);
    let mut together = GroupParams::default();
    together.linkage = Linkage::DistanceAndVelocity;
    together.social_distance = TOGETHER_M;
    together.velocity_difference = TOGETHER_MPS;
    crowd_clusters(&near, &together, None).iter().any(|group| {
        let members: Vec<Point2> = group.iter().map(|&i| near.position(i)).collect();
        members.len() > 1 && meets_hull(robot, radius, &members)
    })
}

/// Whether a disc meets the convex hull of points: it meets a line between two of them, or they are all around it.
fn meets_hull(centre: Point2, radius: f64, points: &[Point2]) -> bool {
    let meets_line = points
        .iter()
        .enumerate()
        .any(|(k, from)| points[..k].iter().any(|to| to_line(centre, *from, *to) < radius));
    meets_line || is_surrounded(centre, points)
}

/// Distance from a point to the line between two others.
fn to_line(p: Point2, from: Point2, to: Point2) -> f64 {
    let length_squared = from.distance_squared(to);
    let along = (p.x - from.x) * (to.x - from.x) + (p.y - from.y) * (to.y - from.y);
    let share = if length_squared > 0.0 { (along / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(from.toward(to, share))
}

/// Whether there are points in every half of the plane around a point.
fn is_surrounded(p: Point2, points: &[Point2]) -> bool {
    let mut directions: Vec<f64> = points.iter().map(|point| bearing(p, *point)).collect();
    directions.sort_by(f64::total_cmp);
    let last = directions[directions.len() - 1];
    let widest =
        directions.windows(2).map(|pair| pair[1] - pair[0]).fold(directions[0] + TAU - last, f64::max);
    widest < PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_people_who_are_together_and_nowhere_else() {
        // Two who talk, 1.4 m apart, at x = 0 and x = 1.4; the robot's radius is 0.3 m.
        let two = People::walking(0.25, &[[0.0, 0.0, 0.0, 0.0], [1.4, 0.0, 0.0, 0.0]]);
        assert!(is_in_group(Point2::new(0.7, 0.29), 0.3, &two));
        assert!(!is_in_group(Point2::new(0.7, 0.31), 0.3, &two));
        // Beyond the second one it is beside the group.
        assert!(!is_in_group(Point2::new(1.8, 0.0), 0.3, &two));
        // 1.6 m apart they are not together, and neither if one walks away at 0.5 m/s.
        let apart = People::walking(0.25, &[[0.0, 0.0, 0.0, 0.0], [1.6, 0.0, 0.0, 0.0]]);
        assert!(!is_in_group(Point2::new(0.7, 0.0), 0.3, &apart));
        let parting = People::walking(0.25, &[[0.0, 0.0, 0.0, 0.0], [1.4, 0.0, 0.5, 0.0]]);
        assert!(!is_in_group(Point2::new(0.7, 0.0), 0.3, &parting));
    }

    #[test]
    fn in_the_middle_of_a_ring_it_is_in_the_group_though_far_from_all_lines() {
        // Eight people on a circle of 1.8 m: neighbours are 2 * 1.8 * sin(pi / 8) = 1.38 m apart.
        let ring: Vec<[f64; 4]> = (0..8)
            .map(|k| {
                let angle = TAU * f64::from(k) / 8.0;
                [1.8 * angle.cos(), 1.8 * angle.sin(), 0.0, 0.0]
            })
            .collect();
        let people = People::walking(0.25, &ring);
        assert!(is_in_group(Point2::default(), 0.05, &people));
        assert!(!is_in_group(Point2::new(2.2, 0.0), 0.3, &people));
    }
}
