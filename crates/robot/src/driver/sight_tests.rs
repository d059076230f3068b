use std::f64::consts::{FRAC_PI_2, PI, TAU};

use curionav_planning::occupancy::OccupancyGrid;
use curionav_schemas::Pose;

use super::*;

const RADIUS: f64 = 0.3;

/// A hall of 20 x 20 m, 0.1 m a cell, with walls all around.
fn hall() -> StaticMap {
    let is_wall = |i: usize| [i % 200, i / 200].iter().any(|at| *at < 2 || *at >= 198);
    let cells = (0..200 * 200).map(|i| if is_wall(i) { 100 } else { 0 }).collect();
    StaticMap::new(OccupancyGrid::new(200, 200, 0.1, Pose2::default(), cells).unwrap())
}

/// 4 m before the wall of the hall that lies in the direction of x, which the robot faces.
fn before_the_wall() -> Pose2 {
    Pose2::new(15.8, 10.0, 0.0)
}

/// What a good laser sees there: half a turn, a degree between beams, 10 m.
fn good(map: &StaticMap, stamp: f64) -> Scan {
    let pose = before_the_wall();
    let rays = RayCaster::new(map);
    let ranges: Vec<f32> = (0..181)
        .map(|i| {
            let bearing = -FRAC_PI_2 + PI * f64::from(i) / 180.0;
            let (sin, cos) = sin_cos(bearing);
            let range = rays.range((10.0 * pose.x, 10.0 * pose.y), (cos, sin), 100.0);
            range.map_or(10.0, |cells| 0.1 * cells) as f32
        })
        .collect();
    Scan {
        tick: 0,
        stamp,
        angle_min: -FRAC_PI_2,
        angle_increment: PI / 180.0,
        range_min: Some(0.1),
        range_max: 10.0,
        laser: Pose { x: 0.0, y: 0.0, heading: 0.0 },
        ranges: ranges.into(),
    }
}

type Spoils = fn(&mut Scan);

fn fill(scan: &mut Scan, range: f32) {
    scan.ranges.0.fill(range);
}

/// Makes of every beam for which `is_spoilt` one of this range.
fn spoil(scan: &mut Scan, range: f32, is_spoilt: fn(usize) -> bool) {
    scan.ranges.0.iter_mut().enumerate().filter(|(i, _)| is_spoilt(*i)).for_each(|(_, one)| *one = range);
}

