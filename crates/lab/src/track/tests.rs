use curionav_crowdsim::{Scenario, World};
use curionav_localization::LocalizerParams;
use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::motion::OdometryNoise;
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};

use super::*;
use crate::robot_log::drive_arguments::Start;
use crate::robot_log::{Faults, Log, Reading};

/// A hall of 20 m x 12 m with outer walls and pillars.
fn hall() -> StaticMap {
    let width = 400;
    let height = 240;
    let cells = (0..width * height).map(|i| {
        let c = i % width;
        let r = i / width;
        let outer = c < 2 || r < 2 || c >= width - 2 || r >= height - 2;
        let pillar = (c / 6) % 16 == 3 && (r / 6) % 13 == 8;
        if outer || pillar { 100 } else { 0 }
    });
    StaticMap::new(OccupancyGrid::new(width, height, 0.05, Pose2::default(), cells.collect()).unwrap())
}

/// The log of a robot that turns to and fro for 20 s among six people who walk about, and who is truly to be seen.
fn crowd(way: Way) -> (Drive, Annotated) {
    let scenario = Scenario::from_toml(
        "name = \"hall\"\nmap = { file = \"hall.yaml\" }\n\
         [robot]\nstart = [8.0, 6.0, 0.0]\ngoal = [17.0, 6.0]\nstart_noise = 0.0\n\
         [laser]\nfov = 6.283185307179586\nbeams = 720\nrange_max = 8.0\n\
         [perception]\npeople = \"laser\"\n\
         [people]\nmotion = \"hrvo\"\n\
         [[crowds]]\ncount = 6\nspeed = [0.4, 1.2]\n",
    );
    let scenario = scenario.unwrap();
    let mut world = World::new(&scenario, hall(), vec![], 1).unwrap();
    let mut readings = Vec::new();
    let mut annotated = Annotated::default();
    for tick in 0..200 {
        let sensed = world.observe();
        let truth = world.truth().pose;
        readings.push(Reading {
            stamp: sensed.stamp,
            ranges: sensed.ranges.clone(),
            laser: scenario.laser,
            odometry: sensed.odometry,
            reference: Some(truth),
        });
        let people = (0..sensed.people.len()).map(|i| sensed.people.position(i)).collect();
        // The first second is left to the tracker: it needs three scans to be sure.
        if tick >= 10 {
            annotated.scans.insert(tick, people);
        }
        let omega = if (tick / 30) % 2 == 0 { 0.3 } else { -0.3 };
        world.step(Twist { v: 0.2, omega });
    }
    let log = Log::of(readings, Faults::default());
    let start = Start::At(log.readings[0].reference.unwrap());
    let given = Given {
        log,
        delay_s: 0.0,
        references_are: "the truth".into(),
        map: hall(),
        start,
        params: LocalizerParams::default(),
        noise: OdometryNoise::default(),
    };
    (Drive { given, way, params: TrackerParams::default(), seed: 1 }, annotated)
}

#[test]
fn people_who_are_simulated_are_found_by_each_way_to_the_robots_place() {
    for way in [Way::Localizer, Way::References, Way::Odometry] {
        let (drive, annotated) = crowd(way);
        let course = Course::of(&drive, |_| {}).unwrap();
        let score = Judgement::of(&course, &annotated, Frame::Map).score();
        let figures = serde_json::to_value(&score).unwrap();
        println!("{way:?}: {figures}");
        assert!(figures["recall"].as_f64().unwrap() > 0.9, "{way:?}: {figures}");
        assert!(figures["precision"].as_f64().unwrap() > 0.9, "{way:?}: {figures}");
        assert!(figures["ospa_m"].as_f64().unwrap() < 0.3, "{way:?}: {figures}");
    }
}
