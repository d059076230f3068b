//! Questions to evaluators that leave together with the one to the generator, before there are candidates.
//!
//! An evaluator then reads scene and mission while the tree grows, and the generator sends it its candidates directly
//! ([`Offer`](curionav_schemas::Offer)): three messages one after the other in a cycle instead of four. Which replica gets
//! which share of the candidates is decided as for the batch before, by its size. Whatever is wrong with it, the cycle
//! goes on with questions that carry their candidates.

use std::future::{Future, poll_fn};
use std::pin::{Pin, pin};
use std::time::Duration;

use curionav_runtime::query::AskError;
use curionav_schemas::limits::MAX_LIST;
use curionav_schemas::{OfferTo, OffersTo, Scores, keys};
use futures_util::future::{BoxFuture, MaybeDone, maybe_done};

use crate::budget::Budget;
use crate::context::PlanContext;
use crate::parts::shares;
use crate::peers::{Call, Peers};
use crate::pool::Pool;
use crate::question::EvaluateQuestions;

/// Who makes the candidates, and which replicas get which.
#[derive(Debug)]
pub struct Plan {
    /// The generator.
    pub generator: String,
    /// What it is to send.
    pub offers: OffersTo,
}

impl Plan {
    /// For the next cycle of a mission, which asks for the costs under `terms`; nothing where it is not possible. Several
    /// trees are put together before they are evaluated.
    pub fn new<P: Peers>(pool: &Pool<P>, context: &PlanContext, terms: &[String]) -> Option<Self> {
        if context.profile.trees != 1 {
            return None;
        }
        let order = &context.mission.order;
        let mut replicas = pool.replicas();
        replicas.wake(pool.peers.now());
        let generator = replicas.preferred(keys::GENERATOR).into_iter().next()?;
        let count = replicas.last_batch();
        let mut to = Vec::new();
        for term in terms.iter().filter(|_| count > 0) {
            if !replicas.may_ask_ahead(term) {
                continue;
            }
            let slots = replicas.choose_slots(term, &order.robot, count);
            let speeds: Vec<f64> = slots.iter().map(|slot| slot.speed).collect();
            let parts = slots.into_iter().zip(shares(&speeds)).enumerate();
            to.extend(parts.map(|(index, (slot, (from, to)))| OfferTo {
                term: term.clone(),
                instance: slot.instance,
                shard: index as u32,
                from,
                to,
            }));
        }
        let is_possible = (1..=MAX_LIST).contains(&to.len());
        is_possible.then(|| Self { generator, offers: OffersTo { clock: order.clock, to } })
    }
}

/// A question that has been asked ahead.
pub(crate) struct Early<'a> {
    /// What the replica gets.
    pub(crate) part: &'a OfferTo,
    /// When it was asked.
    pub(crate) sent: Duration,
    answer: MaybeDone<BoxFuture<'a, Result<Scores, AskError>>>,
}

impl Early<'_> {
    /// Its answer.
    pub(crate) async fn answer(mut self) -> Result<Scores, AskError> {
        (&mut self.answer).await;
        Pin::new(&mut self.answer).take_output().unwrap_or(Err(AskError::NoReply))
    }
}

/// The questions of a cycle that are asked ahead.
#[derive(Default)]
pub struct Ahead<'a>(pub(crate) Vec<Early<'a>>);

impl<'a> Ahead<'a> {
    /// The questions of `plan`; `questions` are those of the cycle without candidates. They leave with the first poll.
    pub fn new<P: Peers>(
        pool: &'a Pool<P>,
        context: &'a PlanContext,
        plan: &'a Plan,
        questions: &'a EvaluateQuestions<'a>,
    ) -> Self {
        let (sent, order) = (pool.peers.now(), &context.mission.order);
        let (timeout, budget_ms) = Budget::ahead(sent, &context.mission, &pool.stages());
        let ask = |part: &'a OfferTo| {
            let answer = async move {
                let question = questions.ahead(part, (&plan.generator, budget_ms));
                let call = Call { instance: &part.instance, robot: &order.robot, timeout, clock: order.clock };
                pool.peers.evaluate(&part.term, call, &question).await
            };
            let answer: BoxFuture<'a, _> = Box::pin(answer);
            Early { part, sent, answer: maybe_done(answer) }
        };
        Self(plan.offers.to.iter().map(ask).collect())
    }

    /// Does `work`, of which the first part goes first, while these are on their way.
    pub async fn alongside<T>(&mut self, work: impl Future<Output = T>) -> T {
        let mut work = pin!(work);
        poll_fn(|context| {
            let done = work.as_mut().poll(context);
            for early in &mut self.0 {
                let _ = Pin::new(&mut early.answer).poll(context);
            }
            done
        })
        .await
    }
}
