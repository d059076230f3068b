//! Robots that ask: each has the pool of a real arbiter, on a link of its own, and uses its dispatch.

use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, anyhow};
use curionav_planning::generation::{Generated, Tree};
use curionav_pool::budget::Budget;
use curionav_pool::context::PlanContext;
use curionav_pool::dispatch;
use curionav_pool::peers::{Peers, ZenohPeers};
use curionav_pool::pool::Pool;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::serve::{Server, refusals};
use curionav_runtime::{map_store, session};
use curionav_schemas::{self as wire, Clock};
use futures_util::future::join_all;
use tokio::task::JoinSet;
use tokio::time::Instant;
use zenoh::Session;

use super::batch::Batch;
use super::processes::{ASKS, HOSTS, Processes};
use super::workload::Workload;
use curionav_runtime::exit::Exit;

/// Deriving what a map has to give takes a replica a second or so.
const READY_TIMEOUT: Duration = Duration::from_secs(60);

/// What is asked for, in turn.
pub(super) enum Work {
    /// Costs of batches under a term.
    Evaluate(&'static str, Vec<Batch>),
    /// Candidates for these moments, one after the other, from so many trees, which are handed on.
    Generate(Vec<wire::Scene>, usize),
}

/// Where in `all` piece `seq` of the work is found: they take turns.
pub(super) fn turn_of<T>(all: &[T], seq: u64) -> usize {
    (seq % all.len().max(1) as u64) as usize
}

/// What piece `seq` of the work is about; nothing of nothing.
pub(super) fn turn<T>(all: &[T], seq: u64) -> Option<&T> {
    all.get(turn_of(all, seq))
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Answer {
    pub(super) candidates: usize,
    /// Parts the question was cut into.
    pub(super) shards: usize,
    pub(super) unanswered: usize,
    /// Until everything was there.
    pub(super) took: Duration,
}

/// One robot's arbiter, as far as pools are concerned.
pub(super) struct Robot {
    pub(super) pool: Arc<Pool<ZenohPeers>>,
    pub(super) context: Arc<PlanContext>,
    // Aborted when dropped.
    _keeping_ready: JoinSet<()>,
}

impl Robot {
    /// A robot on `session` with no replica ready yet.
    pub(super) fn on(session: &Session, context: Arc<PlanContext>) -> anyhow::Result<Self> {
        let peers = ZenohPeers::new(session, false).map_err(Exit::network)?;
        let pool = Arc::new(Pool::new(peers));
        let mut keeping = JoinSet::new();
        let of = Arc::clone(&pool);
        let with = Arc::clone(&context);
        keeping.spawn(async move { of.keep_ready(&with).await });
        Ok(Self { pool, context, _keeping_ready: keeping })
    }

    /// Waits until `count` replicas of `role` are ready for it.
    pub(super) async fn ready(&self, role: &str, count: usize) -> anyhow::Result<()> {
        let deadline = Instant::now() + READY_TIMEOUT;
        loop {
            let ready = self.pool.replicas().ready(role).len();
            if ready == count {
                return Ok(());
            }
            if Instant::now() > deadline {
                let after_s = READY_TIMEOUT.as_secs();
                let error = anyhow!("{ready} of {count} replicas of {role} were ready after {after_s} s");
                return Err(Exit::network(error).into());
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }

    /// Asks the pool for piece `seq` of the work. `trees` are what the last answers of generators left.
    pub(super) async fn ask(
        &self,
        work: &Work,
        seq: u64,
        trees: &mut Vec<Option<Tree>>,
    ) -> anyhow::Result<Answer> {
        let started = std::time::Instant::now();
        let stage = Budget::of_generation(self.pool.peers.now(), &self.context.mission, &self.pool.stages());
        let robot = &self.context.mission.order.robot;
        match work {
            Work::Evaluate(term, batches) => {
                let batch = turn(batches, seq).context("no batch")?;
                let questions = self.context.evaluate_questions((1, seq), &batch.message, &batch.candidates);
                let terms = [(*term).to_owned()];
                let shards = dispatch::evaluate(&self.pool, &terms, robot, &questions, stage).await;
                let scored = shards.iter().filter_map(|shard| shard.cost.as_ref()).map(Vec::len).sum();
                let unanswered = shards.iter().filter(|shard| shard.cost.is_none()).count();
                Ok(Answer {
                    candidates: scored,
                    // No replica was there to ask: the whole batch is one question without an answer.
                    shards: shards.len().max(1),
                    unanswered: if shards.is_empty() { 1 } else { unanswered },
                    took: started.elapsed(),
                })
            }
            Work::Generate(scenes, count) => {
                let scene = turn(scenes, seq).context("no scene")?;
                // A new drive begins without trees.
                let old = if turn_of(scenes, seq) > 0 { std::mem::take(trees) } else { Vec::new() };
                let profile = &self.context.course.profile;
                let shape = dispatch::Shape { steps: profile.steps, dt: profile.dt };
                let asked = (0..*count).map(|tree| {
                    let old = old.get(tree).and_then(Option::as_ref);
                    let question = self.context.generate_question((1, seq), scene, tree, old, &[]);
                    async move { dispatch::generate(&self.pool, robot, &question, tree, shape, stage).await }
                });
                let generated: Vec<Option<Generated>> = join_all(asked)
                    .await
                    .into_iter()
                    .map(|answer| answer.map(|grown| grown.generated))
                    .collect();
                let candidates = generated.iter().flatten().map(|of| of.candidates.len()).sum();
                let unanswered = generated.iter().filter(|of| of.is_none()).count();
                *trees = generated.into_iter().map(|of| of.map(|of| of.tree)).collect();
                Ok(Answer { candidates, shards: *count, unanswered, took: started.elapsed() })
            }
        }
    }
}

/// Runs what one robot does on a thread of its own: sending blocks while there is no room, and in one process
/// robots would hold each other up as they never do in many.
pub(super) fn on_a_thread<T: Send + 'static>(
    robots: &mut JoinSet<T>,
    doing: impl Future<Output = T> + Send + 'static,
) {
    let runtime = tokio::runtime::Handle::current();
    robots.spawn_blocking(move || runtime.block_on(doing));
}

/// Robots behind one router, and the map they share.
pub(super) struct Robots {
    pub(super) all: Vec<Arc<Robot>>,
    /// The first hosts the map, the others belong to the robots.
    pub(super) sessions: Vec<Session>,
    map: Server,
}

impl Robots {
    /// Connects `count` robots to the router of `processes`.
    pub(super) async fn join(
        workload: &Workload,
        processes: &Processes,
        count: usize,
        clock: Clock,
    ) -> anyhow::Result<Self> {
        let connect = async |certificate: &str| -> anyhow::Result<Session> {
            let config = ServiceConfig {
                connect: processes.endpoints_from(0),
                secure: processes.secure.clone(),
                certificates: vec![certificate.parse()?],
                ..ServiceConfig::default()
            };
            Ok(session::client(&config).await.map_err(Exit::network)?)
        };
        let host = connect(HOSTS).await?;
        let map = map_store::host(&host, workload.map.clone(), &refusals()).map_err(Exit::network)?;
        let mut robots = Self { all: Vec::new(), sessions: vec![host], map };
        for index in 0..count {
            let session = connect(ASKS).await?;
            let context = workload.context(&format!("robot-{index}"), clock)?;
            robots.all.push(Arc::new(Robot::on(&session, context)?));
            robots.sessions.push(session);
        }
        Ok(robots)
    }

    pub(super) fn leave(self) {
        drop(self.all);
        drop(self.map);
        self.sessions.iter().for_each(session::close);
    }
}
