//! What stays the same for one revision of the mission.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::evaluators;
use crate::question::{EvaluateQuestions, GenerateQuestion, MissionFields};
use curionav_planning::arbitration::{self, Previous};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::evaluation::Evaluator;
use curionav_planning::evaluation::cpc::InformationField;
use curionav_planning::generation::{self, Generated, GenerationInput, GeneratorKind, Tree};
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::motion::RobotModel;
use curionav_planning::occupancy::{GeodesicField, StaticMap};
use curionav_planning::profile::Profile;
use curionav_planning::scene as planning;
use curionav_planning::terms::{self, BuildError, DerivedFields, Task};
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_schemas::{Mission, Refusal, Reject, Scene, keys};

/// Between the seeds of two trees: 2^64 over the square root of 2, made odd; no multiple of what separates the streams
/// of a seed, so that no tree draws what another draws at another tick.
const TREE_SEED_STEP: u64 = 0xB504_F333_F9DE_6485;

/// Evaluators of a term that are kept ready: a batch is worth being cut into no more shards.
const EVALUATORS_WANTED: usize = 64;

/// A mission made ready: profile parsed, fields derived, evaluators built.
pub struct PlanContext {
    /// The mission as published.
    pub mission: Mission,
    /// How to plan.
    pub profile: Profile,
    /// Where walls are.
    pub map: Arc<StaticMap>,
    /// Distance to go.
    pub geodesic: Arc<GeodesicField>,
    /// What can be driven.
    pub robot: RobotModel,
    /// What an observation is worth, if the generator asks for it.
    information: Option<Arc<InformationField>>,
    /// Where to go.
    pub goal: Point2,
    /// Whether the arbiter computes itself what no replica answers.
    pub in_process: bool,
    /// Whether it even asks nothing that it can compute itself.
    pub alone: bool,
    generator: &'static GeneratorKind,
    fields: MissionFields,
    local: BTreeMap<String, Arc<dyn Evaluator>>,
}

