//! Beliefs, people and scenes.

use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::motion::step;
use curionav_planning::numerics::{eigenvalues, sin_cos};
use curionav_planning::occupancy::Obstacles;
use curionav_planning::scene::{Belief, People, Scene};
use curionav_schemas::{self as wire, F64Array, Frame};
use nalgebra::Matrix3;

const _: () = assert!(People::UNSEEN == wire::limits::UNSEEN_PERSON, "it keeps its identity on the wire");

/// A 3x3 covariance from nine row-major numbers; the schema has checked their count.
pub fn covariance(values: &F64Array) -> Matrix3<f64> {
    let m = Matrix3::from_row_slice(values);
    (m + m.transpose()) * 0.5
}

/// A belief.
pub fn belief(b: &wire::Belief) -> Belief {
    Belief {
        pose: Pose2::new(b.x, b.y, b.heading),
        covariance: covariance(&b.covariance),
        twist: Twist { v: b.v, omega: b.omega },
    }
}

/// A belief; health is the localiser's own to say.
pub fn belief_to_wire(b: &Belief, tick: u64, stamp: f64, health: wire::Health) -> wire::Belief {
    wire::Belief {
        tick,
        stamp,
        x: b.pose.x,
        y: b.pose.y,
        heading: b.pose.heading,
        covariance: b.covariance.transpose().as_slice().into(),
        v: b.twist.v,
        omega: b.twist.omega,
        health,
    }
}

/// Where the robot is said to be when a mission begins, before the first scan.
pub fn initial_belief(mission: &wire::Mission) -> wire::Belief {
    let pose = mission.order.initial_pose;
    wire::Belief {
        tick: 0,
        stamp: 0.0,
        x: pose.x,
        y: pose.y,
        heading: pose.heading,
        covariance: mission.order.initial_covariance.clone(),
        v: 0.0,
        omega: 0.0,
        health: wire::Health {
            outside_weight: 0.0,
            scan_fit: 0.0,
            particles: 0,
            confidence: match mission.order.initial_doubtful {
                true => wire::Confidence::Doubtful,
                false => wire::Confidence::Sure,
            },
        },
    }
}

/// People in the map frame. A robot-frame tracker's are moved there with `robot`, the believed pose
/// (D10); their velocities are taken as relative to the ground.
pub fn people(p: &wire::People, robot: Pose2) -> People {
    let mut people = People {
        id: p.id.0.clone(),
        x: p.x.0.clone(),
        y: p.y.0.clone(),
        vx: p.vx.0.clone(),
        vy: p.vy.0.clone(),
        position_variance: worst_variances(&p.position_covariance),
        velocity_variance: worst_variances(&p.velocity_covariance),
        radius: p.radius,
    };
    if p.frame == Frame::Robot {
        let (s, c) = sin_cos(robot.heading);
        for i in 0..people.len() {
            let q = robot.transform(Point2::new(people.x[i], people.y[i]));
            let vx = people.vx[i];
            let vy = people.vy[i];
            (people.x[i], people.y[i]) = (q.x, q.y);
            (people.vx[i], people.vy[i]) = (c * vx - s * vy, s * vx + c * vy);
        }
    }
    people
}

/// Of each covariance (xx, xy, yy) the variance on its worst axis, which is the same in every frame; none of none.
fn worst_variances(covariances: &Option<F64Array>) -> Vec<f64> {
    let of_each = covariances.iter().flat_map(|all| all.chunks_exact(3));
    of_each.map(|c| eigenvalues(c[0], c[1], c[2]).0.max(0.0)).collect()
}

/// The covariances of variances that are the same on all axes; none of none.
fn round_covariances(variances: &[f64]) -> Option<F64Array> {
    let of_each = variances.iter().flat_map(|variance| [*variance, 0.0, *variance]);
    (!variances.is_empty()).then(|| of_each.collect())
}

/// People as they are at `stamp`, when the robot believes `belief`: seen at the message's own stamp, from where the
/// robot was then, and taken to have gone on at constant velocity (A20). The longer ago that was, the less is known of
/// where they are.
pub fn people_at(p: &wire::People, belief: &Belief, stamp: f64) -> People {
    let age = stamp - p.stamp;
    people(p, step(belief.pose, belief.twist, -age)).after(age)
}

/// People in the map frame.
pub fn people_to_wire(p: &People, tick: u64, stamp: f64) -> wire::People {
    wire::People {
        tick,
        stamp,
        frame: Frame::Map,
        radius: p.radius,
        id: p.id.as_slice().into(),
        x: p.x.as_slice().into(),
        y: p.y.as_slice().into(),
        vx: p.vx.as_slice().into(),
        vy: p.vy.as_slice().into(),
        position_covariance: round_covariances(&p.position_variance),
        velocity_covariance: round_covariances(&p.velocity_variance),
        age: None,
        probability: None,
    }
}

