//! What is real and on no map.

use curionav_planning::occupancy::OccupancyGrid;

use super::*;

const FORWARD: Twist = Twist { v: 1.0, omega: 0.0 };

/// An empty floor of 10 m x 6 m, with a wall at x = 8 that goes across it.
fn floor() -> StaticMap {
    let cells = (0..6000).map(|i| if i % 100 == 80 { 100 } else { 0 }).collect();
    StaticMap::new(OccupancyGrid::new(100, 60, 0.1, Pose2::default(), cells).unwrap())
}

/// A robot at (2, 3) that looks along x, whose laser has no noise, in a world with `what` besides the map.
fn scenario(what: &str) -> Scenario {
    Scenario::from_toml(&format!(
        "name = \"open\"\nmap = {{ file = \"m\" }}\nlaser = {{ range_sigma = 0.0, range_max = 8.0 }}\n\
         [robot]\nstart = [2, 3, 0]\ngoal = [4, 3]\nstart_noise = 0.0\n{what}\n"
    ))
    .unwrap()
}

fn world(what: &str) -> World {
    World::new(&scenario(what), floor(), Vec::new(), 1).unwrap()
}

/// What the laser's middle beam says.
fn ahead(world: &World) -> f32 {
    world.observe().ranges[90]
}

fn drive(world: &mut World, ticks: usize) {
    (0..ticks).for_each(|_| world.step(FORWARD));
}

#[test]
fn a_thing_is_solid_and_seen_and_on_no_map() {
    for (outline, face) in [
        ("size = [1.0, 2.0]", 4.5),
        ("radius = 0.5", 4.5),
        ("corners = [[-0.2, -1.0], [0.3, -1.0], [-0.2, 1.0]]", 4.8),
    ] {
        let mut world = world(&format!("[[world.objects]]\nat = [5, 3, 0]\n{outline}"));
        assert!((f64::from(ahead(&world)) - (face - 2.0)).abs() < 1e-6, "{outline}: {}", ahead(&world));
        drive(&mut world, 60);
        let truth = world.truth();
        assert!((truth.pose.x - (face - 0.3)).abs() < 1e-6, "{outline}: {:?}", truth.pose);
        assert!(truth.wall_clearance.abs() < 1e-6);
        assert_eq!(world.map().grid.cells(), floor().grid.cells());
    }
}

#[test]
fn what_is_low_is_solid_and_not_seen() {
    let mut world = world("[[world.objects]]\nat = [4, 3, 0]\nsize = [0.4, 0.4]\nlow = true");
    assert!((ahead(&world) - 6.0).abs() < 1e-5, "{}", ahead(&world));
    drive(&mut world, 60);
    assert!((world.truth().pose.x - 3.5).abs() < 1e-6);
}

#[test]
fn glass_lets_its_share_of_beams_pass_drawn_anew_each_scan() {
    let mut world = world("[[world.objects]]\nat = [4, 3, 0]\nsize = [0.4, 6.0]\nglass = 0.7");
    let mut passed = 0;
    for _ in 0..1000 {
        passed += u32::from(ahead(&world) > 3.0);
        world.step(Twist::default());
    }
    assert!((650..750).contains(&passed), "{passed} of 1000");
    assert_eq!(world.observe(), world.observe(), "looking twice sees the same");
}

#[test]
fn where_a_wall_is_gone_the_robot_sees_and_drives_through() {
    let gap = "world = { openings = [{ corners = [[7.5, 2], [8.5, 2], [8.5, 4], [7.5, 4]] }] }";
    let text = format!("{gap}\n{}", scenario("").to_toml().unwrap());
    let mut world = World::new(&Scenario::from_toml(&text).unwrap(), floor(), Vec::new(), 1).unwrap();
    assert_eq!(ahead(&world), 8.0);
    drive(&mut world, 75);
    assert!(world.truth().pose.x > 8.2 && world.truth().wall_impact.is_none(), "{:?}", world.truth());
}

