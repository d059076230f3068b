use std::fmt::Write;

use curionav_crowdsim::{Scenario, World};
use curionav_deployment::files::MapFiles;
use curionav_localization::LocalizerParams;
use curionav_planning::geometry::Twist;
use curionav_planning::motion::OdometryNoise;
use curionav_planning::random::{rng, uniform};

use super::drive::{Consistency, Errors, Filter, Start};
use super::*;
use crate::robot_log::arguments::pose;
use crate::robot_log::carmen::Scanner;
use crate::robot_log::robot_file::RobotFile;
use crate::robot_log::{Faults, carmen};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios");

/// The foyer of `quickstart`, and the log of a robot that drives about in it for 100 s, as Carmen writes it.
fn foyer(old_style: bool) -> (StaticMap, Vec<String>) {
    let text = std::fs::read_to_string(format!("{FOLDER}/quickstart.toml")).unwrap();
    let mut scenario = Scenario::from_toml(&text).unwrap();
    scenario.walkers.truncate(2);
    let map = MapFiles::read(&Path::new(FOLDER).join("maps/quickstart.yaml")).unwrap();
    let map = StaticMap::new(map.grid().unwrap());
    let mut world = World::new(&scenario, map.clone(), vec![], 1).unwrap();
    let mut lines = Vec::new();
    let mut random = rng(3, 0);
    let mut turn = 0.0;
    for tick in 0..1000 {
        let seen = world.observe();
        let truth = world.truth();
        let o = seen.odometry;
        let t = truth.pose;
        let stamp = 1e9 + seen.stamp;
        let mut line = String::new();
        if old_style {
            write!(line, "FLASER {}", seen.ranges.len()).unwrap();
            seen.ranges.iter().for_each(|range| write!(line, " {range:.3}").unwrap());
            write!(line, " {} {} {} {} {} {}", t.x, t.y, t.heading, o.x, o.y, o.heading).unwrap();
        } else {
            lines.push(format!("ODOM {} {} {} 0 0 0 {stamp} nohost {stamp}", o.x, o.y, o.heading));
            let laser = scenario.laser;
            let step = laser.bearing(1) - laser.bearing(0);
            write!(
                line,
                "ROBOTLASER1 0 {} {} {step} 5.0 0.01 0 {}",
                laser.bearing(0),
                laser.fov,
                laser.beams
            )
            .unwrap();
            seen.ranges.iter().for_each(|range| write!(line, " {range:.3}").unwrap());
            write!(line, " 0 {} {} {} {} {} {} 0 0 0 0 0", t.x, t.y, t.heading, t.x, t.y, t.heading).unwrap();
        }
        lines.push(format!("{line} {stamp} nohost {stamp}"));
        if tick % 25 == 0 {
            turn = 1.6 * uniform(&mut random) - 0.8;
        }
        // Away from what is near ahead.
        let ahead = &seen.ranges[60..121];
        let near = ahead.iter().copied().fold(f32::INFINITY, f32::min) < 1.2;
        world.step(if near { Twist { v: 0.0, omega: 0.9 } } else { Twist { v: 0.7, omega: turn } });
    }
    (map, lines)
}

fn parsed(lines: &[String]) -> Log {
    carmen::parse(&lines.join("\n"), Scanner { range_max: 5.0, robot_from_laser: None }).unwrap()
}

fn filter() -> Filter {
    Filter { params: LocalizerParams::default(), noise: OdometryNoise::default(), seed: 1 }
}

/// Errors of the localiser and of odometry alone, and the consistency of the covariances.
fn judged(log: &Log, map: &StaticMap, start: Start) -> (Errors, Errors, Consistency) {
    let track = Track::of(log, map, start, filter(), |_| {}).unwrap();
    let references: Vec<Pose2> = log.readings.iter().map(|reading| reading.reference.unwrap()).collect();
    let pairs =
        |poses: &[Pose2]| -> Vec<_> { poses.iter().copied().zip(references.iter().copied()).collect() };
    let alone = by_odometry(log, &track);
    let estimates = pairs(&track.poses);
    let consistency = Consistency::of(&estimates, &track.covariances).unwrap();
    (Errors::of(&estimates).unwrap(), Errors::of(&pairs(&alone)).unwrap(), consistency)
}

#[test]
fn from_a_known_start_the_error_stays_small_where_that_of_odometry_grows() {
    for old_style in [true, false] {
        let (map, lines) = foyer(old_style);
        let log = parsed(&lines);
        assert_eq!((log.readings.len(), &log.faults), (1000, &Faults::default()));
        let start = Start::At(log.readings[0].reference.unwrap());
        let (filter, alone, consistency) = judged(&log, &map, start);
        println!("old style {old_style}: {filter:?}\n{alone:?}\n{consistency:?}");
        assert!(filter.median_m < 0.1 && filter.p95_m < 0.25 && filter.at_end_m < 0.3, "{filter:?}");
        assert!(alone.at_end_m > 2.0 * filter.p95_m, "{alone:?}");
        assert!(consistency.mean < 6.0 && consistency.share_within_95 > 0.8, "{consistency:?}");
    }
}

#[test]
fn from_anywhere_it_finds_the_place_and_keeps_it() {
    let (map, lines) = foyer(true);
    let (filter, ..) = judged(&parsed(&lines), &map, Start::Anywhere);
    assert!(filter.at_end_m < 0.3 && filter.median_m < 0.2, "{filter:?}");
}

