//! Who may drive a robot: what its base grants, and the keys on which it is asked.
//!
//! Whatever plays a robot's base, such as the simulator or the gateway to ROS 2, makes one [`BaseLease`]. It obeys the
//! commands that [`BaseLease::admits`], and no motion while [`BaseLease::paused_for`] says so.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use curionav_schemas::keys::Commanded;
use curionav_schemas::{
    LEASE_MS, Lease, LeaseRequest, LeaseWish, PauseReply, PauseRequest, Refusal, Reject, Twist, keys,
};
use zenoh::Session;

use crate::command_log::{CommandLog, pause_in_words};
use crate::config::ServiceConfig;
use crate::locked::locked;
use crate::metrics::Tally;
use crate::robot_service::first_run;
use crate::serve::{Server, serve_commands, serve_state};
use crate::topic::Inbox;

/// A holder that is not heard of for so long may lose its lease.
pub const LEASE: Duration = Duration::from_millis(LEASE_MS);

/// The driver that may drive.
#[derive(Debug, Clone)]
struct Held {
    driver: String,
    lease: u64,
    heard: Instant,
}

impl Held {
    fn is_of(&self, request: &LeaseRequest) -> bool {
        self.lease == request.lease && self.driver == request.driver
    }

    fn lives(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.heard) <= LEASE
    }
}

/// The grants of one base: pure, with the time as an argument.
#[derive(Debug)]
pub struct Grants {
    /// Number of the next grant: unlike those of a base that was here before.
    next: u64,
    held: Option<Held>,
    /// The driver that has asked the holder to go, and when it did so last.
    wanted_by: Option<(String, Instant)>,
    /// Since when the base is paused.
    paused: Option<Instant>,
}

impl Grants {
    /// No driver drives yet. `first` must differ from every number that an earlier base of this robot has granted.
    pub fn new(first: u64) -> Self {
        Self { next: first, held: None, wanted_by: None, paused: None }
    }

    /// What becomes of a driver's wish.
    ///
    /// # Errors
    /// [`Refusal::LeaseHeld`] while another driver holds the lease or waits for it, and [`Refusal::NoLease`] if a
    /// driver releases what it does not hold.
    pub fn ask(&mut self, request: &LeaseRequest, now: Instant) -> Result<Lease, Refusal> {
        self.wanted_by.take_if(|(_, asked)| now.saturating_duration_since(*asked) > LEASE);
        if let Some(held) = self.held.as_mut().filter(|held| held.is_of(request)) {
            held.heard = now;
            if request.wish == LeaseWish::Release {
                self.held = None;
            }
            return Ok(self.state());
        }
        if request.wish == LeaseWish::Release {
            return Err(Refusal::NoLease);
        }
        if let Some(held) = self.held.as_ref().filter(|held| held.lives(now)) {
            let holder = held.driver.clone();
            if request.wish == LeaseWish::TakeOver {
                self.wanted_by = Some((request.driver.clone(), now));
            }
            return Err(Refusal::LeaseHeld { holder });
        }
        if let Some((waiting, _)) = self.wanted_by.as_ref().filter(|(waiting, _)| *waiting != request.driver)
        {
            return Err(Refusal::LeaseHeld { holder: waiting.clone() });
        }
        self.wanted_by = None;
        self.held = Some(Held { driver: request.driver.clone(), lease: self.next, heard: now });
        self.next += 1;
        if request.paused {
            self.pause(true, now);
        }
        Ok(self.state())
    }

    /// Begins or ends a pause.
    pub fn pause(&mut self, paused: bool, now: Instant) {
        self.paused = paused.then(|| self.paused.unwrap_or(now));
    }

    /// How the lease stands.
    pub fn state(&self) -> Lease {
        Lease {
            lease: self.number(),
            holder: self.held.as_ref().map(|held| held.driver.clone()),
            wanted_by: self.wanted_by.as_ref().map(|(driver, _)| driver.clone()),
            paused: self.paused.is_some(),
        }
    }

    /// Number of the grant that is obeyed; 0 without one. It is obeyed until another driver has asked for the lease:
    /// a holder that was slow for a moment loses nothing.
    pub fn number(&self) -> u64 {
        self.held.as_ref().map_or(0, |held| held.lease)
    }
}

