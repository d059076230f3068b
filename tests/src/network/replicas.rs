//! One replica of a pool crashes or hangs, and returns.

use std::time::{Duration, Instant};

use super::figures::Figures;
use super::pace::{Kept, Pace, measured, play};
use super::recorder::Recorder;
use super::site::{Layout, NOMINAL_LIMIT, POOL, Site};

/// Role of the pool, instance and process.
const REPLICAS: [(&str, &str); 3] = [("generator", "generator-1"), ("cpc", "cpc-1"), ("cnc", "cnc-1")];
/// A hung process is gone when its lease of a second is over, and one side may wait for the other's; the rest is for a
/// busy machine.
const GONE_LIMIT: Duration = Duration::from_secs(6);
const BACK_LIMIT: Duration = Duration::from_secs(10);

#[test]
fn a_killed_replica_costs_no_cycle_and_is_back_at_work_soon() {
    play(&Layout::default(), |site| {
        REPLICAS.iter().try_for_each(|(role, instance)| {
            measured(&format!("SIGKILL of {instance}"), site, is_met(site.pace), |site| {
                let kill = |s: &mut Site| s.kill(instance);
                let restart = |s: &mut Site| s.restart(instance);
                let works = |s: &Site, returned| await_work(s, role, instance, returned);
                fails_and_returns(site, role, instance, kill, restart, works)
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
                fails_and_returns(site, role, instance, stop, go_on, await_whole)
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
    await_back: impl Fn(&Site, Instant) -> Kept<Duration>,
) -> Kept<Figures> {
    site.recorder().await_nominal("nominal before the fault", NOMINAL_LIMIT)?;
    let from = Instant::now();
    fail(site);
    let detected = await_gone(site, role, instance, from)?;
    site.recorder().await_cycles(5)?;
    let returned = Instant::now();
    heal(site);
    let recovered = await_back(site, returned)?;
    site.recorder().await_cycles(5)?;
    let figures = site.recorder().figures_since(from);
    Ok(Figures { detected: Some(detected), recovered: Some(recovered), ..figures })
}

/// Generators that a robot with one search tree keeps ready: one that it asks, and one in reserve.
const GENERATORS_WANTED: f64 = 2.0;

/// Waits until an evaluator that has just been started has answered questions of a cycle. A generator need not be asked
/// soon, nor at all while enough others are ready: it is back once it is alive and the robot has all that it wants.
fn await_work(site: &Site, role: &str, instance: &str, returned: Instant) -> Kept<Duration> {
    let may_work = |r: &Recorder| {
        if role == "generator" {
            r.ready(role) >= Some(GENERATORS_WANTED)
        } else {
            r.work(role, instance) >= Some(1.0)
        }
    };
    let works = |r: &Recorder| r.is_alive(role, instance) && may_work(r);
    site.recorder().await_until("at work again", returned, BACK_LIMIT, works)
}

/// Waits until the arbiter may give every replica work. A replica that has not been started anew may have answered
/// questions from before its fault, so its own counts say less. And a small batch is not cut: an evaluator that is back
/// need not get a part of it soon.
pub(super) fn await_whole(site: &Site, returned: Instant) -> Kept<Duration> {
    let whole = |r: &Recorder| REPLICAS.iter().all(|(role, _)| has_all(r, role));
    site.recorder().await_until("whole again", returned, BACK_LIMIT, whole)
}

/// Waits until `instance` is gone and the arbiter gives it no more work.
pub(super) fn await_gone(site: &Site, role: &str, instance: &str, from: Instant) -> Kept<Duration> {
    let gone = |r: &Recorder| !r.is_alive(role, instance) && !has_all(r, role);
    site.recorder().await_until("gone", from, GONE_LIMIT, gone)
}

fn has_all(recorder: &Recorder, role: &str) -> bool {
    recorder.ready(role) == Some(POOL.len() as f64)
}
