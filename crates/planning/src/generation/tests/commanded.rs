//! Claims about generators that choose by themselves: `dwa`, `hrvo-robot`, `mppi` and `transient-goal`.

use super::*;
use crate::generation::transient_goal::kept;
use crate::geometry::bearing;

const NAMES: [&str; 4] = ["dwa", "hrvo-robot", "mppi", "transient-goal"];

fn part(name: &str) -> GeneratorPart {
    let mut part = Profile::builtin(name).unwrap().generator_part();
    // Enough to choose from, and quickly.
    part.generation.mppi.rollouts = 400;
    part
}

fn generator(name: &str) -> Generator {
    Generator::new(name, part(name))
}

/// People at `x, y` who walk with `vx, vy`.
fn people(of: &[[f64; 4]]) -> People {
    People::walking(0.3, of)
}

/// A robot that drives north at 0.8 m/s in an open hall, 12 m from its goal.
fn northwards(people: &People) -> (World, Scene) {
    let world = World::new(hall(&[]), Point2::new(15.0, 24.0));
    let north = Pose2::new(15.0, 12.0, std::f64::consts::FRAC_PI_2);
    let scene = scene(0, north, Twist { v: 0.8, omega: 0.0 }, people);
    (world, scene)
}

/// Poses of the first candidate.
fn first(answer: &Generated) -> Vec<Pose2> {
    assert!(!answer.candidates.is_empty(), "nothing is offered");
    answer.candidates.range(0).map(|k| answer.candidates.all_states().pose(k)).collect()
}

/// The least gap between bodies on the first candidate.
fn least_gap(world: &World, scene: &Scene, answer: &Generated) -> f64 {
    let gap = |(k, pose): (usize, &Pose2)| {
        let t = answer.candidates.dt() * (k + 1) as f64;
        let people = (0..scene.people.len()).map(|i| scene.people.position_after(i, t));
        let nearest = people.map(|p| p.distance(pose.position())).fold(f64::INFINITY, f64::min);
        nearest - world.robot.radius() - scene.people.radius
    };
    first(answer).iter().enumerate().map(gap).fold(f64::INFINITY, f64::min)
}

fn once(name: &str, world: &World, scene: &Scene) -> Generated {
    generator(name).generate(&world.input(scene, None), None, 1, &|| 0.0)
}

#[test]
fn what_they_offer_is_free_within_limits_and_ends_standing() {
    for name in NAMES {
        let mut offered = 0;
        for (world, scene) in various() {
            let set = once(name, &world, &scene).candidates;
            offered += set.len();
            drivable_and_free(&world, &scene, &set);
        }
        assert!(offered > 20, "{name} offered {offered} in all");
    }
}

#[test]
fn alone_they_drive_to_the_goal() {
    let (world, scene) = northwards(&people(&[]));
    for name in NAMES {
        let end = *first(&once(name, &world, &scene)).last().unwrap();
        // 3.9 s from 0.8 m/s with a stop at the end are 2.9 m at most.
        assert!(end.y > 13.5 && (end.x - 15.0).abs() < 0.6, "{name} ends at {end:?}");
    }
}

#[test]
fn a_way_that_lies_behind_is_turned_to() {
    let world = World::new(hall(&[]), Point2::new(15.0, 25.0));
    let scene = scene(0, Pose2::new(15.0, 8.0, -1.5), Twist::default(), &people(&[]));
    let off = |pose: Pose2| wrap_angle(bearing(pose.position(), world.goal) - pose.heading).abs();
    // The arcs of the dynamic window reach no farther than a step's change of turn rate, the others turn by themselves.
    for (name, least) in [("dwa", 0.05), ("hrvo-robot", 1.0), ("mppi", 0.2), ("transient-goal", 0.3)] {
        let end = *first(&once(name, &world, &scene)).last().unwrap();
        assert!(off(end) < off(scene.belief.pose) - least, "{name} ends at {end:?}");
    }
}

