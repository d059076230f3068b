//! The planner as one object: [`Planner`] takes what the robot knows, cycle by cycle, and answers what it is to do.
//!
//! It is made of two parts that a distributed planner uses as well: [`Course`] is what stays the same on the way to one
//! goal, and [`Carried`] is what one cycle hands to the next.

mod carried;
mod course;

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::sync::Arc;

use crate::arbitration::{Scores, Verdict, arbitrate};
use crate::candidates::CandidateSet;
use crate::evaluation::Evaluator;
use crate::geometry::{Point2, Pose2};
use crate::motion::{OdometryNoise, RobotModel};
use crate::occupancy::{Obstacles, StaticMap};
use crate::parameters::{FieldError, Ranged};
use crate::profile::Profile;
use crate::scene::{Belief, Moment, People, Scene};
use crate::sensor::LaserModel;
use crate::terms::{ObstructedMap, Task};

pub use carried::Carried;
pub use course::{Course, CourseError};

/// Plans for one robot in the process of its caller: no thread, no clock, no network. The same calls with the same
/// seed give the same verdicts, bit for bit, and the same as the services give.
pub struct Planner {
    map: Arc<StaticMap>,
    profile: Profile,
    task: Task,
    seed: u64,
    own_terms: BTreeMap<String, Arc<dyn Evaluator>>,
    course: Option<Course>,
    carried: Carried,
    cycles: u64,
    last: Option<Cycle>,
}

/// What a verdict was made from.
#[derive(Debug, Clone, PartialEq)]
pub struct Cycle {
    /// What was known.
    pub scene: Scene,
    /// What could have been driven.
    pub candidates: CandidateSet,
    /// What each candidate costs under each term, in the term's unit.
    pub scores: Scores,
}

/// Why there is no planner, or none for a goal.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlannerError {
    /// A parameter of the profile is out of its range.
    #[error("profile: {0}")]
    Profile(FieldError),
    /// The profile names what is not built in.
    #[error(transparent)]
    Course(#[from] CourseError<Infallible>),
    /// A term of the profile is neither built in nor given by [`Planner::with_term`].
    #[error("profile.terms: no evaluator for `{term}`; give one with `with_term`")]
    NoEvaluator {
        /// The term's name.
        term: String,
    },
    /// The goal is in a wall, or too near to one for this robot.
    #[error("the goal ({x} m, {y} m) is not free for a robot of this size")]
    GoalNotFree {
        /// Metres, map frame.
        x: f64,
        /// Metres, map frame.
        y: f64,
    },
}

/// No goal has been set: call [`Planner::set_goal`] first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the planner has no goal; call set_goal first")]
pub struct NoGoal;

impl Planner {
    /// A planner without a goal. Laser and odometry are those of [`LaserModel::default`] and
    /// [`OdometryNoise::default`], the seed is 0.
    ///
    /// # Errors
    /// A parameter of `profile` is out of its range; the error names it.
    pub fn new(map: Arc<StaticMap>, profile: Profile, robot: RobotModel) -> Result<Self, PlannerError> {
        profile.check().map_err(PlannerError::Profile)?;
        Ok(Self {
            map,
            profile,
            task: Task { robot, ..Task::default() },
            seed: 0,
            own_terms: BTreeMap::new(),
            course: None,
            carried: Carried::default(),
            cycles: 0,
            last: None,
        })
    }

    /// With a seed: it decides what the generator samples.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// With the laser that the robot localises itself with.
    #[must_use]
    pub fn with_laser(self, laser: LaserModel) -> Self {
        Self { task: Task { laser, ..self.task }, ..self }
    }

    /// With what the robot's odometry misses.
    #[must_use]
    pub fn with_odometry_noise(self, noise: OdometryNoise) -> Self {
        Self { task: Task { noise, ..self.task }, ..self }
    }

    /// With the evaluator of a term that the profile lists and that is not built in.
    #[must_use]
    pub fn with_term(mut self, name: &str, evaluator: Arc<dyn Evaluator>) -> Self {
        self.own_terms.insert(name.to_owned(), evaluator);
        self
    }

    /// Sets where to go, map frame, and derives every field that the way needs: about a second on a large map. What was
    /// carried over from cycles to another goal is forgotten.
    ///
    /// # Errors
    /// The goal is not free, or the profile names a generator or a term that does not exist. The goal stays what it
    /// was.
    pub fn set_goal(&mut self, goal: Point2) -> Result<(), PlannerError> {
        if self.map.to_obstacle.at(&self.map.grid, goal) < self.task.robot.radius() {
            return Err(PlannerError::GoalNotFree { x: goal.x, y: goal.y });
        }
        let task = Task { goal, ..self.task.clone() };
        let mut course = Course::new(self.profile.clone(), task, self.seed, &self.map)?;
        course.evaluators.extend(self.own_terms.clone());
        if let Some(term) = self.profile.terms.keys().find(|term| course.evaluator(term).is_none()) {
            return Err(PlannerError::NoEvaluator { term: term.clone() });
        }
        self.course = Some(course);
        self.carried = Carried::default();
        Ok(())
    }

