//! Questions to replicas: borrowed from where their parts are, so that nothing is copied but into the bytes sent.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

use curionav_planning::candidates::CandidateSet;
use curionav_planning::generation::{self, Tree, own};
use curionav_planning::geometry::Pose2;
use curionav_planning::profile::Profile;
use curionav_planning::terms;
use curionav_runtime::convert;
use curionav_schemas::{
    self as wire, CandidateShardSlices, LaserModel, MapId, MissionOrder, OdometryNoise, Reject, RobotModel,
    Scene, Value, encode, keys,
};
use serde::Serialize;

use crate::evaluators;

/// Parameters of a mission's generator and terms, as they travel.
pub(crate) struct Parameters {
    terms: BTreeMap<String, Value>,
    generator: Value,
    /// What limits the growth of one cycle.
    pub(crate) iterations: u32,
}

impl Parameters {
    pub(crate) fn new(profile: &Profile) -> Result<Self, Reject> {
        let mut terms = BTreeMap::new();
        for term in profile.terms.keys() {
            terms.insert(term.clone(), evaluators::parameters(profile, term)?);
        }
        Ok(Self { terms, generator: generator_part(profile)?, iterations: profile.iterations() })
    }
}

/// What the generator of a profile takes from it. Tables that only other generators read stay behind: a replica reads
/// the parameters in every cycle.
fn generator_part(profile: &Profile) -> Result<Value, Reject> {
    let mut part = convert::to_value(&profile.generator_part())?;
    let Some(kind) = generation::find(&profile.generator) else { return Ok(part) };
    let others: Vec<_> = generation::tables_not_read_by(kind).map(Value::from).collect();
    let Value::Map(fields) = &mut part else { unreachable!("a struct is a map") };
    for (name, tables) in fields {
        if let (Some("generation"), Value::Map(tables)) = (name.as_text(), tables) {
            tables.retain(|(table, _)| !others.contains(table));
        }
    }
    Ok(part)
}

/// What evaluators can be asked in one cycle.
pub struct EvaluateQuestions<'a> {
    /// Epoch and number of the cycle.
    pub(crate) id: (u64, u64),
    pub(crate) order: &'a MissionOrder,
    pub(crate) parameters: &'a Parameters,
    pub(crate) scene: Cow<'a, Scene>,
    pub(crate) candidates: Cow<'a, CandidateSet>,
}

impl EvaluateQuestions<'_> {
    /// How many candidates there are.
    pub fn count(&self) -> usize {
        self.candidates.len()
    }

    /// The question for the costs under `term` of the candidates `range`, which are shard number `shard`.
    pub fn shard<'a>(&'a self, term: &'a str, shard: u32, range: Range<usize>) -> EvaluateQuestion<'a> {
        EvaluateQuestion { questions: self, term, shard, range }
    }
}

/// One question to an evaluator.
pub struct EvaluateQuestion<'a> {
    questions: &'a EvaluateQuestions<'a>,
    term: &'a str,
    shard: u32,
    range: Range<usize>,
}

/// An [`EvaluateRequest`](wire::EvaluateRequest) that owns nothing.
#[derive(Serialize)]
struct EvaluateRequest<'a> {
    epoch: u64,
    seq: u64,
    shard: u32,
    budget_ms: u32,
    map: MapId,
    goal_x: f64,
    goal_y: f64,
    laser: &'a LaserModel,
    robot_model: &'a RobotModel,
    odometry_noise: OdometryNoise,
    scene: &'a Scene,
    candidates: CandidateShardSlices<'a>,
    params: &'a Value,
}