/// The lease of one robot, as its base serves it.
#[derive(Debug)]
pub struct BaseLease {
    grants: Mutex<Grants>,
    /// What was refused; commands of drivers that do not hold the lease are among it.
    refused: Tally,
    log: CommandLog,
}

/// The queryables of a base's lease.
pub type LeaseServers = [Server; 3];

impl BaseLease {
    /// Serves the lease of the robot of `config`, as the base `role` of its instance: how the lease stands, wishes of
    /// drivers, and pauses. What is refused, commands of other drivers included, is added to `refused`.
    ///
    /// # Errors
    /// If a key cannot be served.
    pub fn serve(
        session: &Session,
        config: &ServiceConfig,
        role: &str,
        refused: &Tally,
    ) -> anyhow::Result<(Arc<Self>, LeaseServers)> {
        let ServiceConfig { robot, instance, .. } = config;
        let base = Arc::new(Self {
            grants: Mutex::new(Grants::new(first_run())),
            refused: refused.clone(),
            log: CommandLog::new(config),
        });
        let shown = Arc::clone(&base);
        let asked = Arc::clone(&base);
        let halted = Arc::clone(&base);
        let role = role.to_owned();
        let instance = instance.clone();
        let state = serve_state(session, &keys::robot(robot, "lease")?, refused, move || Ok(shown.state()))?;
        let wishes =
            serve_commands(session, robot, Commanded::Lease, refused, move |wish, by| asked.ask(&wish, by))?;
        let pauses = serve_commands(session, robot, Commanded::Pause, refused, move |request, by| {
            halted.pause(request, by);
            let Lease { lease, paused, .. } = halted.state();
            Ok(PauseReply { role: role.clone(), instance: instance.clone(), lease, paused })
        })?;
        Ok((base, [state, wishes, pauses]))
    }

    /// A driver that holds the lease repeats its wish, and so does one that waits: what changes nothing is not logged.
    fn ask(&self, request: &LeaseRequest, by: &str) -> Result<Lease, Reject> {
        let mut grants = locked(&self.grants);
        let before = grants.state();
        let answer = grants.ask(request, Instant::now()).map_err(Reject::from);
        let after = grants.state();
        if (before.lease, &before.wanted_by) != (after.lease, &after.wanted_by) {
            let wish = match request.wish {
                LeaseWish::Hold => "to drive",
                LeaseWish::TakeOver => "to take over",
                LeaseWish::Release => "to give up the lease",
            };
            let command = format!("driver `{}` wishes {wish}", request.driver);
            self.log.note(by, &command, &answer.as_ref().map(|lease| format!("lease {}", lease.lease)));
        }
        answer
    }

    /// Begins or ends a pause that `by` has asked for.
    pub fn pause(&self, request: PauseRequest, by: &str) {
        locked(&self.grants).pause(request.paused, Instant::now());
        self.log.note(by, pause_in_words(request), &Ok("the base obeys".into()));
    }

    /// How the lease stands.
    pub fn state(&self) -> Lease {
        locked(&self.grants).state()
    }

    /// Number of the grant that is obeyed; 0 without one.
    pub fn number(&self) -> u64 {
        locked(&self.grants).number()
    }

    /// Whether the base obeys this command. One of a driver that does not hold the lease is counted.
    pub fn admits(&self, command: &Twist) -> bool {
        let number = self.number();
        let admitted = number != 0 && command.lease == number;
        if !admitted {
            self.refused.add(&[Refusal::NoLease.code()]);
        }
        admitted
    }

    /// The commands of `inbox` that the base obeys.
    #[must_use]
    pub fn commands(self: &Arc<Self>, inbox: Inbox<Twist>) -> Inbox<Twist> {
        let lease = Arc::clone(self);
        inbox.only(move |command| lease.admits(command))
    }

