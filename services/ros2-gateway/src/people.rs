//! People as the robot's own tracker publishes them.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::sin_cos;
use curionav_ros2::messages as ros;
use curionav_schemas::{Frame, People};

use crate::config::Frames;
use crate::fault::Fault;
use crate::frames::{FrameTree, Mount};
use crate::robot_clock::RobotClock;

/// Faster than any person, m/s, and farther than any place, m.
const FAST: f64 = 20.0;
const FAR: f64 = 1e5;

/// The people of a message, at `stamp` seconds of the robot's clock: in the map's frame if that is theirs, and
/// otherwise in the robot's. `z` is not read: some publishers have other things there.
///
/// # Errors
/// If a number is none, or if it is not known where their frame is.
pub(crate) fn people(
    said: &ros::People,
    (tick, stamp): (u64, f64),
    (frames, names, clock): (&FrameTree, &Frames, &RobotClock),
    radius: f64,
) -> Result<People, Fault> {
    let frame = &said.header.frame_id;
    let (kind, from_theirs) = if *frame == names.map {
        (Frame::Map, Pose2::default())
    } else if *frame == names.odom {
        let robot = clock.pose_at(stamp);
        let robot = robot.ok_or_else(|| Fault::unknown_frame(frame, &names.base))?;
        (Frame::Robot, robot.relative(Pose2::default()))
    } else {
        let found =
            frames.pose_in(&names.base, frame).ok_or_else(|| Fault::unknown_frame(frame, &names.base))?;
        let mount = Mount::of(&found).filter(|mount| !mount.is_upside_down);
        let mount = mount.ok_or_else(|| Fault::unusable(format!("the frame `{frame}` of people leans")))?;
        (Frame::Robot, mount.pose)
    };
    let (s, c) = sin_cos(from_theirs.heading);
    let mut people = People {
        tick,
        stamp,
        frame: kind,
        radius,
        id: Vec::new().into(),
        x: Vec::new().into(),
        y: Vec::new().into(),
        vx: Vec::new().into(),
        vy: Vec::new().into(),
        position_covariance: None,
        velocity_covariance: None,
        age: None,
        probability: None,
    };
    for person in &said.people {
        let p = person.position;
        let v = person.velocity;
        let is_near = p.x.abs() <= FAR && p.y.abs() <= FAR;
        let is_slow = v.x.abs() <= FAST && v.y.abs() <= FAST;
        if !is_near || !is_slow {
            return Err(Fault::malformed(format!("a person at {p:?} with {v:?} is none")));
        }
        let place = from_theirs.transform(Point2::new(p.x, p.y));
        people.id.0.push(id(&person.name));
        people.x.0.push(place.x);
        people.y.0.push(place.y);
        people.vx.0.push(c * v.x - s * v.y);
        people.vy.0.push(s * v.x + c * v.y);
    }
    Ok(people)
}

/// A number for a name: the name itself if it is a number, and otherwise a hash of it (FNV-1a). The upper half of the
/// numbers is left to curionav.
fn id(name: &str) -> u32 {
    let number = name.parse().unwrap_or_else(|_| {
        name.bytes().fold(0x811c_9dc5, |hash: u32, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
    });
    number & (u32::MAX >> 1)
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Twist;
    use curionav_ros2::messages::{Header, Person, Point, Time};

    use super::*;

    fn said(frame: &str) -> ros::People {
        // HuNavSim has a heading and a turn rate in z.
        let position = Point { x: 3.0, y: 1.0, z: 2.2 };
        let velocity = Point { x: 0.0, y: 1.0, z: -0.4 };
        let person = Person { name: "anna".into(), position, velocity, ..Person::default() };
        let header = Header { frame_id: frame.into(), ..Header::default() };
        ros::People { header, people: vec![Person { name: "7".into(), ..person.clone() }, person] }
    }

    fn read(said: &ros::People) -> Result<People, Fault> {
        let mut clock = RobotClock::new(0.1);
        let heading = std::f64::consts::FRAC_PI_2;
        clock.measured(Time::default(), Pose2::new(1.0, 1.0, heading), Twist::default());
        people(said, (4, 0.0), (&FrameTree::default(), &Frames::default(), &clock), 0.25)
    }

    #[test]
    fn people_of_the_map_stay_there_and_those_of_odometry_are_seen_from_the_robot() {
        let in_map = read(&said("map")).unwrap();
        assert_eq!((in_map.frame, in_map.x[0], in_map.y[0], in_map.vy[0]), (Frame::Map, 3.0, 1.0, 1.0));
        assert_eq!((in_map.id[0], in_map.tick), (7, 4));
        let seen = read(&said("odom")).unwrap();
        // 2 m east of a robot that looks north: to its right; walking north is ahead.
        assert_eq!(seen.frame, Frame::Robot);
        assert!((seen.x[0]).abs() < 1e-12 && (seen.y[0] + 2.0).abs() < 1e-12, "{seen:?}");
        assert!((seen.vx[0] - 1.0).abs() < 1e-12 && seen.vy[0].abs() < 1e-12, "{seen:?}");
    }

    #[test]
    fn people_of_an_unknown_frame_or_without_numbers_are_dropped() {
        assert_eq!(read(&said("camera")).unwrap_err(), Fault::unknown_frame("camera", "base_link"));
        let mut wrong = said("map");
        wrong.people[1].velocity.x = f64::NAN;
        assert!(read(&wrong).is_err());
    }

    #[test]
    fn a_name_keeps_its_number() {
        assert_eq!((id("12"), id("anna"), id("4294967295")), (12, id("anna"), u32::MAX >> 1));
        assert!(id("anna") != id("anne") && id("anna") <= u32::MAX >> 1);
    }
}
