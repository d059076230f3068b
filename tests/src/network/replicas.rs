//! One replica of a pool crashes or hangs, and returns.

use std::time::{Duration, Instant};

use super::figures::Figures;
use super::pace::{Kept, Pace, measured, play};
use super::site::{Layout, NOMINAL_LIMIT, Site};

/// Role of the pool, instance and process.
const REPLICAS: [(&str, &str); 3] = [("generator", "generator-1"), ("cpc", "cpc-1"), ("cnc", "cnc-1")];
/// A hung process is gone when its lease of a second is over; the rest is for a busy machine.
const GONE_LIMIT: Duration = Duration::from_secs(5);
pub(super) const BACK_LIMIT: Duration = Duration::from_secs(10);

#[test]
fn a_killed_replica_costs_no_cycle_and_is_back_at_work_soon() {
    play(&Layout::default(), |site| {
        REPLICAS.iter().try_for_each(|(role, instance)| {
            measured(&format!("SIGKILL of {instance}"), site, is_met(site.pace), |site| {
                fails_and_returns(site, role, instance, |s| s.kill(instance), |s| s.restart(instance))
            })
        })
    });
}

#[test]
fn a_hung_replica_costs_no_cycle_and_is_back_at_work_soon() {
    play(&Layout::default(), |site| {
        REPLICAS.iter().try_for_each(|(role, instance)| {
            let stop = |s: &mut Site| s.signal("STOP", instance);
            let go_on = |s: &mut Site| s.signal("CONT", instance);
            measured(&format!("SIGSTOP of {instance}"), site, is_met(site.pace), |site| {
                fails_and_returns(site, role, instance, stop, go_on)
            })
        })
    });
}

fn is_met(pace: Pace) -> impl Fn(&Figures) -> bool {
    let soon = pace.scaled(Duration::from_secs(2));
    move |f| f.undecided == 0 && f.degraded <= 1 && f.recovered.is_some_and(|time| time < soon)
}

fn fails_and_returns(
    site: &mut Site,
    role: &str,
    instance: &str,
    fail: impl Fn(&mut Site),
    heal: impl Fn(&mut Site),
) -> Kept<Figures> {
    site.recorder().await_nominal("nominal before the fault", NOMINAL_LIMIT)?;
    let from = Instant::now();
    fail(site);
    let gone = |s: &Site| s.recorder().await_until("gone", from, GONE_LIMIT, |r| !r.is_alive(role, instance));
    let detected = gone(site)?;
    site.recorder().await_cycles(5)?;
    let returned = Instant::now();
    heal(site);
    let recovered = await_work(site, role, instance, returned)?;
    site.recorder().await_cycles(5)?;
    let figures = site.recorder().figures_since(from);
    Ok(Figures { detected: Some(detected), recovered: Some(recovered), ..figures })
}

/// Waits until a replica that has just come back is given work. What it says of itself is read once it is announced:
/// questions from before its fault, which it may have answered meanwhile, do not count.
pub(super) fn await_work(site: &Site, role: &str, instance: &str, returned: Instant) -> Kept<Duration> {
    let recorder = site.recorder();
    recorder.await_until("announced again", returned, BACK_LIMIT, |r| r.is_alive(role, instance))?;
    let mut before = None;
    recorder.await_until("says how it is", returned, BACK_LIMIT, |r| {
        before = r.work(role, instance);
        before.is_some()
    })?;
    // A generator answers the question whether it is ready with candidates; an evaluator is asked for no cost.
    let enough = before.unwrap() + if role == "generator" { 2.0 } else { 1.0 };
    recorder.await_until("at work again", returned, BACK_LIMIT, |r| r.work(role, instance) >= Some(enough))
}
