//! Which arbiter the driver follows: epochs that rise from one arbiter to the next.
//!
//! The driver says with every command whose decision it follows. An arbiter that hears nothing of it when it starts
//! may decide under an epoch that is too low, and is refused; with the first command it hears it steps above.

use curionav_schemas::limits::MAX_EPOCH_STEP;

/// Bits of an epoch that tell arbiters apart which succeed the same one; the rest counts successions.
const NONCE_BITS: u32 = 20;
/// An arbiter of which no newer decision is followed for this long is taken to be gone, seconds of the robot's clock.
const SILENCE: f64 = 0.6;
/// A command this much older than another one has not been overtaken on its way: the robot's clock was set back,
/// seconds.
const LATE: f64 = 1.0;

/// (epoch, seq) of a decision: later ones are greater.
pub type DecisionId = (u64, u64);

/// What the driver was heard to follow.
#[derive(Debug, Clone, Copy)]
struct Heard {
    id: DecisionId,
    /// When it began to, and when it was heard last, by the robot's clock.
    since: f64,
    stamp: f64,
}

/// The epoch of an arbiter, and what it knows of others.
#[derive(Debug, Default)]
pub struct Epoch {
    number: u64,
    /// Whether it has learnt which arbiter to succeed.
    introduced: bool,
    heard: Option<Heard>,
}

impl Epoch {
    /// That of an arbiter that has just started. `nonce` should differ from that of any other arbiter.
    pub fn new(nonce: u64) -> Self {
        Self { number: (1 << NONCE_BITS) | nonce_of(nonce), ..Self::default() }
    }

    /// That of an arbiter which decided under `epoch`, when a recorded cycle is planned once more.
    pub fn resume(epoch: u64) -> Self {
        Self { number: epoch, introduced: true, heard: None }
    }

    /// Rises with every succession; no two arbiters share one.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The same for another mission, in which the robot's clock may begin anew.
    pub fn fresh(&self) -> Self {
        Self { number: self.number, introduced: self.introduced, heard: None }
    }

    /// Outranks the arbiter that made `followed`, the last decision that the driver has followed, if any, unless it is
    /// this one; `seq` is of its newest decision.
    pub fn succeed(&mut self, followed: Option<DecisionId>, seq: u64) {
        self.introduced = true;
        if let Some(followed) = followed.filter(|followed| self.is_outranked(*followed, seq)) {
            // Of what a driver follows none is so great that this would not be greater.
            let successions = ((followed.0 >> NONCE_BITS) + 1).min(u64::MAX >> NONCE_BITS);
            self.number = (successions << NONCE_BITS) | nonce_of(self.number);
        }
    }

    /// A command was heard, of the decision `followed`, or (0, 0) without one, given at `stamp` of the robot's clock.
    /// An arbiter that has just started outranks the one before at once; later it gives way to one that outranks it,
    /// until that one has fallen silent.
    pub fn observe_command(&mut self, followed: DecisionId, stamp: f64, seq: u64) {
        if self.heard.is_some_and(|heard| (0.0..LATE).contains(&(heard.stamp - stamp))) {
            return;
        }
        let since = self.heard.filter(|heard| heard.id == followed).map_or(stamp, |heard| heard.since);
        self.heard = Some(Heard { id: followed, since, stamp });
        let lives = (0.0..=SILENCE).contains(&(stamp - since));
        if !self.introduced || !lives {
            self.succeed(Some(followed).filter(|followed| *followed > (0, 0)), seq);
        }
    }

    /// True if the driver, last following `followed`, would reject our decisions: they are older, or too far ahead, as
    /// the driver has forgotten what it followed before.
    fn is_outranked(&self, followed: DecisionId, seq: u64) -> bool {
        followed > (self.number, seq) || self.number.saturating_sub(followed.0) > MAX_EPOCH_STEP
    }
}

fn nonce_of(number: u64) -> u64 {
    number & ((1 << NONCE_BITS) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arbiter_that_starts_later_outranks_and_no_two_share_an_epoch() {
        let first = Epoch::new(0xffff_ffff);
        let last = (first.number(), 50);
        let [mut second, mut third] = [3, 4].map(Epoch::new);
        second.succeed(Some(last), 0);
        assert!(second.number() > first.number());
        // Both started at once and know the same last decision.
        third.succeed(Some(last), 0);
        assert_ne!(second.number(), third.number());
        // Its own last decision is nothing to succeed.
        let epoch = second.number();
        second.succeed(Some((epoch, 9)), 9);
        assert_eq!(second.number(), epoch);
    }

    #[test]
    fn an_arbiter_that_heard_nothing_when_it_started_outranks_with_the_first_command_it_hears() {
        let mut late = Epoch::new(1);
        late.observe_command((7 << NONCE_BITS, 3), 10.0, 5);
        assert!(late.number() > 7 << NONCE_BITS);
    }

    #[test]
    fn an_arbiter_gives_way_to_its_successor_while_that_one_lives() {
        let mut old = Epoch::new(1);
        old.succeed(None, 0);
        let epoch = old.number();
        let rival = old.number() + 9;
        for tick in 0..20 {
            old.observe_command((rival, tick / 3), 10.0 + 0.1 * tick as f64, 50);
            assert_eq!(old.number(), epoch, "tick {tick}");
        }
        // Its seventh decision, of 11.8, stays the last.
        old.observe_command((rival, 6), 12.3, 50);
        assert_eq!(old.number(), epoch);
        old.observe_command((rival, 6), 12.5, 50);
        assert!(old.number() > rival);
    }

    #[test]
    fn a_command_that_was_overtaken_changes_nothing() {
        let mut arbiter = Epoch::new(1);
        arbiter.succeed(None, 0);
        let own = arbiter.number();
        for (id, stamp) in [((own, 4), 10.0), ((own + 1, 4), 9.3), ((own, 5), 10.1), ((own + 1, 4), 9.9)] {
            arbiter.observe_command(id, stamp, 5);
        }
        assert_eq!(arbiter.number(), own);
    }

    #[test]
    fn an_epoch_is_never_out_of_reach_of_what_is_followed() {
        // What no driver follows, once said to be followed, leads astray for as long as another arbiter is given time.
        for astray in [u64::MAX, 1 << 62, 1 << 40] {
            let mut arbiter = Epoch::new(1);
            arbiter.observe_command((astray, 1), 10.0, 5);
            for tick in 1..=8 {
                arbiter.observe_command((1 << NONCE_BITS, 9), 10.0 + 0.1 * f64::from(tick), 5);
            }
            let above = arbiter.number() - (1 << NONCE_BITS);
            assert!((1..=MAX_EPOCH_STEP).contains(&above), "{astray}: {above}");
        }
    }
}
