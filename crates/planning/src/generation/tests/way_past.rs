//! Claims about the way past people who stand.

use super::*;
use crate::generation::way_past::way_past;

/// `curionav`'s parameters.
fn part() -> GeneratorPart {
    Profile::builtin("curionav").unwrap().generator_part()
}

/// A corridor two metres wide, the goal 12 m north of a robot that stands in its middle.
fn corridor(of: &[[f64; 2]]) -> (World, Scene) {
    let world = World::new(hall(&[(2.0, 2.0, 14.0, 28.0), (16.0, 2.0, 28.0, 28.0)]), Point2::new(15.0, 24.0));
    let people: Vec<_> = of.iter().map(|&[x, y]| [x, y, 0.0, 0.0]).collect();
    let north = Pose2::new(15.0, 12.0, std::f64::consts::FRAC_PI_2);
    let scene = scene(0, north, Twist::default(), &People::walking(0.25, &people));
    (world, scene)
}

fn past(world: &World, scene: &Scene, params: &GeneratorPart, spacing: f64) -> Option<Vec<Point2>> {
    let input = GenerationInput { params, ..world.input(scene, None) };
    way_past(&input, &input.checker(), spacing)
}

#[test]
fn a_person_who_stands_in_a_corridor_is_passed_where_there_is_room() {
    for (x, side) in [(14.6, 1.0), (15.4, -1.0)] {
        let (world, scene) = corridor(&[[x, 13.5]]);
        let way = past(&world, &scene, &part(), 0.06).expect("there is room beside the person");
        assert!(way.last().is_some_and(|end| end.y > 14.4), "it ends at {:?}", way.last());
        // It keeps the room that collision checks ask for, and goes by on the free side.
        let input = world.input(&scene, None);
        let params = part();
        let checker = GenerationInput { params: &params, ..input }.checker();
        let mut from = scene.belief.pose.position();
        for to in way {
            for k in 1..=20 {
                let p = from.toward(to, f64::from(k) / 20.0);
                assert!(checker.wall_clear(Pose2::new(p.x, p.y, 0.0)), "{p:?}");
                let gap = p.distance(scene.people.position(0)) - world.robot.radius() - 0.25;
                assert!(gap > checker.gap_asked(0, 0.0) - 0.02, "{gap} m at {p:?}");
                assert!((p.y - 13.5).abs() > 0.2 || (p.x - x) * side > 0.0, "{p:?}");
            }
            from = to;
        }
    }
}

#[test]
fn where_the_way_ahead_is_closed_the_way_back_is_found_and_none_where_both_are() {
    let two = [[14.55, 12.9], [15.45, 12.9]];
    let (world, scene) = corridor(&two);
    let way = past(&world, &scene, &part(), 0.03).expect("the way back is free");
    assert!(way.iter().all(|corner| corner.y < 12.0), "{way:?}");
    let (world, scene) = corridor(&[two[0], two[1], [14.55, 11.1], [15.45, 11.1]]);
    assert_eq!(past(&world, &scene, &part(), 0.03), None);
}

#[test]
fn a_robot_that_has_lost_patience_is_offered_a_way_past_who_stands_there() {
    // The time is over before branches of the tree are looked at, and the shortest way ends before the person.
    let generator = Generator::new("rrt-star", part());
    let passes = |x: f64, impatient: bool| {
        let (world, scene) = corridor(&[[x, 14.0]]);
        let moving = Belief { twist: Twist { v: 0.6, omega: 0.0 }, ..scene.belief };
        let scene = Scene { belief: moving, impatient, ..scene };
        let set = generator.generate(&world.input(&scene, None), None, 1, &|| 1.0).candidates;
        (0..set.len()).any(|i| set.end(i).position().y > 14.0)
    };
    // The less room there is, the fewer ways lead past.
    let places = (0..40).map(|k| 14.7 + 0.01 * f64::from(k));
    let alone = places.clone().filter(|x| passes(*x, false)).count();
    let offered = places.filter(|x| passes(*x, true)).count();
    assert!(offered > alone, "{offered} and {alone} of 40");
}

#[test]
fn a_robot_between_a_shelf_and_two_who_wait_for_it_gets_out() {
    let world = World::new(hall(&[(18.3, 12.4, 20.6, 13.26)]), Point2::new(21.0, 8.0));
    let two = People::walking(0.25, &[[19.58, 14.11, 0.0, 0.0], [18.58, 14.26, 0.0, 0.0]]);
    let out_after = |params: &GeneratorPart| {
        let generator = Generator::new("rrt-star", params.clone());
        let mut pose = Pose2::new(19.05, 13.82, 0.5);
        let mut twist = Twist::default();
        let mut previous: Option<Vec<Pose2>> = None;
        let start = pose.position();
        (0..60).find(|&cycle| {
            let scene = Scene { in_place: 4.0, ..scene(0, pose, twist, &two) };
            let input = world.input(&scene, previous.as_deref());
            let set = generator.generate(&input, None, cycle, &|| 0.0).candidates;
            if !set.is_empty() {
                let states: Vec<usize> = set.range(0).collect();
                let all = set.all_states();
                (pose, twist) = all.at(states[0]);
                previous = Some(states[1..].iter().map(|&at| all.pose(at)).collect());
            }
            let gap = |i: usize| pose.position().distance(two.position(i)) - world.robot.radius() - 0.25;
            assert!(gap(0) > 0.02 && gap(1) > 0.02, "it is {} and {} m from them", gap(0), gap(1));
            pose.position().distance(start) > 1.0
        })
    };
    let params = part();
    let cycles = out_after(&params).expect("it gets out");
    assert!(cycles < 50, "it takes {cycles} cycles");
    // What is asked of those who walk would keep it there.
    let mut wide = params;
    wide.collision.tight_after = 0.0;
    assert_eq!(out_after(&wide), None);
}