#[test]
fn a_thing_comes_and_goes_at_its_times_and_not_onto_the_robot() {
    let mut here = world("[[world.objects]]\nat = [4, 3, 0]\nradius = 0.3\nfrom_s = 1.0\nuntil_s = 2.0");
    let mut seen = Vec::new();
    for _ in 0..25 {
        seen.push(ahead(&here) < 3.0);
        here.step(Twist::default());
    }
    let expected: Vec<bool> = (0..25).map(|tick| (10..20).contains(&tick)).collect();
    assert_eq!(seen, expected);
    let mut under = world("[[world.objects]]\nat = [2.2, 3, 0]\nradius = 0.3\nfrom_s = 0.5");
    drive(&mut under, 30);
    let behind = under.around.distance(Point2::new(2.2, 3.0));
    assert!(under.truth().pose.x > 3.0 && behind == 0.0, "it comes once the robot has left");
}

#[test]
fn a_trolley_is_pushed_to_and_fro_and_waits_for_the_robot() {
    let trolley = "[[world.objects]]\nat = [5, 1, 0]\nsize = [0.8, 0.4]\nroute = [[5, 5]]\nspeed = 1.0";
    let mut world = world(trolley);
    let mut ranges = Vec::new();
    for _ in 0..80 {
        world.step(Twist::default());
        ranges.push(ahead(&world));
    }
    // It goes across the robot's view, 0.4 m wide, twice.
    let crossings = ranges.windows(2).filter(|pair| pair[0] > 5.0 && pair[1] < 3.0).count();
    assert!(crossings == 2 && ranges.iter().all(|r| *r > 2.79), "{ranges:?}");
    for _ in 0..100 {
        world.step(FORWARD);
        assert!(world.truth().wall_clearance >= 0.0, "it is pushed into the robot");
    }
}

#[test]
fn people_walk_around_what_stands_on_no_map() {
    let walker = "[people]\nmotion = \"hrvo\"\n[[walkers]]\nroute = [[3, 5], [7, 5]]\n\
                  [[world.objects]]\nat = [5, 5.2, 0]\nsize = [0.6, 0.6]";
    let fault = World::new(&scenario(walker), floor(), Vec::new(), 1).unwrap_err();
    assert_eq!(fault.field, "walkers[0].route[0]", "{fault}");
    let mut later = world(&walker.replace("size", "from_s = 0.5\nsize"));
    for _ in 0..300 {
        later.step(Twist::default());
        assert!(later.around.distance(later.people().position(0)) > 0.1);
    }
}

#[test]
fn a_carried_robot_is_elsewhere_and_its_odometry_is_not() {
    let mut world = world("[[world.events]]\nat_s = 1.0\ncarried_to = [4.0, 1.0, 1.5]");
    drive(&mut world, 9);
    let before = world.observe().odometry;
    drive(&mut world, 1);
    assert_eq!(world.truth().pose, Pose2::new(4.0, 1.0, 1.5));
    assert!(world.observe().odometry.position().distance(before.position()) < 0.1);
    let into_a_wall = "[[world.events]]\nat_s = 1.0\ncarried_to = [8.0, 1.0, 1.5]";
    let fault = World::new(&scenario(into_a_wall), floor(), Vec::new(), 1).unwrap_err();
    assert_eq!(fault.field, "world.events[0].carried_to");
}

#[test]
fn a_laser_fails_from_its_event_on() {
    let events = "[[world.events]]\nat_s = 0.5\nlaser = { silent_share = 1.0 }\n\
                  [[world.events]]\nat_s = 1.0\nlaser = { moved = [0.5, 0.0, 0.0] }\n\
                  [[world.events]]\nat_s = 1.5\nlaser = { noise_m = 0.2 }\n\
                  [[world.events]]\nat_s = 2.0\nlaser = {}";
    let mut world = world(events);
    let mut seen = Vec::new();
    for _ in 0..25 {
        seen.push(ahead(&world));
        world.step(Twist::default());
    }
    assert!(seen[..5].iter().all(|r| (r - 6.0).abs() < 1e-5));
    assert!(seen[5..10].iter().all(|r| r.is_nan()));
    assert!(seen[10..15].iter().all(|r| (r - 5.5).abs() < 1e-5), "{seen:?}");
    assert!(seen[15..20].iter().all(|r| (r - 6.0).abs() > 1e-4 && (r - 6.0).abs() < 1.0), "{seen:?}");
    assert!(seen[20..].iter().all(|r| (r - 6.0).abs() < 1e-5));
}

