//! Routers that end, alone or one of two.

use std::time::{Duration, Instant};

use curionav_schemas::{CommandReason, Twist};

use super::figures::Figures;
use super::pace::{Kept, Pace, measured, play};
use super::recorder::Recorder;
use super::site::{Layout, NOMINAL_LIMIT, Site, router_on};

const BACK_LIMIT: Duration = Duration::from_secs(15);

#[test]
fn a_router_that_restarts_is_a_stop_and_the_robot_goes_on() {
    play(&Layout::default(), |site| measured("router down for 1 s", site, within(site.pace, 2), restarted));
}

fn restarted(site: &mut Site) -> Kept<Figures> {
    site.recorder().await_nominal("nominal before the fault", NOMINAL_LIMIT)?;
    let speed = |r: &Recorder| r.record().odometry.last().map(|(_, o)| o.v).unwrap();
    let before = speed(site.recorder());
    let from = Instant::now();
    site.kill(&router_on("router"));
    // The fault itself, not a wait for anything.
    std::thread::sleep(site.pace.scaled(Duration::from_secs(1)));
    let returned = Instant::now();
    site.restart(&router_on("router"));
    site.recorder().await_until("heard again", returned, BACK_LIMIT, |r| {
        r.record().odometry.last().is_some_and(|(at, _)| *at > returned)
    })?;
    let after = speed(site.recorder());
    // 0.7 s of braking at 0.5 m/s2 at the least, most of which is to be seen.
    assert!(after <= (before - 0.2).max(0.0), "from {before:.2} m/s to {after:.2} m/s: it did not brake");
    planning_again(site, from, returned)
}

#[test]
fn with_two_routers_one_may_end() {
    let layout = Layout { routers: &["router", "router-2"], ..Layout::default() };
    play(&layout, |site| {
        measured("the robot's of two routers killed", site, within(site.pace, 2), |site| {
            site.recorder().await_nominal("nominal before the fault", NOMINAL_LIMIT)?;
            let from = Instant::now();
            site.kill(&router_on("router"));
            let figures = planning_again(site, from, from);
            // What starts now finds the first router of its list gone.
            site.kill("arbiter");
            site.restart("arbiter");
            site.await_ready("arbiter");
            site.recorder().await_nominal("with an arbiter that never knew the first router", BACK_LIMIT)?;
            site.restart(&router_on("router"));
            site.await_ready(&router_on("router"));
            figures
        })?;
        // Zenoh tries the routers of its list in turn, a second each.
        measured("the pool's of two routers cut off", site, within(site.pace, 4), |site| {
            let from = Instant::now();
            site.network.set_link("router-2", false);
            let figures = planning_again(site, from, from);
            site.network.set_link("router-2", true);
            figures
        })
    });
}

fn within(pace: Pace, seconds: u64) -> impl Fn(&Figures) -> bool {
    let soon = pace.scaled(Duration::from_secs(seconds));
    move |f| f.recovered.is_some_and(|time| time < soon)
}

/// Waits until decisions of the whole pool come again and are followed.
fn planning_again(site: &Site, from: Instant, returned: Instant) -> Kept<Figures> {
    let recorder = site.recorder();
    let recovered = recorder.await_until("planning again", returned, BACK_LIMIT, |r| {
        let record = r.record();
        let planned = record.nominal_since(returned, 1);
        let tracks = |(at, c): &(Instant, Twist)| *at > returned && c.reason == CommandReason::Tracking;
        planned && record.commands.last().is_some_and(tracks)
    })?;
    recorder.await_nominal("nominal again", BACK_LIMIT)?;
    Ok(Figures { recovered: Some(recovered), ..recorder.figures_since(from) })
}
