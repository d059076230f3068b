//! Which nodes of ROS there are, by their liveliness tokens, and what is wrong among them.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use anyhow::anyhow;
use curionav_ros2::token::{EntityKind, ROOT, Token};
use curionav_runtime::locked::locked;
use curionav_runtime::metrics::Tally;
use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use crate::fault::FaultKind;
use crate::problem::{Problem, ProblemKind};

/// Tokens that are remembered: of some forty nodes with a hundred topics each. Further ones are ignored.
const TOKENS_MAX: usize = 4096;

/// Something that the gateway says or hears, as its own token has it.
#[derive(Debug, Clone)]
pub(crate) struct Used {
    /// Name with its outer slash.
    pub(crate) topic: String,
    /// Name of the type.
    pub(crate) type_name: String,
    /// Hash of the type.
    pub(crate) hash: String,
    /// Whether no other node may publish it.
    pub(crate) is_exclusive: bool,
}

/// The tokens of one domain.
pub(crate) struct Graph {
    own_session: String,
    tokens: Arc<Mutex<BTreeMap<String, Token>>>,
    _subscriber: Option<Subscriber<()>>,
}

impl Graph {
    /// Follows the tokens of `domain`, those already there included, if nodes have tokens.
    ///
    /// # Errors
    /// If they cannot be followed.
    pub(crate) fn follow(session: &Session, domain: Option<u32>, refused: &Tally) -> anyhow::Result<Self> {
        let tokens = Arc::<Mutex<BTreeMap<String, Token>>>::default();
        let noted = Arc::clone(&tokens);
        let refused = refused.clone();
        let subscriber = match domain {
            None => None,
            Some(domain) => {
                let key = format!("{ROOT}/{domain}/**");
                let tokens = session.liveliness().declare_subscriber(key.clone()).history(true);
                let tokens = tokens.callback(move |sample| {
                    if !note(&mut locked(&noted), sample.key_expr().as_str(), sample.kind()) {
                        refused.add(&[ROOT, FaultKind::Malformed.code()]);
                    }
                });
                Some(tokens.wait().map_err(|error| anyhow!("{key}: {error}"))?)
            }
        };
        Ok(Self { own_session: session.zid().to_string(), tokens, _subscriber: subscriber })
    }

    /// What is wrong with what the gateway uses: another publisher where there may be none, and other types under the
    /// same name.
    pub(crate) fn problems(&self, used: &[Used]) -> Vec<Problem> {
        problems(&locked(&self.tokens), &self.own_session, used)
    }
}

/// Takes note of a token; whether it is one.
fn note(tokens: &mut BTreeMap<String, Token>, key: &str, kind: SampleKind) -> bool {
    match (key.parse::<Token>(), kind) {
        (Err(_), _) => false,
        (Ok(token), SampleKind::Put) => {
            if tokens.len() < TOKENS_MAX || tokens.contains_key(key) {
                tokens.insert(key.to_owned(), token);
            }
            true
        }
        (Ok(_), SampleKind::Delete) => {
            tokens.remove(key);
            true
        }
    }
}

fn problems(tokens: &BTreeMap<String, Token>, own_session: &str, used: &[Used]) -> Vec<Problem> {
    let mut problems = Vec::new();
    for token in tokens.values().filter(|token| token.session != own_session) {
        let Some(endpoint) = &token.endpoint else { continue };
        for use_of in used.iter().filter(|used| used.topic == endpoint.topic) {
            let topic = &use_of.topic;
            let node = token.node_path();
            if endpoint.type_name != use_of.type_name || endpoint.hash != use_of.hash {
                let detail = format!("{node} has {} {}", endpoint.type_name, endpoint.hash);
                problems.push(Problem::new(ProblemKind::OtherType, topic, detail));
            } else if use_of.is_exclusive && token.kind == EntityKind::Publisher {
                problems.push(Problem::new(ProblemKind::SecondPublisher, topic, node));
            }
        }
    }
    problems
}

#[cfg(test)]
mod tests {
    use super::*;

    fn used() -> Vec<Used> {
        let of = |topic: &str, is_exclusive| Used {
            topic: topic.into(),
            type_name: "T_".into(),
            hash: "H".into(),
            is_exclusive,
        };
        vec![of("/r1/cmd_vel", true), of("/r1/scan", false)]
    }

    fn tokens(texts: &[&str]) -> BTreeMap<String, Token> {
        let mut tokens = BTreeMap::new();
        texts.iter().for_each(|text| assert!(note(&mut tokens, text, SampleKind::Put), "{text}"));
        tokens
    }

    #[test]
    fn a_second_publisher_and_another_type_are_named() {
        let tokens = tokens(&[
            "@ros2_lv/0/abc/0/1/MP/%/%r1/gateway/%r1%cmd_vel/T_/H/::,10:,:,:,,",
            "@ros2_lv/0/def/0/1/MP/%/%r1/teleop/%r1%cmd_vel/T_/H/::,10:,:,:,,",
            "@ros2_lv/0/def/0/2/MS/%/%r1/base/%r1%cmd_vel/Twist_/H/::,10:,:,:,,",
            "@ros2_lv/0/def/0/3/MP/%/%r2/teleop/%r2%cmd_vel/T_/H/::,10:,:,:,,",
            "@ros2_lv/0/def/0/4/MP/%/%r1/base/%r1%scan/T_/H/2::,5:,:,:,,",
            "@ros2_lv/0/def/0/0/NN/%/%r1/base",
        ]);
        let found = problems(&tokens, "abc", &used());
        assert_eq!(
            found,
            [
                Problem::new(ProblemKind::SecondPublisher, "/r1/cmd_vel", "/r1/teleop"),
                Problem::new(ProblemKind::OtherType, "/r1/cmd_vel", "/r1/base has Twist_ H"),
            ]
        );
    }

    #[test]
    fn a_node_that_goes_takes_its_problem_with_it_and_invented_tokens_fill_no_memory() {
        let text = "@ros2_lv/0/def/0/1/MP/%/%r1/teleop/%r1%cmd_vel/T_/H/::,10:,:,:,,";
        let mut tokens = tokens(&[text]);
        assert!(note(&mut tokens, text, SampleKind::Delete) && tokens.is_empty());
        assert!(!note(&mut tokens, "@ros2_lv/0/what/ever", SampleKind::Put));
        (0..2 * TOKENS_MAX).for_each(|i| {
            assert!(note(&mut tokens, &format!("@ros2_lv/0/a/0/{i}/NN/%/%/n"), SampleKind::Put))
        });
        assert_eq!(tokens.len(), TOKENS_MAX);
    }
}
