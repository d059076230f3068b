//! What a group that takes the room of its hull costs, under `cnc` and `human-space`.

use nalgebra::Matrix3;

use crate::candidates::CandidateSet;
use crate::convex_hull::{convex_hull, distance_squared};
use crate::crowd_cluster::{GroupParams, GroupShape, Linkage, crowd_clusters};
use crate::evaluation::Evaluator;
use crate::evaluation::hccdm::{ComponentMotion, Hccdm, HccdmEvaluator, HccdmParams, Kernel};
use crate::evaluation::human_space::{HumanSpaceEvaluator, HumanSpaceParams};
use crate::geometry::{Point2, Pose2, Twist};
use crate::lanes::tests::levels;
use crate::random::{Rng, rng, uniform};
use crate::scene::{Belief, People, Scene};
use crate::states::States;

/// Those of the profile `curionav`.
fn groups() -> GroupParams {
    GroupParams {
        linkage: Linkage::DistanceAndVelocity,
        social_distance: 1.25,
        velocity_difference: 0.6,
        shape: GroupShape::Hull,
    }
}

fn hccdm(kernel: Kernel, motion: ComponentMotion) -> HccdmParams {
    HccdmParams { kernel, motion, ..HccdmParams::default() }
}

fn scene(people: People) -> Scene {
    let belief =
        Belief { pose: Pose2::default(), covariance: Matrix3::identity() * 0.01, twist: Twist::default() };
    Scene::new(belief, people)
}

/// A robot that stands at each place for five states.
fn standing(at: &[Point2]) -> CandidateSet {
    let mut states = States::default();
    for p in at {
        (0..5).for_each(|_| states.push(Pose2::new(p.x, p.y, 0.0), Twist::default()));
    }
    CandidateSet::new(5, 0.3, (0..at.len() as u32).collect(), states).unwrap()
}

fn human_space(people: &People, at: Point2) -> f64 {
    let term = HumanSpaceEvaluator { params: HumanSpaceParams::default(), groups: groups(), sight: None };
    term.evaluate(&scene(people.clone()), &standing(&[at]), &|| false).unwrap()[0]
}

/// Density under each kernel, at a place 0.3 s from now.
fn densities(people: &People, at: Point2) -> [f64; 2] {
    [Kernel::Gaussian, Kernel::Flat].map(|kernel| {
        let params = hccdm(kernel, ComponentMotion::Moving);
        Hccdm::build(people, &params, &groups(), None, 1, 0.3).cost(&[at.x], &[at.y])
    })
}

/// People in groups of one to five who walk alike, some of them in a row, within 12 m.
fn random_groups(r: &mut Rng) -> People {
    let mut each = Vec::new();
    while each.len() < 20 {
        let place = [12.0 * uniform(r), 12.0 * uniform(r)];
        let velocity = [2.0 * uniform(r) - 1.0, 2.0 * uniform(r) - 1.0];
        let is_row = uniform(r) < 0.3;
        for k in 0..1 + (5.0 * uniform(r)) as usize {
            let aside = if is_row { 0.0 } else { 1.5 * uniform(r) };
            let [vx, vy] = velocity.map(|v| v + 0.2 * uniform(r));
            each.push([place[0] + k as f64, place[1] + aside, vx, vy]);
        }
    }
    let variances = |r: &mut Rng| (0..each.len()).map(|_| 0.3 * uniform(r)).collect();
    let position_variance = variances(r);
    let velocity_variance = variances(r);
    People { position_variance, velocity_variance, ..People::walking(0.25, &each) }
}

#[test]
fn the_end_of_a_queue_of_eight_has_at_least_the_room_of_a_lone_person() {
    let queue = |spacing: f64| {
        let row: Vec<[f64; 4]> = (0..8).map(|k| [spacing * f64::from(k), 0.0, 0.0, 0.0]).collect();
        People::walking(0.25, &row)
    };
    let lone = queue(1.0).pick([0]);
    for spacing in [0.6, 1.0, 1.2, 2.0] {
        // At the end, beside it, and up to where a person has no room left.
        for (x, y) in [(0.0, 0.0), (-0.5, 0.0), (-1.5, 0.0), (-2.0, 1.0), (0.0, 1.5), (0.0, 3.0)] {
            let at = Point2::new(x, y);
            let pairs = densities(&queue(spacing), at).into_iter().zip(densities(&lone, at));
            for (of_queue, of_lone) in pairs {
                assert!(of_queue >= of_lone * (1.0 - 1e-9), "{spacing}, at {at:?}: {of_queue} and {of_lone}");
            }
            let [of_queue, of_lone] = [&queue(spacing), &lone].map(|people| human_space(people, at));
            assert!(of_queue >= of_lone * (1.0 - 1e-12), "{spacing}, at {at:?}: {of_queue} and {of_lone}");
        }
    }
    let paper = Hccdm::build(&queue(2.0), &HccdmParams::default(), &GroupParams::default(), None, 1, 0.3);
    let [of_lone, _] = densities(&lone, Point2::default());
    assert!(paper.cost(&[0.0], &[0.0]) < 0.1 * of_lone, "what the paper's reading gives");
}

#[test]
fn every_member_has_at_least_the_density_and_the_room_that_it_would_have_alone() {
    let mut crowds = 0;
    for seed in 0..100 {
        let mut r = rng(seed, 62);
        let people = random_groups(&mut r);
        crowds += crowd_clusters(&people, &groups(), None).iter().filter(|group| group.len() > 2).count();
        for i in 0..people.len() {
            let at = people.position_after(i, 0.3);
            let alone = people.pick([i]);
            for (all, one) in densities(&people, at).into_iter().zip(densities(&alone, at)) {
                assert!(all >= one * (1.0 - 1e-9), "seed {seed}, person {i}: {all} and {one}");
            }
            assert!(human_space(&people, at) >= human_space(&alone, at) * (1.0 - 1e-12), "seed {seed}");
        }
    }
    assert!(crowds > 100, "groups of three and more: {crowds}");
}

