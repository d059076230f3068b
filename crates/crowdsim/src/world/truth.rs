//! What really is at one tick.

use curionav_planning::geometry::{Pose2, Twist, bearing, wrap_angle};
use curionav_planning::numerics::{hypot, sin_cos};
use curionav_planning::scene::People;

/// A person that the robot's body overlaps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Who.
    pub id: u32,
    /// How fast the robot comes towards the person, m/s; negative while it goes away.
    pub robot_speed: f64,
    /// How fast the person comes towards the robot, m/s; negative while the person goes away.
    pub person_speed: f64,
}

/// A person whose body overlaps the robot's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// Who.
    pub id: u32,
    /// In which direction from the robot, radians: 0 is straight ahead, positive to the left.
    pub bearing: f64,
}

/// What really is at one tick: for measures, never for a planner.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Ticks since the start.
    pub tick: u64,
    /// Seconds since the start.
    pub time: f64,
    /// The robot's pose, map frame.
    pub pose: Pose2,
    /// The robot's speed and turn rate.
    pub twist: Twist,
    /// Distance between the centres of the robot and the nearest person, metres; infinite without people.
    pub person_distance: f64,
    /// Distance to the nearest person that no wall hides from the robot, metres; infinite without one.
    pub seen_person_distance: f64,
    /// Gap between the robot's body and the nearest person's, metres; negative when they overlap.
    pub person_clearance: f64,
    /// Gap between the robot's body and the nearest wall or thing, metres.
    pub wall_clearance: f64,
    /// Speed at which a wall or a thing stopped the robot during this tick, m/s.
    pub wall_impact: Option<f64>,
    /// The people whose disc overlaps the robot's (D11), by ascending id. One who came into being too late for the
    /// robot to stop, as filmed people do at the edge of a film, is left out until they have parted.
    pub touching: Vec<Touch>,
    /// All people whose disc overlaps the robot's, by ascending id, also those who are left out of `touching`.
    pub overlaps: Vec<Overlap>,
    /// Whether the robot's body is between people who stand or walk together: in the convex hull of their centres.
    pub is_in_group: bool,
    /// How much of this tick all people with routes together lost against walking on at their preferred speed:
    /// one who stands and wants to walk on counts as 1.
    pub held_up: f64,
    /// The part of `held_up` of those in whose social space the robot is, nearer than 3.6 m.
    pub held_up_near: f64,
    /// Seconds until the robot and a person touch if all go on as they go; infinite when they never will.
    pub time_to_collision: f64,
}

impl Overlap {
    /// The i-th person.
    pub(super) fn of(pose: Pose2, people: &People, i: usize) -> Self {
        let bearing = wrap_angle(bearing(pose.position(), people.position(i)) - pose.heading);
        Self { id: people.id[i], bearing }
    }
}

impl Touch {
    /// How the robot and the i-th person go towards each other along the line between their centres.
    pub(super) fn of(pose: Pose2, twist: Twist, people: &People, i: usize) -> Self {
        let person = people.position(i);
        let dx = person.x - pose.x;
        let dy = person.y - pose.y;
        let distance = hypot(dx, dy).max(f64::MIN_POSITIVE);
        let (sin, cos) = sin_cos(pose.heading);
        Self {
            id: people.id[i],
            robot_speed: twist.v * (cos * dx + sin * dy) / distance,
            person_speed: -(people.vx[i] * dx + people.vy[i] * dy) / distance,
        }
    }
}
