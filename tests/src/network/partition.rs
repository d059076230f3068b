//! The whole pool is out of reach of a robot that has its router with it.

use std::time::{Duration, Instant};

use curionav_schemas::{Action, Decision, Evaluated};

use super::figures::Figures;
use super::pace::{Kept, Pace, measured, play};
use super::recorder::{Record, Recorder};
use super::site::{Layout, NOMINAL_LIMIT, POOL, Site};

const LIMIT: Duration = Duration::from_secs(15);
/// Cycles that may be degraded once the pool is known to be back.
const HEALING_CYCLES: usize = 5;

#[test]
fn without_its_pool_the_robot_goes_on_by_itself() {
    let layout = Layout { routers: &["robot"], ..Layout::default() };
    play(&layout, |site| {
        measured("the whole pool cut off", site, is_met(site.pace), |site| {
            let from = cut_off(site)?;
            site.recorder().await_until("evaluates by itself", from, LIMIT, |r| {
                last(&r.record(), 5, |d| {
                    let local = |term| d.evaluated.get(term) == Some(&Evaluated::Local);
                    d.action == Action::Follow && local("cnc") && local("cpc")
                })
            })?;
            reunited(site, from)
        })
    });
}

#[test]
fn without_its_pool_and_without_leave_to_replace_it_the_robot_stops() {
    let layout = Layout { routers: &["robot"], in_process: false, ..Layout::default() };
    play(&layout, |site| {
        measured("the same, in_process = false", site, is_met(site.pace), |site| {
            let from = cut_off(site)?;
            site.recorder().await_until("stands", from, LIMIT, |r| {
                let record = r.record();
                last(&record, 5, |d| d.action == Action::Stop)
                    && record.odometry.last().is_some_and(|(_, o)| o.v == 0.0)
            })?;
            reunited(site, from)
        })
    });
}

fn is_met(pace: Pace) -> impl Fn(&Figures) -> bool {
    let soon = pace.scaled(Duration::from_secs(2));
    move |f| f.undecided == 0 && f.recovered.is_some_and(|time| time < soon)
}

fn cut_off(site: &Site) -> Kept<Instant> {
    site.recorder().await_nominal("nominal before the fault", NOMINAL_LIMIT)?;
    let from = Instant::now();
    POOL.iter().for_each(|host| site.network.set_link(host, false));
    Ok(from)
}

/// Links the pool again, waits until every replica has announced itself, and then for nominal cycles.
fn reunited(site: &Site, from: Instant) -> Kept<Figures> {
    let recorder = site.recorder();
    let pool = [("generator", "generator"), ("cpc", "cpc"), ("cnc", "cnc")];
    let all = |alive: bool| {
        move |r: &Recorder| {
            (0..POOL.len())
                .all(|i| pool.iter().all(|(role, p)| r.is_alive(role, &format!("{p}-{i}")) == alive))
        }
    };
    let detected = recorder.await_until("all are gone", from, LIMIT, all(false))?;
    let returned = Instant::now();
    POOL.iter().for_each(|host| site.network.set_link(host, true));
    let recovered = recorder.await_until("all are back", returned, LIMIT, all(true))?;
    recorder.await_cycles(HEALING_CYCLES)?;
    let healed = Instant::now();
    recorder.await_until("nominal", healed, LIMIT, |r| r.record().nominal_since(healed, 5))?;
    let figures = recorder.figures_since(from);
    Ok(Figures { detected: Some(detected), recovered: Some(recovered), ..figures })
}

fn last(record: &Record, count: usize, holds: impl Fn(&Decision) -> bool) -> bool {
    record.decisions.len() >= count && record.decisions.iter().rev().take(count).all(|(_, d)| holds(d))
}
