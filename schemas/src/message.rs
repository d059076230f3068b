//! How a message becomes bytes and bytes become a message.

use crate::reject::cut;
use crate::wellformed;
use crate::{Refusal, Reject};
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
        encode(self)
    }

    /// Refuses, without looking at a byte of it, what is too long or says that it is another message.
    ///
    /// # Errors
    /// The refusal with which a sender is answered.
    fn admit(length: usize, encoding: Option<&str>) -> Result<(), Reject> {
        if length > Self::MAX_BYTES {
            return Err(Refusal::Oversize { found: length as u64, most: Self::MAX_BYTES as u64 }.into());
        }
        if let Some(found) = encoding.filter(|found| *found != Self::ENCODING) {
            let found = cut(found.to_owned());
            let expected = Self::ENCODING.to_owned();
            return Err(Refusal::WrongEncoding { found, expected }.into());
        }
        Ok(())
    }

    /// Reads a message from bytes that nothing has checked. `encoding` is the string that came with them, if any did.
    ///
    /// # Errors
    /// The refusal with which a sender is answered.
    fn decode(bytes: &[u8], encoding: Option<&str>) -> Result<Self, Reject> {
        Self::admit(bytes.len(), encoding)?;
        // The deserialiser copies every string through its scratch: with room for the longest, in one piece.
        let mut scratch = vec![0; wellformed::check(bytes)?];
        let mut rest = bytes;
        let value: Self = ciborium::de::from_reader_with_buffer(&mut rest, &mut scratch)
            .map_err(|error| Refusal::WrongStructure { detail: detail(&error) })?;
        // The deserialiser takes a map for a plain enum value and then loses its place.
        if !rest.is_empty() {
            let detail = "a map stands where a text belongs".to_owned();
            return Err(Refusal::WrongStructure { detail }.into());
        }
        value.validate()?;
        Ok(value)
    }
}

/// The CBOR bytes of a message, or of what borrows the parts of one. Does not validate.
pub fn encode<M: Serialize>(message: &M) -> Vec<u8> {
    // Counting first is cheap, as arrays count in one go; growing the buffer would copy them again and again.
    let mut length = Length(0);
    write(message, &mut length);
    let mut bytes = Vec::with_capacity(length.0);
    write(message, &mut bytes);
    bytes
}

fn write<M: Serialize>(message: &M, to: impl std::io::Write) {
    #[expect(
        clippy::expect_used,
        reason = "memory takes all bytes and no type of the contract fails to serialise"
    )]
    ciborium::into_writer(message, to).expect("encoding into memory");
}

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

fn detail(error: &ciborium::de::Error<std::io::Error>) -> String {
    cut(match error {
        ciborium::de::Error::Semantic(_, reason) => reason.clone(),
        other => other.to_string(),
    })
}
