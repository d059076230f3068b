//! A viewer who does all that it may, and some of what it may not, as fast as can be, while a fleet drives.

use std::time::{Duration, Instant};

use curionav_runtime::session;

use super::fleet::robot;
use super::run::{Driving, Site};
use super::watch::{Counts, Drive};
use crate::end_to_end::program::{soak_time, turn, two_workers};
use crate::faults::base::TICK;
use crate::faults::corridor_map;
use crate::foreign_bytes::ceilings::Memory;
use crate::foreign_bytes::viewer::Flood;
use crate::pace::Pace;

const ROBOTS: usize = 6;
/// Ticks of those due, and decisions per tick, at least. The flood comes from the fleet's machine, which it would not
/// elsewhere.
const KEPT: f64 = 0.8;

#[test]
fn a_viewer_at_full_speed_delays_no_robot_of_a_fleet() {
    let _turn = turn();
    let lasts = soak_time(10).min(Duration::from_secs(60));
    let runtime = two_workers();
    runtime.block_on(at_full_speed(lasts));
    runtime.shutdown_timeout(Duration::from_secs(2));
}

async fn at_full_speed(lasts: Duration) {
    let site = Site::start(ROBOTS, true).await;
    let pids = site.fleet.pids();
    let memory = Memory::watch(pids.iter().map(|(name, pid)| (name.as_str(), *pid)));
    let viewer = session::client(&site.fleet.config("viewer")).await.unwrap();
    // At a pace that the machine keeps beside the flood.
    for halvings in 0.. {
        let pace = Pace::halved(halvings);
        let driving = Driving::start(&site.fleet, ROBOTS, Drive { pace, is_long: false }).await;
        let before: Counts = driving.robots.iter().map(|r| r.watch().counts).sum();
        let (begun, flood) = (Instant::now(), Flood::begin(&viewer, &robot(0), &corridor_map::fields().1));
        tokio::time::sleep(lasts).await;
        let after: Counts = driving.robots.iter().map(|r| r.watch().counts).sum();
        let seconds = begun.elapsed().as_secs_f64();
        let deeds = tokio::task::spawn_blocking(|| flood.end()).await.unwrap();
        let (ticks, decisions) = (after.ticks - before.ticks, after.decisions - before.decisions);
        let due = pace.speed() * seconds / TICK * ROBOTS as f64;
        println!(
            "{deeds} deeds of the viewer in {seconds:.0} s, at {} of the pace: {ticks} ticks of {due:.0}, {decisions} decisions, \
             {} late, {} nominal",
            pace.speed(),
            after.late - before.late,
            after.nominal - before.nominal,
        );
        let robots = driving.robots.clone();
        driving.end().await;
        // A slow machine excuses what is late, but nothing else.
        robots.iter().for_each(|robot| robot.watch().violations().assert_none());
        let is_in_time =
            after.late == before.late && ticks as f64 > KEPT * due && decisions as f64 > KEPT * ticks as f64;
        if is_in_time {
            robots.iter().for_each(|robot| robot.watch().judge());
            break;
        }
        assert!(!pace.is_slowest(), "not at the slowest pace either");
    }
    memory.judge();
    session::close(&viewer);
    site.end();
}