    /// Sets the heading to end with at this goal and those to come, map frame, radians; none if any will do.
    pub fn set_goal_heading(&mut self, heading: Option<f64>) {
        self.task.goal_heading = heading;
        if let Some(course) = &mut self.course {
            course.task.goal_heading = heading;
        }
    }

    /// Sets what stands on the map that it does not have, until it is set again: all that is known now. The way past it
    /// is derived, which takes some milliseconds on a large map. A new goal begins without obstacles.
    ///
    /// # Errors
    /// No goal has been set.
    pub fn set_obstacles(&mut self, obstacles: Obstacles) -> Result<(), NoGoal> {
        let course = self.course.as_ref().ok_or(NoGoal)?;
        let map = Arc::clone(&self.map);
        let past = if obstacles.is_empty() {
            course.past(&map)
        } else {
            course.past(&ObstructedMap { map, obstacles })
        };
        let Ok(past) = past;
        self.course = Some(past);
        Ok(())
    }

    /// Whether obstacles leave the robot no way from `here` to within `tolerance` metres of the goal. The services end
    /// a mission after this has been so for a while.
    ///
    /// # Errors
    /// No goal has been set.
    pub fn is_closed(&self, here: Point2, tolerance: f64) -> Result<bool, NoGoal> {
        Ok(self.course.as_ref().ok_or(NoGoal)?.geodesic.is_closed(here, tolerance))
    }

    /// Whether there is a way to the goal from `start` on the map. Ask before the first cycle: the services refuse a
    /// mission without one.
    ///
    /// # Errors
    /// No goal has been set.
    pub fn has_way(&self, start: Point2) -> Result<bool, NoGoal> {
        Ok(self.course.as_ref().ok_or(NoGoal)?.has_way(start))
    }

    /// Plans once (Alg. 2). `stamp` is the robot's clock in seconds and must not fall from one cycle to the next.
    /// `people` are all that are known at `stamp`, map frame, in any order; those beyond the Working Zone do not count.
    /// Where there is no way to the goal ([`Planner::has_way`]), the robot gets as near to it as the walls allow.
    ///
    /// # Errors
    /// No goal has been set.
    pub fn cycle(&mut self, belief: Belief, people: &People, stamp: f64) -> Result<Verdict, NoGoal> {
        self.cycle_of_tick(self.cycles, belief, people, stamp)
    }

    /// As [`Planner::cycle`], in which the robot's tick is the caller's: samples depend on it. With the tick of a
    /// recorded cycle and what was carried into it, the verdict is the recorded one.
    ///
    /// # Errors
    /// No goal has been set.
    pub fn cycle_of_tick(
        &mut self,
        tick: u64,
        belief: Belief,
        people: &People,
        stamp: f64,
    ) -> Result<Verdict, NoGoal> {
        let course = self.course.as_ref().ok_or(NoGoal)?;
        let moment = Moment { tick, stamp };
        let observer = &mut self.carried.observer;
        let mut scene = observer.form_scene(&self.profile, &self.task.robot, moment, belief, people);
        course.complete(&mut scene);
        let candidates = course.generate_all(&scene, &mut self.carried);
        let scores = course.score(&scene, &candidates);
        let previous = self.carried.previous.as_ref();
        let verdict = arbitrate(&course.arbitration(&scene, &candidates, previous), &scores);
        self.carried.remember(&verdict.decision, stamp);
        self.cycles = tick + 1;
        self.last = Some(Cycle { scene, candidates, scores });
        Ok(verdict)
    }

    /// The base has braked for `seconds` now because something is too close to a robot that is at `pose`. Profiles
    /// with an `[unseen]` table plan around what must stand there, unless it is a wall. Without a goal it says nothing.
    pub fn observe_braking(&mut self, pose: Pose2, stamp: f64, seconds: f64) {
        if let Some(course) = &self.course {
            course.observe_braking(&mut self.carried.observer, pose, stamp, seconds);
        }
    }

    /// What the newest verdict was made from.
    pub fn last(&self) -> Option<&Cycle> {
        self.last.as_ref()
    }
}

#[cfg(test)]
mod backing_tests;
#[cfg(test)]
mod tests;