#[test]
fn a_group_holds_as_many_people_as_it_has() {
    // A triangle and a row: nowhere as thin as a lone person, so that Steiner's formula alone decides.
    let crowds: [&[[f64; 4]]; 2] = [
        &[[0.0, 0.0, 0.3, 0.0], [1.0, 0.1, 0.3, 0.0], [0.4, 0.8, 0.3, 0.1]],
        &[[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0], [3.0, 0.0, 0.0, 0.0]],
    ];
    for rows in crowds {
        let people = People::walking(0.25, rows);
        for kernel in [Kernel::Gaussian, Kernel::Flat] {
            let map = Hccdm::build(&people, &hccdm(kernel, ComponentMotion::Moving), &groups(), None, 1, 0.3);
            assert_eq!(map.components().len(), 1);
            let axis = (-70..=100).map(|k| 0.1 * f64::from(k));
            let places = axis.clone().flat_map(|x| axis.clone().map(move |y| (x, y)));
            let held: f64 = places.map(|(x, y)| 0.01 * map.cost(&[x], &[y])).sum();
            let count = rows.len() as f64;
            assert!((held - count).abs() < 0.01 * count, "{kernel:?}: {held} of {count}");
        }
    }
}

#[test]
fn costs_are_those_of_a_plain_look_at_every_hull_with_every_kind_of_vectors() {
    for seed in 0..60 {
        let mut r = rng(seed, 63);
        let people = random_groups(&mut r);
        let kernel = if seed % 2 == 0 { Kernel::Gaussian } else { Kernel::Flat };
        let params = hccdm(kernel, ComponentMotion::Frozen);
        let steps = 11;
        let mut states = States::default();
        for _ in 0..steps {
            states.push(Pose2::new(14.0 * uniform(&mut r), 14.0 * uniform(&mut r), 0.0), Twist::default());
        }
        let set = CandidateSet::new(steps, 0.3, vec![0], states).unwrap();
        let map = Hccdm::build(&people, &params, &groups(), None, steps, 0.3);
        let mut expected = 0.0;
        for k in 0..steps {
            let p = set.all_states().position(k);
            for (component, members) in map.components().iter().zip(crowd_clusters(&people, &groups(), None))
            {
                let points: Vec<Point2> = members.iter().map(|&i| people.position(i)).collect();
                // The height is what the map has in the middle of the hull.
                let middle = convex_hull(&points);
                let n = middle.len() as f64;
                let x = middle.iter().map(|p| p.x).sum::<f64>() / n;
                let y = middle.iter().map(|p| p.y).sum::<f64>() / n;
                let alone = Hccdm::build(&people.pick(members), &params, &groups(), None, 1, 0.3);
                let q = 0.5 * distance_squared(&middle, p) / component.variance;
                let share = match kernel {
                    Kernel::Gaussian if q <= 8.0 => crate::numerics::exp(-q),
                    Kernel::Flat if std::f64::consts::LN_2 * q * q <= 8.0 => {
                        crate::numerics::exp(-std::f64::consts::LN_2 * q * q)
                    }
                    _ => 0.0,
                };
                expected += alone.cost(&[x], &[y]) * share;
            }
        }
        let term = HccdmEvaluator { params, groups: groups(), sight: None };
        let scene = scene(people);
        let found = term.evaluate(&scene, &set, &|| false).unwrap()[0];
        assert!(
            (found - expected).abs() <= 1e-9 * expected.max(1e-3),
            "seed {seed}: {found}, not {expected}"
        );
        for level in levels() {
            let cost = term.evaluate_at(level, &scene, &set, &|| false).unwrap()[0];
            assert_eq!(cost.to_bits(), found.to_bits(), "seed {seed}, {level:?}");
        }
    }
}

#[test]
fn neither_the_order_of_people_nor_other_candidates_change_a_cost() {
    for seed in 0..20 {
        let mut r = rng(seed, 64);
        let people = random_groups(&mut r);
        let count = people.len();
        let order: Vec<usize> = (0..count).rev().collect();
        let shuffled = people.pick(order);
        let places: Vec<Point2> =
            (0..30).map(|_| Point2::new(14.0 * uniform(&mut r), 14.0 * uniform(&mut r))).collect();
        let set = standing(&places);
        let cnc = HccdmEvaluator { params: HccdmParams::default(), groups: groups(), sight: None };
        let space =
            HumanSpaceEvaluator { params: HumanSpaceParams::default(), groups: groups(), sight: None };
        let terms: [&dyn Evaluator; 2] = [&cnc, &space];
        for term in terms {
            let costs = term.evaluate(&scene(people.clone()), &set, &|| false).unwrap();
            let again = term.evaluate(&scene(shuffled.clone()), &set, &|| false).unwrap();
            for (i, (cost, other)) in costs.iter().zip(&again).enumerate() {
                assert!((cost - other).abs() <= 1e-12 * cost.max(1.0), "seed {seed}: {cost}, {other}");
                let alone = term.evaluate(&scene(people.clone()), &set.pick(i..i + 1), &|| false).unwrap();
                assert_eq!(alone[0].to_bits(), cost.to_bits(), "seed {seed}");
            }
        }
    }
}
