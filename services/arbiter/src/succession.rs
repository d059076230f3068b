//! Whom the driver obeys: epochs that rise from one arbiter to the next.
//!
//! The driver says with every command whose decision it obeys. An arbiter that hears nothing of it when it starts
//! may decide under an epoch that is too low, and is not obeyed; with the first command it hears it steps above.

use curionav_schemas::limits::MAX_EPOCH_STEP;

/// Bits of an epoch that tell arbiters apart which succeed the same one; the rest counts successions.
const NONCE_BITS: u32 = 20;
/// An arbiter of whom no newer decision is obeyed for this long is taken to be gone, seconds of the robot's clock.
const SILENCE: f64 = 0.6;
/// A command this much older than another one has not been overtaken on its way: the robot's clock was set back,
/// seconds.
const LATE: f64 = 1.0;

/// (epoch, seq) of a decision: later ones are greater.
pub type Order = (u64, u64);

/// What the driver was heard to obey.
#[derive(Debug, Clone, Copy)]
struct Heard {
    id: Order,
    /// When it began to, and when it was heard last, by the robot's clock.
    since: f64,
    stamp: f64,
}

/// The epoch of an arbiter, and what it knows of others.
#[derive(Debug, Default)]
pub struct Succession {
    epoch: u64,
    /// Whether it has learnt whom to succeed.
    introduced: bool,
    heard: Option<Heard>,
}

impl Succession {
    /// That of an arbiter that has just started. `nonce` should differ from that of any other arbiter.
    pub fn new(nonce: u64) -> Self {
        Self { epoch: (1 << NONCE_BITS) | nonce_of(nonce), ..Self::default() }
    }

    /// That of an arbiter which decided under `epoch`, when a recorded cycle is planned once more.
    pub fn resume(epoch: u64) -> Self {
        Self { epoch, introduced: true, heard: None }
    }

    /// Rises with every succession; no two arbiters share one.
    pub fn epoch(&self) -> u64 {
        self.epoch
    }

    /// The same for another mission, in which the robot's clock may begin anew.
    pub fn fresh(&self) -> Self {
        Self { epoch: self.epoch, introduced: self.introduced, heard: None }
    }

    /// Outranks whoever made `obeyed`, the last decision the driver has obeyed, if any, unless this arbiter made
    /// it; `seq` is of its newest decision.
    pub fn succeed(&mut self, obeyed: Option<Order>, seq: u64) {
        self.introduced = true;
        if let Some(obeyed) = obeyed.filter(|obeyed| self.is_outranked(*obeyed, seq)) {
            // Of what a driver obeys none is so great that this would not be greater.
            let successions = ((obeyed.0 >> NONCE_BITS) + 1).min(u64::MAX >> NONCE_BITS);
            self.epoch = (successions << NONCE_BITS) | nonce_of(self.epoch);
        }
    }

    /// A command was heard, of the decision `obeyed`, or (0, 0) without one, given at `stamp` of the robot's clock.
    /// Whoever has just started outranks the one before at once; later it gives way to one that outranks it,
    /// until that one has fallen silent.
    pub fn hear(&mut self, obeyed: Order, stamp: f64, seq: u64) {
        if self.heard.is_some_and(|heard| (0.0..LATE).contains(&(heard.stamp - stamp))) {
            return;
        }
        let since = self.heard.filter(|heard| heard.id == obeyed).map_or(stamp, |heard| heard.since);
        self.heard = Some(Heard { id: obeyed, since, stamp });
        let lives = (0.0..=SILENCE).contains(&(stamp - since));
        if !self.introduced || !lives {
            self.succeed(Some(obeyed).filter(|obeyed| *obeyed > (0, 0)), seq);
        }
    }

    /// Whether a driver that obeys `obeyed` does not obey this one: it is older, or too far ahead, the driver having
    /// forgotten whom it obeyed before.
    fn is_outranked(&self, obeyed: Order, seq: u64) -> bool {
        obeyed > (self.epoch, seq) || self.epoch.saturating_sub(obeyed.0) > MAX_EPOCH_STEP
    }
}

fn nonce_of(number: u64) -> u64 {
    number & ((1 << NONCE_BITS) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_starts_later_outranks_and_no_two_share_an_epoch() {
        let first = Succession::new(0xffff_ffff);
        let last = (first.epoch(), 50);
        let [mut second, mut third] = [3, 4].map(Succession::new);
        second.succeed(Some(last), 0);
        assert!(second.epoch() > first.epoch());
        // Both started at once and know the same last decision.
        third.succeed(Some(last), 0);
        assert_ne!(second.epoch(), third.epoch());
        // Its own last decision is nothing to succeed.
        let epoch = second.epoch();
        second.succeed(Some((epoch, 9)), 9);
        assert_eq!(second.epoch(), epoch);
    }

    #[test]
    fn who_heard_nothing_when_it_started_outranks_with_the_first_command_it_hears() {
        let mut late = Succession::new(1);
        late.hear((7 << NONCE_BITS, 3), 10.0, 5);
        assert!(late.epoch() > 7 << NONCE_BITS);
    }

    #[test]
    fn an_arbiter_gives_way_to_its_successor_while_that_one_lives() {
        let mut old = Succession::new(1);
        old.succeed(None, 0);
        let (epoch, rival) = (old.epoch(), old.epoch() + 9);
        for tick in 0..20 {
            old.hear((rival, tick / 3), 10.0 + 0.1 * tick as f64, 50);
            assert_eq!(old.epoch(), epoch, "tick {tick}");
        }
        // Its seventh decision, of 11.8, stays the last.
        old.hear((rival, 6), 12.3, 50);
        assert_eq!(old.epoch(), epoch);
        old.hear((rival, 6), 12.5, 50);
        assert!(old.epoch() > rival);
    }

    #[test]
    fn a_command_that_was_overtaken_changes_nothing() {
        let mut arbiter = Succession::new(1);
        arbiter.succeed(None, 0);
        let own = arbiter.epoch();
        for (id, stamp) in [((own, 4), 10.0), ((own + 1, 4), 9.3), ((own, 5), 10.1), ((own + 1, 4), 9.9)] {
            arbiter.hear(id, stamp, 5);
        }
        assert_eq!(arbiter.epoch(), own);
    }

    #[test]
    fn an_epoch_is_never_out_of_reach_of_what_is_obeyed() {
        // What no driver obeys, once said to be obeyed, leads astray for as long as somebody else is given time.
        for astray in [u64::MAX, 1 << 62, 1 << 40] {
            let mut arbiter = Succession::new(1);
            arbiter.hear((astray, 1), 10.0, 5);
            for tick in 1..=8 {
                arbiter.hear((1 << NONCE_BITS, 9), 10.0 + 0.1 * f64::from(tick), 5);
            }
            let above = arbiter.epoch() - (1 << NONCE_BITS);
            assert!((1..=MAX_EPOCH_STEP).contains(&above), "{astray}: {above}");
        }
    }
}
