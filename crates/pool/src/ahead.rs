//! Questions to evaluators that the generator asks, as soon as it has candidates.
//!
//! The arbiter tells the generator whom to ask, and the evaluators answer the arbiter: three messages one after the other
//! in a cycle instead of four. Which replica gets which share of the candidates is decided as for the batch before, by its
//! size. Whatever is wrong with it, the cycle goes on with questions of the arbiter's own.

use std::future::{Future, poll_fn};
use std::pin::{Pin, pin};
use std::time::Duration;

use curionav_runtime::query::AskError;
use curionav_schemas::limits::MAX_LIST;
use curionav_schemas::{Forward, ForwardTo, Scores, keys};
use futures_util::future::{BoxFuture, MaybeDone, maybe_done};

use crate::budget::Budget;
use crate::context::PlanContext;
use crate::parts::shares;
use crate::peers::{Call, Peers};
use crate::pool::Pool;

/// Who makes the candidates of a cycle, and whom it asks about them.
#[derive(Debug)]
pub struct Plan {
    /// The generator.
    pub generator: String,
    /// What it is told.
    pub forward: Forward,
    /// How long answers are waited for.
    timeout: Duration,
}

impl Plan {
    /// For the next cycle of a mission, which needs the costs under `terms`; nothing where it is not possible. Several
    /// trees are put together before they are evaluated.
    pub fn new<P: Peers>(pool: &Pool<P>, context: &PlanContext, terms: &[String]) -> Option<Self> {
        let (now, order) = (pool.peers.now(), &context.mission.order);
        let (timeout, budget_ms) = Budget::ahead(now, &context.mission, &pool.stages());
        let mut replicas = pool.replicas();
        let count = replicas.last_batch();
        if context.profile.trees != 1 || count == 0 {
            return None;
        }
        replicas.wake(now);
        let generator = replicas.preferred(keys::GENERATOR).into_iter().next()?;
        let mut to = Vec::new();
        for term in terms {
            if !replicas.may_ask_ahead(term) {
                continue;
            }
            let Some(params) = context.term_parameters(term) else { continue };
            let slots = replicas.choose_slots(term, &order.robot, count);
            let speeds: Vec<f64> = slots.iter().map(|slot| slot.speed).collect();
            let parts = slots.into_iter().zip(shares(&speeds)).enumerate();
            to.extend(parts.map(|(index, (slot, (start, end)))| ForwardTo {
                term: term.clone(),
                instance: slot.instance,
                shard: index as u32,
                start,
                end,
                params: params.clone(),
            }));
        }
        let (clock, odometry_noise) = (order.clock, order.odometry_noise);
        let forward = Forward { clock, budget_ms, odometry_noise, to };
        let is_possible = (1..=MAX_LIST).contains(&forward.to.len());
        is_possible.then_some(Self { generator, forward, timeout })
    }
}

/// An answer that is expected from a replica which the generator asks.
pub(crate) struct Early<'a> {
    /// What it is asked.
    pub(crate) part: &'a ForwardTo,
    /// Since when it is expected.
    pub(crate) since: Duration,
    answer: MaybeDone<BoxFuture<'a, Result<Scores, AskError>>>,
}

impl Early<'_> {
    /// Completes with it.
    pub(crate) async fn answer(mut self) -> Result<Scores, AskError> {
        (&mut self.answer).await;
        Pin::new(&mut self.answer).take_output().unwrap_or(Err(AskError::NoReply))
    }
}

/// The answers that are expected in a cycle.
#[derive(Default)]
pub struct Ahead<'a>(pub(crate) Vec<Early<'a>>);

impl<'a> Ahead<'a> {
    /// Those of `plan` in cycle `id` (epoch and number).
    pub fn new<P: Peers>(
        pool: &'a Pool<P>,
        context: &'a PlanContext,
        plan: &'a Plan,
        (epoch, seq): (u64, u64),
    ) -> Self {
        let (since, order) = (pool.peers.now(), &context.mission.order);
        let expect = |part: &'a ForwardTo| {
            let call = Call {
                instance: &part.instance,
                robot: &order.robot,
                timeout: plan.timeout,
                clock: order.clock,
            };
            let answer = pool.peers.expect(&part.term, call, (epoch, seq, part.shard));
            let answer: BoxFuture<'a, _> = Box::pin(answer);
            Early { part, since, answer: maybe_done(answer) }
        };
        Self(plan.forward.to.iter().map(expect).collect())
    }

    /// Does `work`, at the end of which the generator has asked, while these are expected.
    pub async fn alongside<T>(&mut self, work: impl Future<Output = T>) -> T {
        let mut work = pin!(work);
        poll_fn(|context| {
            for early in &mut self.0 {
                let _ = Pin::new(&mut early.answer).poll(context);
            }
            work.as_mut().poll(context)
        })
        .await
    }
}