#[test]
fn a_late_scan_shows_what_was() {
    let mut world = world("[laser_faults]\nlate_s = 0.3");
    let mut places = Vec::new();
    for tick in 0..40_usize {
        places.push(world.truth().pose.x);
        let then = places[tick.saturating_sub(3)];
        assert!((f64::from(ahead(&world)) - (8.0 - then)).abs() < 1e-5, "tick {tick}");
        world.step(FORWARD);
    }
}

#[test]
fn what_makes_no_sense_is_refused_with_its_field() {
    for (what, field) in [
        ("[[world.objects]]\nat = [4, 3, 0]", "world.objects[0]"),
        ("[[world.objects]]\nat = [4, 3, 0]\nradius = 0.2\nsize = [1, 1]", "world.objects[0]"),
        ("[[world.objects]]\nat = [4, 3, 0]\nsize = [1, 1, 1]", "world.objects[0].size"),
        ("[[world.objects]]\nat = [4, 3, 0]\ncorners = [[0, 0], [0, 1], [1, 0]]", "world.objects[0].corners"),
        (
            "[[world.objects]]\nat = [4, 3, 0]\nradius = 0.2\nfrom_s = 3.0\nuntil_s = 2.0",
            "world.objects[0].until_s",
        ),
        ("[[world.events]]\nat_s = 1.0", "world.events[0]"),
        (
            "[[world.events]]\nat_s = 2.0\nlaser = {}\n[[world.events]]\nat_s = 1.0\nlaser = {}",
            "world.events[1].at_s",
        ),
    ] {
        let text = format!(
            "name = \"open\"\nmap = {{ file = \"m\" }}\n[robot]\nstart = [2, 3, 0]\ngoal = [4, 3]\n{what}\n"
        );
        let fault = Scenario::from_toml(&text).unwrap_err();
        assert_eq!(fault.field, field, "{fault}");
        assert!(fault.line.is_some(), "{fault}");
    }
    let through_a_wall = "[[world.objects]]\nat = [5, 1, 0]\nradius = 0.3\nroute = [[5, 2], [9, 2]]";
    let fault = World::new(&scenario(through_a_wall), floor(), Vec::new(), 1).unwrap_err();
    assert_eq!(fault.field, "world.objects[0].route");
    let onto_it = "[[world.objects]]\nat = [2.2, 3, 0]\nradius = 0.3";
    let fault = World::new(&scenario(onto_it), floor(), Vec::new(), 1).unwrap_err();
    assert_eq!(fault.field, "robot.start");
}

#[test]
fn a_person_behind_a_wall_is_the_nearest_but_in_view_only_where_the_wall_is_gone() {
    let people = People::walking(0.25, &[[8.6, 3.0, 0.0, 0.0], [7.7, 1.0, 0.0, 0.0]]);
    let mut world = world("");
    drive(&mut world, 80);
    world.replace_live_people(&people);
    let truth = world.truth();
    assert!((truth.pose.x - 7.7).abs() < 1e-6, "{:?}", truth.pose);
    assert!((truth.person_distance - 0.9).abs() < 1e-6, "{truth:?}");
    assert!((truth.seen_person_distance - 2.0).abs() < 1e-6, "{truth:?}");
    let gap = "world = { openings = [{ corners = [[7.5, 2], [8.5, 2], [8.5, 4], [7.5, 4]] }] }";
    let text = format!("{gap}\n{}", scenario("").to_toml().unwrap());
    let mut open = World::new(&Scenario::from_toml(&text).unwrap(), floor(), Vec::new(), 1).unwrap();
    open.replace_live_people(&people.pick([0]));
    assert!((open.truth().seen_person_distance - 6.6).abs() < 1e-6, "{:?}", open.truth());
}
