//! A cycle planned again as the arbiter plans it, with everything computed in this process.

use std::collections::BTreeMap;
use std::future::{Future, pending};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use anyhow::Context;
use curionav_arbiter::cycle;
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::profile::Profile;
use curionav_pool::context::PlanContext;
use curionav_pool::peers::{Call, Peers};
use curionav_pool::pool::Pool;
use curionav_pool::question::{EvaluateQuestion, GenerateQuestion};
use curionav_pool::replicas::Wanted;
use curionav_robot::arbiter::cycle::Observation;
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_runtime::locked::locked;
use curionav_runtime::query::AskError;
use curionav_schemas::{
    CycleReport, Decision, EvaluateRequest, F64Array, GenerateReply, MapId, Memory, Message, Mission,
    OccupancyGrid, Scene, Scores, Tree,
};

/// The instance that answers for terms which this program cannot compute.
const RECORDING: &str = "recording";

/// (robot, run, revision): which mission.
type MissionId = (String, u64, u64);

pub(super) struct Offline {
    planner: Option<Profile>,
    missions: BTreeMap<MissionId, Mission>,
    fields: BTreeMap<MapId, Fields>,
    contexts: BTreeMap<MissionId, Arc<PlanContext>>,
    /// Trees grown here, by mission: for a planner whose generator is not the one that was recorded.
    own_trees: BTreeMap<MissionId, Vec<Tree>>,
    pool: Pool<OfflinePeers>,
}

impl Offline {
    pub(super) fn new(planner: Option<Profile>) -> Self {
        Self {
            planner,
            missions: BTreeMap::new(),
            fields: BTreeMap::new(),
            contexts: BTreeMap::new(),
            own_trees: BTreeMap::new(),
            pool: Pool::new(Arc::new(OfflinePeers::default())),
        }
    }

    pub(super) fn learn_mission(&mut self, mission: Mission) {
        self.missions.insert((mission.order.robot.clone(), mission.run, mission.revision), mission);
    }

    pub(super) fn learn_map(&mut self, map: OccupancyGrid) -> anyhow::Result<()> {
        let id = map.map;
        let grid = convert::occupancy_grid(map)?;
        self.fields.insert(id, Fields::of_maps([StaticMap::new(grid)]));
        Ok(())
    }

    /// The name of the planner that a mission was carried out with.
    pub(super) fn recorded_planner(&self) -> Option<String> {
        let mission = self.missions.values().next()?;
        convert::from_value::<Profile>("profile", &mission.order.profile).ok().map(|profile| profile.name)
    }

    /// Plans the cycle of `report` again, which began with `memory`; or says why it cannot be planned again.
    pub(super) async fn plan(
        &mut self,
        mut memory: Memory,
        report: &CycleReport,
    ) -> anyhow::Result<Result<Decision, &'static str>> {
        let id = (memory.robot.clone(), memory.run, memory.revision);
        let Some(mission) = self.missions.get(&id) else {
            return Ok(Err("its mission is not in the recording"));
        };
        let recorded: Profile = convert::from_value("profile", &mission.order.profile)?;
        let context = match self.contexts.get(&id) {
            Some(context) => Arc::clone(context),
            None => {
                let Some(fields) = self.fields.get(&mission.order.map) else {
                    return Ok(Err("its map is not in the recording"));
                };
                let mut mission = mission.clone();
                if let Some(planner) = &self.planner {
                    mission.order.profile = convert::to_value(planner)?;
                }
                let context = PlanContext::new(mission, fields, true);
                let context = Arc::new(context.context("this mission cannot be planned")?);
                self.contexts.insert(id.clone(), Arc::clone(&context));
                context
            }
        };
        let foreign = context.course.profile.generator != recorded.generator;
        if foreign {
            memory.trees = self.own_trees.remove(&id).unwrap_or_default();
        }
        let context = self.past_obstacles(context, &report.scene)?;
        self.answer_from(report, &context);
        let belief = report.scene.belief.clone();
        let observation = Observation { belief, people: report.scene.people.clone() };
        let mut carried = curionav_robot::arbiter::memory::Memory::recall(memory)?;
        let (decision, _) = cycle::plan(&self.pool, &context, &mut carried, observation).await;
        if foreign {
            self.own_trees.insert(id, carried.to_wire(&context.mission).trees);
        }
        Ok(Ok(decision))
    }

    /// The same mission with the obstacles of a scene.
    fn past_obstacles(&self, context: Arc<PlanContext>, scene: &Scene) -> anyhow::Result<Arc<PlanContext>> {
        let obstacles = convert::obstacles(&scene.obstacles);
        let fields = self.fields.get(&context.mission.order.map).filter(|_| !obstacles.is_empty());
        let Some(fields) = fields else { return Ok(context) };
        let here = Point2::new(scene.belief.x, scene.belief.y);
        let obstructed = context.obstructed(&obstacles, here, fields);
        Ok(Arc::new(obstructed.context("there is no course past its obstacles")?))
    }

    /// Lets the recording stand in for terms that are not built in: it knows their costs as long as the candidates are
    /// those that were recorded.
    fn answer_from(&self, report: &CycleReport, context: &PlanContext) {
        // Whether it could answer in an earlier cycle says nothing about this one.
        self.pool.clear();
        let peers = &self.pool.peers;
        *locked(&peers.report) = Some(report.clone());
        let foreign = context.pool_terms().filter(|term| context.course.evaluator(term).is_none());
        for term in foreign {
            let mut replicas = self.pool.replicas();
            let wanted = Wanted { robot: &context.mission.order.robot, count: 1 };
            replicas.update(term, &[RECORDING.to_owned()], wanted, Duration::ZERO);
            for probe in replicas.take_due(Duration::ZERO) {
                replicas.probed(&probe.role, &probe.instance, Some(1), Duration::ZERO);
            }
        }
    }
}

