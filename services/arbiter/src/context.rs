//! What stays the same for one revision of the mission.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use curionav_planning::arbitration::Previous;
use curionav_planning::candidates::CandidateSet;
use curionav_planning::evaluation::Evaluator;
use curionav_planning::geometry::Point2;
use curionav_planning::motion::RobotModel;
use curionav_planning::occupancy::{GeodesicField, StaticMap};
use curionav_planning::profile::Profile;
use curionav_runtime::convert;
use curionav_runtime::evaluators::{AT_HOME, evaluator, parameters};
use curionav_runtime::fields::Fields;
use curionav_runtime::generator::{self, GeneratorParams};
use curionav_schemas::limits::MAX_CANDIDATES;
use curionav_schemas::{EvaluateRequest, GenerateRequest, Mission, Reject, RejectCode, Scene, Tree, Value};

/// Between the seeds of two trees: 2^64 over the square root of 2, made odd; no multiple of what separates the streams
/// of a seed, so that no tree draws what another draws at another tick.
const TREE_SEED_STEP: u64 = 0xB504_F333_F9DE_6485;

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
    /// Where to go.
    pub goal: Point2,
    /// Whether the arbiter computes itself what no replica answers.
    pub in_process: bool,
    parameters: BTreeMap<String, Value>,
    local: BTreeMap<String, Arc<dyn Evaluator>>,
}

impl PlanContext {
    /// Fetches the map and derives every field; blocks for as long as that takes (a second or so).
    pub fn new(mission: Mission, fields: &Fields, in_process: bool) -> Result<Self, Reject> {
        let profile: Profile = convert::from_value("profile", &mission.profile)?;
        profile.check().map_err(|e| Reject::invalid("profile", e.to_string()))?;
        if !generator::is_known(&profile.generator) {
            let reason = format!(
                "`{}` is not a trajectory generator; known: {}",
                profile.generator,
                generator::known()
            );
            return Err(Reject::invalid("profile.generator", reason));
        }
        let most = profile.trees as usize * profile.max_candidates() as usize;
        if most > MAX_CANDIDATES {
            let reason =
                format!("all trees may offer {most} candidates, a batch has at most {MAX_CANDIDATES}");
            return Err(Reject::invalid("profile.trees", reason));
        }
        let robot = convert::robot_model(&mission.robot_model);
        let goal = Point2::new(mission.goal_x, mission.goal_y);
        let map = fields.map(mission.map)?;
        let geodesic = fields.geodesic(mission.map, goal, robot.radius())?;
        let start = convert::pose(mission.initial_pose).position();
        if !geodesic.at(&map.grid, start).is_finite() {
            let reason = format!("({:.2}, {:.2}) cannot be reached from the start", goal.x, goal.y);
            return Err(Reject::invalid("goal", reason));
        }
        let mut parameters_of = BTreeMap::new();
        for metric in profile.terms.keys() {
            parameters_of.insert(metric.clone(), parameters(&profile, metric)?);
        }
        let mut context = Self {
            mission,
            profile,
            map,
            geodesic,
            robot,
            goal,
            in_process,
            parameters: parameters_of,
            local: BTreeMap::new(),
        };
        for metric in context.profile.terms.keys() {
            match evaluator(metric, &context.warm_up(metric), fields) {
                Ok(built) => {
                    context.local.insert(metric.clone(), built);
                }
                // Somebody else's metric: its pool is the only home it has.
                Err(reject) if reject.code == RejectCode::Unknown => {}
                Err(reject) => return Err(reject),
            }
        }
        Ok(context)
    }

    /// Metrics asked of pools, in order.
    pub fn pool_metrics(&self) -> impl Iterator<Item = &str> {
        let terms = self.profile.terms.iter().filter(|(_, t)| t.weight > 0.0);
        terms.map(|(m, _)| m.as_str()).filter(|m| !AT_HOME.contains(m))
    }

    /// Whether candidates, or their costs under a metric, can be computed without the pool of `role`.
    pub fn is_replaceable(&self, role: &str) -> bool {
        self.in_process && (role == generator::ROLE || self.local.contains_key(role))
    }

