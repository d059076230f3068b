//! Claims about Bi-Risk-RRT.

use super::*;
use crate::generation::bi_risk_rrt::heuristic::Heuristic;
use crate::generation::risk_rrt::control_lattice::ControlLattice;
use crate::generation::risk_rrt::time_tree::{Node, TimeTree};

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

fn lattice(world: &World) -> ControlLattice<'_> {
    ControlLattice::new(&world.robot, 0.3, 5, 9)
}

/// The tree in time of an answer, and the other tree or the path found with it.
fn split(tree: &Tree, world: &World, params: &GeneratorPart) -> Option<(TimeTree, Heuristic)> {
    Heuristic::split(tree, &lattice(world), 300, &params.generation.bi_risk_rrt)
}

fn both(tree: &Tree, world: &World, params: &GeneratorPart) -> (TimeTree, Heuristic) {
    split(tree, world, params).unwrap()
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
    let mut together = 0;
    let mut alone = 0;
    for seed in 1..=4 {
        let of = |name, nodes| Generator::new(name, deep(nodes)).generate(&input, None, seed, &|| 0.0).tree;
        let of_bi = |nodes| both(&of("bi-risk-rrt", nodes), &world, &deep(nodes));
        let of_one = |nodes| TimeTree::from_value(&of("risk-rrt", nodes), &lattice(&world), 300).unwrap();
        let met = budgets.iter().map(|&n| of_bi(n)).find(|(_, heuristic)| heuristic.is_found).unwrap();
        let in_time = met.0.nodes.len();
        let at_goal =
            |tree: &TimeTree| tree.nodes.iter().any(|n| n.pose.position().distance(world.goal) < 1.0);
        let reached = budgets.iter().map(|&n| of_one(n)).find(at_goal).map_or(7900, |tree| tree.nodes.len());
        println!("seed {seed}: {in_time} nodes in time until the trees met, {reached} until the goal alone");
        (together, alone) = (together + in_time, alone + reached);
    }
    assert!(together < alone, "{together} {alone}");
}

#[test]
fn the_heuristic_leads_from_the_goal_to_the_tree_and_keeps_clear_of_walls() {
    let (world, scene) = walled();
    let input = world.input(&scene, None);
    let tree = Generator::new("bi-risk-rrt", deep(7900)).generate(&input, None, 1, &|| 0.0).tree;
    let (forward, heuristic) = both(&tree, &world, &deep(7900));
    let path: Vec<Point2> = heuristic.tree.nodes.iter().map(|n| n.pose.position()).collect();
    assert!(heuristic.is_found && path[0] == world.goal);
    assert!((1..path.len()).all(|n| heuristic.tree.parent(n) == Some(n - 1)));
    for &p in &path[1..] {
        assert!(world.map.to_obstacle.exact_clearance(&world.map.grid, p) >= world.robot.radius());
    }
    let end = path[path.len() - 1];
    let nearest = forward.nodes.iter().map(|n| n.pose.position().distance(end)).fold(f64::INFINITY, f64::min);
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
        let (robots, goals) = both(&tree, &world, &deep(500));
        let is_near = |n: &&Node| {
            (0..people.len()).any(|i| n.pose.position().distance(Point2::new(people.x[i], people.y[i])) < 0.5)
        };
        [robots, goals.tree].map(|tree| tree.nodes.iter().filter(is_near).count())
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
    let set = &answer.candidates;
    let (forward, heuristic) = both(&answer.tree, &world, &params(200));
    assert!(heuristic.is_found && !set.is_empty());
    for i in 0..set.len() {
        let states = set.range(i);
        let at = |k: usize| set.all_states().pose(k);
        let first = forward.nodes.iter().find(|n| n.pose == at(states.start)).unwrap();
        assert_eq!(first.parent, 0);
        for k in states {
            assert!(heuristic.tree.nodes.iter().all(|n| n.pose != at(k)));
        }
    }
}

#[test]
fn what_lies_behind_the_robot_is_dropped_from_the_heuristic() {
    let (world, scene) = walled();
    let generator = Generator::new("bi-risk-rrt", deep(7900));
    let tree = generator.generate(&world.input(&scene, None), None, 1, &|| 0.0).tree;
    let (forward, mut heuristic) = both(&tree, &world, &generator.params);
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
fn a_value_that_no_generator_has_made_is_not_taken_apart() {
    let (world, scene) = walled();
    let generator = Generator::new("bi-risk-rrt", params(200));
    let tree = generator.generate(&world.input(&scene, None), None, 1, &|| 0.0).tree;
    let split = |tree: &Tree| split(tree, &world, &generator.params);
    assert!(split(&tree).is_some());
    let first = tree.parent.iter().rposition(|parent| *parent == Tree::NO_PARENT).unwrap();
    let with_parent = |node: usize, parent: u32| {
        let mut tree = tree.clone();
        tree.parent[node] = parent;
        tree
    };
    // A third root, a child of the other tree, and one tree alone.
    assert!(split(&with_parent(first + 5, Tree::NO_PARENT)).is_none());
    assert!(split(&with_parent(first + 5, 0)).is_none());
    assert!(split(&with_parent(first, 0)).is_none());
    let with = |name: &str, numbers: Vec<f64>| {
        let mut tree = tree.clone();
        tree.columns.insert(name.to_owned(), numbers);
        split(&tree)
    };
    for name in Heuristic::COLUMNS {
        let mut longer = tree.columns[name].clone();
        longer.push(0.0);
        assert!(with(name, Vec::new()).is_none() && with(name, longer).is_none(), "{name}");
    }
    assert!(with("found", vec![0.5]).is_none());
}

#[test]
fn same_seed_same_trees_over_cycles() {
    let (world, scene) = walled();
    let run = |seed: u64| {
        let generator = Generator::new("bi-risk-rrt", params(200));
        let first = generator.generate(&world.input(&scene, None), None, seed, &|| 0.0);
        generator.generate(&world.input(&scene, None), Some(first.tree), seed + 1, &|| 0.0)
    };
    let answer = run(3);
    assert_eq!(answer, run(3));
    assert!(answer.tree.is_sound());
    // The reverse tree goes on growing although the robot starts anew.
    let (_, heuristic) = both(&answer.tree, &world, &params(200));
    assert!(!heuristic.is_found && heuristic.tree.nodes.len() > 110);
    assert_ne!(answer.tree, run(4).tree);
}
