//! Questions to replicas, put together from fields: those that stay the same for a mission or for a cycle are encoded
//! once, and the arrays of candidates are copied once, from where they are into the bytes that are sent.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

use curionav_planning::candidates::CandidateSet;
use curionav_planning::generation::Tree;
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
            generator_part: Fields::default().with("profile", &profile.generator_part()),
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