    /// Whether `role` is a metric that only services of its own compute, whatever the configuration.
    pub fn is_foreign(&self, role: &str) -> bool {
        role != generator::ROLE && !self.local.contains_key(role)
    }

    /// The in-process evaluator of a metric, for falling back.
    pub fn local(&self, metric: &str) -> Option<&Arc<dyn Evaluator>> {
        self.local.get(metric)
    }

    /// The question for some candidates of a scene under `metric`.
    pub fn evaluate_request(
        &self,
        metric: &str,
        id: (u64, u64),
        scene: &Scene,
        candidates: &CandidateSet,
        range: Range<usize>,
    ) -> EvaluateRequest {
        EvaluateRequest {
            robot: self.mission.robot.clone(),
            epoch: id.0,
            seq: id.1,
            shard: 0,
            budget_ms: 0,
            map: self.mission.map,
            goal_x: self.goal.x,
            goal_y: self.goal.y,
            laser: self.mission.laser.clone(),
            robot_model: self.mission.robot_model.clone(),
            odometry_noise: self.mission.odometry_noise,
            scene: scene.clone(),
            candidates: convert::shard_to_wire(candidates, range),
            params: self.parameters.get(metric).cloned().unwrap_or(Value::Map(Vec::new())),
        }
    }

    /// The question for candidates of tree `index`. What is drawn depends on the mission's seed, the tree's
    /// index and the scene's tick alone, so that a restart, or another replica, grows the same tree.
    pub fn generate_request(
        &self,
        id: (u64, u64),
        scene: &Scene,
        index: usize,
        tree: Option<Tree>,
        previous: Option<&Previous>,
    ) -> Result<GenerateRequest, Reject> {
        let params = GeneratorParams {
            generation: self.profile.generation.clone(),
            collision: self.profile.collision,
            risk: self.profile.risk,
            steps: self.profile.steps,
            dt: self.profile.dt,
            min_speed: self.profile.min_speed,
            forecast: self.profile.forecast,
            previous: previous.map(|p| ahead(p, scene.stamp)).unwrap_or_default(),
        };
        Ok(GenerateRequest {
            robot: self.mission.robot.clone(),
            epoch: id.0,
            seq: id.1,
            budget_ms: 0,
            map: self.mission.map,
            goal_x: self.goal.x,
            goal_y: self.goal.y,
            scene: scene.clone(),
            tree,
            seed: self.mission.seed.wrapping_add((index as u64).wrapping_mul(TREE_SEED_STEP)),
            iterations: self.profile.iterations(),
            generator: self.profile.generator.clone(),
            robot_model: self.mission.robot_model.clone(),
            laser: self.mission.laser.clone(),
            params: convert::to_value(&params)?,
        })
    }

    /// A question without candidates: whoever answers it is warm.
    pub fn warm_up(&self, metric: &str) -> EvaluateRequest {
        let none = CandidateSet::empty(self.profile.steps, self.profile.dt);
        self.evaluate_request(metric, (0, 0), &self.empty_scene(), &none, 0..0)
    }

    /// A question for no growth at all: whoever answers it is warm.
    pub fn warm_up_generator(&self) -> Result<GenerateRequest, Reject> {
        let mut request = self.generate_request((0, 0), &self.empty_scene(), 0, None, None)?;
        request.iterations = 0;
        Ok(request)
    }

    fn empty_scene(&self) -> Scene {
        let belief = convert::initial_belief(&self.mission);
        let people = convert::people_to_wire(&curionav_planning::scene::People::default(), 0, 0.0);
        Scene { tick: 0, stamp: 0.0, belief, people, uncertain: false }
    }
}

/// What is left of the previous trajectory at `stamp`.
fn ahead(previous: &Previous, stamp: f64) -> Vec<[f64; 3]> {
    let tail = previous.trajectory.tail(stamp - previous.stamp);
    (0..tail.len()).filter_map(|k| tail.state(k)).map(|(pose, _)| [pose.x, pose.y, pose.heading]).collect()
}