#[test]
fn a_person_in_the_way_is_kept_off() {
    for (what, person) in [
        ("stands", [15.1, 14.5, 0.0, 0.0]),
        ("comes", [15.5, 17.5, 0.0, -0.6]),
        ("crosses", [17.0, 14.0, -0.7, 0.0]),
    ] {
        let (world, scene) = northwards(&people(&[person]));
        for name in NAMES {
            let answer = once(name, &world, &scene);
            assert!(!answer.candidates.is_empty(), "{name}: a person {what}, and nothing is offered");
            let gap = least_gap(&world, &scene, &answer);
            assert!(gap > 0.1, "{name}: a person {what}, and the first choice leaves {gap} m");
        }
    }
}

#[test]
fn the_same_input_gives_the_same_answer_and_a_tree_of_others_is_replaced() {
    let (world, scene) = northwards(&crowd(3));
    for name in NAMES {
        let fresh = once(name, &world, &scene);
        assert_eq!(once(name, &world, &scene), fresh, "{name}");
        let broken = Tree { parent: vec![7; 3], ..fresh.tree.clone() };
        let input = world.input(&scene, None);
        let mut longer = fresh.tree.clone();
        longer.columns.values_mut().for_each(|column| column.push(0.0));
        for tree in [broken, PoseTree::rooted(Pose2::default()).into_value(), longer] {
            assert_eq!(generator(name).generate(&input, Some(tree), 1, &|| 0.0), fresh, "{name}");
        }
    }
}

#[test]
fn they_offer_something_when_the_time_is_over_at_once() {
    let (world, scene) = northwards(&people(&[]));
    for name in NAMES {
        let answer = generator(name).generate(&world.input(&scene, None), None, 1, &|| 1.0);
        assert!(!answer.candidates.is_empty(), "{name}");
    }
}

#[test]
fn a_robot_that_does_not_get_away_is_offered_ways_out() {
    let world = World::new(hall(&[(2.0, 2.0, 14.0, 28.0), (16.0, 2.0, 28.0, 28.0)]), Point2::new(15.0, 24.0));
    let north = Pose2::new(15.0, 12.0, std::f64::consts::FRAC_PI_2);
    let after = |generator: &Generator, seconds: f64, of: &People| {
        let scene = Scene { in_place: seconds, ..scene(0, north, Twist::default(), of) };
        (generator.generate(&world.input(&scene, None), None, 1, &|| 0.0), scene)
    };
    // Nose to nose with a person who stands in a corridor two metres wide.
    let one = people(&[[15.0, 12.75, 0.0, 0.0]]);
    for name in NAMES {
        let recovers = generator(name);
        let (own, _) = after(&recovers, 0.0, &one);
        assert_eq!(after(&recovers, 2.9, &one).0, own, "{name}");
        let (late, scene) = after(&recovers, 3.0, &one);
        assert!(!late.candidates.is_empty(), "{name}");
        drivable_and_free(&world, &scene, &late.candidates);
        for i in 0..late.candidates.len() {
            let end = late.candidates.end(i).position();
            assert!(end.distance(north.position()) > 0.1, "{name}: a way out ends at {end:?}");
        }
        let mut never = generator(name);
        never.params.generation.recovery.patience = 0.0;
        assert_eq!(after(&never, 3.0, &one).0, own, "{name}");
    }
}

