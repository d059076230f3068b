//! What every message of `rmw_zenoh` carries beside its payload.

/// Bytes of the name of a publisher or client.
const GID: usize = 16;

/// Sequence number, time of sending, and who sends. A reply echoes number and name of the request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Attachment {
    /// Counts what this sender has sent, from 1 on.
    pub sequence: i64,
    /// When it was sent, nanoseconds since 1970.
    pub stamp_ns: i64,
    /// Name of the sender; any will do that no other sender has.
    pub gid: [u8; GID],
}

/// Bytes that are no attachment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum AttachmentError {
    /// It has another length.
    #[error("the attachment has {0} bytes instead of 33")]
    Length(usize),
    /// The length of its name is another.
    #[error("the attachment names its sender in {0} bytes instead of 16")]
    Gid(u8),
}

impl Attachment {
    /// Bytes of one: two numbers of eight, the length of the name, and the name.
    pub const BYTES: usize = 17 + GID;

    /// Its bytes, little-endian.
    pub fn encode(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        bytes[..8].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[8..16].copy_from_slice(&self.stamp_ns.to_le_bytes());
        bytes[16] = GID as u8;
        bytes[17..].copy_from_slice(&self.gid);
        bytes
    }

    /// The one in `bytes`.
    ///
    /// # Errors
    /// If they are none.
    pub fn decode(bytes: &[u8]) -> Result<Self, AttachmentError> {
        let bytes: &[u8; Self::BYTES] = bytes.try_into().map_err(|_| AttachmentError::Length(bytes.len()))?;
        let (sequence, rest) = bytes.split_first_chunk::<8>().ok_or(AttachmentError::Length(0))?;
        let (stamp, rest) = rest.split_first_chunk::<8>().ok_or(AttachmentError::Length(0))?;
        match rest {
            [length, gid @ ..] if usize::from(*length) == GID => Ok(Self {
                sequence: i64::from_le_bytes(*sequence),
                stamp_ns: i64::from_le_bytes(*stamp),
                gid: gid.try_into().map_err(|_| AttachmentError::Length(0))?,
            }),
            rest => Err(AttachmentError::Gid(rest.first().copied().unwrap_or(0))),
        }
    }
}
