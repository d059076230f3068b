//! From what arrives to a question that can be answered: bytes are decoded, and a question that comes before its
//! candidates waits here for them, or they for it. Neither takes a slot meanwhile.

use std::sync::Mutex;
use std::time::Instant;

use curionav_schemas::{CandidateShard, Message, Offer, Reject};
use zenoh::query::Query;

use crate::locked::locked;

/// What a question or offer counts for at least: it may hold on to the batch of Zenoh's that it came in.
pub(crate) const BYTES_MIN: usize = 64 << 10;
/// Bytes of questions and offers that wait for each other: two of the largest.
const BYTES_MAX: usize = 32 << 20;

/// Something that arrived.
pub(crate) enum Item {
    /// A question.
    Asked(Query),
    /// Candidates of a robot from a generator, an encoded [`Offer`].
    Offered {
        /// The generator.
        from: String,
        /// The robot.
        robot: String,
        /// The offer.
        bytes: Vec<u8>,
    },
}

/// A question that is to be answered now, or refused.
pub(crate) struct Ready<Q> {
    pub(crate) query: Query,
    /// When the last part of it came.
    pub(crate) came: Instant,
    pub(crate) question: Result<Q, Reject>,
}

/// Epoch, cycle and shard of a question.
pub type Number = (u64, u64, u32);

/// How questions wait for offers.
pub struct Offers<Q> {
    /// Where offers come.
    pub key: String,
    /// The generator that a question waits for, and the question's epoch, cycle and shard; nothing if it is complete.
    pub awaits: fn(&Q) -> Option<(&str, Number)>,
    /// Completes a question.
    pub complete: fn(&mut Q, CandidateShard),
}

/// Makes questions of what arrives.
pub(crate) struct Intake<Q> {
    decode: fn(&[u8]) -> Result<Q, Reject>,
    offers: Option<(Offers<Q>, Mutex<Halves<(Query, Q)>>)>,
}

impl<Q> Intake<Q> {
    pub(crate) fn new(decode: fn(&[u8]) -> Result<Q, Reject>, offers: Option<Offers<Q>>) -> Self {
        Self { decode, offers: offers.map(|offers| (offers, Mutex::default())) }
    }

    /// Where offers come, if any do.
    pub(crate) fn offers_key(&self) -> Option<&str> {
        self.offers.as_ref().map(|(offers, _)| offers.key.as_str())
    }

    /// Takes in what came from `robot`, of so many `bytes`: gives the question that can be answered now, and those that
    /// find no room to wait for their offers. An offer that is none is refused.
    pub(crate) fn take(
        &self,
        robot: &str,
        (item, bytes, came): (Item, usize, Instant),
    ) -> Result<(Option<Ready<Q>>, Vec<Query>), Reject> {
        let (from, number, half) = match item {
            Item::Asked(query) => {
                let payload = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
                let question = (self.decode)(&payload);
                drop(payload);
                let awaits = self.offers.as_ref().map(|(offers, _)| offers.awaits);
                let waits = |question: &Q| awaits?(question).map(|(from, number)| (from.to_owned(), number));
                let awaited = question.as_ref().ok().and_then(waits);
                match (awaited, question) {
                    (Some((from, number)), Ok(question)) => (from, number, Half::Question((query, question))),
                    (_, question) => return Ok((Some(Ready { query, came, question }), Vec::new())),
                }
            }
            Item::Offered { from, bytes, .. } => {
                let Offer { epoch, seq, shard, candidates } = Offer::decode(&bytes, None)?;
                (from, (epoch, seq, shard), Half::Offer(candidates))
            }
        };
        let Some((offers, halves)) = &self.offers else { return Ok((None, Vec::new())) };
        let id = Id { robot: robot.to_owned(), from, number };
        let (pair, lost) = locked(halves).add(id, bytes, half);
        let ready = pair.map(|((query, mut question), candidates)| {
            (offers.complete)(&mut question, candidates);
            Ready { query, came, question: Ok(question) }
        });
        Ok((ready, lost.into_iter().map(|(query, _)| query).collect()))
    }

    /// An offer to `robot`'s questions found no room: gives those that wait and will not be answered.
    pub(crate) fn lost(&self, robot: &str) -> Vec<Query> {
        let lost = self.offers.as_ref().map(|(_, halves)| locked(halves).lose(robot));
        lost.unwrap_or_default().into_iter().map(|(query, _)| query).collect()
    }
}

/// What question and offer have in common.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Id {
    /// Whose candidates.
    pub robot: String,
    /// The generator.
    pub from: String,
    /// Epoch, cycle and shard of the question.
    pub number: Number,
}

impl Id {
    /// Whether this is of an earlier cycle of the same arbiter.
    fn is_before(&self, other: &Self) -> bool {
        let ((epoch, seq, _), (other_epoch, other_seq, _)) = (self.number, other.number);
        self.robot == other.robot && epoch == other_epoch && seq < other_seq
    }
}

/// A question without its candidates, or candidates without their question.
pub enum Half<W> {
    /// The first.
    Question(W),
    /// The second.
    Offer(CandidateShard),
}

/// Halves that wait for their other halves, the oldest first.
pub struct Halves<W> {
    waiting: Vec<(Id, usize, Half<W>)>,
}

