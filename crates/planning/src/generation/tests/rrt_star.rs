//! Claims about the tree's growth.

use super::*;
use crate::generation::dubins::Dubins;

const RADIUS: f64 = 4.9;

fn alone(pose: Pose2) -> Scene {
    let belief = Belief { pose, covariance: Matrix3::zeros(), twist: Twist::default() };
    let people = People { radius: 0.3, ..People::default() };
    Scene::new(belief, people)
}

fn checker<'a>(map: &'a StaticMap, scene: &'a Scene) -> CollisionChecker<'a> {
    let robot = RobotModel::default();
    let forecast = ForecastParams::default();
    CollisionChecker::new(map, &robot, scene, forecast, &CollisionParams::default())
}

fn grown(
    map: &StaticMap,
    scene: &Scene,
    tree: PoseTree,
    params: &RrtStarParams,
    iterations: u32,
    seed: u64,
) -> PoseTree {
    let checker = checker(map, scene);
    let centre = scene.belief.pose.position();
    let space =
        SampleSpace { grid: &map.grid, centre, radius: RADIUS, way: &[], landmarks: &Landmarks::default() };
    let mut search = RrtStar::new(params, &checker, &space, tree);
    search.grow(iterations, &mut rng(seed, 0), &Pace::new(&|| 0.0));
    search.into_tree()
}

#[test]
fn edges_are_clear_and_costs_are_their_lengths() {
    let map = furnished();
    let params = RrtStarParams::default();
    let scene = alone(Pose2::new(12.0, 12.0, 1.2));
    let tree = grown(&map, &scene, PoseTree::rooted(scene.belief.pose), &params, 600, 3);
    assert!(tree.clone().into_value().is_sound());
    assert!(tree.len() > 200, "{}", tree.len());
    let checker = checker(&map, &scene);
    for n in 1..tree.len() {
        let parent = tree.parent(n).unwrap();
        let path = Dubins::shortest(tree.pose(parent).into(), tree.pose(n).into(), params.turning_radius);
        assert!((tree.cost[parent] + path.length() - tree.cost[n]).abs() < 1e-6);
        assert!(path.length() <= params.max_edge + 1e-9);
        assert!(path.walk(0.05, |p| checker.wall_clear(p).then_some(0.05)), "node {n}");
    }
}

#[test]
fn more_samples_only_shorten_the_ways_there_are() {
    let map = furnished();
    let scene = alone(Pose2::new(12.0, 9.0, 1.2));
    let params = RrtStarParams { max_nodes: 3000, ..RrtStarParams::default() };
    for seed in 0..5 {
        let early = grown(&map, &scene, PoseTree::rooted(scene.belief.pose), &params, 300, seed);
        let late = grown(&map, &scene, early.clone(), &params, 2000, seed + 100);
        // poses never move, so each early node is found again among the late ones
        let cost = |pose: Pose2| (0..late.len()).find(|&n| late.pose(n) == pose).map(|n| late.cost[n]);
        let mut before = 0.0;
        let mut after = 0.0;
        for n in 0..early.len() {
            let now = cost(early.pose(n)).unwrap();
            assert!(now <= early.cost[n] + 1e-6);
            (before, after) = (before + early.cost[n], after + now);
        }
        assert!(after < 0.99 * before, "seed {seed}: {before} -> {after}");
    }
}

#[test]
fn a_full_tree_stays_within_its_bound() {
    let map = furnished();
    let scene = alone(Pose2::new(12.0, 9.0, 1.2));
    let params = RrtStarParams { max_nodes: 100, ..RrtStarParams::default() };
    let tree = grown(&map, &scene, PoseTree::rooted(scene.belief.pose), &params, 1000, 1);
    assert_eq!(tree.len(), 100);
    let thin = crate::generation::update::thin(tree, 40, |t, n| t.cost[n]);
    assert!(thin.len() == 40 && thin.into_value().is_sound());
}
