//! Claims about Risk-RRT.

use super::*;
use crate::collision_risk::CollisionRisk;
use crate::generation::risk_rrt::TimeTree;
use crate::generation::risk_rrt::control_lattice::ControlLattice;
use crate::generation::risk_rrt::growth::Ground;

const DEPTH: u32 = 50;

fn generator(nodes: u32) -> Generator {
    let mut params = Profile::builtin("risk-rrt").unwrap().generator_part();
    params.generation.risk_rrt.nodes = nodes;
    Generator::new("risk-rrt", params)
}

fn lattice(robot: &RobotModel) -> ControlLattice<'_> {
    ControlLattice::new(robot, 0.3, 5, 9)
}

fn read(value: &Tree, robot: &RobotModel) -> TimeTree {
    TimeTree::from_value(value, &lattice(robot), DEPTH).unwrap()
}

/// The tree with the risks that are seen in `scene`.
fn with_risks(value: &Tree, world: &World, scene: &Scene) -> TimeTree {
    let params = generator(0).params;
    let input = GenerationInput { params: &params, ..world.input(scene, None) };
    Ground::new(&input).growth_of(read(value, &world.robot)).tree
}

/// The poses of a candidate, from state `from` on.
fn poses(set: &CandidateSet, candidate: usize, from: usize) -> Vec<Pose2> {
    let states = set.range(candidate).skip(from);
    states.map(|k| set.all_states().pose(k)).collect()
}

/// Walks `cycles` cycles down the best path of `generator`, `ticks` ticks each, among furniture.
fn walk(generator: &Generator, cycles: u64, ticks: u64, each: impl FnMut(&World, &Scene, &Generated)) {
    walk_in(&World::new(furnished(), Point2::new(14.0, 26.0)), |_| generator, cycles, ticks, each);
}

fn walk_in<'g>(
    world: &World,
    generator: impl Fn(u64) -> &'g Generator,
    cycles: u64,
    ticks: u64,
    mut each: impl FnMut(&World, &Scene, &Generated),
) {
    let mut belief = (Pose2::new(12.0, 8.0, 1.2), Twist { v: 0.6, omega: 0.0 });
    let (mut tree, mut driven): (Option<Tree>, Option<Vec<Pose2>>) = (None, None);
    for cycle in 0..cycles {
        let scene = scene(ticks * cycle, belief.0, belief.1, &crowd(cycle));
        let answer = generator(cycle).generate(&world.input(&scene, driven.as_deref()), tree, 7, &|| 0.0);
        each(world, &scene, &answer);
        let set = &answer.candidates;
        if set.is_empty() {
            (belief.1, driven) = (Twist::default(), None);
        } else {
            let trajectory = crate::trajectory::Trajectory::of(set, 0, belief);
            let elapsed = 0.1 * ticks as f64;
            belief = trajectory.at(elapsed);
            let tail = trajectory.tail(elapsed, belief);
            driven = Some((0..tail.len()).map(|k| tail.states().at(k).0).collect());
        }
        tree = Some(answer.tree);
    }
}

#[test]
fn risk_never_falls_along_a_branch_and_nothing_grows_beyond_the_threshold() {
    let mut risky = 0;
    walk(&generator(200), 12, 3, |world, scene, answer| {
        let tree = with_risks(&answer.tree, world, scene);
        for (index, node) in tree.nodes.iter().enumerate().skip(1) {
            let parent = &tree.nodes[node.parent as usize];
            assert!(node.risk >= parent.risk && node.depth == parent.depth + 1 && node.depth <= DEPTH);
            risky += usize::from(node.risk > 0.9);
            // Those that were free when they were grown from may have become risky since.
            if answer.tree.parent.len() == 201 {
                assert!(parent.risk <= 0.9, "node {index} grew from a risk of {}", parent.risk);
            }
        }
    });
    assert!(risky > 0, "nothing was ever in the way");
}

#[test]
fn no_offered_path_runs_a_greater_risk_than_the_threshold() {
    let mut risky = 0;
    walk(&generator(200), 12, 3, |world, scene, answer| {
        let tree = with_risks(&answer.tree, world, scene);
        let moments = (0..=DEPTH).map(|d| 0.3 * f64::from(d));
        let risk = CollisionRisk::new(
            &scene.people,
            ForecastParams::default(),
            world.robot.radius(),
            &crate::collision_risk::RiskParams::default(),
            moments,
        );
        for i in 0..answer.candidates.len() {
            for (k, pose) in poses(&answer.candidates, i, 0).into_iter().enumerate() {
                // Braking after the branch is not the tree's.
                let Some(node) = tree.nodes.iter().find(|n| n.pose == pose && n.depth as usize == k + 1)
                else {
                    break;
                };
                assert!(node.risk <= 0.9 && risk.at(k + 1, pose.position()) <= node.risk + 1e-9);
                risky += usize::from(node.risk > 0.01);
            }
        }
    });
    assert!(risky > 50, "only {risky} poses ran any risk");
}

