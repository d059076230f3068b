//! One scan of the tracker of people, among as many as a scan can show.

use std::fmt::Write;
use std::sync::Arc;

use curionav_crowdsim::{Observation as Sensed, Scenario, World};
use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::motion::OdometryNoise;
use curionav_planning::nalgebra::Matrix3;
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::scene::Belief;
use curionav_tracking_people::{Observation, Tracker, TrackerParams};

use crate::case::Case;
use crate::hall;

/// People in view.
const PEOPLE: u32 = 40;
/// Scans in one repeat, and before it, so that people are known.
const SCANS: usize = 8;

/// A scan of 1081 beams over 270 degrees with 40 people in it, as discs and as legs.
pub(crate) fn cases() -> anyhow::Result<Vec<Case>> {
    ["disc", "legs"].into_iter().map(case).collect()
}

fn case(shape: &str) -> anyhow::Result<Case> {
    let mut world = world(shape)?;
    let sensed: Vec<Sensed> = (0..2 * SCANS)
        .map(|_| {
            let seen = world.observe();
            world.step(Twist::default());
            seen
        })
        .collect();
    let laser = world.scenario().laser;
    let covariance = Matrix3::identity() * 0.01;
    let belief = Belief { pose: world.truth().pose, covariance, twist: Twist::default() };
    let scan = move |tracker: &mut Tracker, seen: &Sensed| {
        let stamp = seen.stamp;
        let odometry = seen.odometry;
        let now = Observation { stamp, ranges: &seen.ranges, laser: &laser, odometry, belief: &belief };
        tracker.update(&now).0.len()
    };
    let mut known = Tracker::new(
        Arc::new(StaticMap::new(hall::grid()?)),
        TrackerParams::default(),
        OdometryNoise::default(),
    );
    sensed[..SCANS].iter().for_each(|seen| {
        scan(&mut known, seen);
    });
    let track = move |mut tracker: Tracker| {
        sensed[SCANS..].iter().map(|seen| scan(&mut tracker, seen)).sum::<usize>()
    };
    Ok(Case::after(format!("track/{shape}/{PEOPLE}"), SCANS as u32, move || known.clone(), track))
}

/// A robot that stands among people at different bearings and distances, who walk to and fro.
fn world(shape: &str) -> anyhow::Result<World> {
    let mut text = format!(
        "name = \"around\"\nmap = {{ file = \"none.yaml\" }}\n\
         robot = {{ start = [16.0, 16.0, 0.7], goal = [18.0, 16.0], start_noise = 0.0 }}\n\
         laser = {{ fov = 4.71238898038469, beams = 1081, range_max = 10.0 }}\npeople = {{ shape = \"{shape}\" }}\n"
    );
    for k in 0..PEOPLE {
        // A spiral over the 260 degrees ahead: neighbours are not hidden behind each other.
        let distance = 1.6 + 0.45 * f64::from(k % 4);
        let bearing = -2.27 + 4.54 / 40.0 * f64::from(k);
        let (s, c) = sin_cos(0.7 + bearing);
        let x = 16.0 + distance * c;
        let y = 16.0 + distance * s;
        writeln!(text, "[[walkers]]\nroute = [[{x}, {y}], [{}, {}]]", x + 0.4 * c, y + 0.4 * s)?;
    }
    let scenario = Scenario::from_toml(&text)?;
    let world = World::new(&scenario, StaticMap::new(hall::grid()?), Vec::new(), 1)?;
    debug_assert_eq!(world.truth().pose, Pose2::new(16.0, 16.0, 0.7));
    Ok(world)
}
