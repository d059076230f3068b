//! Two ways in which ROS 2 is on Zenoh, and the one function by which anything is sent.

use crate::attachment::{Attachment, AttachmentError};
use crate::cdr::CdrError;
use crate::interface::{Distribution, Interface};
use crate::message::Message;
use crate::token::Token;

/// A way in which ROS 2 is on Zenoh.
pub trait Dialect: Send + Sync {
    /// The key of a topic or service, whose name has its outer slash: `/r1/scan`.
    fn key(&self, name: &str, interface: &Interface) -> String;

    /// Whether nodes find each other by liveliness tokens, and messages carry an attachment.
    fn is_native(&self) -> bool;

    /// The key of a liveliness token; nothing where there are none.
    fn token_key(&self, token: &Token) -> Option<String> {
        self.is_native().then(|| token.to_string())
    }

    /// The attachment of a message that came; nothing where there are none.
    ///
    /// # Errors
    /// If there should be one and it is none.
    fn attachment(&self, bytes: Option<&[u8]>) -> Result<Option<Attachment>, AttachmentError> {
        if self.is_native() { Attachment::decode(bytes.unwrap_or_default()).map(Some) } else { Ok(None) }
    }
}

/// Nodes of `rmw_zenoh_cpp`.
#[derive(Debug, Clone, Copy)]
pub struct RmwZenoh {
    /// The domain of ROS (`ROS_DOMAIN_ID`).
    pub domain: u32,
    /// What the nodes are of.
    pub distribution: Distribution,
}

impl Dialect for RmwZenoh {
    fn key(&self, name: &str, interface: &Interface) -> String {
        let domain = self.domain;
        let topic = name.trim_matches('/');
        format!("{domain}/{topic}/{}/{}", interface.dds(), interface.hash(self.distribution))
    }

    fn is_native(&self) -> bool {
        true
    }
}

/// Nodes on DDS, behind `zenoh-bridge-ros2dds` or its plugin.
#[derive(Debug, Clone, Copy)]
pub struct Ros2Dds;

impl Dialect for Ros2Dds {
    fn key(&self, name: &str, _: &Interface) -> String {
        name.trim_matches('/').to_owned()
    }

    fn is_native(&self) -> bool {
        false
    }
}

/// What is given to Zenoh: no part of it may be changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outgoing {
    payload: Vec<u8>,
    attachment: Option<[u8; Attachment::BYTES]>,
}

impl Outgoing {
    /// Encapsulation and content.
    pub fn payload(&self) -> &[u8] {
        &self.payload
    }

    /// The attachment, where there is one.
    pub fn attachment(&self) -> Option<&[u8]> {
        self.attachment.as_ref().map(|bytes| &bytes[..])
    }
}

/// The payload and attachment of everything that is sent: messages, requests and replies. A listener of ROS ends its
/// process on bytes that are malformed, so nothing is put into a session in another way.
///
/// # Errors
/// If the message is longer than a reader takes; then nothing may be sent.
pub fn outgoing<M: Message>(
    dialect: &dyn Dialect,
    message: &M,
    attachment: Attachment,
) -> Result<Outgoing, CdrError> {
    let attachment = dialect.is_native().then(|| attachment.encode());
    Ok(Outgoing { payload: message.encode()?, attachment })
}