#[test]
fn following_the_path_keeps_what_is_ahead_and_nothing_else() {
    let mut before: Option<TimeTree> = None;
    let mut followed = 0;
    // No growth but in the first cycle, so that what is left can be compared.
    let grows = generator(400);
    let stays = generator(0);
    let world = World::new(furnished(), Point2::new(14.0, 26.0));
    walk_in(
        &world,
        |cycle| if cycle == 0 { &grows } else { &stays },
        5,
        3,
        |world, scene, answer| {
            let tree = read(&answer.tree, &world.robot);
            assert!((tree.stamp - scene.stamp).abs() < 1e-9);
            if let Some(old) = &before {
                let same = |a: &crate::generation::risk_rrt::time_tree::Node,
                            b: &crate::generation::risk_rrt::time_tree::Node| {
                    a.pose == b.pose && a.twist == b.twist
                };
                let root = (0..old.nodes.len())
                    .find(|&n| old.nodes[n].depth == 1 && same(&old.nodes[n], &tree.nodes[0]))
                    .unwrap();
                // Everything that hung on the new root, and only that, each one step less deep, at its time.
                let kept: Vec<usize> =
                    (0..old.nodes.len()).filter(|&n| n == root || old.branch(n).contains(&root)).collect();
                assert_eq!(kept.len(), tree.nodes.len());
                for (new, &n) in kept.iter().enumerate() {
                    assert!(same(&tree.nodes[new], &old.nodes[n]));
                    assert_eq!(tree.nodes[new].depth + 1, old.nodes[n].depth);
                    assert!((tree.time(new) - old.time(n)).abs() < 1e-9);
                }
                followed += 1;
            }
            before = Some(tree);
        },
    );
    assert_eq!(followed, 4);
}

#[test]
fn the_path_that_the_term_prefers_comes_first_and_no_node_is_better() {
    // No walls, so that no path is left out because it would brake into one.
    let world = World::new(hall(&[]), Point2::new(14.0, 26.0));
    let generator = generator(200);
    walk_in(
        &world,
        |_| &generator,
        6,
        3,
        |world, scene, answer| {
            let tree = with_risks(&answer.tree, world, scene);
            let weighing = crate::collision_risk::RiskParams::default();
            let radius = world.robot.radius();
            let forecast = ForecastParams::default();
            let map = std::sync::Arc::new(world.map.clone());
            let goal = world.goal;
            let term =
                crate::evaluation::risk::RiskEvaluator { map, goal, radius, forecast, params: weighing };
            let costs =
                crate::evaluation::Evaluator::evaluate(&term, scene, &answer.candidates, &|| false).unwrap();
            assert!(costs.iter().all(|cost| costs[0] <= cost + 1e-9), "at {}", scene.stamp);
            let root_distance = tree.nodes[0].pose.position().distance(world.goal);
            for n in tree.nodes[1..].iter().filter(|n| n.risk <= 0.9) {
                let node = weighing.node_cost(n.pose, n.risk, root_distance, world.goal);
                assert!(costs[0] <= node + 1e-6, "at {}: {} {node}", scene.stamp, costs[0]);
            }
        },
    );
}

/// Candidates start where the robot will be and obey its limits, whatever part of a step has passed.
fn can_be_driven(generator: &Generator, ticks: u64) {
    let mut offered = 0;
    walk(generator, 8, ticks, |world, scene, answer| {
        let set = &answer.candidates;
        let robot = &world.robot;
        assert_eq!((set.steps(), set.dt()), (57, 0.3));
        for i in 0..set.len() {
            let mut position = scene.belief.pose.position();
            let mut twist: Option<Twist> = None;
            for (k, pose) in set.range(i).zip(poses(set, i, 0)) {
                let next = Twist { v: set.all_states().v[k], omega: set.all_states().omega[k] };
                assert!((0.0..=robot.v_max).contains(&next.v) && next.omega.abs() <= robot.omega_max);
                assert!(position.distance(pose.position()) <= 0.31, "a leap at state {k}");
                if let Some(twist) = twist {
                    assert!((next.v - twist.v).abs() <= 0.15 + 1e-9);
                    assert!((next.omega - twist.omega).abs() <= 0.3 + 1e-9);
                }
                (position, twist) = (pose.position(), Some(next));
            }
            assert_eq!(twist, Some(Twist::default()));
            offered += 1;
        }
    });
    assert!(offered > 50, "only {offered}");
}

#[test]
fn candidates_can_be_driven_and_end_standing() {
    can_be_driven(&generator(200), 3);
}

#[test]
fn cycles_shorter_than_a_step_follow_the_same_tree() {
    can_be_driven(&generator(200), 1);
    let mut sizes = Vec::new();
    walk(&generator(50), 6, 1, |_, _, answer| sizes.push(answer.tree.parent.len()));
    // Within the first step nothing is left behind: 50 more nodes a cycle.
    assert_eq!(sizes[..3], [51, 101, 151]);
}

