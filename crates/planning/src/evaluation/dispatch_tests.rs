//! Whatever vectors a machine has, costs and decisions are the same.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use crate::arbitration::{Action, Context, Scores, arbitrate};
use crate::candidates::CandidateSet;
use crate::collision_risk::RiskParams;
use crate::crowd_cluster::GroupParams;
use crate::evaluation::cpc::{
    CpcEvaluator, CpcOccludedEvaluator, CpcParams, InformationField, InformationParams, RayField,
};
use crate::evaluation::distance::DistanceEvaluator;
use crate::evaluation::hccdm::{HccdmEvaluator, HccdmParams};
use crate::evaluation::risk::RiskEvaluator;
use crate::forecast::ForecastParams;
use crate::generation::{GenerationInput, Tree, find};
use crate::geometry::{Point2, Pose2, Twist};
use crate::lanes::{Level, tests::levels};
use crate::motion::{OdometryNoise, RobotModel, step};
use crate::occupancy::{GeodesicField, OccupancyGrid, StaticMap};
use crate::profile::Profile;
use crate::random::{Rng, rng, uniform};
use crate::scene::{Belief, People, Scene};
use crate::sensor::LaserModel;
use crate::states::States;

const GOAL: Point2 = Point2::new(17.0, 8.0);

/// A hall of 20 m x 10 m with pillars, and what the terms look up in it.
struct Hall {
    map: StaticMap,
    geodesic: Arc<GeodesicField>,
    cnc: HccdmEvaluator,
    cpc: CpcEvaluator,
    occluded: CpcOccludedEvaluator,
    distance: DistanceEvaluator,
}

impl Hall {
    fn new(origin: Pose2, laser: LaserModel) -> Self {
        let solid = |c: usize, r: usize| {
            c < 2 || r < 2 || c >= 198 || r >= 98 || (c % 50 < 6 && r % 40 < 6 && c > 20)
        };
        let cells = (0..200 * 100).map(|i| if solid(i % 200, i / 200) { 100 } else { 0 }).collect();
        let map = StaticMap::new(OccupancyGrid::new(200, 100, 0.1, origin, cells).unwrap());
        let geodesic = Arc::new(GeodesicField::new(&map, GOAL, 0.45));
        let params = InformationParams::default();
        let information = Arc::new(InformationField::new(&map, &laser, &params));
        let rays = Arc::new(RayField::new(&information, &map, &laser, &params));
        let cpc = CpcEvaluator::new(information, OdometryNoise::default(), CpcParams::default());
        Self {
            cnc: HccdmEvaluator {
                params: HccdmParams::default(),
                groups: GroupParams::default(),
                sight: None,
            },
            occluded: CpcOccludedEvaluator::new(cpc.clone(), rays, ForecastParams::default()),
            cpc,
            distance: DistanceEvaluator::Geodesic(Arc::clone(&geodesic)),
            geodesic,
            map,
        }
    }

