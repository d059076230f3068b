//! Claims about backing out of a place where nothing else is free.

use super::*;
use crate::motion::Footprint;

/// Longer than wide, 0.9 m by 0.6 m, with this greatest speed backwards.
fn oblong(v_reverse: f64) -> RobotModel {
    let corners = [(-0.45, -0.3), (0.45, -0.3), (0.45, 0.3), (-0.45, 0.3)];
    let vertices = corners.map(|(x, y)| Point2::new(x, y)).to_vec();
    RobotModel { footprint: Footprint::Polygon { vertices }, v_reverse, ..RobotModel::default() }
}

/// A hall with a niche of 0.8 m by 0.4 m in the wall east of the robot, whose nose is 0.1 m from its end; the goal is
/// behind it.
fn niche(robot: RobotModel, behind: &[(f64, f64, f64, f64)]) -> World {
    niche_until(16.4, robot, behind)
}

/// The niche, but it ends at this x, metres.
fn niche_until(end: f64, robot: RobotModel, behind: &[(f64, f64, f64, f64)]) -> World {
    let walls = [(16.0, 2.0, 28.0, 14.6), (16.0, 15.4, 28.0, 28.0), (end, 14.6, 28.0, 15.4)];
    World { robot, ..World::new(hall(&[&walls, behind].concat()), Point2::new(8.0, 15.0)) }
}

/// What is offered to a robot that has been in the niche for so long.
fn offered(world: &World, seconds: f64) -> (CandidateSet, Scene) {
    let people = People::walking(0.25, &[]);
    let pose = Pose2::new(15.85, 15.0, 0.0);
    let scene = Scene { in_place: seconds, ..scene(0, pose, Twist::default(), &people) };
    (recovering().generate(&world.input(&scene, None), None, 1, &|| 0.0).candidates, scene)
}

/// How far back the candidates end of a robot that has been in the niche for three seconds.
fn metres_back(world: &World) -> Vec<f64> {
    let (set, scene) = offered(world, 3.0);
    (0..set.len()).map(|i| -scene.belief.pose.relative(set.end(i)).x).collect()
}

fn recovering() -> Generator {
    let mut params = part("curiosity");
    (params.generation.recovery.patience, params.generation.recovery.insist) = (3.0, true);
    Generator::new("rrt-star", params)
}

fn part(profile: &str) -> GeneratorPart {
    Profile::builtin(profile).unwrap().generator_part()
}

/// Whether any state of a set goes backwards.
fn goes_back(set: &CandidateSet) -> bool {
    set.all_states().v.iter().any(|v| *v < 0.0)
}

#[test]
fn a_robot_that_can_do_nothing_else_backs_by_up_to_a_third_of_a_metre() {
    let world = niche(oblong(0.2), &[]);
    assert!(!goes_back(&offered(&world, 2.9).0), "before its time in the place is over");
    let (set, _) = offered(&world, 3.0);
    let back = metres_back(&world);
    assert_eq!(back.len(), 3, "{back:?}");
    for (metres, expected) in back.iter().zip([0.3, 0.2, 0.1]) {
        assert!((metres - expected).abs() < 0.03, "{back:?}");
    }
    let states = set.all_states();
    assert!(states.v.iter().all(|v| (-0.2..=0.0).contains(v)), "{:?}", states.v);
    assert!(states.heading.iter().all(|heading| *heading == 0.0));
    assert!((0..3).all(|i| states.v[set.range(i).end - 1] == 0.0), "{:?}", states.v);
}

#[test]
fn it_backs_only_as_far_as_is_free_and_never_if_it_never_drives_backwards() {
    assert!(!goes_back(&offered(&niche(oblong(0.0), &[]), 3.0).0));
    // Its tail is at 15.4 m, and 0.05 m are kept.
    let near = metres_back(&niche(oblong(0.2), &[(14.0, 14.0, 15.1, 16.0)]));
    assert!(near.len() == 2 && near[0] < 0.23 && near[1] < 0.13, "{near:?}");
    let occupied = niche(oblong(0.2), &[(14.0, 14.0, 15.3, 16.0)]);
    assert!(!goes_back(&offered(&occupied, 3.0).0));
}

#[test]
fn who_can_turn_does_not_back() {
    let disc = RobotModel { v_reverse: 0.2, ..RobotModel::default() };
    let (set, _) = offered(&niche(disc, &[]), 3.0);
    assert!(!set.is_empty() && !goes_back(&set));
}

#[test]
fn backing_that_has_been_begun_is_gone_to_its_end() {
    let world = niche(oblong(0.2), &[]);
    let (set, scene) = offered(&world, 3.0);
    let states: Vec<(Pose2, Twist)> = set.range(0).map(|at| set.all_states().at(at)).collect();
    let (pose, twist) = states[2];
    assert!(twist.v < 0.0);
    let ahead: Vec<Pose2> = states[3..].iter().map(|(pose, _)| *pose).collect();
    let belief = Belief { pose, twist, ..scene.belief.clone() };
    // It may have come to another place meanwhile.
    for in_place in [3.9, 0.0] {
        let scene = Scene { in_place, belief: belief.clone(), ..scene.clone() };
        let next = recovering().generate(&world.input(&scene, Some(&ahead)), None, 1, &|| 0.0).candidates;
        assert_eq!(next.len(), 1, "{in_place} s in one place");
        let apart = next.end(0).position().distance(set.end(0).position());
        assert!(apart < 0.03, "it now ends {apart} m elsewhere");
    }
    let stopped = Belief { twist: Twist::default(), ..belief };
    let scene = Scene { in_place: 0.0, belief: stopped, ..scene };
    let another = recovering().generate(&world.input(&scene, Some(&ahead)), None, 1, &|| 0.0).candidates;
    assert!(!goes_back(&another), "it has been stopped");
}

#[test]
fn at_its_end_it_goes_on_backing_although_there_is_room_ahead_in_the_dead_end() {
    let world = niche_until(17.0, oblong(0.2), &[]);
    let people = People::walking(0.25, &[]);
    // Nearly a metre is free ahead, and its corners are still inside.
    let pose = Pose2::new(15.58, 15.0, 0.0);
    let end = [Pose2::new(15.55, 15.0, 0.0); 5];
    for (v, backs) in [(-0.15, true), (0.0, false)] {
        let scene = scene(0, pose, Twist { v, omega: 0.0 }, &people);
        let set = recovering().generate(&world.input(&scene, Some(&end)), None, 1, &|| 0.0).candidates;
        assert_eq!(goes_back(&set), backs, "at {v} m/s");
        let farthest = (0..set.len()).map(|i| set.end(i).x).fold(f64::INFINITY, f64::min);
        assert!(!backs || (farthest - 15.28).abs() < 0.03, "{farthest}");
    }
}