#[test]
fn same_seed_same_tree() {
    let run = |seed: u64| {
        let world = World::new(furnished(), Point2::new(14.0, 26.0));
        let scene = scene(0, Pose2::new(12.0, 8.0, 1.2), Twist::default(), &crowd(1));
        generator(200).generate(&world.input(&scene, None), None, seed, &|| 0.0)
    };
    assert_eq!(run(5), run(5));
    assert_ne!(run(5).tree, run(6).tree);
}

#[test]
fn a_value_becomes_the_same_tree_again_and_a_foreign_one_is_not_gone_on_with() {
    let world = World::new(furnished(), Point2::new(14.0, 26.0));
    let pose = Pose2::new(12.0, 8.0, 1.2);
    let twist = Twist { v: 0.3, omega: 0.1 };
    let scene = scene(0, pose, twist, &crowd(1));
    let input = world.input(&scene, None);
    let fresh = generator(200).generate(&input, None, 1, &|| 0.0);
    let tree = read(&fresh.tree, &world.robot);
    assert_eq!(tree.to_value(), fresh.tree);
    assert!(fresh.tree.is_sound());

    let others = [
        Generator::rrt_star().generate(&input, None, 1, &|| 0.0).tree,
        Generator::new("bi-risk-rrt", generator(200).params).generate(&input, None, 1, &|| 0.0).tree,
        Tree::default(),
    ];
    let driven = poses(&fresh.candidates, 0, 0);
    let input = world.input(&scene, Some(&driven));
    for other in others {
        assert_eq!(generator(200).generate(&input, Some(other), 1, &|| 0.0), fresh);
    }
    let mut faster = fresh.tree.clone();
    faster.columns.get_mut("v").unwrap()[150] = 3.0;
    assert_eq!(TimeTree::from_value(&faster, &lattice(&world.robot), DEPTH), None);
    let mut shorter = fresh.tree.clone();
    shorter.columns.get_mut("omega").unwrap().pop();
    assert_eq!(TimeTree::from_value(&shorter, &lattice(&world.robot), DEPTH), None);
    let mut without_heading = fresh.tree.clone();
    without_heading.columns.get_mut("root").unwrap().pop();
    assert_eq!(TimeTree::from_value(&without_heading, &lattice(&world.robot), DEPTH), None);
    assert_eq!(TimeTree::from_value(&fresh.tree, &lattice(&world.robot), 2), None);
    // And the paper's planner does not go on with this one.
    let star = Generator::rrt_star();
    let alone = star.generate(&input, None, 1, &|| 0.0);
    assert_eq!(star.generate(&input, Some(fresh.tree), 1, &|| 0.0), alone);
}

#[test]
fn a_tree_of_any_other_time_is_not_gone_on_with() {
    let world = World::new(furnished(), Point2::new(14.0, 26.0));
    let pose = Pose2::new(12.0, 8.0, 1.2);
    let scene = scene(0, pose, Twist { v: 0.6, omega: 0.0 }, &crowd(1));
    let fresh = generator(50).generate(&world.input(&scene, None), None, 1, &|| 0.0);
    let driven = poses(&fresh.candidates, 0, 0);
    let input = world.input(&scene, Some(&driven));
    // So long ago that steps since then do not fit into 32 bits, with the robot's next pose for a root.
    for ago in [1e3, 0.3 * f64::from(u32::MAX) - 0.15, 1e12] {
        let mut tree = fresh.tree.clone();
        let next = driven[0];
        tree.columns.insert("root".to_owned(), vec![next.x, next.y, next.heading, scene.stamp - ago]);
        assert_eq!(generator(50).generate(&input, Some(tree), 1, &|| 0.0).tree, fresh.tree, "{ago}");
    }
}

#[test]
fn off_its_path_the_robot_starts_a_new_tree() {
    let world = World::new(furnished(), Point2::new(14.0, 26.0));
    let start = Pose2::new(12.0, 8.0, 1.2);
    let first = scene(0, start, Twist { v: 0.6, omega: 0.0 }, &crowd(1));
    let answer = generator(200).generate(&world.input(&first, None), None, 1, &|| 0.0);
    let driven = poses(&answer.candidates, 0, 1);
    let on_path = poses(&answer.candidates, 0, 0)[0];
    let tree_at = |aside: f64| {
        let pose = Pose2::new(on_path.x + aside, on_path.y, on_path.heading);
        let second = scene(3, pose, Twist { v: 0.6, omega: 0.0 }, &crowd(1));
        generator(0)
            .generate(&world.input(&second, Some(&driven)), Some(answer.tree.clone()), 1, &|| 0.0)
            .tree
    };
    assert!(tree_at(0.0).parent.len() > 1);
    assert_eq!(tree_at(0.29), tree_at(0.0));
    assert_eq!(tree_at(0.31).parent.len(), 1);
}
