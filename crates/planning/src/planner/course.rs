//! What stays the same on the way to one goal.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::arbitration::{Context, Observer, Previous, Scores};
use crate::candidates::CandidateSet;
use crate::evaluation::Evaluator;
use crate::evaluation::cpc::InformationField;
use crate::footprint::FootprintShape;
use crate::generation::{self, Generated, GenerationInput, GeneratorKind, GeneratorPart, Tree, own};
use crate::geometry::{Point2, Pose2};
use crate::motion::RobotModel;
use crate::occupancy::{GeodesicField, Obstacles, StaticMap};
use crate::planner::Carried;
use crate::profile::Profile;
use crate::scene::Scene;
use crate::terms::{self, DerivedFields, Task};

/// Between the seeds of two trees: 2^64 over the square root of 2, made odd; no multiple of what separates the streams
/// of a seed, so that no tree draws what another draws at another tick.
const TREE_SEED_STEP: u64 = 0xB504_F333_F9DE_6485;

/// Between two places at which the room on a way is looked up, metres: less than any robot is wide.
const WAY_SPACING: f64 = 0.05;

/// How far ahead the way is looked at for narrow places, metres: as far as a decision leads.
const PASSAGE_AHEAD: f64 = 3.0;

/// Farther from the robot no driver brakes for what stands beside its way, metres.
const BRAKED_FOR: f64 = 0.15;

/// From so much room beside the robot on, a way is not narrow, metres: no margin asks for as much.
const PASSAGE_WIDE: f64 = 0.3;

/// A goal made ready: fields derived, generator found, evaluators built.
pub struct Course {
    /// How to plan.
    pub profile: Profile,
    /// Where walls are, and obstacles that are on no map.
    pub map: Arc<StaticMap>,
    /// Those obstacles.
    pub obstacles: Obstacles,
    /// Distance to go.
    pub geodesic: Arc<GeodesicField>,
    /// What can be driven: backwards only if the laser looks there.
    pub robot: RobotModel,
    /// Where to go, map frame.
    pub goal: Point2,
    /// The run's.
    pub seed: u64,
    pub(super) task: Task,
    /// None for a planner of one's own, which others ask.
    generator: Option<&'static GeneratorKind>,
    /// What an observation is worth, if the generator asks for it.
    information: Option<Arc<InformationField>>,
    /// By term.
    pub(super) evaluators: BTreeMap<String, Arc<dyn Evaluator>>,
}

/// Why a goal cannot be made ready.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CourseError<E> {
    /// No generator of that name is built in.
    #[error("profile.generator: `{name}` is unknown; known: {}", generation::generator_names().join(", "))]
    UnknownGenerator {
        /// The name in the profile.
        name: String,
    },
    /// A field could not be derived.
    #[error("{0}")]
    Field(E),
}

impl Course {
    /// Takes from `fields` all that the way of `task` needs. Terms that are not built in have no evaluator here.
    ///
    /// # Errors
    /// The profile names no generator that exists, or there is no such field.
    pub fn new<F: DerivedFields>(
        profile: Profile,
        task: Task,
        seed: u64,
        fields: &F,
    ) -> Result<Self, CourseError<F::Error>> {
        let generator = generation::find(&profile.generator);
        if generator.is_none() && !own::is_own(&profile.generator) {
            return Err(CourseError::UnknownGenerator { name: profile.generator });
        }
        let mut evaluators = BTreeMap::new();
        for term in profile.terms.keys() {
            if let Some(built) = terms::evaluator(term, &profile, &task, fields) {
                evaluators.insert(term.clone(), built.map_err(CourseError::Field)?);
            }
        }
        let looks = profile.generator_part().looks_for_landmarks();
        let information = looks.then(|| fields.information(task.laser, &profile.information));
        Ok(Self {
            map: fields.map().map_err(CourseError::Field)?,
            obstacles: fields.obstacles(),
            geodesic: fields.geodesic(task.goal, task.robot.radius()).map_err(CourseError::Field)?,
            information: information.transpose().map_err(CourseError::Field)?,
            profile,
            robot: task.robot.seeing_with(&task.laser),
            goal: task.goal,
            seed,
            task,
            generator,
            evaluators,
        })
    }

