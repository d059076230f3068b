use curionav_planning::geometry::Pose2;
use curionav_planning::occupancy::OccupancyGrid;

use super::*;
use crate::maps::Maps;

/// 20 m x 12 m at 0.1 m with outer walls, and a wall at x = 10 with a door of 2 m in its middle.
fn two_rooms() -> StaticMap {
    let cells = (0..200 * 120)
        .map(|i| {
            let (c, r) = (i % 200, i / 200);
            let outer = c == 0 || r == 0 || c == 199 || r == 119;
            if outer || (c == 100 && !(50..70).contains(&r)) { 100 } else { 0 }
        })
        .collect();
    StaticMap::new(OccupancyGrid::new(200, 120, 0.1, Pose2::default(), cells).unwrap())
}

fn scenario(crowds: &str) -> Scenario {
    let text = format!(
        "name = \"t\"\nmap = {{ file = \"m\" }}\n[robot]\nstart = [2, 6, 0]\ngoal = [18, 6]\n\
         [[walkers]]\nroute = [[4, 4], [8, 4]]\n{crowds}"
    );
    Scenario::from_toml(&text).unwrap()
}

const WALKERS: &str = "[[crowds]]\ncount = 25\nplaces = 3\nstretch_m = [2, 8]\nspeed = [0.4, 0.9]\n";
const GROUPS: &str = "[[crowds]]\ncount = 11\nbehaviour = \"stand\"\ngroup = [2, 4]\n";

fn starts(scenario: &Scenario) -> Vec<Point2> {
    scenario.walkers.iter().map(|w| WalkerState::new(w).position()).collect()
}

#[test]
fn the_seed_draws_the_people_and_nothing_else_does() {
    let (map, scenario) = (two_rooms(), scenario(&format!("{WALKERS}{GROUPS}")));
    let drawn = |seed| populated(&scenario, &map, seed).unwrap();
    assert_eq!(drawn(3), drawn(3));
    let (three, four) = (starts(&drawn(3)), starts(&drawn(4)));
    assert_eq!(three[0], four[0]);
    assert!(three.iter().zip(&four).skip(1).all(|(a, b)| a != b));
}

#[test]
fn every_seed_has_the_people_that_were_asked_for_where_they_have_room() {
    let (map, scenario) = (two_rooms(), scenario(&format!("{WALKERS}{GROUPS}")));
    let robot = &scenario.robot;
    for seed in 0..30 {
        let drawn = populated(&scenario, &map, seed).unwrap();
        drawn.check_on(&Maps::of(map.clone()), &map).unwrap();
        assert_eq!(drawn.walkers.len(), 1 + 25 + 11, "seed {seed}");
        for walker in &drawn.walkers[1..26] {
            assert_eq!((walker.mode, walker.route.len()), (WalkMode::BackAndForth, 3), "seed {seed}");
            assert!((0.4..=0.9).contains(&walker.speed), "seed {seed}");
            let stretches = walker.route.windows(2).map(|w| w[0].distance(w[1]));
            assert!(stretches.into_iter().all(|s| (2.0..=8.0).contains(&s)), "seed {seed}");
        }
        let starts = starts(&drawn);
        for (i, a) in starts.iter().enumerate() {
            assert!(starts[..i].iter().all(|b| a.distance(*b) >= 0.6 - 1e-12), "seed {seed}");
            let off = a.distance(robot.start.position()).min(a.distance(robot.goal));
            assert!(i == 0 || off >= 1.5, "seed {seed}: {off} m from start or goal");
        }
        for (k, a) in starts.iter().enumerate().skip(26) {
            let friend = (26..starts.len()).filter(|j| *j != k).map(|j| starts[j].distance(*a));
            // The last of an odd number may stand alone.
            let nearest = friend.fold(f64::INFINITY, f64::min);
            assert!(
                nearest < 0.86 || k + 1 == starts.len(),
                "seed {seed}: person {k} stands {nearest} m off"
            );
        }
        let standing: Vec<Point2> = starts[26..].to_vec();
        assert!(Floor::new(&scenario, &map).has_way_around(&standing), "seed {seed}");
    }
}

