//! Messages put together from fields that were encoded before: what many questions have in common is encoded once.

use crate::message::write;
use serde::Serialize;

/// A CBOR map with text keys, field by field.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fields(Vec<u8>);

/// The first byte of a map without entries; the count of up to 23 entries is added to it.
const MAP: u8 = 0xa0;
const ENTRIES_MAX: u8 = 23;

impl Default for Fields {
    fn default() -> Self {
        Self(vec![MAP])
    }
}

impl Fields {
    /// No fields yet, with room for so many bytes of them.
    pub fn with_room(bytes: usize) -> Self {
        let mut fields = Vec::with_capacity(1 + bytes);
        fields.push(MAP);
        Self(fields)
    }

    /// These and the field `name`.
    ///
    /// # Panics
    /// There are more than 23 fields, which no message of the contract has.
    #[must_use]
    pub fn with(mut self, name: &str, value: &impl Serialize) -> Self {
        self.count(1);
        write(&name, &mut self.0);
        write(value, &mut self.0);
        self
    }

    /// These and the field `name`, itself a map of the fields `part`.
    ///
    /// # Panics
    /// As [`Self::with`].
    #[must_use]
    pub fn with_part(mut self, name: &str, part: &Self) -> Self {
        self.count(1);
        write(&name, &mut self.0);
        self.0.extend_from_slice(&part.0);
        self
    }

    /// These and all of `others`, none of which may be among these.
    ///
    /// # Panics
    /// As [`Self::with`].
    #[must_use]
    pub fn and(mut self, others: &Self) -> Self {
        self.count(others.0[0] - MAP);
        self.0.extend_from_slice(&others.0[1..]);
        self
    }

    /// Bytes so far.
    pub fn encoded_len(&self) -> usize {
        self.0.len()
    }

    /// The message that these fields make up.
    pub fn into_bytes(self) -> Vec<u8> {
        self.0
    }

    fn count(&mut self, more: u8) {
        self.0[0] += more;
        assert!(self.0[0] <= MAP + ENTRIES_MAX, "a message of the contract has 23 fields at most");
    }
}
