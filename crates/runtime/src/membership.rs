//! Who is alive: liveliness tokens, followed in the background.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use curionav_schemas::keys;
use tokio::sync::watch;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use crate::topic::TopicError;

/// Instances alive, by role, in order.
pub type Members = BTreeMap<String, BTreeSet<String>>;

/// A live view of all roles.
pub struct Membership {
    _subscriber: Subscriber<()>,
    members: watch::Receiver<Members>,
}

impl Membership {
    /// Follows every token, those already there included.
    pub fn follow(session: &Session) -> Result<Self, TopicError> {
        let key = keys::every_live();
        let (sender, members) = watch::channel(Members::new());
        let subscriber = session
            .liveliness()
            .declare_subscriber(key.clone())
            .history(true)
            .callback(move |sample| {
                let Some((role, instance)) = keys::service_of(sample.key_expr().as_str()) else { return };
                let (role, instance) = (role.to_owned(), instance.to_owned());
                sender.send_modify(|members| match sample.kind() {
                    SampleKind::Put => {
                        members.entry(role).or_default().insert(instance);
                    }
                    SampleKind::Delete => {
                        if let Some(instances) = members.get_mut(&role) {
                            instances.remove(&instance);
                        }
                        members.retain(|_, instances| !instances.is_empty());
                    }
                });
            })
            .wait()
            .map_err(TopicError::on(&key))?;
        Ok(Self { _subscriber: subscriber, members })
    }

    /// Instances of `role` alive now, in order.
    pub fn of(&self, role: &str) -> Vec<String> {
        self.members.borrow().get(role).map(|s| s.iter().cloned().collect()).unwrap_or_default()
    }

    /// All instances alive now, by role.
    pub fn all(&self) -> Members {
        self.members.borrow().clone()
    }

    /// A receiver that wakes on every change.
    pub fn changes(&self) -> watch::Receiver<Members> {
        self.members.clone()
    }
}

/// Tokens of those alive arrive with the declaration; this covers a slow router.
const SETTLE: Duration = Duration::from_millis(300);

/// All instances alive, for a program that looks once.
pub async fn members(session: &Session) -> Result<Members, TopicError> {
    let membership = Membership::follow(session)?;
    tokio::time::sleep(SETTLE).await;
    Ok(membership.all())
}

/// Announces this instance. Declare it after the queryables it stands for.
pub fn announce(session: &Session, role: &str, instance: &str) -> Result<LivelinessToken, TopicError> {
    let key = keys::live(role, instance).map_err(|e| TopicError::on(role)(e.into()))?;
    session.liveliness().declare_token(key.clone()).wait().map_err(TopicError::on(&key))
}
