//! Names that can be a chunk of a key.

use crate::limits::MAX_ID;

/// A name that cannot be a chunk of a key.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("name `{name}` must be 1 to {MAX_ID} of the characters a-z, 0-9, `_` and `-`")]
pub struct KeyError {
    /// The name, cut to a length that can be shown.
    pub name: String,
}

/// Checks a name of a robot, instance, role, term, world or stream.
///
/// # Errors
/// It is empty, longer than [`MAX_ID`], or has a character other than `a-z`, `0-9`, `_` and `-`.
pub fn check_id(name: &str) -> Result<(), KeyError> {
    let is_plain = name.bytes().all(|byte| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'_' | b'-'));
    if (1..=MAX_ID).contains(&name.len()) && is_plain {
        return Ok(());
    }
    Err(KeyError { name: name.chars().take(MAX_ID).collect() })
}

/// The parts of the longest identity: role, world, robot and instance.
const IDENTITY_PARTS: usize = 4;

/// Checks an identity: the name of a certificate, such as `operator.ward3`, which is names with dots between them.
///
/// # Errors
/// A part of it is no [name](check_id), or it has more than four.
pub fn check_identity(identity: &str) -> Result<(), KeyError> {
    let parts: Vec<&str> = identity.split('.').take(IDENTITY_PARTS + 1).collect();
    parts.iter().try_for_each(|part| check_id(part))?;
    if parts.len() > IDENTITY_PARTS {
        return Err(KeyError { name: identity.chars().take(MAX_ID).collect() });
    }
    Ok(())
}
