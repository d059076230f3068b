//! What the tracker promises.

use std::collections::BTreeSet;

use curionav_crowdsim::scenario::{Motion, Scenario};
use curionav_planning::geometry::Point2;
use curionav_planning::numerics::sin_cos;
use curionav_tracking_people::{Person, TrackerParams};

use super::scene::{Bench, hall, scenario};

const CROWD: &str =
    "[[crowds]]\ncount = 12\nspeed = [0.4, 1.2]\n[[crowds]]\ncount = 3\nbehaviour = \"stand\"\n";
/// A localiser that is sure, and one that is not.
const BELIEFS: [[f64; 2]; 2] = [[0.03, 0.01], [0.2, 0.05]];

fn everywhere(_: f64, _: f64) -> bool {
    false
}

fn no_pillars(x: f64, y: f64) -> bool {
    (0.2..19.8).contains(&x) && (0.2..11.8).contains(&y)
}

/// A robot that sees half of what is around, among people who keep to their routes.
fn half_view(people: &str) -> Scenario {
    let mut scenario = scenario("disc", people);
    (scenario.laser.fov, scenario.laser.beams) = (std::f64::consts::PI, 361);
    scenario.people.motion = Motion::Scripted;
    scenario
}

#[test]
fn a_simulated_crowd_is_followed_to_three_decimetres_whatever_the_laser_sees_of_it() {
    for shape in ["disc", "legs"] {
        for sigma in BELIEFS {
            let (mut ospa, mut switches, mut seconds) = (0.0, 0, 0.0);
            let seeds = 1..=5;
            for seed in seeds.clone() {
                let scenario = scenario(shape, CROWD);
                let found = Bench::new(&scenario, hall(everywhere), hall(everywhere), sigma, seed).drive(300);
                eprintln!(
                    "{shape}, sigma {sigma:?}, seed {seed}: OSPA {:.3} m, {} switches",
                    found.ospa, found.switches
                );
                (ospa, switches, seconds) =
                    (ospa + found.ospa, switches + found.switches, seconds + found.seen_s);
            }
            let ospa = ospa / seeds.count() as f64;
            eprintln!(
                "{shape}, sigma {sigma:?}: OSPA {ospa:.3} m, {switches} switches in {seconds:.0} person-seconds"
            );
            assert!(ospa <= 0.3, "{shape}, sigma {sigma:?}: OSPA {ospa} m");
            // One change of identity in 20 seconds of being seen.
            assert!((switches as f64) < seconds / 20.0, "{shape}: {switches} in {seconds} s");
        }
    }
}

#[test]
fn a_wall_is_no_person_whether_the_map_has_it_or_not() {
    for sigma in BELIEFS {
        // The map does not know a stretch of the upper wall.
        let unknown = |x: f64, y: f64| (4.0..12.0).contains(&x) && y > 11.0;
        let scenario = scenario("disc", "");
        // What is seen of an unknown wall through a narrow gap may look like a person for a moment.
        for (known, most) in [(hall(everywhere), 0), (hall(unknown), 12)] {
            let mut bench = Bench::new(&scenario, hall(everywhere), known, sigma, 3);
            let ticks = (0..100).filter(|_| !bench.tick().1.is_empty()).count();
            assert!(ticks <= most, "sigma {sigma:?}: a person in {ticks} scans, at most {most}");
        }
    }
}

#[test]
fn a_person_who_stands_beside_a_wall_is_found() {
    for shape in ["disc", "legs"] {
        // 0.45 m from the wall's face to the centre.
        let one = "[[walkers]]\nroute = [[10.0, 11.45]]\nmode = \"stand\"\n";
        let mut bench = Bench::new(&scenario(shape, one), hall(everywhere), hall(everywhere), BELIEFS[0], 1);
        let found = (0..50).map(|_| bench.tick().1).filter(|people| {
            people.len() == 1
                && (people[0].position.x - 10.0).abs() < 0.3
                && (people[0].position.y - 11.45).abs() < 0.3
        });
        let found = found.count();
        assert!(found >= 45, "{shape}: {found} of 50");
    }
}

#[test]
fn a_person_who_stands_for_a_minute_stays_a_person() {
    for shape in ["disc", "legs"] {
        let mut seen = 0;
        let mut known = 0;
        // In the open, beside a wall, and beside a pillar.
        for [x, y] in [[11.0, 8.5], [10.0, 11.4], [9.9, 6.4]] {
            let one = format!("[[walkers]]\nroute = [[{x}, {y}]]\nmode = \"stand\"\n");
            let mut bench =
                Bench::new(&scenario(shape, &one), hall(everywhere), hall(everywhere), BELIEFS[0], 1);
            for tick in 0..600 {
                let (sensed, people) = bench.tick();
                let place = Point2::new(x, y);
                if tick >= 10 && !sensed.people.is_empty() {
                    seen += 1;
                    known += usize::from(people.iter().any(|person| person.position.distance(place) < 0.3));
                }
            }
        }
        println!("{shape}: a person in {known} of {seen} scans");
        assert!(seen > 900 && known * 100 >= seen * 95, "{shape}: {known} of {seen}");
    }
}

