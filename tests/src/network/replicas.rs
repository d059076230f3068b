//! One replica of a pool crashes or hangs, and returns.

use std::time::{Duration, Instant};

use super::figures::{Figures, measured};
use super::invariants;
use super::site::{Layout, Site};

/// Role of the pool, instance and process.
const REPLICAS: [(&str, &str); 3] = [("generator", "generator-1"), ("cpc", "cpc-1"), ("cnc", "hccdm-1")];
/// A hung process is gone when its lease of a second is over; the rest is for a busy machine.
const GONE_LIMIT: Duration = Duration::from_secs(5);
const BACK_LIMIT: Duration = Duration::from_secs(10);

#[test]
fn a_killed_replica_costs_no_cycle_and_is_back_at_work_soon() {
    let Some(mut site) = Site::start("killing replicas", &Layout::default()) else { return };
    for (role, instance) in REPLICAS {
        measured(&format!("SIGKILL of {instance}"), &mut site, is_met, |site| {
            // A new process counts from 0.
            fails_and_returns(site, role, instance, |_| 0, |s| s.kill(instance), |s| s.restart(instance))
        });
    }
    invariants::check(site.recorder());
}

#[test]
fn a_hung_replica_costs_no_cycle_and_is_back_at_work_soon() {
    let Some(mut site) = Site::start("hanging replicas", &Layout::default()) else { return };
    for (role, instance) in REPLICAS {
        let (stop, go_on) =
            (|s: &mut Site| s.signal("STOP", instance), |s: &mut Site| s.signal("CONT", instance));
        measured(&format!("SIGSTOP of {instance}"), &mut site, is_met, |site| {
            fails_and_returns(site, role, instance, |s| answered(s, role, instance), stop, go_on)
        });
    }
    invariants::check(site.recorder());
}

fn is_met(figures: &Figures) -> bool {
    let soon = figures.recovered.is_some_and(|time| time < Duration::from_secs(2));
    figures.undecided == 0 && figures.degraded <= 1 && soon
}

fn fails_and_returns(
    site: &mut Site,
    role: &str,
    instance: &str,
    before: impl Fn(&Site) -> u64,
    fail: impl Fn(&mut Site),
    heal: impl Fn(&mut Site),
) -> Figures {
    site.recorder().await_nominal("nominal before the fault", Duration::from_secs(20));
    let before = before(site);
    let from = Instant::now();
    fail(site);
    let gone = |s: &Site| s.recorder().await_until("gone", from, GONE_LIMIT, |r| !r.is_alive(role, instance));
    let detected = gone(site);
    site.recorder().await_cycles(5);
    let returned = Instant::now();
    heal(site);
    let recovered = await_work(site, role, instance, before, returned);
    site.recorder().await_cycles(5);
    let figures = Figures::since(&site.recorder().record(), from);
    Figures { detected: Some(detected), recovered: Some(recovered), ..figures }
}

/// Questions the replica has answered; none if it does not say.
pub(super) fn answered(site: &Site, role: &str, instance: &str) -> u64 {
    site.recorder().questions(role, instance).unwrap_or(0)
}

/// Waits until a replica that has just come back has been given work: it has answered two questions more than
/// `before`, and the first only asks whether it is ready.
pub(super) fn await_work(
    site: &Site,
    role: &str,
    instance: &str,
    before: u64,
    returned: Instant,
) -> Duration {
    site.recorder().await_until("at work again", returned, BACK_LIMIT, |r| {
        r.is_alive(role, instance) && r.questions(role, instance) >= Some(before + 2)
    })
}
