//! A whole cycle as the arbiter plans it, with everything computed in this process and no network.

use std::future::{Future, pending};
use std::sync::Arc;
use std::time::Duration;

use curionav_arbiter::cycle::plan;
use curionav_arbiter::report::CycleOutcome;
use curionav_pool::context::PlanContext;
use curionav_pool::peers::{Call, Peers};
use curionav_pool::pool::Pool;
use curionav_pool::question::{EvaluateQuestion, GenerateQuestion};
use curionav_robot::arbiter::cycle::Observation;
use curionav_robot::arbiter::memory::Memory;
use curionav_runtime::query::AskError;
use curionav_schemas::{self as wire, Decision, GenerateReply};

use crate::case::Case;
use crate::mission::OnTheWay;

/// The second cycle of a robot that knows where it is, and of one that does not and so asks for `cpc` as well.
pub(crate) fn cases() -> anyhow::Result<Vec<Case>> {
    let of = |(name, variance)| {
        let on_the_way = OnTheWay::with("curiosity")?;
        let arbiter = Arbiter::new()?;
        let mut memory = Memory::new(1);
        let observation = |tick| on_the_way.observation(on_the_way.pose, tick, variance);
        arbiter.plan(&on_the_way.context, &mut memory, observation(120));
        let carried = memory.to_wire(&on_the_way.context.mission);
        let next = observation(123);
        let context = on_the_way.context.clone();
        let work = move |(mut memory, observation)| arbiter.plan(&context, &mut memory, observation);
        // The memory is what the first cycle left, every time.
        let recall = move || {
            let memory = Memory::recall(carried.clone());
            #[expect(clippy::expect_used, reason = "it has just been written by the same program")]
            (memory.expect("a memory that can be recalled"), next.clone())
        };
        Ok(Case::after(format!("cycle/{name}"), 1, recall, work))
    };
    [("certain", 0.01), ("uncertain", 0.2)].into_iter().map(of).collect()
}

/// An arbiter without replicas.
pub(crate) struct Arbiter {
    pool: Pool<NoPeers>,
    runtime: tokio::runtime::Runtime,
}

impl Arbiter {
    pub(crate) fn new() -> anyhow::Result<Self> {
        let runtime = tokio::runtime::Builder::new_current_thread().build()?;
        Ok(Self { pool: Pool::new(Arc::new(NoPeers)), runtime })
    }

    /// One cycle.
    pub(crate) fn plan(
        &self,
        context: &PlanContext,
        memory: &mut Memory,
        observation: Observation,
    ) -> (Decision, CycleOutcome) {
        self.runtime.block_on(plan(&self.pool, context, memory, observation))
    }
}

/// No replica is there to be asked, and time stands still: no budget cuts anything short.
struct NoPeers;

impl Peers for NoPeers {
    fn now(&self) -> Duration {
        Duration::ZERO
    }

    fn sleep(&self, _: Duration) -> impl Future<Output = ()> + Send {
        pending()
    }

    fn compute<R>(&self, work: impl FnOnce() -> R) -> R {
        work()
    }

    fn follow(&self, _: &[&str]) {}

    fn alive(&self, _: &str) -> Vec<String> {
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
        _: &str,
        _: Call<'_>,
        _: &EvaluateQuestion<'_>,
    ) -> Result<wire::Scores, AskError> {
        Err(AskError::NoReply)
    }
}