/// Scans that show too little, and the reason that names it.
const BLIND: &[(Spoils, CommandReason)] = &[
    // One beam to the rear; a greatest range of 0.4 m; all at the greatest range. A laser 1,000 km away and an
    // increment of 0 are refused before; if they were not:
    (|s| (s.angle_min, s.ranges) = (PI, vec![3.0].into()), CommandReason::BlindNarrow),
    (|s| s.range_max = 0.4, CommandReason::BlindShort),
    (|s| fill(s, 10.0), CommandReason::BlindMap),
    (|s| s.angle_increment = 0.0, CommandReason::BlindNarrow),
    // As the gateway passes them on: all 0; all nearer than the least range; half of them no number; all -inf.
    (|s| fill(s, 0.0), CommandReason::BlindSilent),
    (|s| fill(s, 0.05), CommandReason::BlindSilent),
    (|s| spoil(s, f32::NAN, |i| i % 2 == 0), CommandReason::BlindSilent),
    (|s| fill(s, f32::NEG_INFINITY), CommandReason::BlindSilent),
    // Two beams, half a turn apart; beams 10 degrees apart; a quarter of a turn; a sixth of the increment.
    (|s| (s.angle_increment, s.ranges) = (PI, vec![4.0; 2].into()), CommandReason::BlindNarrow),
    (|s| (s.angle_increment, s.ranges) = (PI / 18.0, vec![4.0; 19].into()), CommandReason::BlindNarrow),
    (|s| s.ranges.0.truncate(91), CommandReason::BlindNarrow),
    (|s| s.angle_increment /= 6.0, CommandReason::BlindNarrow),
    // Reaches: of a toy, and one that falls short by a millimetre.
    (|s| s.range_max = 0.12, CommandReason::BlindShort),
    (|s| s.range_max = 2.999, CommandReason::BlindShort),
    // No number at all, in the half ahead and a bit, in all but the middle, in blocks; zeros mixed with NaN.
    (|s| fill(s, f32::NAN), CommandReason::BlindSilent),
    (|s| spoil(s, f32::NAN, |i| i < 92), CommandReason::BlindSilent),
    (|s| spoil(s, f32::NAN, |i| !(60..120).contains(&i)), CommandReason::BlindSilent),
    (|s| spoil(s, f32::NAN, |i| i % 20 < 11), CommandReason::BlindSilent),
    (|s| (0..181).for_each(|i| s.ranges.0[i] = [0.0, f32::NAN][i % 2]), CommandReason::BlindSilent),
    // A cover on the laser: 0.15 m away, 0.29 m; a hood over two thirds of it.
    (|s| fill(s, 0.15), CommandReason::BlindSilent),
    (|s| fill(s, 0.29), CommandReason::BlindSilent),
    (|s| spoil(s, 0.2, |i| i % 3 > 0), CommandReason::BlindSilent),
    // Infinite, or beyond the greatest range, everywhere, and but for two beams that meet something.
    (|s| fill(s, f32::INFINITY), CommandReason::BlindMap),
    (|s| fill(s, 65.533), CommandReason::BlindMap),
    (|s| spoil(s, 10.0, |i| i != 90 && i != 91), CommandReason::BlindMap),
    // Free, and what is not is no number; a pillar of mist at the edge.
    (|s| (0..181).for_each(|i| s.ranges.0[i] = [10.0, 10.0, f32::NAN][i % 3]), CommandReason::BlindMap),
    (|s| spoil(s, 10.0, |i| i > 8), CommandReason::BlindMap),
];

/// A place that is known as well as a localiser knows it that has seen its walls.
fn known(map: &StaticMap, pose: Pose2) -> OnMap<'_> {
    OnMap { map, pose, position_sigma: 0.07, heading_sigma: 0.03 }
}

fn view(map: &StaticMap) -> View<'_> {
    View { radius: RADIUS, tick_s: 0.1, on_map: Some(known(map, before_the_wall())) }
}

#[test]
fn a_scan_that_shows_too_little_is_named_and_a_good_one_again_is_driven_by() {
    let map = hall();
    let view = view(&map);
    for (case, (spoils, reason)) in BLIND.iter().enumerate() {
        let mut sight = Sight::new(ScannerLimits::default());
        let mut judge = |tick: u32, spoilt: bool| {
            let mut scan = good(&map, 0.1 * f64::from(tick));
            if spoilt {
                spoils(&mut scan);
            }
            sight.judge(&scan, &view)
        };
        assert!((0..20).all(|tick| judge(tick, false).is_none()), "case {case}: blind before");
        let found: Vec<_> = (20..30).map(|tick| judge(tick, true).map(|blind| blind.reason)).collect();
        // The map is held against the third scan on: 0.3 s.
        assert!(found[3..].iter().all(|one| *one == Some(*reason)), "case {case}: {found:?}");
        assert!(*reason == CommandReason::BlindMap || found[0] == Some(*reason), "case {case}: {found:?}");
        assert!((30..40).all(|tick| judge(tick, false).is_none()), "case {case}: does not go on");
    }
    assert!(BLIND.len() >= 27);
}

#[test]
fn scans_that_come_too_rarely_are_blind() {
    let map = hall();
    let view = view(&map);
    let verdicts = |every: f64, count: u32| -> Vec<bool> {
        let mut sight = Sight::new(ScannerLimits::default());
        (0..count).map(|i| sight.judge(&good(&map, every * f64::from(i)), &view).is_some()).collect()
    };
    // 10, 5 and 4.2 scans per second are enough, 3 are not, once they have been counted for a second.
    for every in [0.1, 0.2, 0.238] {
        assert!(verdicts(every, 40).into_iter().all(|blind| !blind), "every {every} s");
    }
    assert_eq!(verdicts(0.333, 8)[4..], [true; 4]);
    // A base of 2 ticks per second cannot give more.
    let mut sight = Sight::new(ScannerLimits::default());
    let slow = View { tick_s: 0.5, ..view };
    assert!((0..10).all(|i| sight.judge(&good(&map, 0.5 * f64::from(i)), &slow).is_none()));
}

