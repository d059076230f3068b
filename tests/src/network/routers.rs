//! Routers that end, alone or one of two.

use std::time::{Duration, Instant};

use curionav_driver::control::TRACKING;

use super::figures::{Figures, measured};
use super::invariants;
use super::recorder::Recorder;
use super::site::{Layout, Site, router_on};

const BACK_LIMIT: Duration = Duration::from_secs(15);

#[test]
fn a_router_that_restarts_is_a_stop_and_the_robot_goes_on() {
    let Some(mut site) = Site::start("a router restart", &Layout::default()) else { return };
    measured("router down for 1 s", &mut site, is_met, |site| {
        site.recorder().await_nominal("nominal before the fault", Duration::from_secs(20));
        let speed = |r: &Recorder| r.record().odometry.last().map(|(_, o)| o.v).unwrap();
        let before = speed(site.recorder());
        let from = Instant::now();
        site.kill(&router_on("router"));
        // The fault itself, not a wait for anything.
        std::thread::sleep(Duration::from_secs(1));
        let returned = Instant::now();
        site.restart(&router_on("router"));
        site.recorder().await_until("heard again", returned, BACK_LIMIT, |r| {
            r.record().odometry.last().is_some_and(|(at, _)| *at > returned)
        });
        let after = speed(site.recorder());
        // 0.7 s of braking at 0.5 m/s2 at the least, most of which is to be seen.
        assert!(after <= (before - 0.2).max(0.0), "from {before:.2} m/s to {after:.2} m/s: it did not brake");
        planning_again(site, from, returned)
    });
    invariants::check(site.recorder());
}

/// Zenoh tries the routers of its list in turn, a second each.
const CHANGE_OVER_LIMIT: Duration = Duration::from_secs(4);

#[test]
fn with_two_routers_one_may_end() {
    let layout = Layout { routers: &["router", "router-2"], ..Layout::default() };
    let Some(mut site) = Site::start("two routers", &layout) else { return };
    measured("the robot's of two routers killed", &mut site, is_met, |site| {
        site.recorder().await_nominal("nominal before the fault", Duration::from_secs(20));
        let from = Instant::now();
        site.kill(&router_on("router"));
        planning_again(site, from, from)
    });
    // Whoever starts now finds the first router of its list gone.
    site.kill("arbiter");
    site.restart("arbiter");
    site.await_ready("arbiter");
    site.recorder().await_nominal("with an arbiter that never knew the first router", BACK_LIMIT);
    site.restart(&router_on("router"));
    site.await_ready(&router_on("router"));
    let in_time = |f: &Figures| f.recovered.is_some_and(|time| time < CHANGE_OVER_LIMIT);
    measured("the pool's of two routers cut off", &mut site, in_time, |site| {
        let from = Instant::now();
        site.network.set_link("router-2", false);
        let figures = planning_again(site, from, from);
        site.network.set_link("router-2", true);
        figures
    });
    invariants::check(site.recorder());
}

fn is_met(figures: &Figures) -> bool {
    figures.recovered.is_some_and(|time| time < Duration::from_secs(2))
}

/// Waits until decisions of the whole pool come again and are followed.
fn planning_again(site: &Site, from: Instant, returned: Instant) -> Figures {
    let recorder = site.recorder();
    let recovered = recorder.await_until("planning again", returned, BACK_LIMIT, |r| {
        let record = r.record();
        let planned = record.nominal_since(returned, 1);
        planned && record.commands.last().is_some_and(|(at, c)| *at > returned && c.reason == TRACKING)
    });
    recorder.await_nominal("nominal again", BACK_LIMIT);
    let figures = Figures::since(&recorder.record(), from);
    Figures { recovered: Some(recovered), ..figures }
}
