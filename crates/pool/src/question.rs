//! Questions to replicas, put together from fields: those that stay the same for a mission or for a cycle are encoded
//! once, and the arrays of candidates are copied once, from where they are into the bytes that are sent.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

use curionav_planning::candidates::CandidateSet;
use curionav_planning::generation::{self, Tree};
use curionav_planning::geometry::Pose2;
use curionav_planning::profile::Profile;
use curionav_planning::terms;
use curionav_runtime::convert;
use curionav_schemas::{Fields, Mission, Reject, Scene, Value};

use crate::evaluators;

/// Room for the fields that every question has of its own, with their names, bytes.
const OWN_FIELDS: usize = 256;

/// What all questions of a mission have in common.
pub(crate) struct MissionFields {
    evaluate: Fields,
    /// The parameters of each term.
    terms: BTreeMap<String, Fields>,
    generate: Fields,
    /// What the generator takes from the profile.
    generator_part: Fields,
}

impl MissionFields {
    pub(crate) fn new(mission: &Mission, profile: &Profile) -> Result<Self, Reject> {
        let order = &mission.order;
        let common = Fields::default()
            .with("map", &order.map)
            .with("goal_x", &order.goal_x)
            .with("goal_y", &order.goal_y)
            .with("laser", &order.laser)
            .with("robot_model", &order.robot_model);
        let mut terms = BTreeMap::new();
        for term in profile.terms.keys() {
            terms.insert(term.clone(), term_fields(&evaluators::parameters(profile, term)?));
        }
        Ok(Self {
            evaluate: common.clone().with("odometry_noise", &order.odometry_noise),
            terms,
            generate: common.with("generator", &profile.generator),
            generator_part: Fields::default().with("profile", &generator_part(profile)?),
        })
    }

    /// The questions about `candidates` of a scene in cycle (epoch, seq).
    pub(crate) fn evaluate<'a>(
        &'a self,
        id: (u64, u64),
        scene: &Scene,
        candidates: Cow<'a, CandidateSet>,
    ) -> EvaluateQuestions<'a> {
        EvaluateQuestions { id, mission: self, cycle: cycle_fields(id, scene), candidates }
    }

    /// The question for candidates of a scene in cycle (epoch, seq); `previous` is what is left of the last trajectory.
    pub(crate) fn generate(
        &self,
        id: (u64, u64),
        scene: &Scene,
        tree: Option<&Tree>,
        previous: &[Pose2],
        (seed, iterations): (u64, u32),
    ) -> GenerateQuestion {
        let previous: Vec<[f64; 3]> = previous.iter().map(|pose| [pose.x, pose.y, pose.heading]).collect();
        let params = self.generator_part.clone().with("previous", &previous);
        let mut fields = cycle_fields(id, scene)
            .and(&self.generate)
            .with_part("params", &params)
            .with("seed", &seed)
            .with("iterations", &iterations);
        if let Some(tree) = tree {
            fields = fields.with("tree", &convert::tree_to_wire(tree.clone()));
        }
        GenerateQuestion { id, fields }
    }
}

/// What the generator of a profile takes from it. Tables that only other generators read stay behind: a replica reads the
/// parameters in every cycle.
fn generator_part(profile: &Profile) -> Result<Value, Reject> {
    let mut part = convert::to_value(&profile.generator_part())?;
    let Some(kind) = generation::find(&profile.generator) else { return Ok(part) };
    let others: Vec<_> = generation::tables_of_others(kind).map(Value::from).collect();
    let Value::Map(fields) = &mut part else { unreachable!("a struct is a map") };
    for (name, tables) in fields {
        if let (Some("generation"), Value::Map(tables)) = (name.as_text(), tables) {
            tables.retain(|(table, _)| !others.contains(table));
        }
    }
    Ok(part)
}

fn term_fields(parameters: &Value) -> Fields {
    Fields::default().with("params", parameters)
}

fn cycle_fields((epoch, seq): (u64, u64), scene: &Scene) -> Fields {
    Fields::default().with("epoch", &epoch).with("seq", &seq).with("scene", scene)
}

