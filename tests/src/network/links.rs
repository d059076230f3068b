//! Links that are cut, lose one direction, are narrow, or slow.

use std::time::{Duration, Instant};

use super::figures::Figures;
use super::pace::{Kept, Pace, measured, play};
use super::replicas::{await_gone, await_whole};
use super::site::{Layout, NOMINAL_LIMIT, POOL, Site};

#[test]
fn a_machine_of_the_pool_that_is_cut_off_or_not_heard_costs_no_cycle() {
    play(&Layout::default(), |site| {
        let is_met = is_met(site.pace);
        measured("link of pool-1 down", site, &is_met, |site| {
            cut_and_mended(site, |s, cut| s.network.set_link(POOL[1], !cut))
        })?;
        measured("nothing from the router to pool-1", site, &is_met, |site| {
            cut_and_mended(site, |s, cut| s.network.set_loss("router", POOL[1], cut))
        })
    });
}

/// Three replicas are lost at once, one of each role. A first packet of a connection that is lost is sent again after
/// one second and after two more; then the arbiter asks within a second whether the replica is there.
fn is_met(pace: Pace) -> impl Fn(&Figures) -> bool {
    let soon = pace.scaled(Duration::from_secs(4));
    move |f| f.undecided == 0 && f.degraded <= 5 && f.recovered.is_some_and(|time| time < soon)
}

fn cut_and_mended(site: &mut Site, set_cut: impl Fn(&Site, bool)) -> Kept<Figures> {
    site.recorder().await_nominal("nominal before the fault", NOMINAL_LIMIT)?;
    let from = Instant::now();
    set_cut(site, true);
    let detected = await_gone(site, "cnc", "cnc-1", from)?;
    site.recorder().await_cycles(5)?;
    let returned = Instant::now();
    set_cut(site, false);
    let recovered = await_whole(site, returned)?;
    let figures = site.recorder().figures_since(from);
    Ok(Figures { detected: Some(detected), recovered: Some(recovered), ..figures })
}

#[test]
fn over_a_narrow_link_every_cycle_ends_in_a_decision() {
    let layout = Layout { routers: &["robot"], ..Layout::default() };
    let is_met = |f: &Figures| f.undecided == 0;
    play(&layout, |site| {
        site.network.throttle("robot", 20);
        measured("20 Mbit/s to the robot", site, is_met, |site| {
            let from = Instant::now();
            site.recorder().await_cycles(25)?;
            Ok(site.recorder().figures_since(from))
        })
    });
}

#[test]
fn late_answers_belong_to_no_later_cycle() {
    // As much later than an answer may be at any pace.
    let set = |site: &Site, delay, jitter| {
        let ms = |ms| site.pace.scaled(Duration::from_millis(ms));
        site.delayed_link.as_ref().unwrap().set(ms(delay), ms(jitter));
    };
    let is_met = |f: &Figures| f.undecided == 0;
    play(&Layout { delayed: true, ..Layout::default() }, |site| {
        measured("20 to 40 ms each way to the pool", site, is_met, |site| {
            let from = Instant::now();
            set(site, 20, 20);
            site.recorder().await_cycles(25)?;
            let figures = site.recorder().figures_since(from);
            set(site, 0, 0);
            let mended = Instant::now();
            site.recorder().await_nominal("nominal without the delay", NOMINAL_LIMIT)?;
            Ok(Figures { recovered: Some(mended.elapsed()), ..figures })
        })
    });
}