impl PlanContext {
    /// Fetches the map and derives every field; blocks for as long as that takes (a second or so).
    pub fn new(mission: Mission, fields: &Fields, in_process: bool) -> Result<Self, Reject> {
        convert::check_order(&mission.order)?;
        let profile: Profile = convert::parameters("profile", &mission.order.profile)?;
        let Some(generator) = generation::find(&profile.generator) else {
            let known = generation::known();
            return Err(Refusal::UnknownName { found: profile.generator, known }.at("profile.generator"));
        };
        if let Some(term) = profile.terms.keys().find(|term| keys::check_id(term).is_err()) {
            return Err(Refusal::NotAName { found: term.clone() }.at("profile.terms"));
        }
        let robot = convert::robot_model(&mission.order.robot_model);
        let goal = Point2::new(mission.order.goal_x, mission.order.goal_y);
        let derived = fields.of(mission.order.map);
        let map = derived.map()?;
        let task = Task {
            goal,
            robot: robot.clone(),
            laser: convert::laser(&mission.order.laser),
            noise: convert::noise(&mission.order.odometry_noise),
        };
        // The way to the goal takes one thread, what a sensor sees takes all of them.
        let (geodesic, local) = std::thread::scope(|scope| {
            let geodesic = scope.spawn(|| derived.geodesic(goal, robot.radius()));
            let local = local_evaluators(&profile, &task, &derived);
            (geodesic.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), local)
        });
        let geodesic = geodesic?;
        let start = convert::pose(mission.order.initial_pose).position();
        if !geodesic.at(start).is_finite() {
            return Err(Refusal::UnreachableGoal { x: goal.x, y: goal.y }.at("goal"));
        }
        let local = local?;
        let looks = profile.generator_part().looks_for_landmarks();
        let information = looks.then(|| derived.information(task.laser, &profile.information)).transpose()?;
        let fields = MissionFields::new(&mission, &profile)?;
        Ok(Self {
            mission,
            profile,
            map,
            geodesic,
            goal,
            robot,
            information,
            in_process,
            alone: false,
            generator,
            fields,
            local,
        })
    }

    /// The same for an arbiter that, if it is `alone`, computes all that it can and asks for nothing of it.
    #[must_use]
    pub fn alone(self, alone: bool) -> Self {
        Self { alone, in_process: alone || self.in_process, ..self }
    }

    /// Whether the arbiter computes a term itself, without asking a pool.
    pub fn is_own(&self, term: &str) -> bool {
        terms::is_local(term) || self.alone && self.local.contains_key(term)
    }

    /// Terms asked of pools, in order.
    pub fn pool_terms(&self) -> impl Iterator<Item = &str> {
        let terms = self.profile.terms.iter().filter(|(_, t)| t.weight > 0.0);
        terms.map(|(m, _)| m.as_str()).filter(|m| !self.is_own(m))
    }

    /// Terms asked of pools in a scene, in order.
    pub fn active_pool_terms(&self, scene: &planning::Scene) -> Vec<String> {
        let active = self.profile.active_terms(scene.uncertain).map(|(term, _)| term);
        active.filter(|term| !self.is_own(term)).map(str::to_owned).collect()
    }

    /// All pools that are asked: the generators', then those of the terms.
    pub fn pool_roles(&self) -> impl Iterator<Item = &str> {
        (!self.alone).then_some(keys::GENERATOR).into_iter().chain(self.pool_terms())
    }

    /// How many replicas of `role` are kept ready. A generator prepares for every goal of the robots that keep it ready, so
    /// each robot has one per tree, and one for when one of these fails. What evaluators prepare for, robots share.
    pub fn replicas_wanted(&self, role: &str) -> usize {
        if role == keys::GENERATOR { self.profile.trees as usize + 1 } else { EVALUATORS_WANTED }
    }

    /// Whether candidates, or their costs under a term, can be computed without the pool of `role`.
    pub fn is_replaceable(&self, role: &str) -> bool {
        self.in_process && !self.is_foreign(role)
    }

    /// Whether `role` is a term that only services of its own compute, whatever the configuration.
    pub fn is_foreign(&self, role: &str) -> bool {
        role != keys::GENERATOR && !self.local.contains_key(role)
    }

    /// What the arbitration of `candidates` in `scene` depends on.
    pub fn arbitration<'a>(
        &'a self,
        scene: &'a planning::Scene,
        candidates: &'a CandidateSet,
        previous: Option<&'a Previous>,
    ) -> arbitration::Context<'a> {
        let Self { profile, map, robot, goal, .. } = self;
        arbitration::Context { profile, scene, map, robot, goal: *goal, candidates, previous }
    }

    /// The in-process evaluator of a term, for falling back.
    pub fn local(&self, term: &str) -> Option<&Arc<dyn Evaluator>> {
        self.local.get(term)
    }

    /// The questions about `candidates` of a scene, in cycle `id` (epoch and number).
    pub fn evaluate_questions<'a>(
        &'a self,
        id: (u64, u64),
        scene: &Scene,
        candidates: &'a CandidateSet,
    ) -> EvaluateQuestions<'a> {
        self.fields.evaluate(id, scene, Cow::Borrowed(candidates))
    }

    /// The question for candidates of tree `index`. What is drawn depends on the mission's seed, the tree's
    /// index and the scene's tick alone, so that a restart, or another replica, grows the same tree.
    pub fn generate_question(
        &self,
        id: (u64, u64),
        scene: &Scene,
        index: usize,
        tree: Option<&Tree>,
        previous: &[Pose2],
    ) -> GenerateQuestion {
        self.fields.generate(id, scene, tree, previous, (self.tree_seed(index), self.profile.iterations()))
    }

    /// The answer to the same question, computed here; also says whether it was cut short. `spent` gives the share of the
    /// time for it that is over.
    pub fn generate(
        &self,
        scene: &planning::Scene,
        index: usize,
        tree: Option<Tree>,
        previous: &[Pose2],
        spent: &dyn Fn() -> f64,
    ) -> (Generated, bool) {
        let input = GenerationInput {
            params: &self.profile.generator_part(),
            map: &self.map,
            goal: self.goal,
            geodesic: &self.geodesic,
            information: self.information.as_deref(),
            robot: &self.robot,
            scene,
            previous: (!previous.is_empty()).then_some(previous),
            seed: self.tree_seed(index),
        };
        self.generator.generate(&input, tree, spent)
    }

    fn tree_seed(&self, index: usize) -> u64 {
        self.mission.order.seed.wrapping_add((index as u64).wrapping_mul(TREE_SEED_STEP))
    }

    /// Questions without candidates: a replica that answers one is warm.
    pub fn warm_up(&self) -> EvaluateQuestions<'_> {
        let none = CandidateSet::empty(self.profile.steps, self.profile.dt);
        self.fields.evaluate((0, 0), &self.empty_scene(), Cow::Owned(none))
    }

    /// A question for no growth at all: a replica that answers it is warm.
    pub fn warm_up_generator(&self) -> GenerateQuestion {
        self.fields.generate((0, 0), &self.empty_scene(), None, &[], (self.tree_seed(0), 0))
    }

    fn empty_scene(&self) -> Scene {
        let belief = convert::initial_belief(&self.mission);
        let people = convert::people_to_wire(&planning::People::default(), 0, 0.0);
        Scene { tick: 0, stamp: 0.0, belief, people, uncertain: false, in_place_s: 0.0, impatient: false }
    }
}

/// The evaluators of the profile's terms that are built in, by name. The others only replicas of their own can compute.
fn local_evaluators(
    profile: &Profile,
    task: &Task,
    fields: &impl DerivedFields<Error = Reject>,
) -> Result<BTreeMap<String, Arc<dyn Evaluator>>, Reject> {
    let built = profile.terms.keys().map(|term| (term, terms::evaluator(term, profile, task, fields)));
    let known = built.filter(|(_, built)| !matches!(built, Err(BuildError::Unknown)));
    known
        .map(|(term, built)| Ok((term.clone(), built.map_err(|e| evaluators::reject("profile", e))?)))
        .collect()
}

/// What is left of the previous trajectory at `stamp`, by state.
pub fn ahead(previous: &Previous, stamp: f64) -> Vec<Pose2> {
    let elapsed = stamp - previous.stamp;
    let tail = previous.trajectory.tail(elapsed, previous.trajectory.at(elapsed));
    (0..tail.len()).map(|k| tail.states().at(k).0).collect()
}