impl EvaluateQuestion<'_> {
    /// Epoch, number of the cycle, and number of the shard.
    pub fn id(&self) -> (u64, u64, u32) {
        (self.questions.id.0, self.questions.id.1, self.shard)
    }

    /// How many candidates it is about.
    pub fn count(&self) -> usize {
        self.range.len()
    }

    /// The bytes of the [`EvaluateRequest`](wire::EvaluateRequest), to be answered within `budget_ms`.
    pub fn encode(&self, budget_ms: u32) -> Vec<u8> {
        let EvaluateQuestions { id: (epoch, seq), order, parameters, scene, candidates } = self.questions;
        let none = Value::Map(Vec::new());
        encode(&EvaluateRequest {
            epoch: *epoch,
            seq: *seq,
            shard: self.shard,
            budget_ms,
            map: order.map,
            goal_x: order.goal_x,
            goal_y: order.goal_y,
            laser: &order.laser,
            robot_model: &order.robot_model,
            odometry_noise: order.odometry_noise,
            scene,
            candidates: convert::shard_to_wire(candidates, self.range.clone(), terms::columns(self.term)),
            // A term that the profile does not have has no parameters.
            params: parameters.terms.get(self.term).unwrap_or(&none),
        })
    }
}

/// The role of the services that have this generator.
pub(crate) fn generator_role(generator: &str) -> &str {
    if own::is_own(generator) { generator } else { keys::GENERATOR }
}

/// One question to a generator.
pub struct GenerateQuestion<'a> {
    /// Epoch and number of the cycle.
    pub(crate) id: (u64, u64),
    pub(crate) order: &'a MissionOrder,
    pub(crate) parameters: &'a Parameters,
    pub(crate) generator: &'a str,
    pub(crate) scene: Cow<'a, Scene>,
    pub(crate) tree: Option<&'a Tree>,
    /// What is left of the trajectory decided last.
    pub(crate) previous: &'a [Pose2],
    pub(crate) seed: u64,
    pub(crate) iterations: u32,
}

/// A [`GenerateRequest`](wire::GenerateRequest) that owns no more than it must.
#[derive(Serialize)]
struct GenerateRequest<'a> {
    epoch: u64,
    seq: u64,
    budget_ms: u32,
    map: MapId,
    goal_x: f64,
    goal_y: f64,
    scene: &'a Scene,
    #[serde(skip_serializing_if = "Option::is_none")]
    tree: Option<wire::Tree>,
    seed: u64,
    iterations: u32,
    generator: &'a str,
    robot_model: &'a RobotModel,
    laser: &'a LaserModel,
    params: GeneratorParams<'a>,
}

/// [`GeneratorParams`](crate::generator::GeneratorParams) without what other generators read.
#[derive(Serialize)]
struct GeneratorParams<'a> {
    profile: &'a Value,
    previous: Vec<[f64; 3]>,
}