    /// The same course past the obstacles of `fields`, which are of the same map. Derived are the fields that obstacles
    /// change, and the terms that read them: those that an arbiter computes itself.
    ///
    /// # Errors
    /// There is no such field.
    pub fn past<F: DerivedFields>(&self, fields: &F) -> Result<Self, F::Error> {
        let mut evaluators = self.evaluators.clone();
        for term in self.profile.terms.keys().filter(|term| terms::is_local(term)) {
            if let Some(built) = terms::evaluator(term, &self.profile, &self.task, fields) {
                evaluators.insert(term.clone(), built?);
            }
        }
        Ok(Self {
            map: fields.map()?,
            obstacles: fields.obstacles(),
            geodesic: fields.geodesic(self.goal, self.robot.radius())?,
            information: self.information.clone(),
            profile: self.profile.clone(),
            robot: self.robot.clone(),
            goal: self.goal,
            seed: self.seed,
            task: self.task.clone(),
            generator: self.generator,
            evaluators,
        })
    }

    /// The evaluator of a term; none if the term is not built in.
    pub fn evaluator(&self, term: &str) -> Option<&Arc<dyn Evaluator>> {
        self.evaluators.get(term)
    }

    /// Whether there is a way to the goal from `start` on the map.
    pub fn has_way(&self, start: Point2) -> bool {
        self.geodesic.at(start).is_finite()
    }

    /// Adds to a scene what the course knows: obstacles, how narrow the way ahead is, and whether people are at the
    /// goal ([`Patience::near_goal`](crate::profile::Patience::near_goal)).
    pub fn complete(&self, scene: &mut Scene) {
        let here = scene.belief.pose.position();
        scene.obstacles = self.obstacles.clone();
        scene.passage = self.passage(here);
        let near = self.profile.patience.near_goal;
        let is_near = |p: Point2| p.distance(self.goal) < near;
        scene.impatient |=
            is_near(here) && (0..scene.people.len()).any(|i| is_near(scene.people.position(i)));
    }

    /// Tells `observer` that the driver has braked for `seconds` now ([`Observer::observe_braking`]), unless a wall or
    /// an obstacle that is known stands so near to a robot at `pose` that a driver brakes for it.
    pub fn observe_braking(&self, observer: &mut Observer, pose: Pose2, stamp: f64, seconds: f64) {
        let near = self.robot.radius() + BRAKED_FOR;
        if self.map.to_obstacle.clearance(&self.map.grid, pose.position(), near) >= near {
            observer.observe_braking(&self.profile, &self.robot, pose, stamp, seconds);
        }
    }

    /// The least room beside the robot on the next 3 m of the way from `start`, metres; none where it is 0.3 m or more.
    /// A footprint that is no disc is taken lengthwise, as it goes through a door.
    pub fn passage(&self, start: Point2) -> Option<f64> {
        let way = self.geodesic.descend_for(start, WAY_SPACING, PASSAGE_AHEAD);
        let radius = FootprintShape::from(&self.robot.footprint).inscribed_radius();
        let enough = radius + PASSAGE_WIDE;
        let narrow = way.iter().filter(|p| self.map.to_obstacle.at(&self.map.grid, **p) < enough);
        let clearances = narrow.map(|p| self.map.to_obstacle.exact_clearance(&self.map.grid, *p));
        let least = clearances.fold(enough, f64::min);
        (least < enough).then_some(least - radius)
    }

    /// The least room that the way from `start` has to walls and unknown floor on the map, metres, as far as the
    /// centres of its cells say; infinite where there is no way.
    pub fn narrowest(&self, start: Point2) -> f64 {
        let way = self.geodesic.descend(start, WAY_SPACING);
        way.iter().map(|p| self.map.to_obstacle.at(&self.map.grid, *p)).fold(f64::INFINITY, f64::min)
    }

