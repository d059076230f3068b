//! Claims about taking the tree over.

use super::*;
use crate::generation::pose_tree::Nodes;

#[test]
fn standing_still_loses_nothing_and_a_far_jump_starts_afresh() {
    let world = World::new(furnished(), Point2::new(14.0, 26.0));
    let people = People { radius: 0.3, ..People::default() };
    let params = Profile::default().generator_part();
    let pose = Pose2::new(12.0, 8.0, 1.6);
    let here = scene(0, pose, Twist::default(), &people);
    let tree = Generator::rrt_star().generate(&world.input(&here, None), None, 1, &|| 0.0).tree;
    let reroot = |pose: Pose2| {
        let scene = scene(3, pose, Twist::default(), &people);
        let checker = CollisionChecker::new(
            &world.map,
            &world.robot,
            &scene,
            ForecastParams::default(),
            &params.collision,
        );
        let nodes = Nodes::of(&tree).unwrap();
        crate::generation::update::reroot(nodes, pose, 4.9, &params.generation.tree, &checker)
    };
    let same = reroot(pose);
    // a node may stick out of the disc it was sampled in
    assert!(same.len() * 20 >= tree.parent.len() * 19, "{} of {}", same.len(), tree.parent.len());
    assert_eq!(reroot(Pose2::new(27.0, 27.0, 0.0)).len(), 1);
}

#[test]
fn moving_on_keeps_most_of_the_tree() {
    let world = World::new(furnished(), Point2::new(14.0, 26.0));
    let people = People { radius: 0.3, ..People::default() };
    let params = Profile::default().generator_part();
    for seed in 0..5 {
        let mut tree = None;
        let mut pose = Pose2::new(15.0, 2.0, 1.6);
        for k in 0..5 {
            let scene = scene(3 * k, pose, Twist { v: 0.9, omega: 0.0 }, &people);
            let input = world.input(&scene, None);
            let answer = Generator::rrt_star().generate(&input, tree.take(), seed, &|| 0.0);
            let best = (0..answer.candidates.len()).next().unwrap();
            let first = answer.candidates.range(best).start;
            let set = &answer.candidates;
            let next = set.all_states().pose(first);
            let moved = self::scene(3 * k + 3, next, Twist { v: 0.9, omega: 0.0 }, &people);
            let checker = CollisionChecker::new(
                &world.map,
                &world.robot,
                &moved,
                ForecastParams::default(),
                &params.collision,
            );
            // reachable: still in the disc and not behind the robot's turning circles
            let nodes = Nodes::of(&answer.tree).unwrap();
            let reachable = (1..nodes.len())
                .filter(|&n| {
                    let p = next.inverse_transform(nodes.position(n));
                    nodes.position(n).distance(next.position()) < 4.9 && p.x > 0.0
                })
                .count();
            let kept = crate::generation::update::reroot(nodes, next, 4.9, &params.generation.tree, &checker);
            assert!(kept.clone().into_value().is_sound());
            println!(
                "seed {seed} cycle {k}: {} nodes, {reachable} reachable, {} kept",
                answer.tree.parent.len(),
                kept.len()
            );
            assert!(kept.len() * 2 >= reachable, "seed {seed}: {} of {reachable}", kept.len());
            tree = Some(answer.tree);
            pose = next;
        }
    }
}
