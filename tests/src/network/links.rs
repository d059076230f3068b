//! Links that are cut, lose one direction, are narrow, or slow.

use std::time::{Duration, Instant};

use super::figures::{Figures, measured};
use super::invariants;
use super::replicas::{answered, await_work};
use super::site::{Layout, POOL, Site};

/// The lease is a second, and one side may wait for the other's.
const GONE_LIMIT: Duration = Duration::from_secs(6);

#[test]
fn a_machine_of_the_pool_that_is_cut_off_or_not_heard_costs_no_cycle() {
    let Some(mut site) = Site::start("cutting a link", &Layout::default()) else { return };
    measured("link of pool-1 down", &mut site, is_met, |site| {
        cut_and_mended(site, |s, cut| s.network.set_link(POOL[1], !cut))
    });
    measured("nothing from the router to pool-1", &mut site, is_met, |site| {
        cut_and_mended(site, |s, cut| s.network.set_loss("router", POOL[1], cut))
    });
    invariants::check(site.recorder());
}

/// Three replicas are lost at once, one of each role. An attempt to connect that is under way when the link is
/// mended may have to end first, which takes a second.
fn is_met(figures: &Figures) -> bool {
    let soon = figures.recovered.is_some_and(|time| time < Duration::from_secs(3));
    figures.undecided == 0 && figures.degraded <= 5 && soon
}

fn cut_and_mended(site: &mut Site, set_cut: impl Fn(&Site, bool)) -> Figures {
    site.recorder().await_nominal("nominal before the fault", Duration::from_secs(20));
    const CUT_OFF: [(&str, &str); 3] = [("cnc", "hccdm-1"), ("cpc", "cpc-1"), ("generator", "generator-1")];
    let before = CUT_OFF.map(|(role, instance)| answered(site, role, instance));
    let from = Instant::now();
    set_cut(site, true);
    let detected = site.recorder().await_until("gone", from, GONE_LIMIT, |r| !r.is_alive("cnc", "hccdm-1"));
    site.recorder().await_cycles(5);
    let returned = Instant::now();
    set_cut(site, false);
    let mut recovered = Duration::ZERO;
    for ((role, instance), before) in CUT_OFF.into_iter().zip(before) {
        recovered = await_work(site, role, instance, before, returned);
    }
    let figures = Figures::since(&site.recorder().record(), from);
    Figures { detected: Some(detected), recovered: Some(recovered), ..figures }
}

#[test]
fn over_a_narrow_link_every_cycle_ends_in_a_decision() {
    let layout = Layout { routers: &["robot"], ..Layout::default() };
    let Some(mut site) = Site::start("a narrow link", &layout) else { return };
    measured(
        "20 Mbit/s to the robot",
        &mut site,
        |f| f.undecided == 0,
        |site| {
            let from = Instant::now();
            site.network.throttle("robot", 20);
            site.recorder().await_cycles(25);
            Figures::since(&site.recorder().record(), from)
        },
    );
    invariants::check(site.recorder());
}

#[test]
fn late_answers_belong_to_no_later_cycle() {
    let Some(mut site) = Site::start("delay and jitter", &Layout { delayed: true, ..Layout::default() })
    else {
        return;
    };
    let set = |site: &Site, delay, jitter| {
        let ms = Duration::from_millis;
        site.delayed_link.as_ref().unwrap().set(ms(delay), ms(jitter));
    };
    measured(
        "20 to 40 ms each way to the pool",
        &mut site,
        |f| f.undecided == 0,
        |site| {
            let from = Instant::now();
            set(site, 20, 20);
            site.recorder().await_cycles(25);
            let figures = Figures::since(&site.recorder().record(), from);
            set(site, 0, 0);
            let mended = Instant::now();
            site.recorder().await_nominal("nominal without the delay", Duration::from_secs(20));
            Figures { recovered: Some(mended.elapsed()), ..figures }
        },
    );
    invariants::check(site.recorder());
}
