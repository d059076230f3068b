//! What a robot does that does not know where it is: it looks around and drives slowly along what it sees, so that new
//! scans tell it. Nothing here uses the map, which says nothing about a place that is not known.

use std::f64::consts::TAU;

use crate::geometry::{Point2, Twist};
use crate::motion::{RobotModel, step};
use crate::scene::Belief;
use crate::states::States;
use crate::trajectory::Trajectory;

/// Greatest speed of a robot that is not sure where it is, m/s.
pub const SLOW: f64 = 0.2;
/// Rate of the turn on the spot, rad/s: slow enough for every scan to be used.
const TURN_RATE: f64 = 0.5;
/// Between two turns it drives for so long, seconds.
const DRIVE_S: f64 = 10.0;
/// Turn rates between which it chooses while driving, rad/s.
const RATES: [f64; 7] = [0.0, 0.2, -0.2, 0.4, -0.4, 0.6, -0.6];
/// So far it looks ahead, seconds, in steps of as many.
const AHEAD_S: f64 = 3.0;
const AHEAD_STEP_S: f64 = 0.5;
/// Room that it keeps to what it sees, metres.
const ROOM: f64 = 0.2;
/// Room that it drives with along a wall, metres: the wall is well in sight, and people can pass on the other side.
const ROOM_ALONG_WALLS: f64 = 0.6;
/// A straight way is worth so many metres of other room per rad/s.
const STRAIGHT: f64 = 0.3;
/// The motion that is decided on, in states of so many seconds.
const STATES: usize = 12;
const STATE_S: f64 = 0.1;

/// What a laser sees around the robot.
#[derive(Debug, Clone, Default)]
pub struct Surroundings {
    /// Where beams ended, robot frame, metres.
    pub ends: Vec<Point2>,
    /// Whether the laser sees all around the robot, so that a turn on the spot shows nothing new.
    pub sees_all_around: bool,
}

/// How far a robot has come with looking around.
#[derive(Debug, Clone, Default)]
pub struct Localising {
    /// Stamp of the last call, seconds.
    last: Option<f64>,
    turned: f64,
    driven_s: f64,
}

impl Localising {
    /// The motion from `stamp` on, for about a second: a turn on the spot if the laser does not see all around, then
    /// ten seconds along walls, and so on.
    pub fn motion(
        &mut self,
        stamp: f64,
        belief: &Belief,
        around: &Surroundings,
        robot: &RobotModel,
    ) -> Option<Trajectory> {
        let seconds = self.last.replace(stamp).map_or(0.0, |last| (stamp - last).max(0.0));
        let turns = !around.sees_all_around && self.turned < TAU;
        if turns {
            self.turned += belief.twist.omega.abs() * seconds;
        } else {
            self.driven_s += seconds;
        }
        if self.driven_s >= DRIVE_S {
            self.turned = 0.0;
            self.driven_s = 0.0;
        }
        let on_the_spot = Twist { v: 0.0, omega: TURN_RATE };
        let wanted = if turns { on_the_spot } else { along_walls(around, robot).unwrap_or(on_the_spot) };
        let start = belief.motion();
        let (mut pose, mut twist) = start;
        let mut states = States::default();
        for _ in 0..STATES {
            twist = robot.limit(twist, wanted, STATE_S);
            pose = step(pose, twist, STATE_S);
            states.push(pose, twist);
        }
        Trajectory::new(start, STATE_S, states).ok()
    }

    /// How long a motion may be followed, seconds.
    pub const VALID_FOR: f64 = STATES as f64 * STATE_S;
}

/// The arc ahead that keeps most nearly the room of a wall to what is seen; none if all are blocked.
fn along_walls(around: &Surroundings, robot: &RobotModel) -> Option<Twist> {
    let radius = robot.footprint.circumscribed_radius();
    let arcs = RATES.map(|omega| Twist { v: SLOW.min(robot.v_max), omega });
    let free = arcs.into_iter().filter_map(|arc| {
        let (least, last) = room_along(arc, &around.ends, radius);
        let miss = (last.min(2.0 * ROOM_ALONG_WALLS) - ROOM_ALONG_WALLS).abs();
        (least >= ROOM).then_some((miss + STRAIGHT * arc.omega.abs(), arc))
    });
    free.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, arc)| arc)
}