#[test]
fn a_person_who_touches_a_wall_is_found_on_every_side_of_it() {
    // 0.05 m from a pillar with corners at (10.5, 6.3) and (10.8, 6.6): before it, and beside it on either side.
    for [x, y] in [[10.2, 6.45], [10.65, 6.0], [10.65, 6.9]] {
        let mut scenario = half_view(&format!("[[walkers]]\nroute = [[{x}, {y}]]\nmode = \"stand\"\n"));
        scenario.laser.beams = 181;
        let mut bench = Bench::new(&scenario, hall(everywhere), hall(everywhere), BELIEFS[0], 1);
        let is_it =
            |people: &Vec<Person>| people.len() == 1 && people[0].position.distance(Point2::new(x, y)) < 0.2;
        let found = (0..50).map(|_| bench.tick().1).filter(is_it).count();
        // Taken for a part of the pillar it is found 41 times below and never above.
        assert!(found >= 45, "({x}, {y}): {found} of 50");
    }
}

#[test]
fn people_who_stand_do_not_walk_when_the_robot_turns() {
    let people: String = [[12.0, 6.5], [11.0, 9.0], [11.5, 3.0], [5.0, 7.5], [6.0, 3.5], [13.5, 8.0]]
        .map(|[x, y]| format!("[[walkers]]\nroute = [[{x}, {y}]]\nmode = \"stand\"\n"))
        .concat();
    for sigma in BELIEFS {
        let mut speeds = Vec::new();
        for seed in 1..=3 {
            let scenario = scenario("disc", &people);
            let mut bench = Bench::new(&scenario, hall(everywhere), hall(everywhere), sigma, seed);
            (0..10).for_each(|_| drop(bench.tick()));
            for _ in 0..60 {
                speeds
                    .extend(bench.tick().1.iter().map(|person| person.velocity.distance(Point2::default())));
            }
        }
        assert!(speeds.len() > 3 * 60 * 5, "{} of 1080", speeds.len());
        let rms = (speeds.iter().map(|speed| speed * speed).sum::<f64>() / speeds.len() as f64).sqrt();
        eprintln!("sigma {sigma:?}: {rms:.3} m/s");
        // With odometry alone, and a filter that knows only of walking, it is 0.17 m/s.
        assert!(rms <= 0.08, "sigma {sigma:?}: {rms} m/s");
    }
}

#[test]
fn a_person_at_the_edge_of_the_view_stands_where_it_stands() {
    // Half of it is out of view for a part of the time, beside a robot that turns to and fro.
    for [x, y] in [[8.3, 6.65], [8.15, 5.35], [8.3, 5.35]] {
        let one = format!("[[walkers]]\nroute = [[{x}, {y}]]\nmode = \"stand\"\n");
        let mut bench = Bench::new(&half_view(&one), hall(everywhere), hall(everywhere), BELIEFS[0], 1);
        let seen: Vec<_> = (0..60).flat_map(|_| bench.tick().1).filter(|person| person.age == 0.0).collect();
        let off = |person: &Person| person.position.distance(Point2::new(x, y));
        let worst = seen.iter().map(off).fold(0.0, f64::max);
        let fastest = seen.iter().map(|p| p.velocity.distance(Point2::default())).fold(0.0, f64::max);
        eprintln!("({x}, {y}): {} scans, {worst:.3} m, {fastest:.3} m/s", seen.len());
        assert!(seen.len() >= 10, "({x}, {y}): {} scans", seen.len());
        // Taken for a leg of its own it is up to 0.22 m off, and walks at up to 0.3 m/s.
        assert!(worst <= 0.12 && fastest <= 0.13, "({x}, {y}): {worst} m, {fastest} m/s");
    }
}

#[test]
fn a_person_is_known_after_three_scans_and_behind_another() {
    // One stands 3 m ahead; another walks from 5 m aside, behind the first, to the other side, 2 m farther away.
    let people = "[[walkers]]\nroute = [[11.0, 6.0]]\nmode = \"stand\"\n\
                  [[walkers]]\nroute = [[13.0, 3.0], [13.0, 9.0]]\nspeed = 1.0\nmode = \"once\"\n";
    let mut scenario = scenario("disc", people);
    scenario.people.motion = Motion::Scripted;
    let mut bench = Bench::new(&scenario, hall(no_pillars), hall(no_pillars), BELIEFS[0], 1);
    let mut counts = Vec::new();
    let mut ids = BTreeSet::new();
    for _ in 0..60 {
        let (_, people) = bench.tick();
        ids.extend(people.iter().map(|person| person.id));
        counts.push(people.len());
    }
    assert_eq!(counts[..4], [0, 0, 2, 2], "{counts:?}");
    assert!(counts[3..].iter().all(|count| *count == 2) && ids.len() == 2, "{counts:?} {ids:?}");
}