    /// For how long the base has been paused.
    pub fn paused_for(&self) -> Option<Duration> {
        locked(&self.grants).paused.map(|since| since.elapsed())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wish(driver: &str, lease: u64, wish: LeaseWish) -> LeaseRequest {
        LeaseRequest { driver: driver.into(), lease, wish, paused: false }
    }

    fn held_by(holder: &str) -> Refusal {
        Refusal::LeaseHeld { holder: holder.into() }
    }

    const STEP: Duration = Duration::from_millis(200);

    #[test]
    fn one_driver_has_it_and_another_is_told_who() {
        let start = Instant::now();
        let mut grants = Grants::new(7);
        let first = grants.ask(&wish("a", 0, LeaseWish::Hold), start).unwrap();
        assert_eq!((first.lease, first.holder.as_deref()), (7, Some("a")));
        for k in 1..50 {
            let now = start + STEP * k;
            assert_eq!(grants.ask(&wish("a", 7, LeaseWish::Hold), now).unwrap().lease, 7);
            assert_eq!(grants.ask(&wish("b", 0, LeaseWish::Hold), now), Err(held_by("a")));
            // Nor does one of the same name share it.
            assert_eq!(grants.ask(&wish("a", 0, LeaseWish::Hold), now), Err(held_by("a")));
        }
    }

    #[test]
    fn a_driver_that_is_silent_loses_it_to_the_next_that_asks_and_to_nothing_else() {
        let start = Instant::now();
        let mut grants = Grants::new(7);
        grants.ask(&wish("a", 0, LeaseWish::Hold), start).unwrap();
        // Silent for long, but no other has asked.
        assert_eq!(grants.ask(&wish("a", 7, LeaseWish::Hold), start + 9 * LEASE).unwrap().lease, 7);
        let late = start + 10 * LEASE + STEP;
        assert_eq!(grants.ask(&wish("b", 0, LeaseWish::Hold), late).unwrap().lease, 8);
        assert_eq!(grants.ask(&wish("a", 7, LeaseWish::Hold), late), Err(held_by("b")));
    }

    #[test]
    fn a_take_over_waits_until_the_holder_has_gone_and_nobody_slips_in() {
        let start = Instant::now();
        let mut grants = Grants::new(7);
        grants.ask(&wish("a", 0, LeaseWish::Hold), start).unwrap();
        assert_eq!(grants.ask(&wish("b", 0, LeaseWish::TakeOver), start), Err(held_by("a")));
        let seen = grants.ask(&wish("a", 7, LeaseWish::Hold), start + STEP).unwrap();
        assert_eq!(seen.wanted_by.as_deref(), Some("b"));
        assert_eq!(grants.ask(&wish("c", 0, LeaseWish::Release), start + STEP), Err(Refusal::NoLease));
        assert_eq!(grants.ask(&wish("a", 7, LeaseWish::Release), start + STEP).unwrap().lease, 0);
        assert_eq!(grants.ask(&wish("c", 0, LeaseWish::Hold), start + STEP), Err(held_by("b")));
        assert_eq!(grants.ask(&wish("b", 0, LeaseWish::TakeOver), start + STEP).unwrap().lease, 8);
        assert_eq!(grants.state().wanted_by, None);
    }

    #[test]
    fn one_that_wanted_it_and_went_away_keeps_nobody_waiting() {
        let start = Instant::now();
        let mut grants = Grants::new(7);
        grants.ask(&wish("a", 0, LeaseWish::Hold), start).unwrap();
        assert!(grants.ask(&wish("b", 0, LeaseWish::TakeOver), start).is_err());
        grants.ask(&wish("a", 7, LeaseWish::Release), start + STEP).unwrap();
        let later = start + LEASE + STEP;
        assert_eq!(grants.ask(&wish("c", 0, LeaseWish::Hold), later).unwrap().holder.as_deref(), Some("c"));
    }

    #[test]
    fn a_base_that_was_restarted_learns_of_a_pause_from_the_driver_and_forgets_none_of_its_own() {
        let start = Instant::now();
        let mut anew = Grants::new(9);
        let paused = LeaseRequest { paused: true, ..wish("a", 7, LeaseWish::Hold) };
        let granted = anew.ask(&paused, start).unwrap();
        assert!(granted.paused && granted.lease == 9);
        // What the holder says later is older than a resume that came here first.
        anew.pause(false, start);
        assert!(!anew.ask(&LeaseRequest { lease: 9, ..paused }, start).unwrap().paused);
        anew.pause(true, start);
        assert!(anew.ask(&wish("b", 0, LeaseWish::Hold), start + 2 * LEASE).unwrap().paused);
    }
}
