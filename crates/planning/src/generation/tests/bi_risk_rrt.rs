//! Claims about Bi-Risk-RRT.

use super::*;
use crate::generation::bi_risk_rrt::heuristic::Heuristic;
use crate::generation::risk_rrt::control_lattice::ControlLattice;

fn params(nodes: u32) -> GeneratorPart {
    let mut params = Profile::builtin("bi-risk-rrt").unwrap().generator_part();
    params.generation.risk_rrt.nodes = nodes;
    params
}

/// Both trees deep enough to cross the hall, in one cycle, and samples from all of it, as the authors of
/// Bi-Risk-RRT compare the two.
fn deep(nodes: u32) -> GeneratorPart {
    let mut params = params(nodes);
    params.steps = 400;
    (params.generation.risk_rrt.max_depth, params.generation.risk_rrt.max_nodes) = (300, 8000);
    params.generation.risk_rrt.window = 30.0;
    params
}

fn sides(tree: &Tree) -> Vec<f64> {
    tree.extra[Heuristic::COLUMN].clone()
}

/// A wall of 4 m between start and goal, 18 m apart.
fn walled() -> (World, Scene) {
    let goal = Point2::new(15.0, 24.0);
    let world = World::new(hall(&[(13.0, 18.0, 17.0, 18.4)]), goal);
    let no_people = People { radius: 0.3, ..People::default() };
    (world, scene(0, Pose2::new(15.0, 6.0, 1.57), Twist::default(), &no_people))
}

/// Both trees together need about as many nodes as one alone; what is saved is nodes in time, each of which
/// has to be checked against every person in every cycle.
#[test]
fn behind_a_wall_the_tree_in_time_meets_the_other_sooner_than_it_would_reach_the_goal() {
    let (world, scene) = walled();
    let input = world.input(&scene, None);
    let budgets = [1000, 1400, 2000, 2800, 4000, 5600, 7900];
    let (mut both, mut alone) = (0, 0);
    for seed in 1..=4 {
        let of_bi =
            |nodes| Generator::new("bi-risk-rrt", deep(nodes)).generate(&input, None, seed, &|| 0.0).tree;
        let of_one =
            |nodes| Generator::new("risk-rrt", deep(nodes)).generate(&input, None, seed, &|| 0.0).tree;
        let met = budgets.iter().map(|&n| of_bi(n)).find(|tree| sides(tree).contains(&2.0)).unwrap();
        let in_time = sides(&met).iter().filter(|side| **side == 0.0).count();
        let at_goal = |tree: &Tree| (0..tree.len()).any(|n| tree.position(n).distance(world.goal) < 1.0);
        let reached = budgets.iter().map(|&n| of_one(n)).find(at_goal).map_or(7900, |tree| tree.len());
        println!("seed {seed}: {in_time} nodes in time until the trees met, {reached} until the goal alone");
        (both, alone) = (both + in_time, alone + reached);
    }
    assert!(both < alone, "{both} {alone}");
}

#[test]
fn the_heuristic_leads_from_the_goal_to_the_tree_and_keeps_clear_of_walls() {
    let (world, scene) = walled();
    let input = world.input(&scene, None);
    let tree = Generator::new("bi-risk-rrt", deep(7900)).generate(&input, None, 1, &|| 0.0).tree;
    let path: Vec<usize> = (0..tree.len()).filter(|&n| sides(&tree)[n] == 2.0).collect();
    assert_eq!(tree.position(path[0]), world.goal);
    assert!(path.windows(2).all(|w| tree.parent(w[1]) == Some(w[0])));
    for &n in &path[1..] {
        assert!(world.map.to_obstacle.clearance(&world.map.grid, tree.position(n)) >= world.robot.radius());
    }
    let end = tree.position(path[path.len() - 1]);
    let nearest = (0..path[0]).map(|n| tree.position(n).distance(end)).fold(f64::INFINITY, f64::min);
    assert!(nearest < 1.0, "{nearest}");
}

