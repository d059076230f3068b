//! Liveliness tokens: how nodes of `rmw_zenoh` find each other.

use std::fmt::{Display, Formatter};
use std::str::FromStr;

use crate::limits;
use crate::qos::{Qos, QosError};

/// What every token begins with.
pub const ROOT: &str = "@ros2_lv";

/// What a token stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum EntityKind {
    /// A node.
    Node,
    /// A publisher.
    Publisher,
    /// A subscriber.
    Subscriber,
    /// The serving end of a service.
    Service,
    /// The asking end of a service.
    Client,
}

impl EntityKind {
    const CODES: [(Self, &'static str); 5] = [
        (Self::Node, "NN"),
        (Self::Publisher, "MP"),
        (Self::Subscriber, "MS"),
        (Self::Service, "SS"),
        (Self::Client, "SC"),
    ];

    fn code(self) -> &'static str {
        Self::CODES.iter().find(|(kind, _)| *kind == self).map_or("", |(_, code)| code)
    }
}

/// The topic or service that an entity is of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoint {
    /// Name with its outer slash, such as `/r1/scan`.
    pub topic: String,
    /// Name of the type as DDS has it.
    pub type_name: String,
    /// Hash of the type.
    pub hash: String,
    /// Quality of service.
    pub qos: Qos,
}

/// A node, or something that a node has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Token {
    /// The domain of ROS.
    pub domain: u32,
    /// The Zenoh session of the node.
    pub session: String,
    /// The node's number in its session.
    pub node_id: u64,
    /// The entity's number in its session; of a node again `node_id`.
    pub entity_id: u64,
    /// What it stands for.
    pub kind: EntityKind,
    /// The node's enclave; the usual one is `/`.
    pub enclave: String,
    /// The node's namespace; the outermost is `/`.
    pub namespace: String,
    /// The node's name.
    pub node: String,
    /// Of what it is; of a node nothing.
    pub endpoint: Option<Endpoint>,
}

impl Token {
    /// The node's name with its namespace.
    pub fn node_path(&self) -> String {
        format!("{}/{}", self.namespace.trim_end_matches('/'), self.node)
    }
}

/// Why a key is no token.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum TokenError {
    /// It is longer than any token.
    #[error("the token has {0} bytes; the most is {most}", most = limits::TOKEN)]
    TooLong(usize),
    /// It has fewer or more parts, or another beginning.
    #[error("not a token; a token looks like `@ros2_lv/0/ZID/0/1/MP/%/%/NODE/%TOPIC/TYPE/HASH/QOS`")]
    Form,
    /// A number in it is none.
    #[error("a field of the token is not a number")]
    Number,
    /// Its quality of service is none.
    #[error(transparent)]
    Qos(#[from] QosError),
}

/// A name with slashes as one chunk of a key; the empty name is the outermost namespace.
fn mangled(name: &str) -> String {
    if name.is_empty() { "%".to_owned() } else { name.replace('/', "%") }
}

fn plain(chunk: &str) -> String {
    chunk.replace('%', "/")
}

impl Display for Token {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let Self { domain, session, node_id, entity_id, kind, enclave, namespace, node, endpoint } = self;
        let enclave = mangled(enclave);
        let namespace = mangled(namespace);
        let code = kind.code();
        write!(f, "{ROOT}/{domain}/{session}/{node_id}/{entity_id}/{code}/{enclave}/{namespace}/{node}")?;
        match endpoint {
            Some(Endpoint { topic, type_name, hash, qos }) => {
                write!(f, "/{}/{type_name}/{hash}/{qos}", mangled(topic))
            }
            None => Ok(()),
        }
    }
}

impl FromStr for Token {
    type Err = TokenError;

    fn from_str(text: &str) -> Result<Self, TokenError> {
        if text.len() > limits::TOKEN {
            return Err(TokenError::TooLong(text.len()));
        }
        let mut chunks = text.split('/');
        let mut chunk = || chunks.next().filter(|chunk| !chunk.is_empty()).ok_or(TokenError::Form);
        if chunk()? != ROOT {
            return Err(TokenError::Form);
        }
        let domain = chunk()?.parse().map_err(|_| TokenError::Number)?;
        let session = chunk()?.to_owned();
        let node_id = chunk()?.parse().map_err(|_| TokenError::Number)?;
        let entity_id = chunk()?.parse().map_err(|_| TokenError::Number)?;
        let code = chunk()?;
        let kind = EntityKind::CODES.iter().find(|(_, known)| *known == code).ok_or(TokenError::Form)?.0;
        let enclave = plain(chunk()?);
        let namespace = plain(chunk()?);
        let node = chunk()?.to_owned();
        let endpoint = if kind == EntityKind::Node {
            None
        } else {
            let topic = plain(chunk()?);
            let type_name = chunk()?.to_owned();
            let hash = chunk()?.to_owned();
            Some(Endpoint { topic, type_name, hash, qos: chunk()?.parse()? })
        };
        if chunks.next().is_some() {
            return Err(TokenError::Form);
        }
        Ok(Self { domain, session, node_id, entity_id, kind, enclave, namespace, node, endpoint })
    }
}