    /// What the arbitration of `candidates` in `scene` depends on.
    pub fn arbitration<'a>(
        &'a self,
        scene: &'a Scene,
        candidates: &'a CandidateSet,
        previous: Option<&'a Previous>,
    ) -> Context<'a> {
        let Self { profile, map, robot, goal, .. } = self;
        let goal_heading = self.task.goal_heading;
        Context { profile, scene, map, robot, goal: *goal, goal_heading, candidates, previous }
    }

    /// Grows tree number `index` (Alg. 1) and says whether that was cut short. `previous` is what is left of the
    /// trajectory decided last. `spent` gives the share of the time that is over, 1 at its end.
    pub fn generate(
        &self,
        scene: &Scene,
        index: usize,
        tree: Option<Tree>,
        previous: &[Pose2],
        spent: &dyn Fn() -> f64,
    ) -> (Generated, bool) {
        let params = self.profile.generator_part();
        let Some(generator) = self.generator else {
            let candidates = CandidateSet::empty(params.steps, params.dt);
            return (Generated { candidates, tree: Tree::default() }, false);
        };
        generator.generate(&self.input(scene, index, &params, previous), tree, spent)
    }

    /// What a generator is told in `scene` for tree number `index`, with the `params` of the profile.
    fn input<'a>(
        &'a self,
        scene: &'a Scene,
        index: usize,
        params: &'a GeneratorPart,
        previous: &'a [Pose2],
    ) -> GenerationInput<'a> {
        GenerationInput {
            params,
            map: &self.map,
            goal: self.goal,
            geodesic: &self.geodesic,
            information: self.information.as_deref(),
            robot: &self.robot,
            scene,
            previous: (!previous.is_empty()).then_some(previous),
            seed: self.tree_seed(index),
        }
    }

    /// Whether candidates come from a planner of one's own; [`Self::generate`] then gives none.
    pub fn asks_own(&self) -> bool {
        self.generator.is_none()
    }

    /// The candidates that `ask` makes in `scene` of what a planner of one's own is told, within the speed that zones
    /// allow.
    pub fn ask_own(
        &self,
        scene: &Scene,
        ask: impl FnOnce(&GenerationInput<'_>) -> CandidateSet,
    ) -> CandidateSet {
        let params = self.profile.generator_part();
        own::within_zones(&self.input(scene, 0, &params, &[]), ask)
    }

    /// The seed of tree number `index`. What a tree draws depends on it and on the scene's tick alone, so that a
    /// restart, or another replica, grows the same tree.
    pub fn tree_seed(&self, index: usize) -> u64 {
        self.seed.wrapping_add((index as u64).wrapping_mul(TREE_SEED_STEP))
    }

    /// Grows every tree to its end, one after the other: the candidates of all of them.
    pub fn generate_all(&self, scene: &Scene, carried: &mut Carried) -> CandidateSet {
        let previous = carried.ahead(scene.stamp);
        carried.trees.resize(self.profile.trees as usize, None);
        let mut sets = Vec::new();
        for (index, tree) in carried.trees.iter_mut().enumerate() {
            let (generated, _) = self.generate(scene, index, tree.take(), &previous, &|| 0.0);
            sets.push(generated.candidates);
            *tree = Some(generated.tree);
        }
        CandidateSet::concat(self.profile.steps, self.profile.dt, sets)
    }

    /// Scores every candidate under every term that counts in `scene`. A cost that is not finite or negative, or one
    /// too many, leaves its candidates unscored.
    pub fn score(&self, scene: &Scene, candidates: &CandidateSet) -> Scores {
        let mut scores = Scores::new(candidates.len());
        for (term, _) in self.profile.active_terms(scene.uncertain) {
            let costs = self.evaluator(term).map(|it| it.evaluate(scene, candidates, &|| false));
            if let Some(Ok(costs)) = costs {
                // Costs that do not fit are none: the candidates then lack the term.
                let _ = scores.insert(term, 0, &costs);
            }
        }
        scores
    }
}