#[test]
fn groups_walk_side_by_side_and_a_share_of_the_people_is_heedless() {
    let map = two_rooms();
    let together =
        "[[crowds]]\ncount = 24\nspeed = [0.8, 1.6]\ngroup = [1, 3]\nstretch_m = [2, 8]\nheedless = 0.4\n";
    let scenario = scenario(together);
    let mut heedless = 0;
    let mut beside = 0;
    for seed in 0..20 {
        let drawn = populated(&scenario, &map, seed).unwrap();
        drawn.check_on(&Maps::of(map.clone()), &map).unwrap();
        assert_eq!(drawn.walkers.len(), 1 + 24, "seed {seed}");
        heedless += drawn.walkers.iter().filter(|walker| walker.heedless).count();
        for pair in drawn.walkers[1..].windows(2) {
            let apart = pair[0].route[0].distance(pair[1].route[0]);
            let same_pace = pair[0].speed == pair[1].speed && pair[0].start_offset == pair[1].start_offset;
            // Two bodies of half a metre and the gap between them.
            if same_pace {
                assert!((apart - 0.7).abs() < 1e-9, "seed {seed}: {apart}");
                beside += 1;
            }
        }
    }
    // 480 people, of whom each is heedless with a chance of 0.4, in groups of two on average.
    assert!((150..=234).contains(&heedless), "{heedless}");
    assert!((180..=300).contains(&beside), "{beside}");
}

#[test]
fn a_crowd_without_groups_and_heedless_people_is_drawn_as_before() {
    let map = two_rooms();
    let drawn = |more: &str| populated(&scenario(&format!("{WALKERS}{more}")), &map, 5).unwrap().walkers;
    assert_eq!(drawn(""), drawn("group = [1, 1]\nheedless = 0.0\n"));
    let all_heedless = drawn("heedless = 1.0\n");
    assert!(all_heedless[1..].iter().all(|walker| walker.heedless));
}

#[test]
fn people_walk_from_region_to_region() {
    let region = |x: f64| format!("{{ corners = [[{x}, 4], [{}, 4], [{}, 8], [{x}, 8]] }}", x + 2.0, x + 2.0);
    let regions = [region(1.0), region(9.0), region(16.0)].join(", ");
    let scenario = scenario(&format!("[[crowds]]\ncount = 20\nregions = [{regions}]\napart_m = 0.0\n"));
    let drawn = populated(&scenario, &two_rooms(), 5).unwrap();
    for walker in &drawn.walkers[1..] {
        for (corner, region) in walker.route.iter().zip(&scenario.crowds[0].regions) {
            assert!(contains(&region.corners, *corner), "{corner:?}");
        }
        assert_eq!(walker.route.len(), 3);
    }
    // They are anywhere on their way, half of them on the way back.
    let back = drawn.walkers[1..].iter().filter(|w| w.start_offset > 0.5 * w.cycle_length()).count();
    assert!((3..=17).contains(&back), "{back} of 20");
}

#[test]
fn a_crowd_without_room_says_how_many_found_some() {
    let small = "regions = [{ corners = [[4, 7], [6, 7], [6, 9], [4, 9]] }]";
    let standing = scenario(&format!("[[crowds]]\ncount = 40\nbehaviour = \"stand\"\n{small}\n"));
    let error = populated(&standing, &two_rooms(), 1).unwrap_err();
    assert_eq!(error.field, "crowds[0]");
    let placed: usize = error.problem.split(' ').nth(3).unwrap().parse().unwrap();
    // At 0.6 m from each other: between a coarse and the densest packing of four square metres.
    assert!((4..=14).contains(&placed), "{error}");

    let outside = scenario("[[crowds]]\ncount = 1\nregions = [{ corners = [[30, 7], [36, 7], [36, 9]] }]\n");
    assert_eq!(populated(&outside, &two_rooms(), 1).unwrap_err().field, "crowds[0].regions[0]");
}

#[test]
fn people_who_would_bar_every_way_are_an_error() {
    // Wherever three people stand in a door of two metres, none of the gaps is as wide as the robot.
    let door = "regions = [{ corners = [[9.6, 5], [10.4, 5], [10.4, 7], [9.6, 7]] }]";
    let crowd = scenario(&format!("[[crowds]]\ncount = 3\nbehaviour = \"stand\"\n{door}\n"));
    let error = populated(&crowd, &two_rooms(), 1).unwrap_err();
    assert_eq!(error.field, "crowds", "{error}");
}

#[test]
fn the_seed_draws_when_a_recording_begins() {
    let recorded =
        "[[recorded]]\nfile = \"f\"\nformat = \"text\"\nfps = 25\nstart_s = 20\nstart_until_s = 80\n";
    let (map, scenario) = (two_rooms(), scenario(recorded));
    let start = |seed| populated(&scenario, &map, seed).unwrap().recorded[0].start_s;
    let starts: Vec<f64> = (0..50).map(start).collect();
    assert!(starts.iter().all(|s| (20.0..80.0).contains(s)), "{starts:?}");
    assert!(starts.iter().any(|s| *s < 30.0) && starts.iter().any(|s| *s > 70.0), "{starts:?}");
    assert_eq!(start(7), starts[7]);
}