#[test]
fn a_person_out_of_view_is_remembered_as_long_as_its_place_is_known() {
    // One stands to the left and behind: in view while the robot has turned left, for 3 s not, then again.
    let followed = |people: &str| {
        let mut bench = Bench::new(&half_view(people), hall(everywhere), hall(everywhere), BELIEFS[0], 1);
        let known: Vec<Person> = (0..95).flat_map(|_| bench.tick().1).collect();
        let longest = known.iter().map(|person| person.age).fold(0.0, f64::max);
        (known, longest)
    };
    let (known, longest) = followed("[[walkers]]\nroute = [[7.5, 8.0]]\nmode = \"stand\"\n");
    let ids: BTreeSet<u32> = known.iter().map(|person| person.id).collect();
    let off = known.iter().map(|person| person.position.distance(Point2::new(7.5, 8.0))).fold(0.0, f64::max);
    eprintln!("stands: unseen for {longest:.1} s, off by {off:.2} m, {ids:?}");
    assert!(longest >= 2.0 && ids.len() == 1 && off <= 0.3, "{longest} s, {off} m, {ids:?}");
    // One comes towards the robot and passes it: where it is then is known for less long.
    let (known, passed) =
        followed("[[walkers]]\nroute = [[12.0, 7.0], [1.0, 7.0]]\nspeed = 1.0\nmode = \"once\"\n");
    let spread = known.iter().map(|person| person.position_covariance.trace()).fold(0.0, f64::max);
    eprintln!("walks: unseen for {passed:.1} s, sigma {:.2} m", (0.5 * spread).sqrt());
    assert!(passed >= 1.0 && passed < longest, "{passed} s, {longest} s");
    assert!((0.5 * spread).sqrt() <= TrackerParams::default().forget_sigma, "{spread} m2");
}

#[test]
fn a_person_who_is_not_where_it_should_be_seen_is_forgotten_after_half_a_second() {
    let in_a_world = |people: &str| {
        let mut bench = Bench::new(&half_view(people), hall(no_pillars), hall(no_pillars), BELIEFS[0], 1);
        let count = (0..20).map(|_| bench.tick().1.len()).last();
        (bench, count)
    };
    let (with, one) = in_a_world("[[walkers]]\nroute = [[11.0, 7.0]]\nmode = \"stand\"\n");
    let (mut without, none) = in_a_world("");
    assert_eq!((one, none), (Some(1), Some(0)));
    without.tracker = with.tracker;
    let counts: Vec<usize> = (0..7).map(|_| without.tick().1.len()).collect();
    assert_eq!(counts, [1, 1, 1, 1, 1, 0, 0]);
}

#[test]
fn the_same_scans_give_the_same_people_and_the_order_of_people_in_the_world_does_not_matter() {
    let crowd = |order: [usize; 4]| {
        let places = ["[10.0, 8.0]", "[10.5, 5.0]", "[6.5, 7.5]", "[12.0, 5.5]"];
        order.map(|i| format!("[[walkers]]\nroute = [{}]\nmode = \"stand\"\n", places[i])).concat()
    };
    let run = |order| {
        let scenario = scenario("disc", &crowd(order));
        let mut bench = Bench::new(&scenario, hall(everywhere), hall(everywhere), BELIEFS[1], 7);
        (0..20).map(|_| bench.tick().1).collect::<Vec<_>>()
    };
    let people = run([0, 1, 2, 3]);
    assert_eq!(people.last().unwrap().len(), 4);
    assert_eq!(run([0, 1, 2, 3]), people);
    assert_eq!(run([3, 1, 0, 2]), people);
}

#[test]
fn a_scan_with_forty_people_in_view_takes_three_milliseconds_at_most() {
    for shape in ["disc", "legs"] {
        // Around the robot at 9 degrees from each other, so that none hides another.
        let people: String = (0..40)
            .map(|k| {
                let (s, c) = sin_cos(std::f64::consts::TAU * f64::from(k) / 40.0);
                let distance = 3.2 + 0.3 * f64::from(k % 3);
                format!(
                    "[[walkers]]\nroute = [[{}, {}]]\nmode = \"stand\"\n",
                    8.0 + distance * c,
                    6.0 + distance * s
                )
            })
            .collect();
        let mut scenario = scenario(shape, &people);
        scenario.laser.beams = 1081;
        let mut bench = Bench::new(&scenario, hall(no_pillars), hall(no_pillars), BELIEFS[1], 1);
        (0..10).for_each(|_| drop(bench.tick()));
        let known = bench.tick().1.len();
        assert!(known >= 36, "{shape}: only {known} of 40 are known");
        // Other work on the machine only makes it slower.
        let fastest = (0..50).map(|_| bench.scan_time()).min().unwrap();
        println!("{shape}: {:.2} ms for a scan with {known} people", 1e3 * fastest.as_secs_f64());
        assert!(fastest.as_secs_f64() <= 3e-3, "{shape}: {fastest:?}");
    }
}