/// What evaluators can be asked in one cycle.
pub struct EvaluateQuestions<'a> {
    id: (u64, u64),
    mission: &'a MissionFields,
    cycle: Fields,
    candidates: Cow<'a, CandidateSet>,
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

impl EvaluateQuestion<'_> {
    /// Epoch, number of the cycle, and number of the shard.
    pub fn id(&self) -> (u64, u64, u32) {
        (self.questions.id.0, self.questions.id.1, self.shard)
    }

    /// How many candidates it is about.
    pub fn count(&self) -> usize {
        self.range.len()
    }

    /// The bytes of the [`EvaluateRequest`](curionav_schemas::EvaluateRequest), to be answered within `budget_ms`.
    pub fn encode(&self, budget_ms: u32) -> Vec<u8> {
        let EvaluateQuestions { mission, cycle, candidates, .. } = self.questions;
        // A term that the profile does not have has no parameters.
        let term = match mission.terms.get(self.term) {
            Some(fields) => Cow::Borrowed(fields),
            None => Cow::Owned(term_fields(&Value::Map(Vec::new()))),
        };
        let shard = convert::shard_to_wire(candidates, self.range.clone(), terms::columns(self.term));
        let parts = [cycle, &mission.evaluate, &*term];
        let room =
            parts.iter().map(|part| part.encoded_len()).sum::<usize>() + shard.array_bytes() + OWN_FIELDS;
        parts
            .into_iter()
            .fold(Fields::with_room(room), Fields::and)
            .with("shard", &self.shard)
            .with("budget_ms", &budget_ms)
            .with("candidates", &shard)
            .into_bytes()
    }
}

/// One question to a generator.
pub struct GenerateQuestion {
    id: (u64, u64),
    /// All but the budget.
    fields: Fields,
}

impl GenerateQuestion {
    /// Epoch and number of the cycle.
    pub fn id(&self) -> (u64, u64) {
        self.id
    }

    /// The bytes of the [`GenerateRequest`](curionav_schemas::GenerateRequest), to be answered within `budget_ms`.
    pub fn encode(&self, budget_ms: u32) -> Vec<u8> {
        Fields::with_room(self.fields.encoded_len() + OWN_FIELDS)
            .and(&self.fields)
            .with("budget_ms", &budget_ms)
            .into_bytes()
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::terms::NAMES;
    use curionav_schemas::{self as wire, EvaluateRequest, GenerateRequest, Message};
    use curionav_testing::golden;

    use super::*;
    use crate::generator::GeneratorParams;

    const BUDGET: u32 = 80;

    fn fields(mission: &Mission, profile: &Profile) -> MissionFields {
        MissionFields::new(mission, profile).unwrap()
    }

    /// What the bytes of a message say, which is the same for any order of its fields.
    fn read<M: Message>(bytes: &[u8]) -> M {
        M::decode(bytes, None).unwrap()
    }

    #[test]
    fn a_question_to_an_evaluator_says_what_its_request_says() {
        let (mission, scene, set) = (golden::mission(), golden::scene(), golden::candidate_set());
        let candidates = convert::candidates(set.clone()).unwrap();
        let profile = Profile::builtin("curiosity").unwrap();
        let mission_fields = fields(&mission, &profile);
        let questions = mission_fields.evaluate((2, 14), &scene, Cow::Borrowed(&candidates));
        let order = mission.order;
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
                let (asked, plain) = (question.encode(BUDGET), plain.encode());
                assert_eq!(asked.len(), plain.len(), "{term}, shard {shard}");
                assert_eq!(read::<EvaluateRequest>(&asked), read(&plain), "{term}, shard {shard}");
            }
        }
    }

    #[test]
    fn a_question_to_a_generator_says_what_its_request_says() {
        let (mission, scene) = (golden::mission(), golden::scene());
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
            let (tree, poses) = (tree.map(convert::tree), [(1.3, -0.45, 0.31), (1.5, -0.4, 0.3)]);
            let previous = poses.map(|(x, y, heading)| Pose2::new(x, y, heading));
            let question =
                fields(&mission, &profile).generate((2, 14), &scene, tree.as_ref(), &previous, (17, 400));
            let (asked, plain) = (question.encode(BUDGET), plain.encode());
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
