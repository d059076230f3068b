//! How a message becomes bytes and bytes become a message.

use crate::VERSION;
use crate::limits::MAX_TEXT;
use crate::reject::Reject;
use crate::wellformed;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Something whose values have limits beyond those of their types.
pub trait Validate {
    /// Checks shapes, limits and finite numbers of this value and all it holds.
    ///
    /// # Errors
    /// Names the first field at fault.
    fn validate(&self) -> Result<(), Reject>;
}

/// Why bytes are not the message they were taken for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DecodeError {
    /// More bytes than the message may have; nothing was parsed.
    #[error("{message} of {bytes} bytes exceeds its limit of {limit}")]
    Oversize {
        /// The message expected.
        message: &'static str,
        /// Bytes received.
        bytes: usize,
        /// Bytes allowed.
        limit: usize,
    },
    /// The encoding string is none of ours.
    #[error("encoding `{found}` is not `{expected}`")]
    Encoding {
        /// The encoding string expected.
        expected: &'static str,
        /// The one received.
        found: String,
    },
    /// Another message of ours.
    #[error("expected message `{expected}`, received `{found}`")]
    Name {
        /// The message expected.
        expected: &'static str,
        /// The one received.
        found: String,
    },
    /// The right message of another version.
    #[error(
        "{message} has version `{found}`; this program speaks version `v{VERSION}`: update the older side"
    )]
    Version {
        /// The message expected.
        message: &'static str,
        /// The version received.
        found: String,
    },
    /// Not one definite-length CBOR item and nothing more.
    #[error("{message} is malformed at byte {offset}: {reason}")]
    Malformed {
        /// The message expected.
        message: &'static str,
        /// Where.
        offset: usize,
        /// What.
        reason: &'static str,
    },
    /// CBOR, but without this message's fields or with other types.
    #[error("{message}: {detail}")]
    Structure {
        /// The message expected.
        message: &'static str,
        /// What the deserialiser says.
        detail: String,
    },
    /// A field has a value, shape or size it may not have.
    #[error("{message}: {reject}")]
    Invalid {
        /// The message expected.
        message: &'static str,
        /// Which field and why.
        reject: Reject,
    },
}

/// A message of the contract: what crosses the wire on its own.
pub trait Message: Validate + Serialize + DeserializeOwned {
    /// Name in the encoding string and of the CDDL rule.
    const NAME: &'static str;
    /// Schema part of the encoding: `curionav.{NAME}.v1`.
    const SCHEMA: &'static str;
    /// Full encoding string: `application/cbor;curionav.{NAME}.v1`.
    const ENCODING: &'static str;
    /// Most bytes an encoded message may have.
    const MAX_BYTES: usize;

    /// The CBOR bytes. Does not validate: a peer will refuse what [`Validate::validate`] refuses here.
    fn encode(&self) -> Vec<u8> {
        // Counting first is cheap, as arrays count in one go; growing the buffer would copy them again and again.
        let mut length = Length(0);
        write(self, &mut length);
        let mut bytes = Vec::with_capacity(length.0);
        write(self, &mut bytes);
        bytes
    }

    /// Reads a message from bytes nobody has checked. `encoding` is the string that came with them, if any did.
    ///
    /// # Errors
    /// See [`DecodeError`]; convert it with `Reject::from(&error)` to answer the sender.
    fn decode(bytes: &[u8], encoding: Option<&str>) -> Result<Self, DecodeError> {
        let message = Self::NAME;
        if bytes.len() > Self::MAX_BYTES {
            return Err(DecodeError::Oversize { message, bytes: bytes.len(), limit: Self::MAX_BYTES });
        }
        if let Some(found) = encoding {
            check_encoding::<Self>(found)?;
        }
        wellformed::check(bytes).map_err(|wellformed::Fault { offset, reason }| DecodeError::Malformed {
            message,
            offset,
            reason,
        })?;
        let mut scratch = vec![0; bytes.len().clamp(SCRATCH_MIN, SCRATCH_MAX)];
        let mut rest = bytes;
        let value: Self = ciborium::de::from_reader_with_buffer(&mut rest, &mut scratch)
            .map_err(|error| DecodeError::Structure { message, detail: detail(&error) })?;
        // The deserialiser takes a map for a plain enum value and then loses its place.
        if !rest.is_empty() {
            return Err(DecodeError::Structure {
                message,
                detail: "a map stands where a text belongs".to_owned(),
            });
        }
        value.validate().map_err(|reject| DecodeError::Invalid { message, reject })?;
        Ok(value)
    }
}

fn write<M: Serialize>(message: &M, to: impl std::io::Write) {
    #[expect(
        clippy::expect_used,
        reason = "memory takes all bytes and no type of the contract fails to serialise"
    )]
    ciborium::into_writer(message, to).expect("encoding into memory");
}

/// Counts what is written.
struct Length(usize);

impl std::io::Write for Length {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0 += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// The deserialiser reads keys whole into its scratch: room for the longest key there is.
const SCRATCH_MIN: usize = 1024;
/// It copies byte strings through its scratch: larger pieces are no faster.
const SCRATCH_MAX: usize = 64 * 1024;

fn detail(error: &ciborium::de::Error<std::io::Error>) -> String {
    let mut detail = match error {
        ciborium::de::Error::Semantic(_, reason) => reason.clone(),
        other => other.to_string(),
    };
    detail.truncate(detail.floor_char_boundary(MAX_TEXT));
    detail
}

fn check_encoding<M: Message>(found: &str) -> Result<(), DecodeError> {
    if found == M::ENCODING {
        return Ok(());
    }
    let shown = || found[..found.floor_char_boundary(MAX_TEXT)].to_owned();
    let parts = found.strip_prefix("application/cbor;curionav.").and_then(|schema| schema.rsplit_once('.'));
    Err(match parts {
        Some((name, version)) if name == M::NAME => DecodeError::Version {
            message: M::NAME,
            found: version[..version.floor_char_boundary(64)].to_owned(),
        },
        Some((name, _)) => DecodeError::Name {
            expected: M::NAME,
            found: name[..name.floor_char_boundary(MAX_TEXT)].to_owned(),
        },
        None => DecodeError::Encoding { expected: M::ENCODING, found: shown() },
    })
}