#[test]
fn a_way_out_that_has_been_begun_is_gone_to_its_end() {
    let (world, scene) = northwards(&people(&[[15.0, 10.9, 0.0, 0.0]]));
    let mut params = part("curiosity");
    (params.generation.recovery.patience, params.generation.recovery.insist) = (3.0, true);
    let stuck = Scene { in_place: 4.0, belief: Belief { twist: Twist::default(), ..scene.belief }, ..scene };
    let insisting = Generator::new("rrt-star", params);
    let offered = insisting.generate(&world.input(&stuck, None), None, 1, &|| 0.0).candidates;
    assert!(offered.len() > 1, "{} ways out", offered.len());
    let here = stuck.belief.pose.position();
    let end = |set: &CandidateSet, i: usize| set.end(i).position();
    assert!((0..offered.len()).all(|i| end(&offered, i).distance(here) > 0.29), "one leads nowhere");
    // Whichever was chosen, it alone is offered next, with each speed.
    for chosen in [0, offered.len() - 1] {
        let states = offered.all_states();
        let rest: Vec<Pose2> = offered.range(chosen).map(|at| states.pose(at)).collect();
        let next = insisting.generate(&world.input(&stuck, Some(&rest)), None, 1, &|| 0.0).candidates;
        assert!(!next.is_empty() && next.len() <= 3, "{} are offered", next.len());
        let direction = |p: Point2| bearing(here, p);
        let off = wrap_angle(direction(end(&next, 0)) - direction(end(&offered, chosen))).abs();
        assert!(off < 0.4, "it now leads {off} rad elsewhere");
    }
}

#[test]
fn a_robot_that_has_to_turn_about_first_turns_to_one_side_until_it_leaves() {
    // Nose to nose with a person in an alley one metre wide: the only way out is behind the robot.
    let world = World::new(hall(&[(2.0, 2.0, 14.5, 28.0), (15.5, 2.0, 28.0, 28.0)]), Point2::new(15.0, 24.0));
    let person = people(&[[15.0, 12.65, 0.0, 0.0]]);
    let mut params = part("curiosity");
    (params.generation.recovery.patience, params.generation.recovery.insist) = (3.0, true);
    let insisting = Generator::new("rrt-star", params);
    for heading in [1.4, 1.7] {
        let mut pose = Pose2::new(15.0, 12.0, heading);
        let mut twist = Twist::default();
        let mut turned = 0.0;
        let mut previous: Option<Vec<Pose2>> = None;
        let cycles = (0..40).take_while(|cycle| {
            let in_place = 4.0 + 0.3 * f64::from(*cycle);
            let scene = Scene { in_place, ..scene(0, pose, twist, &person) };
            let answer = insisting.generate(&world.input(&scene, previous.as_deref()), None, 1, &|| 0.0);
            let candidates = answer.candidates;
            let get_away = |i: usize| candidates.end(i).position().distance(pose.position()) > 0.29;
            assert!(candidates.len() == 1 || (0..candidates.len()).all(get_away), "at {pose:?}");
            // The last one is the one that a planner with other costs might take.
            let states: Vec<_> = candidates.range(candidates.len() - 1).collect();
            let all = candidates.all_states();
            let next = all.pose(states[0]);
            let turn = wrap_angle(next.heading - pose.heading);
            assert!(turn * turned >= -1e-6 || !get_away(0), "it turns back at {pose:?}");
            (pose, twist) = all.at(states[0]);
            turned = turn;
            previous = Some(states[1..].iter().map(|&at| all.pose(at)).collect());
            pose.y > 11.5
        });
        let cycles = cycles.count();
        assert!(cycles < 39, "after {cycles} cycles it is at {pose:?}");
    }
}

#[test]
fn mppi_goes_on_with_the_sequence_it_had() {
    let (world, mut scene) = northwards(&people(&[[16.0, 16.0, 0.0, 0.0]]));
    let before = once("mppi", &world, &scene);
    let mut params = part("mppi");
    // Noise so small that the mean is the sequence from before.
    (params.generation.mppi.sigma_v, params.generation.mppi.sigma_omega) = (1e-3, 1e-3);
    let quiet = Generator::new("mppi", params);
    let states = before.candidates.range(0);
    scene.stamp += before.candidates.dt();
    scene.belief.pose = before.candidates.all_states().pose(states.start);
    scene.belief.twist = Twist {
        v: before.candidates.all_states().v[states.start],
        omega: before.candidates.all_states().omega[states.start],
    };
    let after = quiet.generate(&world.input(&scene, None), Some(before.tree.clone()), 1, &|| 0.0);
    // The sequence ends after 2.8 s, and the candidate brakes before.
    for (old, new) in first(&before).iter().skip(1).zip(first(&after)).take(5) {
        assert!(old.position().distance(new.position()) < 0.03, "{old:?} became {new:?}");
    }
    let fresh = quiet.generate(&world.input(&scene, None), None, 1, &|| 0.0);
    assert!(fresh.candidates != after.candidates);
}