#[test]
fn people_are_in_the_way_of_the_robot_alone() {
    let (world, mut scene) = walled();
    // One row of standing people before the robot, one before the goal.
    scene.people = People { radius: 0.3, ..People::default() };
    for k in 0..20 {
        scene.people.id.push(k);
        scene.people.x.push(9.0 + 1.2 * f64::from(k % 10));
        scene.people.y.push(if k < 10 { 8.5 } else { 21.5 });
        scene.people.vx.push(0.0);
        scene.people.vy.push(0.0);
    }
    let people = scene.people.clone();
    // How many nodes of the robot's tree and of the goal's lie where the rows are.
    let near = |scene: &Scene| {
        let generator = Generator::new("bi-risk-rrt", deep(500));
        let tree = generator.generate(&world.input(scene, None), None, 1, &|| 0.0).tree;
        let is_near = |n: &usize| {
            (0..people.len()).any(|i| tree.position(*n).distance(Point2::new(people.x[i], people.y[i])) < 0.5)
        };
        let side = sides(&tree);
        let of = |goals: bool| (0..tree.len()).filter(|&n| (side[n] > 0.0) == goals).filter(is_near).count();
        [of(false), of(true)]
    };
    let [robots, goals] = near(&scene);
    assert!(robots == 0 && goals > 0, "{robots} {goals}");
    scene.people = People { radius: 0.3, ..People::default() };
    let [robots, goals] = near(&scene);
    assert!(robots > 0 && goals > 0, "without people: {robots} {goals}");
}

#[test]
fn no_candidate_holds_a_part_of_the_reverse_tree() {
    // Start and goal so near that the trees meet at once.
    let world = World::new(hall(&[]), Point2::new(15.0, 14.0));
    let no_people = People { radius: 0.3, ..People::default() };
    let scene = scene(0, Pose2::new(15.0, 11.0, 1.57), Twist { v: 0.6, omega: 0.0 }, &no_people);
    let answer =
        Generator::new("bi-risk-rrt", params(200)).generate(&world.input(&scene, None), None, 1, &|| 0.0);
    let (tree, set) = (&answer.tree, &answer.candidates);
    let side = sides(tree);
    assert!(side.contains(&2.0) && !set.is_empty());
    for i in 0..set.len() {
        let states = set.range(i);
        let at = |k: usize| set.all_states().pose(k);
        let first = (0..tree.len()).find(|&n| tree.pose(n) == at(states.start)).unwrap();
        assert_eq!((side[first], tree.parent(first)), (0.0, Some(0)));
        for k in states {
            assert!((0..tree.len()).all(|n| side[n] == 0.0 || tree.pose(n) != at(k)));
        }
    }
}

#[test]
fn what_lies_behind_the_robot_is_dropped_from_the_heuristic() {
    let (world, scene) = walled();
    let lattice = ControlLattice::new(&world.robot, 0.3, 5, 9);
    let params = deep(7900);
    let tree = Generator::new("bi-risk-rrt", params.clone())
        .generate(&world.input(&scene, None), None, 1, &|| 0.0)
        .tree;
    let (forward, mut heuristic) =
        Heuristic::split(&tree, &lattice, 300, &params.generation.bi_risk_rrt).unwrap();
    let whole = heuristic.tree.clone();
    let mut back = forward.to_value();
    heuristic.append_to(&mut back);
    assert!(back == tree);
    let middle = whole.nodes.len() / 2;
    // The robot walks along it from where the trees met.
    for node in whole.nodes[middle..].iter().rev() {
        heuristic.pass(node.pose.position());
    }
    assert!(heuristic.tree.nodes[..] == whole.nodes[..=middle]);
    // Once more at the same place, and at the goal.
    heuristic.pass(whole.nodes[middle].pose.position());
    assert_eq!(heuristic.tree.nodes.len(), middle + 1);
    assert_eq!(heuristic.goal(), world.goal);
}

#[test]
fn same_seed_same_trees_over_cycles() {
    let run = |seed: u64| {
        let (world, scene) = walled();
        let generator = Generator::new("bi-risk-rrt", params(200));
        let first = generator.generate(&world.input(&scene, None), None, seed, &|| 0.0);
        generator.generate(&world.input(&scene, None), Some(first.tree), seed + 1, &|| 0.0)
    };
    let answer = run(3);
    assert_eq!(answer, run(3));
    assert!(answer.tree.is_sound());
    // The reverse tree goes on growing although the robot starts anew.
    assert!(sides(&answer.tree).iter().filter(|s| **s == 1.0).count() > 110);
    assert_ne!(answer.tree, run(4).tree);
}
