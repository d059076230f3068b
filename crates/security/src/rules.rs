//! The router's access rules, in Zenoh's own words: everything is denied but what the table allows.

use curionav_schemas::keys::ROOT;
use serde::{Deserialize, Serialize};

use crate::name::Name;
use crate::table::{Space, Verb};

/// The protocol of links through unix sockets.
const SOCKET: &str = "unixsock-stream";

/// The direction of a message, seen from the router.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Flow {
    /// To the router.
    Ingress,
    /// From the router.
    Egress,
}

/// The kinds of messages that Zenoh's access control tells apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Message {
    /// Something published.
    Put,
    /// Something deleted. No rule allows it.
    Delete,
    /// That there is a subscriber.
    DeclareSubscriber,
    /// A question.
    Query,
    /// An answer.
    Reply,
    /// That there is something that answers.
    DeclareQueryable,
    /// That something is alive.
    LivelinessToken,
    /// Who is alive now?
    LivelinessQuery,
    /// Who is alive, now and later?
    DeclareLivelinessSubscriber,
}

use Flow::{Egress, Ingress};
use Message::{
    DeclareLivelinessSubscriber, DeclareQueryable, DeclareSubscriber, LivelinessQuery, LivelinessToken, Put,
    Query, Reply,
};

impl Verb {
    /// The messages that it takes, by direction. What comes in is held to the very keys of the right. What goes out of
    /// a router may have wildcards for names ([`Keys::Wide`]) where it is a question or a declaration of another
    /// program; it reaches only what has itself declared a key that matches.
    fn messages(self) -> &'static [(Flow, &'static [Message], Keys)] {
        match self {
            Self::Put => &[(Ingress, &[Put], Keys::Own)],
            Self::Subscribe => &[(Ingress, &[DeclareSubscriber], Keys::Own), (Egress, &[Put], Keys::Own)],
            Self::Notice => &[(Egress, &[DeclareSubscriber], Keys::Wide)],
            Self::Ask => &[(Ingress, &[Query], Keys::Own), (Egress, &[Reply], Keys::Own)],
            Self::Serve => {
                &[(Ingress, &[DeclareQueryable, Reply], Keys::Own), (Egress, &[Query], Keys::Wide)]
            }
            Self::Find => &[(Egress, &[DeclareQueryable], Keys::Wide)],
            Self::Hold => &[(Ingress, &[LivelinessToken], Keys::Own)],
            Self::Watch => &[
                (Ingress, &[DeclareLivelinessSubscriber, LivelinessQuery], Keys::Own),
                (Egress, &[LivelinessToken], Keys::Own),
            ],
        }
    }
}

/// Which keys a rule is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Keys {
    /// The keys that the right names.
    Own,
    /// Those with any names in the place of its own.
    Wide,
}

/// One rule, about one name and one direction.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rule {
    /// Unique.
    pub id: String,
    /// Always `allow`.
    pub permission: String,
    /// One direction.
    pub flows: Vec<Flow>,
    /// Kinds of messages.
    pub messages: Vec<Message>,
    /// Keys, with the namespace.
    pub key_exprs: Vec<String>,
}

/// What rules are about: a program that holds a certificate with this name, or one that comes over such a link.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Subject {
    /// The name.
    pub id: String,
    /// The name alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cert_common_names: Option<Vec<String>>,
    /// The protocol alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link_protocols: Option<Vec<String>>,
}

/// Which rules are about which names.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Policy {
    /// Names.
    pub subjects: Vec<String>,
    /// Rules, by their id.
    pub rules: Vec<String>,
}

/// Zenoh's `access_control`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rules {
    enabled: bool,
    default_permission: String,
    /// All rules.
    pub rules: Vec<Rule>,
    subjects: Vec<Subject>,
    policies: Vec<Policy>,
}

/// A key of the table as it is on the network.
pub(crate) fn absolute(space: Space, namespace: Option<&str>, key: &str) -> String {
    match (space, namespace) {
        (Space::Deployment, Some(namespace)) => format!("{namespace}/{ROOT}/{key}"),
        _ => format!("{ROOT}/{key}"),
    }
}

/// With `*` for every name in braces.
pub(crate) fn widened(key: &str) -> String {
    let chunks = key.split('/').map(|chunk| if chunk.starts_with('{') { "*" } else { chunk });
    chunks.collect::<Vec<_>>().join("/")
}

impl Rules {
    /// The rules for these certificates in a deployment with this namespace.
    pub fn new<'a>(names: impl IntoIterator<Item = &'a Name>, namespace: Option<&str>) -> Self {
        let mut made = Self {
            enabled: true,
            default_permission: "deny".into(),
            rules: Vec::new(),
            subjects: Vec::new(),
            policies: Vec::new(),
        };
        for name in names {
            let rules = of_name(name, namespace);
            let id = name.to_string();
            let cert_common_names = Some(vec![id.clone()]);
            made.subjects.push(Subject { id: id.clone(), cert_common_names, link_protocols: None });
            let ids = rules.iter().map(|rule| rule.id.clone()).collect();
            made.policies.push(Policy { subjects: vec![id], rules: ids });
            made.rules.extend(rules);
        }
        made
    }

    /// Also allows to programs that come through a unix socket what those of `robot` may that have a certificate.
    pub fn with_socket(mut self, robot: &str) -> Self {
        let policies = self.policies.iter().filter(|policy| {
            let mut names = policy.subjects.iter().filter_map(|id| id.parse::<Name>().ok());
            names.any(|name| !name.is_router() && name.robot() == Some(robot))
        });
        let rules: Vec<String> = policies.flat_map(|policy| policy.rules.clone()).collect();
        // Zenoh takes no policy without rules.
        if !rules.is_empty() {
            let id = SOCKET.to_owned();
            let link_protocols = Some(vec![SOCKET.to_owned()]);
            self.subjects.push(Subject { id: id.clone(), cert_common_names: None, link_protocols });
            self.policies.push(Policy { subjects: vec![id], rules });
        }
        self
    }

    /// As JSON, which is JSON5 as well.
    pub fn json(&self) -> String {
        // Strings and lists of strings always have a JSON.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }
}

/// One rule for each verb and direction.
fn of_name(name: &Name, namespace: Option<&str>) -> Vec<Rule> {
    let mut rules = Vec::new();
    for &verb in Verb::ALL {
        for (flow, messages, keys) in verb.messages() {
            let rights = name.rights().filter(|right| right.verb == verb);
            let key_exprs: Vec<String> = rights
                .flat_map(|right| {
                    let keys = right.keys.iter().flat_map(|key| match keys {
                        Keys::Wide => vec![widened(key)],
                        Keys::Own => name.fill(key),
                    });
                    keys.map(|key| absolute(right.space, namespace, &key))
                })
                .collect();
            if !key_exprs.is_empty() {
                let direction = if *flow == Ingress { "in" } else { "out" };
                rules.push(Rule {
                    id: format!("{name} {} {direction}", verb.word()),
                    permission: "allow".into(),
                    flows: vec![*flow],
                    messages: messages.to_vec(),
                    key_exprs,
                });
            }
        }
    }
    rules
}