/// The least room of a disc along an arc, and the room at its end, metres.
fn room_along(arc: Twist, ends: &[Point2], radius: f64) -> (f64, f64) {
    let mut pose = Default::default();
    let mut least = f64::INFINITY;
    let mut last = f64::INFINITY;
    for _ in 0..(AHEAD_S / AHEAD_STEP_S) as usize {
        pose = step(pose, arc, AHEAD_STEP_S);
        let nearest = ends.iter().map(|end| end.distance(pose.position())).fold(f64::INFINITY, f64::min);
        last = nearest - radius;
        least = least.min(last);
    }
    (least, last)
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::geometry::Pose2;

    fn moving(v: f64, omega: f64) -> Belief {
        Belief {
            pose: Pose2::new(3.0, -2.0, 0.5),
            covariance: Matrix3::identity(),
            twist: Twist { v, omega },
        }
    }

    /// A wall along y = `side`, from 2 m behind the robot to 6 m ahead.
    fn wall(side: f64) -> Surroundings {
        let ends = (0..80).map(|i| Point2::new(-2.0 + 0.1 * f64::from(i), side)).collect();
        Surroundings { ends, sees_all_around: true }
    }

    #[test]
    fn a_laser_with_a_blind_side_turns_once_around_and_then_drives_on() {
        let robot = RobotModel::default();
        let around = Surroundings { sees_all_around: false, ..wall(1.0) };
        let mut localising = Localising::default();
        let mut turns = Vec::new();
        for tick in 0..400 {
            let stamp = 0.1 * f64::from(tick);
            let motion = localising.motion(stamp, &moving(0.0, 0.5), &around, &robot).unwrap();
            turns.push(motion.at(1.0).1.v == 0.0);
        }
        let turned = turns.iter().take_while(|turn| **turn).count();
        // 6.28 rad at 0.5 rad/s are 12.6 s; then 10 s of driving.
        assert!((125..=130).contains(&turned), "{turned}");
        assert!(turns[turned..turned + 99].iter().all(|turn| !turn) && turns[turned + 105]);
    }

    #[test]
    fn it_drives_slowly_and_keeps_its_room_along_a_wall() {
        let robot = RobotModel::default();
        let rate = |side: f64| along_walls(&wall(side), &robot).unwrap().omega;
        let radius = robot.footprint.circumscribed_radius();
        assert_eq!(rate(radius + 0.6), 0.0);
        assert!(rate(radius + 0.3) < 0.0, "away from a wall that is too near");
        assert!(rate(radius + 1.1) > 0.0, "towards one that is far");
        let motion = Localising::default().motion(0.0, &moving(0.2, 0.0), &wall(radius + 0.6), &robot);
        let states = motion.unwrap();
        assert!(states.states().v.iter().all(|v| *v <= SLOW));
    }

    #[test]
    fn where_all_is_blocked_it_turns_away() {
        let ring =
            (0..90).map(|i| f64::from(i) * TAU / 90.0).map(|a| Point2::new(0.5 * a.cos(), 0.5 * a.sin()));
        let around = Surroundings { ends: ring.collect(), sees_all_around: true };
        let robot = RobotModel::default();
        assert_eq!(along_walls(&around, &robot), None);
        let motion = Localising::default().motion(0.0, &moving(0.0, 0.0), &around, &robot).unwrap();
        assert_eq!(motion.at(0.5).1.v, 0.0);
    }

    #[test]
    fn a_robot_that_drives_brakes_before_it_turns() {
        let robot = RobotModel::default();
        let around = Surroundings { sees_all_around: false, ..wall(1.0) };
        let motion = Localising::default().motion(0.0, &moving(1.0, 0.0), &around, &robot).unwrap();
        let speeds = &motion.states().v;
        // 0.5 m/s2 * 0.1 s less in each state
        assert!((speeds[0] - 0.95).abs() < 1e-12 && speeds[11] > 0.3, "{speeds:?}");
    }
}
