//! Halls with people, seen by a robot that knows where it is or does not.

use std::sync::Arc;
use std::time::{Duration, Instant};

use curionav_crowdsim::{Observation as Sensed, Scenario, World};
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
use curionav_planning::random::{rng, standard_normal};
use curionav_planning::scene::Belief;
use curionav_tracking_people::{Observation, Person, Tracker, TrackerParams};
use nalgebra::{Matrix3, Vector3};

use super::ospa::{Identities, ospa};

/// A hall of 20 m x 12 m with outer walls and pillars, without those of `except`.
pub(super) fn hall(except: impl Fn(f64, f64) -> bool) -> StaticMap {
    let (width, height) = (400, 240);
    let cells = (0..width * height).map(|i| {
        let (c, r) = (i % width, i / width);
        let outer = c < 2 || r < 2 || c >= width - 2 || r >= height - 2;
        let pillar = (c / 6) % 16 == 3 && (r / 6) % 13 == 8;
        let solid = (outer || pillar) && !except(0.05 * c as f64, 0.05 * r as f64);
        if solid { 100 } else { 0 }
    });
    StaticMap::new(OccupancyGrid::new(width, height, 0.05, Pose2::default(), cells.collect()).unwrap())
}

/// A robot in the middle of the hall. `people` is the rest of the scenario.
pub(super) fn scenario(shape: &str, people: &str) -> Scenario {
    Scenario::from_toml(&format!(
        "name = \"hall\"\nmap = {{ file = \"hall.yaml\" }}\n\
         [robot]\nstart = [8.0, 6.0, 0.0]\ngoal = [17.0, 6.0]\nstart_noise = 0.0\n\
         [laser]\nfov = 6.283185307179586\nbeams = 720\nrange_max = 8.0\n\
         [perception]\npeople = \"laser\"\n\
         [people]\nshape = \"{shape}\"\nmotion = \"hrvo\"\n{people}"
    ))
    .unwrap()
}

/// What a drive through a crowd has shown.
pub(super) struct Drive {
    pub(super) ospa: f64,
    pub(super) switches: usize,
    /// People times seconds that were in view.
    pub(super) seen_s: f64,
}

/// A robot that turns to and fro in a world, and its tracker.
pub(super) struct Bench {
    world: World,
    pub(super) tracker: Tracker,
    /// Standard deviations of the belief around the truth, m and rad.
    sigma: [f64; 2],
    noise: curionav_planning::random::Rng,
    took: Duration,
}

impl Bench {
    pub(super) fn new(
        scenario: &Scenario,
        map: StaticMap,
        known: StaticMap,
        sigma: [f64; 2],
        seed: u64,
    ) -> Self {
        let world = World::new(scenario, map, Vec::new(), seed).unwrap();
        let tracker = Tracker::new(Arc::new(known), TrackerParams::default(), scenario.odometry_noise);
        Self { world, tracker, sigma, noise: rng(seed, 91), took: Duration::ZERO }
    }

    /// How long the tracker takes for one scan.
    pub(super) fn scan_time(&mut self) -> Duration {
        self.tick();
        self.took
    }

    /// One tick: what the sensors say, what is believed, and who is tracked, in the map's frame by the true pose.
    pub(super) fn tick(&mut self) -> (Sensed, Vec<Person>) {
        let (sensed, pose) = (self.world.observe(), self.world.truth().pose);
        let mut off = |sigma: f64| sigma * standard_normal(&mut self.noise);
        let [metres, radians] = self.sigma;
        let believed = Pose2::new(pose.x + off(metres), pose.y + off(metres), pose.heading + off(radians));
        let variances = [metres, metres, radians].map(|sigma| sigma * sigma);
        let covariance = Matrix3::from_diagonal(&Vector3::from(variances));
        let belief = Belief { pose: believed, covariance, twist: sensed.twist };
        let laser = &self.world.scenario().laser;
        let now = Observation {
            stamp: sensed.stamp,
            ranges: &sensed.ranges,
            laser,
            odometry: sensed.odometry,
            belief: &belief,
        };
        let started = Instant::now();
        let (mut people, _) = self.tracker.update(&now);
        self.took = started.elapsed();
        for person in &mut people {
            person.position = pose.transform(person.position);
        }
        let omega = if (self.world.tick() / 30).is_multiple_of(2) { 0.3 } else { -0.3 };
        self.world.step(Twist { v: 0.2, omega });
        (sensed, people)
    }

    /// Ticks on, and compares who is tracked now with who is to be seen.
    pub(super) fn drive(&mut self, ticks: usize) -> Drive {
        let (mut sum, mut seen, mut identities) = (0.0, 0, Identities::default());
        for _ in 0..ticks {
            let (sensed, people) = self.tick();
            let truth: Vec<(u32, Point2)> =
                (0..sensed.people.len()).map(|i| (sensed.people.id[i], sensed.people.position(i))).collect();
            let tracks: Vec<(u32, Point2)> =
                people.iter().filter(|p| p.age < 0.25).map(|p| (p.id, p.position)).collect();
            let places = |of: &[(u32, Point2)]| of.iter().map(|one| one.1).collect::<Vec<_>>();
            sum += ospa(&places(&truth), &places(&tracks));
            seen += truth.len();
            identities.take(&truth, &tracks);
        }
        Drive { ospa: sum / ticks as f64, switches: identities.switches, seen_s: 0.1 * seen as f64 }
    }
}
