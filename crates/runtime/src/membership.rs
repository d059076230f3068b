//! Who is alive: liveliness tokens, followed in the background.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Mutex;
use std::time::Duration;

use curionav_schemas::keys;
use tokio::sync::watch;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Session, Wait};

use crate::locked::locked;
use crate::topic::TopicError;

/// Roles and instances of one role that are remembered: many times what a deployment has. Further ones
/// are ignored, because a client can invent any number of them.
const ROLES_MAX: usize = 64;
const INSTANCES_MAX: usize = 1024;

/// Instances alive, by role, in order.
pub type Members = BTreeMap<String, BTreeSet<String>>;

/// A live view of all roles.
pub struct Membership {
    session: Session,
    subscribers: Mutex<BTreeMap<String, Subscriber<()>>>,
    sender: watch::Sender<Members>,
    members: watch::Receiver<Members>,
}

impl Membership {
    /// Follows every token, those already there included.
    pub fn follow(session: &Session) -> Result<Self, TopicError> {
        let membership = Self::new(session);
        let key = keys::every_live();
        let subscriber = membership.subscribe(&key)?;
        locked(&membership.subscribers).insert(key, subscriber);
        Ok(membership)
    }

    /// Follows the tokens of these roles alone; [`Self::also`] adds others.
    pub fn follow_roles(session: &Session, roles: &[&str]) -> Result<Self, TopicError> {
        let membership = Self::new(session);
        roles.iter().try_for_each(|role| membership.also(role))?;
        Ok(membership)
    }

    fn new(session: &Session) -> Self {
        let (sender, members) = watch::channel(Members::new());
        Self { session: session.clone(), subscribers: Mutex::default(), sender, members }
    }

    /// Follows the tokens of `role` from now on, if it has not until now.
    pub fn also(&self, role: &str) -> Result<(), TopicError> {
        let key = keys::every_live_of(role).map_err(|e| TopicError::on(role)(e.into()))?;
        let mut subscribers = locked(&self.subscribers);
        if subscribers.contains_key(&key) || subscribers.len() >= ROLES_MAX {
            return Ok(());
        }
        let subscriber = self.subscribe(&key)?;
        subscribers.insert(key, subscriber);
        Ok(())
    }

    fn subscribe(&self, key: &str) -> Result<Subscriber<()>, TopicError> {
        let sender = self.sender.clone();
        let note = move |sample: Sample| {
            let Some((role, instance)) = keys::service_of(sample.key_expr().as_str()) else { return };
            sender.send_if_modified(|members| note(members, role, instance, sample.kind()));
        };
        let tokens = self.session.liveliness().declare_subscriber(key.to_owned()).history(true);
        tokens.callback(note).wait().map_err(TopicError::on(key))
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

/// Takes note of a token; whether that changes who is alive.
fn note(members: &mut Members, role: &str, instance: &str, kind: SampleKind) -> bool {
    match kind {
        SampleKind::Put => {
            if !members.contains_key(role) && members.len() >= ROLES_MAX {
                return false;
            }
            let instances = members.entry(role.to_owned()).or_default();
            instances.len() < INSTANCES_MAX && instances.insert(instance.to_owned())
        }
        SampleKind::Delete => {
            let Some(instances) = members.get_mut(role) else { return false };
            let gone = instances.remove(instance);
            if instances.is_empty() {
                members.remove(role);
            }
            gone
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invented_names_fill_neither_memory_nor_the_place_of_another_role() {
        let mut members = Members::new();
        for i in 0..3000 {
            note(&mut members, "generator", &format!("invented-{i}"), SampleKind::Put);
            note(&mut members, &format!("role-{i}"), "a", SampleKind::Put);
        }
        assert_eq!((members.len(), members["generator"].len()), (ROLES_MAX, INSTANCES_MAX));
        assert!(note(&mut members, "role-0", "b", SampleKind::Put));
        assert!(!note(&mut members, "role-0", "b", SampleKind::Put));
        // Who goes makes room, and was there before.
        assert!(note(&mut members, "generator", "invented-0", SampleKind::Delete));
        assert!(!note(&mut members, "generator", "invented-2999", SampleKind::Delete));
        assert!(note(&mut members, "generator", "real", SampleKind::Put));
    }
}
