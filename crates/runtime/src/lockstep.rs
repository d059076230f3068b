//! Keeping streams of one tick together.

use std::time::Duration;

use curionav_schemas::{Belief, Clock, Decision, Message, Odometry, People, Reject, Scan, Twist};

use crate::topic::Inbox;

pub use curionav_mission::ticks::has_started_over;

/// A stream message that belongs to a tick.
pub trait Ticked: Message + Clone {
    /// The tick it belongs to.
    fn tick(&self) -> u64;
}

macro_rules! ticked {
    ($($message:ty),*) => {$(
        impl Ticked for $message {
            fn tick(&self) -> u64 {
                self.tick
            }
        }
    )*};
}
ticked!(Belief, Decision, Odometry, People, Scan, Twist);

/// How long lockstep waits for a message before the run is given up: the other side is gone.
pub const LOCKSTEP_PATIENCE: Duration = Duration::from_secs(30);

/// The newest message of a stream, and how to wait for a given tick.
pub struct Latest<M> {
    inbox: Inbox<M>,
    newest: Option<M>,
}

impl<M: Ticked> Latest<M> {
    /// Follows `inbox`.
    pub fn new(inbox: Inbox<M>) -> Self {
        Self { inbox, newest: None }
    }

    /// The newest message that has arrived.
    pub fn newest(&mut self) -> Option<&M> {
        while let Some(message) = self.inbox.try_next() {
            self.newest = Some(message);
        }
        self.newest.as_ref()
    }

    /// Why the newest that has arrived was refused, if it was.
    pub fn refused(&self) -> Option<Reject> {
        self.inbox.refused()
    }

    /// Everything that has arrived, in order; the last one is kept as the newest.
    pub fn drain(&mut self) -> Vec<M> {
        let arrived: Vec<M> = std::iter::from_fn(|| self.inbox.try_next()).collect();
        if let Some(last) = arrived.last() {
            self.newest = Some(last.clone());
        }
        arrived
    }

    /// Forgets what has arrived: with a new run ticks start at 0 again.
    pub fn clear(&mut self) {
        while self.inbox.try_next().is_some() {}
        self.newest = None;
    }

    /// The next message in order, kept as the newest; `None` once the session is closed.
    pub async fn next(&mut self) -> Option<&M> {
        self.newest = Some(self.inbox.next().await?);
        self.newest.as_ref()
    }

    /// In lockstep: waits until the message of `tick` is here, at most [`LOCKSTEP_PATIENCE`]; one that has been
    /// passed over does not come again and is not waited for. In real time: the newest, at once.
    pub async fn of_tick(&mut self, tick: u64, clock: Clock) -> Option<&M> {
        if clock == Clock::Realtime {
            return self.newest();
        }
        let is_past = |m: &M| m.tick() > tick && !has_started_over(m.tick(), tick);
        let wait = async {
            if self.newest.as_ref().is_some_and(is_past) {
                return None;
            }
            while self.newest.as_ref().is_none_or(|m| m.tick() != tick) {
                self.newest = Some(self.inbox.next().await?);
            }
            Some(())
        };
        tokio::time::timeout(LOCKSTEP_PATIENCE, wait).await.ok().flatten()?;
        self.newest.as_ref()
    }
}