    /// Costs under cnc, cpc and distance.
    fn costs(&self, level: Level, scene: &Scene, set: &CandidateSet) -> [(&'static str, Vec<f64>); 3] {
        let never = || false;
        [
            ("cnc", self.cnc.evaluate_at(level, scene, set, &never).unwrap()),
            ("cpc", self.cpc.evaluate_at(level, scene, set, &never).unwrap()),
            ("distance", self.distance.evaluate_at(level, set, &never).unwrap()),
        ]
    }
}

fn between(r: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * uniform(r)
}

fn scene(r: &mut Rng, pose: Pose2, twist: Twist) -> Scene {
    let people = 30;
    let mut draws = |low: f64, high: f64| (0..people).map(|_| between(r, low, high)).collect::<Vec<f64>>();
    let people = People {
        id: (0..people).collect(),
        x: draws(4.0, 20.0),
        y: draws(0.0, 10.0),
        vx: draws(-1.0, 1.0),
        vy: draws(-1.0, 1.0),
        radius: 0.25,
        ..People::default()
    };
    let covariance = Matrix3::from_diagonal(&Vector3::new(0.15, 0.1, 0.03));
    Scene { uncertain: true, ..Scene::new(Belief { pose, covariance, twist }, people) }
}

/// Drives from anywhere, also outside the map.
fn wandering(r: &mut Rng, count: usize, steps: usize) -> CandidateSet {
    let mut states = States::default();
    for _ in 0..count {
        let mut pose = Pose2::new(between(r, -1.0, 21.0), between(r, -1.0, 11.0), between(r, -9.0, 9.0));
        for _ in 0..steps {
            let twist = Twist { v: between(r, -0.2, 2.5), omega: between(r, -1.0, 1.0) };
            pose = step(pose, twist, 0.3);
            states.push(pose, twist);
        }
    }
    CandidateSet::new(steps, 0.3, (0..count as u32).collect(), states).unwrap()
}

#[test]
fn every_kind_of_vectors_gives_the_same_costs_bit_for_bit() {
    let levels = levels();
    let lever = Pose2::new(0.2, -0.1, 0.3);
    for (seed, origin, robot_from_laser) in
        [(1, Pose2::default(), Pose2::default()), (2, Pose2::new(0.3, -0.2, 0.1), lever)]
    {
        let hall = Hall::new(origin, LaserModel { robot_from_laser, ..LaserModel::default() });
        let risk = RiskEvaluator {
            map: Arc::new(hall.map.clone()),
            goal: GOAL,
            radius: 0.3,
            forecast: ForecastParams::default(),
            params: RiskParams::default(),
        };
        let mut r = rng(seed, 0);
        for (count, steps) in [(1, 1), (7, 3), (8, 8), (43, 13), (100, 56)] {
            let scene = scene(&mut r, Pose2::new(2.0, 5.0, 0.0), Twist::default());
            let set = wandering(&mut r, count, steps);
            let bits = |level| {
                let occluded = hall.occluded.evaluate_at(level, &scene, &set, &|| false).unwrap();
                hall.costs(level, &scene, &set)
                    .map(|(_, costs)| costs)
                    .into_iter()
                    .chain([risk.evaluate_at(level, &scene, &set, &|| false).unwrap(), occluded])
                    .map(|costs| costs.iter().map(|c| c.to_bits()).collect::<Vec<_>>())
                    .collect::<Vec<_>>()
            };
            let first = bits(levels[0]);
            for &level in &levels[1..] {
                assert_eq!(bits(level), first, "seed {seed}, {level:?}, {count} x {steps}");
            }
        }
    }
}

/// States that a robot passes in ten cycles that are planned with vectors of this kind.
fn drive(hall: &Hall, level: Level, seed: u64) -> Vec<Pose2> {
    let profile = Profile::default();
    let robot = RobotModel::default();
    let mut r = rng(seed, 1);
    let generator = find("rrt-star").unwrap();
    let mut scene = scene(&mut r, Pose2::new(2.0, 5.0, 0.0), Twist::default());
    let (mut tree, mut way): (Option<Tree>, Vec<Pose2>) = (None, Vec::new());
    for cycle in 0..10 {
        (scene.tick, scene.stamp) = (3 * cycle, 0.3 * cycle as f64);
        let input = GenerationInput {
            params: &profile.generator_part(),
            map: &hall.map,
            goal: GOAL,
            geodesic: &hall.geodesic,
            information: None,
            robot: &robot,
            scene: &scene,
            previous: None,
            seed,
        };
        let (generated, _) = generator.generate(&input, tree.take(), &|| 0.0);
        let candidates = &generated.candidates;
        let mut scores = Scores::new(candidates.len());
        for (term, costs) in hall.costs(level, &scene, candidates) {
            scores.insert(term, 0, &costs).unwrap();
        }
        let context = Context {
            profile: &profile,
            scene: &scene,
            map: &hall.map,
            robot: &robot,
            goal: GOAL,
            goal_heading: None,
            candidates,
            previous: None,
        };
        let decision = arbitrate(&context, &scores).decision;
        if decision.action == Action::Follow {
            let (pose, twist) = decision.trajectory.states().at(0);
            (scene.belief.pose, scene.belief.twist) = (pose, twist);
            way.extend((0..decision.trajectory.len()).map(|k| decision.trajectory.states().pose(k)));
        }
        tree = Some(generated.tree);
    }
    way
}

#[test]
fn every_kind_of_vectors_leads_to_the_same_decisions() {
    let hall = Hall::new(Pose2::default(), LaserModel::default());
    let levels = levels();
    for seed in 1..4 {
        let first = drive(&hall, levels[0], seed);
        assert!(first.len() > 5 * 13, "seed {seed}: a robot that is followed: {}", first.len());
        for &level in &levels[1..] {
            let way = drive(&hall, level, seed);
            assert!(way == first, "seed {seed}: {level:?} decides otherwise");
        }
    }
}