impl<W> Default for Halves<W> {
    fn default() -> Self {
        Self { waiting: Vec::new() }
    }
}

impl<W> Halves<W> {
    /// Adds a half of so many bytes. Gives what is complete with it, and the questions that go: those of earlier cycles of
    /// the same arbiter, and, where there is no room, the oldest of the robot that has most.
    pub fn add(&mut self, id: Id, bytes: usize, half: Half<W>) -> (Option<(W, CandidateShard)>, Vec<W>) {
        let is_question = matches!(half, Half::Question(_));
        let others = |(of, _, waits): &(Id, usize, Half<W>)| {
            *of == id && matches!(waits, Half::Question(_)) != is_question
        };
        if let Some(at) = self.waiting.iter().position(others) {
            let pair = match (self.waiting.remove(at).2, half) {
                (Half::Question(question), Half::Offer(offer))
                | (Half::Offer(offer), Half::Question(question)) => Some((question, offer)),
                _ => None,
            };
            return (pair, Vec::new());
        }
        let mut gone: Vec<_> = self.waiting.extract_if(.., |(of, ..)| *of == id || of.is_before(&id)).collect();
        self.waiting.push((id, bytes.max(BYTES_MIN), half));
        while self.waiting.iter().map(|(_, bytes, _)| bytes).sum::<usize>() > BYTES_MAX {
            let held = |robot: &str| {
                let of_robot = self.waiting.iter().filter(|(id, ..)| id.robot == robot);
                of_robot.map(|(_, bytes, _)| bytes).sum::<usize>()
            };
            // The first of equals, which is the oldest.
            let most = self.waiting.iter().rev().max_by_key(|(id, ..)| held(&id.robot));
            let most = most.map(|(id, ..)| id.robot.clone());
            let Some(at) = self.waiting.iter().position(|(id, ..)| Some(&id.robot) == most.as_ref()) else { break };
            gone.push(self.waiting.remove(at));
        }
        (None, questions(gone))
    }

    /// Takes out all that waits for `robot`, and gives the questions.
    pub fn lose(&mut self, robot: &str) -> Vec<W> {
        questions(self.waiting.extract_if(.., |(id, ..)| id.robot == robot).collect())
    }
}

fn questions<W>(halves: Vec<(Id, usize, Half<W>)>) -> Vec<W> {
    let question = |half| if let Half::Question(question) = half { Some(question) } else { None };
    halves.into_iter().filter_map(|(_, _, half)| question(half)).collect()
}

#[cfg(test)]
mod tests {
    use curionav_testing::golden;

    use super::*;

    fn id(robot: &str, from: &str, seq: u64) -> Id {
        Id { robot: robot.into(), from: from.into(), number: (2, seq, 0) }
    }

    fn offer() -> Half<u32> {
        Half::Offer(golden::candidate_set().into())
    }

    /// Adds a half of few bytes: the question that is complete with it, and those that go.
    fn add(halves: &mut Halves<u32>, id: Id, half: Half<u32>) -> (Option<u32>, Vec<u32>) {
        let (pair, gone) = halves.add(id, 1, half);
        (pair.map(|(question, _)| question), gone)
    }

    #[test]
    fn question_and_offer_find_each_other_in_either_order() {
        let mut halves = Halves::default();
        assert_eq!(add(&mut halves, id("r1", "g", 1), Half::Question(10)), (None, vec![]));
        assert_eq!(add(&mut halves, id("r2", "g", 1), offer()), (None, vec![]));
        assert_eq!(add(&mut halves, id("r1", "other", 1), offer()), (None, vec![]));
        assert_eq!(add(&mut halves, id("r1", "g", 1), offer()), (Some(10), vec![]));
        assert_eq!(add(&mut halves, id("r2", "g", 1), Half::Question(20)), (Some(20), vec![]));
    }

    #[test]
    fn what_waits_goes_with_the_next_cycle_of_its_arbiter() {
        let mut halves = Halves::default();
        add(&mut halves, id("r1", "g", 1), Half::Question(10));
        add(&mut halves, id("r2", "g", 1), Half::Question(20));
        assert_eq!(add(&mut halves, id("r1", "g", 2), Half::Question(11)), (None, vec![10]));
        assert_eq!(add(&mut halves, id("r1", "g", 1), offer()), (None, vec![]));
        assert_eq!(add(&mut halves, id("r2", "g", 1), offer()), (Some(20), vec![]));
        assert_eq!(halves.lose("r1"), [11]);
        assert!(halves.waiting.is_empty());
    }

    #[test]
    fn a_robot_that_leaves_much_waiting_takes_no_room_from_another() {
        let mut halves = Halves::default();
        add(&mut halves, id("modest", "g", 0), Half::Question(1));
        let room = BYTES_MAX / BYTES_MIN;
        for epoch in 0..2 * room {
            // Each of an arbiter of its own.
            let number = (10 + epoch as u64, 0, 0);
            let (_, gone) = add(&mut halves, Id { number, ..id("greedy", "g", 0) }, Half::Question(100));
            assert_eq!(gone.len(), usize::from(epoch + 1 >= room), "{epoch}");
        }
        assert_eq!(add(&mut halves, id("modest", "g", 0), offer()), (Some(1), vec![]));
    }
}
