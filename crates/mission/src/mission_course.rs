//! A mission made ready to plan.

use std::sync::Arc;

use curionav_planning::evaluation::distance::DistanceMeasure;
use curionav_planning::footprint::FootprintShape;
use curionav_planning::generation::{self, own};
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::Obstacles;
use curionav_planning::planner::{Course, CourseError};
use curionav_planning::profile::Profile;
use curionav_planning::terms::{DerivedFields, Task};
use curionav_schemas::{Mission, Refusal, Reject, keys};

use crate::convert;
use crate::fields::{Fields, FieldsOf};

/// A mission and the course to its goal.
pub struct MissionCourse {
    /// The mission as published.
    pub mission: Mission,
    /// How to plan, and every field that it needs.
    pub course: Course,
}

impl MissionCourse {
    /// Fetches the map and derives every field; blocks for as long as that takes (a second or so).
    ///
    /// # Errors
    /// The mission asks for what does not exist or cannot be reached; the refusal names the field.
    pub fn new(mission: Mission, fields: &Fields) -> Result<Self, Reject> {
        convert::check_order(&mission.order)?;
        let way = convert::way(&mission.order)?.map(Arc::new);
        let is_on_way = way.is_some();
        let fields = &fields.of(mission.order.map).along(way);
        let profile: Profile = convert::parameters("profile", &mission.order.profile)?;
        check_follows(&profile, is_on_way)?;
        if let Some(term) = profile.terms.keys().find(|term| keys::check_id(term).is_err()) {
            return Err(Refusal::NotAName { found: term.clone() }.at("profile.terms"));
        }
        let task = Task {
            goal: Point2::new(mission.order.goal_x, mission.order.goal_y),
            goal_heading: mission.order.goal_heading,
            robot: convert::robot_model(&mission.order.robot_model),
            laser: convert::laser(&mission.order.laser),
            noise: convert::noise(&mission.order.odometry_noise),
        };
        let course = course(profile, task, mission.order.seed, fields)?;
        let start = convert::pose(mission.order.initial_pose).position();
        check_room(&course, mission.order.goal_tolerance)?;
        // A way that is given begins where the robot is by now, and not where it was at first.
        if !is_on_way && !course.has_way(start) {
            let Point2 { x, y } = course.goal;
            return Err(Refusal::UnreachableGoal { x, y }.at("goal"));
        }
        Ok(Self { mission, course })
    }
}

/// What is doubtful about a mission, in words, although it is not refused.
pub fn doubt(mission: &Mission, course: &Course) -> Option<String> {
    let start = convert::pose(mission.order.initial_pose).position();
    let room = course.narrowest(start);
    let radius = least_radius(course);
    (room < radius).then(|| {
        format!(
            "the way to the goal leads where there is {room:.2} m of room on the map, and the robot's radius is \
             {radius:.2} m; look at the map, or give another goal"
        )
    })
}

/// The course of `mission` with these obstacles on the map, for a robot that is `here`; blocks while the way past them
/// is derived.
///
/// # Errors
/// The map is not here.
pub fn past_obstacles(
    course: &Course,
    mission: &Mission,
    obstacles: &Obstacles,
    here: Point2,
    fields: &Fields,
) -> Result<Course, Reject> {
    let way = convert::way(&mission.order)?.map(Arc::new);
    course.past(&fields.of(mission.order.map).along(way).obstructed(obstacles, here)?)
}

/// Radius of the largest disc in the robot's footprint, metres: with less room it fits nowhere, however it turns.
fn least_radius(course: &Course) -> f64 {
    FootprintShape::from(&course.robot.footprint).inscribed_radius()
}

/// Refuses a planner that measures as the crow flies what it has to go: it would not keep to a way.
fn check_follows(profile: &Profile, is_on_way: bool) -> Result<(), Reject> {
    if is_on_way && profile.distance == DistanceMeasure::Euclid {
        let why = "`euclid` does not keep to a way that is given; use `geodesic`";
        return Err(Refusal::invalid(why).at("profile.distance"));
    }
    if is_on_way && own::is_own(&profile.generator) {
        let why = "a planner of one's own is not told a way that is given; use a built-in generator";
        return Err(Refusal::invalid(why).at("profile.generator"));
    }
    Ok(())
}

/// Refuses a goal near which the robot fits nowhere: with less room than the least disc of its footprint it can neither
/// stand at the goal nor so near to it that it counts as there. The planner takes unknown floor for a wall.
fn check_room(course: &Course, tolerance: f64) -> Result<(), Reject> {
    let Point2 { x, y } = course.goal;
    let radius = least_radius(course);
    match course.map.most_room(course.goal, tolerance) {
        Some(room) if room < radius => Err(Refusal::NoRoomAtGoal { x, y, room, radius }.at("goal")),
        _ => Ok(()),
    }
}

/// Makes the goal ready. The way to it takes one thread, what a sensor sees takes all of them: both begin at once.
fn course(profile: Profile, task: Task, seed: u64, fields: &FieldsOf<'_>) -> Result<Course, Reject> {
    let goal = task.goal;
    let radius = task.robot.radius();
    fields.map()?;
    let course = std::thread::scope(|scope| {
        // What it derives is kept, and found there by the course.
        scope.spawn(|| fields.geodesic(goal, radius));
        Course::new(profile, task, seed, fields)
    });
    course.map_err(|error| match error {
        CourseError::Field(reject) => reject,
        CourseError::UnknownGenerator { name } => {
            Refusal::UnknownName { found: name, known: generation::generator_names() }.at("profile.generator")
        }
    })
}
