//! The answers of evaluators that a generator has asked for a robot.

use std::sync::{Arc, Mutex};

use curionav_runtime::locked::locked;
use curionav_runtime::query::AskError;
use curionav_schemas::{Message, Reject, Scores, keys};
use tokio::sync::oneshot;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

/// Epoch, cycle and shard of a question.
pub(crate) type Number = (u64, u64, u32);

/// An answer and its bytes.
type Answer = (Result<Scores, AskError>, u64);

/// What is expected of a replica.
struct Expected {
    term: String,
    instance: String,
    number: Number,
    answer: oneshot::Sender<Answer>,
}

impl Expected {
    fn is_from(&self, (term, instance): (&str, &str)) -> bool {
        (self.term.as_str(), self.instance.as_str()) == (term, instance)
    }
}

/// Where the answers come. What is not expected is passed over unread.
#[derive(Default)]
pub(crate) struct ScoresInbox {
    expected: Arc<Mutex<Vec<Expected>>>,
    /// And the robot whose answers they are.
    subscriber: Mutex<Option<(String, Subscriber<()>)>>,
}

impl ScoresInbox {
    /// Listens to the answers for `robot` from now on.
    pub(crate) fn listen(&self, session: &Session, robot: &str) -> zenoh::Result<()> {
        let mut subscriber = locked(&self.subscriber);
        if subscriber.as_ref().is_some_and(|(of, _)| of == robot) {
            return Ok(());
        }
        let expected = Arc::clone(&self.expected);
        let take = move |sample: Sample| take(&mut locked(&expected), &sample);
        let listening = session.declare_subscriber(keys::every_scores(robot)?).callback(take).wait()?;
        *subscriber = Some((robot.to_owned(), listening));
        Ok(())
    }

    /// The answer of a replica to a question with this number.
    pub(crate) fn expect(&self, term: &str, instance: &str, number: Number) -> oneshot::Receiver<Answer> {
        let (sender, answer) = oneshot::channel();
        let (term, instance) = (term.to_owned(), instance.to_owned());
        let mut expected = locked(&self.expected);
        // Those of cycles that are over.
        expected.retain(|other| !other.answer.is_closed());
        expected.push(Expected { term, instance, number, answer: sender });
        answer
    }
}

/// Hands an answer to those that expect it. A refusal does not say what it refuses: it is taken for all that is expected of
/// the replica, as is what cannot be understood.
fn take(expected: &mut Vec<Expected>, sample: &Sample) {
    let Some(replica) = keys::scores_of(sample.key_expr()) else { return };
    if !expected.iter().any(|one| one.is_from(replica)) {
        return;
    }
    let (bytes, encoding) = (sample.payload().len(), sample.encoding().to_string());
    let answer = if encoding == Reject::ENCODING {
        read::<Reject>(sample, &encoding).and_then(|reject| Err(AskError::Rejected(reject)))
    } else {
        read::<Scores>(sample, &encoding)
    };
    let number = answer.as_ref().ok().map(|scores| (scores.epoch, scores.seq, scores.shard));
    let is_for =
        |one: &mut Expected| one.is_from(replica) && number.is_none_or(|number| number == one.number);
    for one in expected.extract_if(.., is_for) {
        // One whose cycle is over listens no longer.
        let _ = one.answer.send((answer.clone(), bytes as u64));
    }
}

fn read<M: Message>(sample: &Sample, encoding: &str) -> Result<M, AskError> {
    // Before a byte is copied.
    let admitted = M::admit(sample.payload().len(), Some(encoding));
    let read = admitted.and_then(|()| M::decode(&sample.payload().to_bytes(), Some(encoding)));
    read.map_err(|reject| AskError::Malformed(reject.to_string()))
}