/// The same people, who are known without error, in the frame of a robot at this pose; velocities stay relative to the
/// ground.
pub fn people_seen_from(robot: Pose2, mut p: wire::People) -> wire::People {
    let (s, c) = sin_cos(robot.heading);
    for i in 0..p.id.len() {
        let q = robot.inverse_transform(Point2::new(p.x[i], p.y[i]));
        let vx = p.vx[i];
        let vy = p.vy[i];
        (p.x.0[i], p.y.0[i]) = (q.x, q.y);
        (p.vx.0[i], p.vy.0[i]) = (c * vx + s * vy, -s * vx + c * vy);
    }
    wire::People { frame: Frame::Robot, ..p }
}

/// A scene.
pub fn scene(s: &wire::Scene) -> Scene {
    let belief = belief(&s.belief);
    let people = people(&s.people, belief.pose);
    Scene {
        tick: s.tick,
        stamp: s.stamp,
        belief,
        people,
        obstacles: obstacles(&s.obstacles),
        passage: s.passage_m,
        uncertain: s.uncertain,
        in_place: s.in_place_s,
        impatient: s.impatient,
    }
}

/// A scene; `health` is that of the belief it was formed from.
pub fn scene_to_wire(s: &Scene, health: wire::Health) -> wire::Scene {
    wire::Scene {
        tick: s.tick,
        stamp: s.stamp,
        belief: belief_to_wire(&s.belief, s.tick, s.stamp, health),
        people: people_to_wire(&s.people, s.tick, s.stamp),
        obstacles: obstacles_to_wire(&s.obstacles),
        passage_m: s.passage,
        uncertain: s.uncertain,
        in_place_s: s.in_place,
        impatient: s.impatient,
    }
}

/// Cells of runs that have been checked.
pub fn obstacles(runs: &wire::U32Array) -> Obstacles {
    let cells = runs.chunks_exact(2).flat_map(|run| run[0]..run[0].saturating_add(run[1]));
    Obstacles::of(cells.collect())
}

fn obstacles_to_wire(obstacles: &Obstacles) -> wire::U32Array {
    let mut runs: Vec<u32> = Vec::new();
    for cell in obstacles.cells() {
        match runs[..] {
            [.., first, count] if first + count == *cell => {
                let last = runs.len() - 1;
                runs[last] += 1;
            }
            _ => runs.extend([*cell, 1]),
        }
    }
    runs.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_seen_a_while_ago_have_gone_on_in_either_frame() {
        let twist = Twist { v: 0.8, omega: 0.5 };
        let then = Belief { pose: Pose2::new(3.0, -1.0, 0.7), covariance: Matrix3::identity(), twist };
        let id = vec![4];
        let x = vec![5.0];
        let y = vec![1.0];
        let seen = People { id, x, y, vx: vec![-1.0], vy: vec![0.5], radius: 0.25, ..People::default() };
        let in_map = wire::People { stamp: 2.0, ..people_to_wire(&seen, 20, 2.0) };
        let in_robot = people_seen_from(then.pose, in_map.clone());
        // 0.6 s later the robot has driven on.
        let now = Belief { pose: step(then.pose, twist, 0.6), ..then };
        for message in [in_map, in_robot] {
            let people = people_at(&message, &now, 2.6);
            assert!(people.position(0).distance(Point2::new(4.4, 1.3)) < 1e-12, "{people:?}");
        }
    }

    #[test]
    fn people_seen_a_while_ago_are_known_less_well_and_a_scene_keeps_how_well() {
        let belief = Belief {
            pose: Pose2::new(3.0, -1.0, 0.7),
            covariance: Matrix3::identity(),
            twist: Twist::default(),
        };
        let one = People {
            id: vec![4],
            x: vec![5.0],
            y: vec![1.0],
            vx: vec![0.0],
            vy: vec![0.0],
            ..People::default()
        };
        let seen = wire::People {
            frame: Frame::Robot,
            position_covariance: Some(vec![0.05, 0.03, 0.05].into()),
            velocity_covariance: Some(vec![0.25, 0.0, 0.09].into()),
            ..people_to_wire(&one, 20, 2.0)
        };
        let now = people_at(&seen, &belief, 2.4);
        // 0.05 + 0.03 on the worst axis, and 0.25 * 0.4^2
        assert!((now.position_variance[0] - 0.12).abs() < 1e-12, "{now:?}");
        assert_eq!(now.velocity_variance, [0.25]);
        assert_eq!(people(&people_to_wire(&now, 24, 2.4), belief.pose), now);
    }
}
