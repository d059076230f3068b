//! A query as it comes to a server: whether it may be read, whose question it is, and the way back.

use std::borrow::Cow;

use curionav_schemas::limits::MAX_TEXT;
use curionav_schemas::{Message, Refusal, Reject, keys};
use zenoh::Wait;
use zenoh::key_expr::KeyExpr;
use zenoh::query::Query;

/// Who the last chunk of a question's key names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Askers {
    /// The chunk names no asker.
    Unnamed,
    /// A robot: the server is one of a pool.
    Robots,
    /// The one who commands, by the name of a certificate.
    Commanders,
}

/// The key that a server answers on.
pub(crate) struct Served {
    pub(crate) key: KeyExpr<'static>,
    pub(crate) askers: Askers,
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
    /// Who asks: the last chunk of the query's key, or the empty name where that names no asker.
    ///
    /// # Errors
    /// If the chunk is no such name.
    pub(crate) fn asker<'a>(&self, query: &'a Query) -> Result<&'a str, Refusal> {
        match self.askers {
            Askers::Unnamed => Ok(""),
            Askers::Robots => keys::asker(query.key_expr()).ok_or(Refusal::WrongRobot),
            Askers::Commanders => keys::commander(query.key_expr()).ok_or(Refusal::WrongCommander),
        }
    }

    /// The key of an answer. A question to several is answered under the key of this one: access rules allow no other.
    fn key_of_answer(&self, query: &Query) -> KeyExpr<'static> {
        let asked = query.key_expr();
        if !asked.is_wild() {
            return asked.clone().into_owned();
        }
        let own = self.key.as_str().strip_suffix("/*");
        let by = own.and_then(|own| Some(format!("{own}/{}", self.asker(query).ok()?)));
        by.and_then(|key| KeyExpr::try_from(key).ok()).unwrap_or_else(|| self.key.clone())
    }

    pub(crate) fn answer<A: Message>(&self, query: &Query, answer: &A) {
        if let Err(error) =
            query.reply(self.key_of_answer(query), answer.encode()).encoding(A::ENCODING).wait()
        {
            tracing::debug!(%error, "reply not sent");
        }
    }
}

pub(crate) fn refuse(query: &Query, reject: &Reject) {
    if let Err(error) = query.reply_err(reject.encode()).encoding(Reject::ENCODING).wait() {
        tracing::debug!(%error, "refusal not sent");
    }
}
