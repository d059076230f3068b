//! What stays the same for one revision of the mission.

use std::borrow::Cow;
use std::sync::Arc;

use curionav_planning::candidates::CandidateSet;
use curionav_planning::generation::Tree;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::Obstacles;
use curionav_planning::planner::Course;
use curionav_planning::scene as planning;
use curionav_planning::terms;
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_runtime::mission_course::{MissionCourse, past_obstacles};
use curionav_schemas::{Mission, Reject, Scene, keys};

use crate::question::{EvaluateQuestions, GenerateQuestion, Parameters, generator_role};

/// Evaluators of a term that are kept ready: a batch is worth being cut into no more shards.
const EVALUATORS_WANTED: usize = 64;

/// A mission made ready: the course to its goal, and what questions about it say.
pub struct PlanContext {
    /// The mission as published.
    pub mission: Mission,
    /// How to plan, and every field that it needs.
    pub course: Course,
    /// Whether the arbiter computes itself what no replica answers.
    pub in_process: bool,
    /// Whether it even asks nothing that it can compute itself.
    pub alone: bool,
    parameters: Arc<Parameters>,
}

impl PlanContext {
    /// Fetches the map and derives every field; blocks for as long as that takes (a second or so).
    pub fn new(mission: Mission, fields: &Fields, in_process: bool) -> Result<Self, Reject> {
        let MissionCourse { mission, course } = MissionCourse::new(mission, fields)?;
        let parameters = Arc::new(Parameters::new(&course.profile)?);
        Ok(Self { mission, course, in_process, alone: false, parameters })
    }

    /// The same mission with these obstacles on the map, for a robot that is `here`; blocks while the way past them is
    /// derived.
    pub fn obstructed(&self, obstacles: &Obstacles, here: Point2, fields: &Fields) -> Result<Self, Reject> {
        Ok(Self {
            mission: self.mission.clone(),
            course: past_obstacles(&self.course, &self.mission, obstacles, here, fields)?,
            parameters: Arc::clone(&self.parameters),
            ..*self
        })
    }

    /// The same for an arbiter that, if it is `alone`, computes all that it can and asks for nothing of it.
    #[must_use]
    pub fn alone(self, alone: bool) -> Self {
        Self { alone, in_process: alone || self.in_process, ..self }
    }

    /// Whether the arbiter computes a term itself, without asking a pool.
    pub fn is_own(&self, term: &str) -> bool {
        terms::is_local(term) || self.alone && self.course.evaluator(term).is_some()
    }

    /// Terms asked of pools, in order.
    pub fn pool_terms(&self) -> impl Iterator<Item = &str> {
        let terms = self.course.profile.terms.iter().filter(|(_, t)| t.weight > 0.0);
        terms.map(|(m, _)| m.as_str()).filter(|m| !self.is_own(m))
    }

    /// Terms asked of pools in a scene, in order.
    pub fn active_pool_terms(&self, scene: &planning::Scene) -> Vec<String> {
        let active = self.course.profile.active_terms(scene.uncertain).map(|(term, _)| term);
        active.filter(|term| !self.is_own(term)).map(str::to_owned).collect()
    }

    /// Whether the arbiter generates candidates itself, without asking a pool. Questions to generators say nothing of a
    /// way that is given, which changes each second: they would have to prepare for it anew each time.
    pub fn generates_itself(&self) -> bool {
        !self.course.asks_own() && (self.alone || self.mission.order.way.is_some())
    }

    /// The role that is asked for candidates: that of built-in generators, or that of a planner of one's own.
    pub fn generator_role(&self) -> &str {
        generator_role(&self.course.profile.generator)
    }

    /// All pools that are asked: the generators', then those of the terms.
    pub fn pool_roles(&self) -> impl Iterator<Item = &str> {
        (!self.generates_itself()).then_some(self.generator_role()).into_iter().chain(self.pool_terms())
    }

    /// How many replicas of `role` are kept ready. A generator prepares for every goal of the robots that keep it
    /// ready, so each robot has one per tree, and one for when one of these fails. What evaluators prepare for, robots
    /// share.
    pub fn replicas_wanted(&self, role: &str) -> usize {
        if keys::generates(role) { self.course.profile.trees as usize + 1 } else { EVALUATORS_WANTED }
    }

    /// Whether candidates, or their costs under a term, can be computed without the pool of `role`.
    pub fn is_replaceable(&self, role: &str) -> bool {
        self.in_process && !self.is_foreign(role)
    }

    /// Whether `role` is a term or a planner that only services of its own compute, whatever the configuration.
    pub fn is_foreign(&self, role: &str) -> bool {
        role != keys::GENERATOR && self.course.evaluator(role).is_none()
    }

    /// The questions about `candidates` of a scene, in cycle `id` (epoch and number).
    pub fn evaluate_questions<'a>(
        &'a self,
        id: (u64, u64),
        scene: &'a Scene,
        candidates: &'a CandidateSet,
    ) -> EvaluateQuestions<'a> {
        self.questions(id, Cow::Borrowed(scene), Cow::Borrowed(candidates))
    }

    /// The question for candidates of tree `index`.
    pub fn generate_question<'a>(
        &'a self,
        id: (u64, u64),
        scene: &'a Scene,
        index: usize,
        tree: Option<&'a Tree>,
        previous: &'a [Pose2],
    ) -> GenerateQuestion<'a> {
        GenerateQuestion {
            id,
            order: &self.mission.order,
            parameters: &self.parameters,
            generator: &self.course.profile.generator,
            scene: Cow::Borrowed(scene),
            tree,
            previous,
            seed: self.course.tree_seed(index),
            iterations: self.parameters.iterations,
        }
    }

    /// Questions without candidates: a replica that answers one is warm.
    pub fn warm_up(&self) -> EvaluateQuestions<'_> {
        let none = CandidateSet::empty(self.course.profile.steps, self.course.profile.dt);
        self.questions((0, 0), Cow::Owned(self.empty_scene()), Cow::Owned(none))
    }

    /// A question for no growth at all: a replica that answers it is warm.
    pub fn warm_up_generator(&self) -> GenerateQuestion<'_> {
        GenerateQuestion {
            id: (0, 0),
            order: &self.mission.order,
            parameters: &self.parameters,
            generator: &self.course.profile.generator,
            scene: Cow::Owned(self.empty_scene()),
            tree: None,
            previous: &[],
            seed: self.course.tree_seed(0),
            iterations: 0,
        }
    }

    fn questions<'a>(
        &'a self,
        id: (u64, u64),
        scene: Cow<'a, Scene>,
        candidates: Cow<'a, CandidateSet>,
    ) -> EvaluateQuestions<'a> {
        let order = &self.mission.order;
        EvaluateQuestions { id, order, parameters: &self.parameters, scene, candidates }
    }

    fn empty_scene(&self) -> Scene {
        let belief = convert::initial_belief(&self.mission);
        let people = convert::people_to_wire(&planning::People::default(), 0, 0.0);
        let obstacles = Default::default();
        Scene {
            tick: 0,
            stamp: 0.0,
            belief,
            people,
            obstacles,
            passage_m: None,
            uncertain: false,
            in_place_s: 0.0,
            impatient: false,
        }
    }
}