#[test]
fn neither_a_pause_nor_a_clock_that_begins_anew_is_a_rare_scan() {
    let map = hall();
    let view = view(&map);
    let mut sight = Sight::new(ScannerLimits::default());
    for begin in [100.0, 160.0, 0.0] {
        assert!((0..20).all(|i| sight.judge(&good(&map, begin + 0.1 * f64::from(i)), &view).is_none()));
    }
}

#[test]
fn what_a_robot_meets_on_its_way_does_not_make_it_blind() {
    let map = hall();
    let view = view(&map);
    let tolerable: [Spoils; 7] = [
        |_| {},
        // A fifth of the beams fails, or two fifths.
        |s| spoil(s, f32::NAN, |i| i % 5 == 0),
        |s| spoil(s, 0.0, |i| i % 5 < 2),
        // A crowd all around; a post of the robot itself; a glass front ahead; a door that stands open.
        |s| fill(s, 0.6),
        |s| spoil(s, 0.1, |i| i < 30),
        |s| spoil(s, 10.0, |i| (60..120).contains(&i)),
        |s| spoil(s, 7.0, |i| (80..100).contains(&i)),
    ];
    for (case, spoils) in tolerable.iter().enumerate() {
        let mut sight = Sight::new(ScannerLimits::default());
        for tick in 0..30 {
            let mut scan = good(&map, 0.1 * f64::from(tick));
            spoils(&mut scan);
            assert_eq!(sight.judge(&scan, &view), None, "case {case}");
        }
    }
    // In the open nothing is in range, and nothing is what it shows.
    let open = StaticMap::new(OccupancyGrid::new(10, 10, 10.0, Pose2::default(), vec![0; 100]).unwrap());
    let mut sight = Sight::new(ScannerLimits::default());
    for tick in 0..30 {
        let mut scan = good(&map, 0.1 * f64::from(tick));
        fill(&mut scan, f32::INFINITY);
        let view = View { on_map: Some(known(&open, Pose2::new(50.0, 50.0, 0.0))), ..view };
        assert_eq!(sight.judge(&scan, &view), None);
    }
}

#[test]
fn a_belief_a_little_off_does_not_make_a_good_scan_blind() {
    let map = hall();
    let scan = good(&map, 0.0);
    for k in 0..16 {
        let (sin, cos) = sin_cos(TAU * f64::from(k) / 16.0);
        let pose = Pose2::new(15.8 + 0.7 * cos, 10.0 + 0.7 * sin, 0.3 * sin);
        let mut sight = Sight::new(ScannerLimits::default());
        let view = View { on_map: Some(known(&map, pose)), ..view(&map) };
        assert!(
            (0..10)
                .all(|i| sight.judge(&Scan { stamp: 0.1 * f64::from(i), ..scan.clone() }, &view).is_none())
        );
    }
}

#[test]
fn the_less_is_known_of_the_place_the_more_walls_have_to_be_missed() {
    let map = hall();
    let blind_at = |position_sigma: f64, heading_sigma: f64| {
        let mut sight = Sight::new(ScannerLimits::default());
        let place = OnMap { position_sigma, heading_sigma, ..known(&map, before_the_wall()) };
        let view = View { on_map: Some(place), ..view(&map) };
        (0..10).any(|tick| {
            let mut scan = good(&map, 0.1 * f64::from(tick));
            fill(&mut scan, 10.0);
            sight.judge(&scan, &view).is_some()
        })
    };
    // As at a start, where the wall is 4 m away and the laser sees 10 m; and anywhere in the hall.
    assert!(blind_at(0.7, 0.26));
    assert!(!blind_at(5.0, 0.26) && !blind_at(0.7, 3.0));
}