#[test]
fn mppi_without_a_forecast_takes_those_who_walk_for_standing() {
    // A person who will be in the way later, and one who stands there now and will be gone.
    let (world, scene) = northwards(&people(&[[15.0, 14.0, 0.9, 0.0], [15.6, 13.6, 0.9, 0.0]]));
    let mut params = part("mppi");
    let aside = |params: &GeneratorPart| {
        let answer =
            Generator::new("mppi", params.clone()).generate(&world.input(&scene, None), None, 1, &|| 0.0);
        first(&answer).iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max)
    };
    let with = aside(&params);
    params.generation.mppi.forecast = false;
    let without = aside(&params);
    assert!(with > without + 0.3, "it gets to {with} with and to {without} without");
}

#[test]
fn hrvo_robot_takes_the_side_that_the_law_takes() {
    for side in [-1.0, 1.0] {
        let (world, scene) = northwards(&people(&[[15.0 + 0.3 * side, 16.0, 0.0, -0.6]]));
        let passing = first(&once("hrvo-robot", &world, &scene));
        let far = passing.iter().map(|p| side * (15.0 - p.x)).fold(f64::NEG_INFINITY, f64::max);
        assert!(far > 0.05, "a person comes on side {side}, and the robot goes {far} m to the other");
    }
}

#[test]
fn a_transient_goal_is_kept_for_two_seconds_unless_it_is_reached_or_blocked() {
    let (world, scene) = northwards(&people(&[]));
    let chosen = once("transient-goal", &world, &scene).tree;
    let (goal, _) = kept(Some(&chosen)).unwrap();
    let next = |seconds: f64, at: Point2, people: People| {
        let mut scene = scene.clone();
        scene.stamp += seconds;
        (scene.belief.pose.x, scene.belief.pose.y) = (at.x, at.y);
        scene.people = people;
        let input = world.input(&scene, None);
        let tree = generator("transient-goal").generate(&input, Some(chosen.clone()), 1, &|| 0.0).tree;
        kept(Some(&tree)).unwrap()
    };
    let here = scene.belief.pose.position();
    assert_eq!(next(1.9, here, people(&[])), (goal, scene.stamp));
    assert_eq!(next(2.1, here, people(&[])).1, scene.stamp + 2.1);
    let near = Point2::new(goal.x, goal.y - 0.2);
    assert_ne!(next(1.0, near, people(&[])).0, goal);
    assert_ne!(next(1.0, here, people(&[[goal.x, goal.y, 0.0, 0.0]])).0, goal);
}

#[test]
fn transient_goals_behind_a_wall_are_left_out_and_a_person_ahead_is_followed() {
    let wall = (14.0, 14.0, 16.0, 14.5);
    let world = World::new(hall(&[wall]), Point2::new(15.0, 24.0));
    let (_, alone) = northwards(&people(&[]));
    let (goal, _) = kept(Some(&once("transient-goal", &world, &alone).tree)).unwrap();
    let straight = Pose2::new(goal.x, goal.y, bearing(alone.belief.pose.position(), goal));
    let input = world.input(&alone, None);
    assert!(input.checker().segment_wall_clear(alone.belief.pose, straight), "{goal:?} is behind the wall");

    // Two ways round a person who stands ahead; a person walks on along the left one.
    let stands = [15.0, 14.5, 0.0, 0.0];
    let side = |x: f64| {
        let (world, scene) = northwards(&people(&[stands, [x, 14.2, 0.0, 0.9]]));
        kept(Some(&once("transient-goal", &world, &scene).tree)).unwrap().0.x - 15.0
    };
    assert!(side(14.3) < 0.0 && side(15.7) > 0.0, "{} and {}", side(14.3), side(15.7));
}
