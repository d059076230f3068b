//! People as they are published: in the frame of the robot that sees them.

use curionav_schemas::limits::MAX_PEOPLE;
use curionav_schemas::{Frame, Odometry, People};
use curionav_tracking_people::Person;
use nalgebra::Matrix2;

/// The message of people who were seen as `odometry` was measured. Of more than a message may hold, those who were seen
/// last.
pub(super) fn message(mut people: Vec<Person>, odometry: &Odometry, radius: f64) -> People {
    people.sort_by(|a, b| a.age.total_cmp(&b.age).then(a.id.cmp(&b.id)));
    people.truncate(MAX_PEOPLE);
    people.sort_by_key(|person| person.id);
    People {
        tick: odometry.tick,
        stamp: odometry.stamp,
        frame: Frame::Robot,
        radius,
        id: people.iter().map(|person| person.id).collect(),
        x: people.iter().map(|person| person.position.x).collect(),
        y: people.iter().map(|person| person.position.y).collect(),
        vx: people.iter().map(|person| person.velocity.x).collect(),
        vy: people.iter().map(|person| person.velocity.y).collect(),
        position_covariance: Some(people.iter().flat_map(|p| entries(&p.position_covariance)).collect()),
        velocity_covariance: Some(people.iter().flat_map(|p| entries(&p.velocity_covariance)).collect()),
        age: Some(people.iter().map(|person| person.age.max(0.0) as f32).collect()),
        probability: Some(people.iter().map(|person| person.probability as f32).collect()),
    }
}

/// The entries xx, xy and yy of a covariance.
fn entries(m: &Matrix2<f64>) -> [f64; 3] {
    [m[(0, 0)].max(0.0), 0.5 * (m[(0, 1)] + m[(1, 0)]), m[(1, 1)].max(0.0)]
}

#[cfg(test)]
mod tests {
    use curionav_mission::convert;
    use curionav_planning::geometry::{Point2, Pose2};
    use curionav_schemas::Message;
    use curionav_testing::golden;

    use super::*;

    fn person(id: u32, x: f64) -> Person {
        Person {
            id,
            position: Point2::new(x, 2.0),
            velocity: Point2::new(0.5, -0.25),
            position_covariance: Matrix2::new(0.04, 0.01, 0.01, 0.02),
            velocity_covariance: Matrix2::new(0.2, 0.0, 0.0, 0.1),
            age: f64::from(id) * 0.1,
            probability: 0.75,
        }
    }

    #[test]
    fn people_arrive_where_and_as_they_were_seen() {
        let odometry = golden::odometry();
        let sent = message(vec![person(2, 4.0), person(5, 6.0)], &odometry, 0.25);
        let read = People::decode(&sent.encode(), Some(People::ENCODING)).unwrap();
        let people = convert::people(&read, Pose2::default());
        assert_eq!(people.id, [2, 5]);
        assert!(people.position(1).distance(Point2::new(6.0, 2.0)) < 1e-12, "{people:?}");
        assert!((people.vx[0] - 0.5).abs() < 1e-12 && (people.vy[0] + 0.25).abs() < 1e-12);
        // The greater eigenvalue of ((0.04, 0.01), (0.01, 0.02)): 0.03 + 0.01 sqrt 2.
        assert!((people.position_variance[0] - (0.03 + 0.01 * 2.0_f64.sqrt())).abs() < 1e-12);
    }

    #[test]
    fn of_too_many_those_who_were_seen_last_are_published() {
        let many = (0..1 + MAX_PEOPLE as u32).map(|id| person(id, 1.0)).collect();
        let sent = message(many, &golden::odometry(), 0.25);
        assert_eq!((sent.id.len(), sent.id[MAX_PEOPLE - 1]), (MAX_PEOPLE, MAX_PEOPLE as u32 - 1));
        assert!(People::decode(&sent.encode(), Some(People::ENCODING)).is_ok());
    }
}