impl GenerateQuestion<'_> {
    /// The role of the services that answer it.
    pub fn role(&self) -> &str {
        generator_role(self.generator)
    }

    /// Epoch and number of the cycle.
    pub fn id(&self) -> (u64, u64) {
        self.id
    }

    /// The bytes of the [`GenerateRequest`](wire::GenerateRequest), to be answered within `budget_ms`.
    pub fn encode(&self, budget_ms: u32) -> Vec<u8> {
        let order = self.order;
        let (epoch, seq) = self.id;
        encode(&GenerateRequest {
            epoch,
            seq,
            budget_ms,
            map: order.map,
            goal_x: order.goal_x,
            goal_y: order.goal_y,
            scene: &self.scene,
            tree: self.tree.cloned().map(convert::tree_to_wire),
            seed: self.seed,
            iterations: self.iterations,
            generator: self.generator,
            robot_model: &order.robot_model,
            laser: &order.laser,
            params: GeneratorParams {
                profile: &self.parameters.generator,
                previous: self.previous.iter().map(|pose| [pose.x, pose.y, pose.heading]).collect(),
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use curionav_planning::geometry::Pose2;
    use curionav_planning::profile::Profile;
    use curionav_planning::terms::{self, NAMES};
    use curionav_runtime::convert;
    use curionav_schemas::{self as wire, EvaluateRequest, GenerateRequest, Message, Value};
    use curionav_testing::golden;

    use super::{EvaluateQuestions, GenerateQuestion, Parameters};
    use crate::evaluators;
    use crate::generator::GeneratorParams;

    const BUDGET: u32 = 80;

    /// What the bytes of a message say, which is the same for any order of its fields.
    fn read<M: Message>(bytes: &[u8]) -> M {
        M::decode(bytes, None).unwrap()
    }

    #[test]
    fn a_question_to_an_evaluator_says_what_its_request_says() {
        let mission = golden::mission();
        let scene = golden::scene();
        let set = golden::candidate_set();
        let candidates = convert::candidates(set.clone()).unwrap();
        let profile = Profile::builtin("curiosity").unwrap();
        let parameters = Parameters::new(&profile).unwrap();
        let order = &mission.order;
        let questions = EvaluateQuestions {
            id: (2, 14),
            order,
            parameters: &parameters,
            scene: Cow::Borrowed(&scene),
            candidates: Cow::Borrowed(&candidates),
        };
        for term in NAMES.iter().copied().chain(["comfort"]) {
            let columns = terms::columns(term);
            for (shard, range) in [0..2, 0..1, 1..2, 2..2].into_iter().enumerate() {
                let part = convert::candidates_to_wire(&candidates.pick(range.clone()));
                let part = wire::CandidateShard::from(part);
                let plain = EvaluateRequest {
                    epoch: 2,
                    seq: 14,
                    shard: shard as u32,
                    budget_ms: BUDGET,
                    map: order.map,
                    goal_x: order.goal_x,
                    goal_y: order.goal_y,
                    laser: order.laser.clone(),
                    robot_model: order.robot_model.clone(),
                    odometry_noise: order.odometry_noise,
                    scene: scene.clone(),
                    candidates: wire::CandidateShard {
                        heading: part.heading.filter(|_| columns.heading),
                        v: part.v.filter(|_| columns.v),
                        omega: part.omega.filter(|_| columns.omega),
                        ..part
                    },
                    params: match profile.terms.contains_key(term) {
                        true => evaluators::parameters(&profile, term).unwrap(),
                        false => Value::Map(Vec::new()),
                    },
                };
                let question = questions.shard(term, shard as u32, range);
                assert_eq!(question.count(), plain.candidates.count as usize);
                let asked = question.encode(BUDGET);
                let plain = plain.encode();
                assert_eq!(asked.len(), plain.len(), "{term}, shard {shard}");
                assert_eq!(read::<EvaluateRequest>(&asked), read(&plain), "{term}, shard {shard}");
            }
        }
    }

    #[test]
    fn a_question_to_a_generator_says_what_its_request_says() {
        let mission = golden::mission();
        let scene = golden::scene();
        for (name, tree) in [
            ("curiosity", None),
            ("curiosity", Some(golden::tree())),
            ("bi-risk-rrt", Some(golden::tree_of_two_roots())),
        ] {
            let profile = Profile::builtin(name).unwrap();
            let previous = vec![[1.3, -0.45, 0.31], [1.5, -0.4, 0.3]];
            let params = GeneratorParams { profile: profile.generator_part(), previous };
            let order = mission.order.clone();
            let plain = GenerateRequest {
                epoch: 2,
                seq: 14,
                budget_ms: BUDGET,
                map: order.map,
                goal_x: order.goal_x,
                goal_y: order.goal_y,
                scene: scene.clone(),
                tree: tree.clone(),
                seed: 17,
                iterations: 400,
                generator: profile.generator.clone(),
                robot_model: order.robot_model,
                laser: order.laser,
                params: convert::to_value(&params).unwrap(),
            };
            let tree = tree.map(convert::tree);
            let poses = [(1.3, -0.45, 0.31), (1.5, -0.4, 0.3)];
            let previous = poses.map(|(x, y, heading)| Pose2::new(x, y, heading));
            let question = GenerateQuestion {
                id: (2, 14),
                order: &mission.order,
                parameters: &Parameters::new(&profile).unwrap(),
                generator: &profile.generator,
                scene: Cow::Borrowed(&scene),
                tree: tree.as_ref(),
                previous: &previous,
                seed: 17,
                iterations: 400,
            };
            let asked = question.encode(BUDGET);
            let plain = plain.encode();
            assert!(asked.len() < plain.len(), "{name}: what others read stays behind");
            let whole = |bytes: &[u8]| {
                let mut request: GenerateRequest = read(bytes);
                let params: GeneratorParams = convert::parameters("params", &request.params).unwrap();
                request.params = convert::to_value(&params).unwrap();
                request
            };
            assert_eq!(whole(&asked), whole(&plain), "{name}");
        }
    }
}