/// Only the recording is asked, and time stands still: no budget cuts anything short.
#[derive(Default)]
struct OfflinePeers {
    report: Mutex<Option<CycleReport>>,
}

impl OfflinePeers {
    /// What was recorded for the candidates of `request`, if they are the same ones.
    fn recorded(&self, term: &str, request: &EvaluateRequest) -> Option<Vec<f64>> {
        let report = locked(&self.report);
        let report = report.as_ref()?;
        let recorded = report.terms.iter().find(|recorded| recorded.term == term)?;
        let asked = &request.candidates;
        let known = &report.candidates;
        let steps = known.steps as usize;
        if asked.steps != known.steps || asked.count > known.count {
            return None;
        }
        // A batch may have been cut into shards: each is a stretch of the recorded one.
        let first = known.id.iter().position(|id| asked.id.first() == Some(id))?;
        let rows = first..first + asked.count as usize;
        let cells = rows.start * steps..rows.end * steps;
        let is_same = |a: &F64Array, b: &F64Array| b.get(cells.clone()).is_some_and(|b| a[..] == *b);
        let same = is_same(&asked.x, &known.x)
            && is_same(&asked.y, &known.y)
            && asked.heading.as_ref().is_none_or(|heading| is_same(heading, &known.heading));
        if !same {
            return None;
        }
        rows.map(|index| recorded.raw_of(index)).collect()
    }
}

impl Peers for OfflinePeers {
    fn now(&self) -> Duration {
        Duration::ZERO
    }

    fn sleep(&self, _time: Duration) -> impl Future<Output = ()> + Send {
        pending()
    }

    fn compute<R>(&self, work: impl FnOnce() -> R) -> R {
        work()
    }

    fn follow(&self, _: &[&str]) {}

    fn alive(&self, _role: &str) -> Vec<String> {
        Vec::new()
    }

    fn membership_changed(&self) -> impl Future<Output = ()> + Send {
        pending()
    }

    async fn generate(&self, _: Call<'_>, _: &GenerateQuestion<'_>) -> Result<GenerateReply, AskError> {
        Err(AskError::NoReply)
    }

    async fn evaluate(
        &self,
        term: &str,
        call: Call<'_>,
        question: &EvaluateQuestion<'_>,
    ) -> Result<Scores, AskError> {
        let request = EvaluateRequest::decode(&question.encode(call.budget_ms()), None);
        let request = request.map_err(|error| AskError::Send(error.to_string()))?;
        let cost = self.recorded(term, &request).ok_or(AskError::NoReply)?;
        Ok(Scores {
            epoch: request.epoch,
            seq: request.seq,
            shard: request.shard,
            term: term.to_owned(),
            instance: call.instance.to_owned(),
            cost: cost.into(),
            elapsed_us: 0,
            slots: 1,
        })
    }
}
