//! A question as it comes, and the way back: a query is answered by a reply, what a generator forwards by a message to the
//! robot.

use std::borrow::Cow;

use curionav_schemas::limits::MAX_TEXT;
use curionav_schemas::{Message, Refusal, Reject, keys};
use zenoh::key_expr::KeyExpr;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Query;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use crate::query::tell;

/// A question.
pub(crate) enum Incoming {
    /// From the one that waits for the reply.
    Query(Query),
    /// From a generator, about the candidates of a robot.
    Forwarded(Forwarded),
}

/// A question of a generator. It is a copy, because the bytes received hold on to the whole batch that they came in.
pub(crate) struct Forwarded {
    robot: String,
    bytes: Vec<u8>,
    quality: (CongestionControl, Priority),
}

/// Where answers go.
pub(crate) struct Home {
    pub(crate) session: Session,
    /// The key that is served.
    pub(crate) own: KeyExpr<'static>,
    /// Whether it takes the questions of every robot, each with the robot's name as its last chunk.
    pub(crate) is_pool: bool,
    /// The term and the instance that are asked on behalf of robots.
    pub(crate) replica: Option<(String, String)>,
}

/// What a question may be, before anything of it is read.
#[derive(Clone, Copy)]
pub(crate) struct Admission {
    /// Bytes of the longest.
    pub(crate) most: usize,
    /// By length and encoding.
    pub(crate) check: fn(usize, Option<&str>) -> Result<(), Reject>,
}

impl Admission {
    /// The bytes that a question brings along, if it may be asked. All that is not its payload says nothing here, so it is
    /// short or refused.
    fn bytes(self, beside: usize, length: usize, encoding: Option<String>) -> Result<usize, Reject> {
        if beside > MAX_TEXT {
            return Err(Refusal::Oversize { found: beside as u64, most: MAX_TEXT as u64 }.into());
        }
        (self.check)(length, encoding.as_deref().filter(|_| length > 0))?;
        Ok(length)
    }

    /// The same of a query.
    pub(crate) fn of_query(self, query: &Query) -> Result<usize, Reject> {
        let beside = query.attachment().map_or(0, |a| a.len()) + query.parameters().as_str().len();
        let length = query.payload().map_or(0, |p| p.len());
        self.bytes(beside, length, query.encoding().map(ToString::to_string))
    }

    /// The question in a message that came on a generator's key, and its bytes.
    pub(crate) fn of_sample(self, sample: &Sample) -> Result<(Forwarded, usize), Reject> {
        let robot = keys::forwarded_for(sample.key_expr()).ok_or(Refusal::WrongRobot)?;
        let beside = sample.attachment().map_or(0, |a| a.len());
        let length = self.bytes(beside, sample.payload().len(), Some(sample.encoding().to_string()))?;
        let forwarded = Forwarded {
            robot: robot.to_owned(),
            bytes: sample.payload().to_bytes().into_owned(),
            quality: (sample.congestion_control(), sample.priority()),
        };
        Ok((forwarded, length))
    }
}

impl Incoming {
    pub(crate) fn payload(&self) -> Cow<'_, [u8]> {
        match self {
            Self::Query(query) => query.payload().map(|payload| payload.to_bytes()).unwrap_or_default(),
            Self::Forwarded(forwarded) => Cow::Borrowed(&forwarded.bytes),
        }
    }

    /// The robot that it is about: the last chunk of a query's key, or the same for all questions of a server that has no
    /// pool. Nothing if the chunk is not a plain name.
    pub(crate) fn robot(&self, home: &Home) -> Option<&str> {
        match self {
            Self::Query(query) => keys::asker(query.key_expr()).or((!home.is_pool).then_some("")),
            Self::Forwarded(forwarded) => Some(&forwarded.robot),
        }
    }

    pub(crate) fn answer<A: Message>(&self, home: &Home, answer: &A) {
        let sent = match self {
            Self::Query(query) => {
                // A question to several is answered under the key of this one: access rules allow no other.
                let asked = query.key_expr();
                let key = if asked.is_wild() { home.own.clone() } else { asked.clone().into_owned() };
                query.reply(key, answer.encode()).encoding(A::ENCODING).wait()
            }
            Self::Forwarded(forwarded) => return forwarded.tell(home, answer),
        };
        if let Err(error) = sent {
            tracing::debug!(%error, "reply not sent");
        }
    }

    pub(crate) fn refuse(&self, home: &Home, reject: &Reject) {
        let sent = match self {
            Self::Query(query) => query.reply_err(reject.encode()).encoding(Reject::ENCODING).wait(),
            Self::Forwarded(forwarded) => return forwarded.tell(home, reject),
        };
        if let Err(error) = sent {
            tracing::debug!(%error, "refusal not sent");
        }
    }
}

impl Forwarded {
    fn tell<M: Message>(&self, home: &Home, message: &M) {
        let Some((term, instance)) = &home.replica else { return };
        let Ok(key) = keys::scores(term, instance, &self.robot) else { return };
        // What could not be sent has been logged.
        let _ = tell::<M>(&home.session, &key, message.encode(), self.quality);
    }
}