#[test]
fn broken_lines_gaps_restarts_and_clocks_that_are_set_back_are_survived() {
    let (map, mut lines) = foyer(true);
    // Odometry begins anew at line 300, the clock goes back an hour at 500, 3 s are missing from 700 on, every
    // fiftieth line is cut off, and two lines stand in each other's place.
    let restart = parsed(&lines).readings[300].odometry;
    for (k, line) in lines.iter_mut().enumerate().skip(300) {
        let mut words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        let at = words.len() - 6;
        let number = |word: &String| word.parse::<f64>().unwrap();
        let raw = Pose2::new(number(&words[at]), number(&words[at + 1]), number(&words[at + 2]));
        // Far enough from where it was that it cannot be a step.
        let anew = Pose2::new(50.0, 0.0, 0.0).compose(restart.relative(raw));
        for (word, value) in words[at..].iter_mut().zip([anew.x, anew.y, anew.heading]) {
            *word = value.to_string();
        }
        if k >= 500 {
            let stamp = number(&words[at + 3]) - 3600.0;
            words[at + 3] = stamp.to_string();
        }
        *line = words.join(" ");
    }
    lines.drain(700..730);
    lines.swap(800, 801);
    let mut cut = 0;
    let mut whole = Vec::new();
    for (k, line) in lines.into_iter().enumerate() {
        cut += usize::from(k % 50 == 49);
        whole.push(if k % 50 == 49 { line[..line.len() / 2].to_owned() } else { line });
    }
    let log = parsed(&whole);
    let expected = Faults {
        broken_lines: cut,
        first_broken: log.faults.first_broken.clone(),
        disordered_scans: 1,
        clock_set_back: 1,
        gaps: 1,
        odometry_restarts: 1,
        without_clock: false,
        later_runs: 0,
    };
    assert_eq!(log.faults, expected);
    assert!(log.faults.first_broken.as_deref().is_some_and(|first| first.starts_with("line 50: ")));
    let (filter, ..) = judged(&log, &map, Start::At(log.readings[0].reference.unwrap()));
    assert!(filter.at_end_m < 0.3 && filter.p95_m < 0.4, "{filter:?}");
}

#[test]
fn the_picture_shows_all_three_tracks() {
    let (map, lines) = foyer(true);
    let log = parsed(&lines);
    let start = Start::At(log.readings[0].reference.unwrap());
    let track = Track::of(&log, &map, start, filter(), |_| {}).unwrap();
    let drawn = picture(&map, &log, &track, &by_odometry(&log, &track));
    assert!(["localiser", "reference", "odometry alone"].iter().all(|name| drawn.contains(name)));
}

#[test]
fn poses_are_three_numbers() {
    assert_eq!(pose("1.5, -2,0"), Ok(Pose2::new(1.5, -2.0, 0.0)));
    for wrong in ["", "1,2", "1,2,3,4", "1,x,3", "nan,0,0"] {
        assert!(pose(wrong).is_err(), "{wrong}");
    }
}

/// The same drive, with scans that come so many readings late.
fn late(log: &Log, readings: usize) -> Log {
    let mut late = log.clone();
    for (k, reading) in late.readings.iter_mut().enumerate() {
        reading.ranges = log.readings[k.saturating_sub(readings)].ranges.clone();
    }
    late
}

fn drive_of(log: Log, map: StaticMap, delay_s: f64) -> Drive {
    let start = Start::At(log.readings[0].reference.unwrap());
    Drive {
        log_name: "log".into(),
        map_name: None,
        picture: String::new(),
        references_are: String::new(),
        params: LocalizerParams::default(),
        noise: filter().noise,
        log,
        delay_s,
        map,
        start,
    }
}

#[test]
fn a_fit_finds_the_delay_of_the_laser_and_the_noise_of_odometry() {
    let (map, lines) = foyer(false);
    let log = parsed(&lines);
    let simulated = OdometryNoise::default();
    for (readings, delay) in [(0, 0.0), (1, 0.1), (2, 0.2)] {
        let drive = drive_of(late(&log, readings), map.clone(), 0.0);
        let found = Fitted::of(&drive, 1, |_| {}).unwrap();
        println!("{delay} s late: {found:?}");
        let told = found.delay_s.unwrap();
        assert!((told - delay).abs() <= 0.03, "{delay}: {found:?}");
        assert!((0.98..1.02).contains(&found.odometry_scale), "{found:?}");
        assert!(found.laser.position().distance(Default::default()) < 0.1, "{found:?}");
        let heading = found.noise.heading_per_metre + found.noise.heading_per_radian;
        let share = heading / (simulated.heading_per_metre + simulated.heading_per_radian);
        assert!((0.2..5.0).contains(&share), "{found:?}");
        let aware = drive_of(late(&log, readings), map.clone(), told);
        let track = aware.track(1, |_| {}).unwrap();
        let pairs: Vec<_> =
            track.poses.iter().zip(&log.readings).map(|(pose, r)| (*pose, r.reference.unwrap())).collect();
        let consistency = Consistency::of(&pairs, &track.covariances).unwrap();
        println!("{consistency:?}");
        assert!(consistency.mean < 4.0, "{delay}: {consistency:?}");
    }
}

#[test]
fn what_a_fit_writes_is_read_as_the_robots_file() {
    let noise = OdometryNoise { position_per_metre: 0.02, ..OdometryNoise::default() };
    let fitted = Fitted { noise, delay_s: Some(0.125), laser: Pose2::default(), odometry_scale: 1.01 };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r1.toml");
    std::fs::write(&path, fitted.toml("a.log")).unwrap();
    let read = RobotFile::read(&path).unwrap();
    assert_eq!((read.noise, read.delay_s), (noise, 0.125));
    std::fs::write(&path, "[scanner]\ndelay_s = -1.0\n").unwrap();
    let error = RobotFile::read(&path).err().unwrap().to_string();
    assert!(error.contains("r1.toml") && error.contains("scanner.delay_s"), "{error}");
}
