//! A query as it comes to a server: whether it may be read, whose question it is, and the way back.

use std::borrow::Cow;

use curionav_schemas::limits::MAX_TEXT;
use curionav_schemas::{Message, Refusal, Reject, keys};
use zenoh::Wait;
use zenoh::key_expr::KeyExpr;
use zenoh::query::Query;

/// The key that a server answers on.
pub(crate) struct Served {
    pub(crate) key: KeyExpr<'static>,
    /// Whether it takes the questions of every robot, each with the robot's name as its last chunk.
    pub(crate) is_pool: bool,
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
    /// The bytes of the question's payload, if it may be asked. The attachment and the parameters say nothing here, so
    /// a question with long ones is refused.
    pub(crate) fn admit(self, query: &Query) -> Result<usize, Reject> {
        let attached = query.attachment().map_or(0, |a| a.len());
        let beside = attached + query.parameters().as_str().len();
        if beside > MAX_TEXT {
            return Err(Refusal::Oversize { found: beside as u64, most: MAX_TEXT as u64 }.into());
        }
        let length = query.payload().map_or(0, |p| p.len());
        let encoding = query.encoding().map(ToString::to_string);
        (self.check)(length, encoding.as_deref().filter(|_| length > 0))?;
        Ok(length)
    }
}

pub(crate) fn payload(query: &Query) -> Cow<'_, [u8]> {
    query.payload().map(|payload| payload.to_bytes()).unwrap_or_default()
}

impl Served {
    /// The robot that the question is about: the last chunk of the query's key, or the empty name for every question of
    /// a server that serves no pool. Nothing if the chunk is not a plain name.
    pub(crate) fn robot<'a>(&self, query: &'a Query) -> Option<&'a str> {
        keys::asker(query.key_expr()).or((!self.is_pool).then_some(""))
    }

    pub(crate) fn answer<A: Message>(&self, query: &Query, answer: &A) {
        // A question to several is answered under the key of this one: access rules allow no other.
        let asked = query.key_expr();
        let key = if asked.is_wild() { self.key.clone() } else { asked.clone().into_owned() };
        if let Err(error) = query.reply(key, answer.encode()).encoding(A::ENCODING).wait() {
            tracing::debug!(%error, "reply not sent");
        }
    }
}

pub(crate) fn refuse(query: &Query, reject: &Reject) {
    if let Err(error) = query.reply_err(reject.encode()).encoding(Reject::ENCODING).wait() {
        tracing::debug!(%error, "refusal not sent");
    }
}
