use super::*;
use crate::crowd_cluster::Linkage;
use crate::crowd_cluster::tests::plain_clusters;
use crate::evaluation::Stopped;
use crate::evaluation::enclosing_circle::tests::brute_force_circle;
use crate::geometry::{Pose2, Twist};
use crate::parameters::Ranged;
use crate::random::{Rng, rng, uniform};
use crate::scene::Belief;
use crate::states::States;
use nalgebra::Matrix3;

fn between(r: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * uniform(r)
}

/// People from (x, y, vx, vy).
fn people(rows: &[[f64; 4]]) -> People {
    People {
        id: (0..rows.len() as u32).map(|i| 10 + 3 * i).collect(),
        x: rows.iter().map(|p| p[0]).collect(),
        y: rows.iter().map(|p| p[1]).collect(),
        vx: rows.iter().map(|p| p[2]).collect(),
        vy: rows.iter().map(|p| p[3]).collect(),
        radius: 0.25,
        ..People::default()
    }
}

fn random_people(r: &mut Rng, n: usize, side: f64) -> People {
    let rows: Vec<[f64; 4]> = (0..n)
        .map(|_| [between(r, 0.0, side), between(r, 0.0, side), between(r, -1.0, 1.0), between(r, -1.0, 1.0)])
        .collect();
    people(&rows)
}

/// The same people, known with errors.
fn known_badly(r: &mut Rng, people: People) -> People {
    let mut variances = || (0..people.len()).map(|_| between(r, 0.0, 0.5)).collect();
    let position_variance = variances();
    let velocity_variance = variances();
    People { position_variance, velocity_variance, ..people }
}

fn random_params(r: &mut Rng) -> HccdmParams {
    HccdmParams {
        personal_distance: between(r, 0.3, 2.0),
        covariance: if uniform(r) < 0.5 { Covariance::Literal } else { Covariance::Squared },
        weighting: if uniform(r) < 0.5 { Weighting::People } else { Weighting::Share },
        kernel: if uniform(r) < 0.5 { Kernel::Gaussian } else { Kernel::Flat },
        motion: if uniform(r) < 0.3 { ComponentMotion::Frozen } else { ComponentMotion::Moving },
        forecast: ForecastParams::default(),
        saturation: 0.0,
    }
}

/// Groups by any linkage, in circles as the paper has them.
fn random_groups(r: &mut Rng) -> GroupParams {
    GroupParams {
        linkage: if uniform(r) < 0.5 { Linkage::Distance } else { Linkage::DistanceAndVelocity },
        social_distance: between(r, 0.5, 4.0),
        velocity_difference: between(r, 0.2, 2.0),
        ..GroupParams::default()
    }
}

/// The map of groups as the paper has them.
fn build(people: &People, params: &HccdmParams, steps: usize, dt: f64) -> Hccdm {
    Hccdm::build(people, params, &GroupParams::default(), None, steps, dt)
}

/// Straight, evenly driven trajectories from random starts: arrays `[candidate, step]`.
fn random_candidates(r: &mut Rng, count: usize, steps: usize, dt: f64, side: f64) -> CandidateSet {
    let mut states = States::default();
    for _ in 0..count {
        let x0 = between(r, 0.0, side);
        let y0 = between(r, 0.0, side);
        let vx = between(r, -1.0, 1.0);
        let vy = between(r, -1.0, 1.0);
        for t in (0..steps).map(|k| time_of(k, dt)) {
            states.push(Pose2::new(x0 + vx * t, y0 + vy * t, 0.0), Twist::default());
        }
    }
    CandidateSet::new(steps, dt, (0..count as u32).collect(), states).unwrap()
}

fn scene(people: People) -> Scene {
    let belief =
        Belief { pose: Pose2::default(), covariance: Matrix3::identity() * 0.01, twist: Twist::default() };
    Scene::new(belief, people)
}

fn evaluate(
    params: HccdmParams,
    groups: GroupParams,
    people: &People,
    candidates: &CandidateSet,
) -> Vec<f64> {
    HccdmEvaluator { params, groups, sight: None }
        .evaluate(&scene(people.clone()), candidates, &|| false)
        .unwrap()
}

/// Equations 16 to 18 as they stand, with every shortcut left out.
fn plain_cost(
    people: &People,
    params: &HccdmParams,
    groups: &GroupParams,
    dt: f64,
    x: &[f64],
    y: &[f64],
) -> f64 {
    let mut cost = 0.0;
    for cluster in plain_clusters(people, groups) {
        let points: Vec<Point2> = cluster.iter().map(|&i| people.position(i)).collect();
        let eps = cluster.len() as f64;
        let circle = brute_force_circle(&points);
        let sigma = circle.radius + params.personal_distance;
        let error = |of: fn(&People, usize) -> f64| cluster.iter().map(|&i| of(people, i)).sum::<f64>() / eps;
        let v0 = if params.covariance == Covariance::Literal { sigma } else { sigma.powi(2) };
        let v0 = v0 + error(|people, i| people.variances(i).0);
        let p = if params.weighting == Weighting::People { eps } else { eps / people.len() as f64 };
        let vx = cluster.iter().map(|&i| people.vx[i]).sum::<f64>() / eps;
        let vy = cluster.iter().map(|&i| people.vy[i]).sum::<f64>() / eps;
        for k in 0..x.len() {
            let t = (k + 1) as f64 * dt;
            let mut mx = circle.centre.x;
            let mut my = circle.centre.y;
            let mut v = v0;
            if params.motion == ComponentMotion::Moving {
                (mx, my) = (mx + vx * t, my + vy * t);
                v += params.forecast.sigma_position.powi(2) + (params.forecast.sigma_velocity * t).powi(2);
                let off = cluster.iter().map(|&i| (people.vx[i] - vx).powi(2) + (people.vy[i] - vy).powi(2));
                v += (0.5 * off.sum::<f64>() / eps + error(|people, i| people.variances(i).1)) * t * t;
            }
            let d2 = (x[k] - mx).powi(2) + (y[k] - my).powi(2);
            let pi = std::f64::consts::PI;
            let half = std::f64::consts::LN_2;
            let q = 0.5 * d2 / v;
            cost += match params.kernel {
                Kernel::Gaussian if q <= 8.0 => p / (2.0 * pi * v) * crate::numerics::exp(-q),
                Kernel::Flat if half * q * q <= 8.0 => {
                    p * half.sqrt() / (pi.powf(1.5) * v) * crate::numerics::exp(-half * q * q)
                }
                _ => 0.0,
            };
        }
    }
    cost
}

#[test]
fn five_thousand_random_maps_equal_the_plain_equations() {
    let mut positive = 0;
    for seed in 0..5000 {
        let mut r = rng(seed, 5);
        let n = (uniform(&mut r) * 13.0) as usize;
        let side = between(&mut r, 3.0, 25.0);
        let crowd = random_people(&mut r, n, side);
        let crowd = if seed % 2 == 0 { known_badly(&mut r, crowd) } else { crowd };
        let params = random_params(&mut r);
        let groups = random_groups(&mut r);
        let steps = 1 + (uniform(&mut r) * 30.0) as usize;
        let dt = between(&mut r, 0.05, 0.5);
        let candidates = random_candidates(&mut r, 3, steps, dt, side);
        let costs = evaluate(params, groups, &crowd, &candidates);
        for (i, cost) in costs.into_iter().enumerate() {
            let range = candidates.range(i);
            let x = &candidates.all_states().x[range.clone()];
            let y = &candidates.all_states().y[range];
            let expected = plain_cost(&crowd, &params, &groups, dt, x, y);
            assert!((cost - expected).abs() <= 1e-9 * expected, "seed {seed}: {cost} for {expected}");
            positive += usize::from(cost > 0.0);
        }
    }
    assert!(positive > 10_000, "a test that sees density: {positive}");
}

#[test]
fn sharding_changes_no_cost() {
    for seed in 0..100 {
        let mut r = rng(seed, 6);
        let crowd = random_people(&mut r, (uniform(&mut rng(seed, 7)) * 40.0) as usize, 15.0);
        let params = random_params(&mut r);
        let groups = random_groups(&mut r);
        let candidates = random_candidates(&mut r, 40, 13, 0.3, 15.0);
        let whole = evaluate(params, groups, &crowd, &candidates);
        let cut = (uniform(&mut r) * 40.0) as usize;
        let mut parts = evaluate(params, groups, &crowd, &candidates.pick(0..cut));
        parts.extend(evaluate(params, groups, &crowd, &candidates.pick(cut..40)));
        let bits = |costs: &[f64]| costs.iter().map(|c| c.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&whole), bits(&parts), "seed {seed}");
    }
}

#[test]
fn the_cost_is_the_density_summed_over_the_states_bit_for_bit() {
    for seed in 0..200 {
        let mut r = rng(seed, 8);
        let crowd = random_people(&mut r, 30, 15.0);
        let candidates = random_candidates(&mut r, 1, 21, 0.2, 15.0);
        let params = random_params(&mut r);
        let map = build(&crowd, &params, 21, 0.2);
        let x = &candidates.all_states().x;
        let y = &candidates.all_states().y;
        let sum = (0..21)
            .map(|k| density(&map, &params, time_of(k, 0.2), Point2::new(x[k], y[k])))
            .fold(0.0, |s, d| s + d);
        assert_eq!(map.cost(x, y).to_bits(), sum.to_bits(), "seed {seed}");
    }
}

/// The inner sum of eq. 18: smoothed density of people `t` seconds from now at `p`.
fn density(map: &Hccdm, params: &HccdmParams, t: f64, p: Point2) -> f64 {
    map.components.iter().map(|c| c.state(params, t).density(params.kernel, p)).fold(0.0, |sum, d| sum + d)
}

/// Density now, of the map as printed: frozen, so that no forecast widens it.
fn printed_density(covariance: Covariance, rows: &[[f64; 4]], weighting: Weighting, p: Point2) -> f64 {
    let params =
        HccdmParams { covariance, weighting, motion: ComponentMotion::Frozen, ..HccdmParams::default() };
    density(&build(&people(rows), &params, 1, 0.3), &params, 0.0, p)
}

#[test]
fn individuals_and_crowds_have_the_published_densities() {
    // one person, variance 1.5: 1 / (2 pi 1.5) = 0.106; variance 1.5^2: 0.071
    let one = [[0.0; 4]];
    let at = Point2::new(0.0, 0.0);
    assert!((printed_density(Covariance::Literal, &one, Weighting::People, at) - 0.1061).abs() < 1e-4);
    assert!((printed_density(Covariance::Squared, &one, Weighting::People, at) - 0.0707).abs() < 1e-4);
    // a crowd of seven in a row of radius 3, each counted once: variance 4.5, 1 / (2 pi 4.5) = 0.0354 in
    // the middle, times exp(-9/9) = 0.0130 at the edge, times exp(-4.5^2/9) = 0.0037 at 1.5 m from it
    let row: Vec<[f64; 4]> = (0..7).map(|i| [f64::from(i) - 3.0, 0.0, 0.0, 0.0]).collect();
    let cases = [
        (Covariance::Literal, 0.0, 0.0354),
        (Covariance::Literal, 3.0, 0.0130),
        (Covariance::Literal, 4.5, 0.0037),
        (Covariance::Squared, 0.0, 0.0079),
        (Covariance::Squared, 3.0, 0.0063),
        (Covariance::Squared, 4.5, 0.0048),
    ];
    for (covariance, x, expected) in cases {
        let found = printed_density(covariance, &row, Weighting::Share, Point2::new(x, 0.0));
        assert!((found - expected).abs() < 1e-4, "{covariance:?} at {x}: {found}, not {expected}");
        let people = printed_density(covariance, &row, Weighting::People, Point2::new(x, 0.0));
        assert!((people - 7.0 * found).abs() < 1e-12);
    }
}

#[test]
fn a_flat_component_holds_as_many_people_and_half_of_its_peak_is_left_where_it_is_steep() {
    let params = |kernel| HccdmParams { kernel, motion: ComponentMotion::Frozen, ..HccdmParams::default() };
    let at = |kernel, x: f64, y: f64| {
        let map = build(&people(&[[0.0; 4]]), &params(kernel), 1, 0.3);
        density(&map, &params(kernel), 0.0, Point2::new(x, y))
    };
    for kernel in [Kernel::Gaussian, Kernel::Flat] {
        let places =
            (-60..=60).flat_map(|i| (-60..=60).map(move |k| (0.1 * f64::from(i), 0.1 * f64::from(k))));
        let held: f64 = places.map(|(x, y)| 0.01 * at(kernel, x, y)).sum();
        assert!((held - 1.0).abs() < 1e-3, "{kernel:?} holds {held} people");
    }
    let peak = at(Kernel::Flat, 0.0, 0.0);
    let steep = 3.0_f64.sqrt();
    assert!((at(Kernel::Flat, steep, 0.0) - 0.5 * peak).abs() < 1e-9);
    // Beside the person all is alike; twice as far as where it is steep there is next to nothing.
    assert!(at(Kernel::Flat, 0.7, 0.0) > 0.98 * peak && at(Kernel::Flat, 1.9 * steep, 0.0) < 1e-3 * peak);
    assert!(at(Kernel::Gaussian, 0.7, 0.0) < 0.9 * at(Kernel::Gaussian, 0.0, 0.0));
}

#[test]
fn people_who_walk_apart_leave_free_what_was_between_them() {
    // Two who pass each other at 1 m/s each, 2 m apart now; and two who walk side by side.
    let apart = [[0.0, 1.0, 1.0, 0.0], [0.0, -1.0, -1.0, 0.0]];
    let together = [[0.0, 1.0, 1.0, 0.0], [0.0, -1.0, 1.0, 0.0]];
    let params = HccdmParams::default();
    let at_centre = |rows: &[[f64; 4]], t: f64| {
        let map = build(&people(rows), &params, 13, 0.3);
        density(&map, &params, t, Point2::new(map.components[0].velocity.x * t, 0.0))
    };
    assert_eq!(at_centre(&apart, 0.0), at_centre(&together, 0.0));
    // After 3 s they are 6 m apart: the variance of 2.5 m2 has grown by half of (1 m/s * 3 s)^2.
    let ratio = at_centre(&apart, 3.0) / at_centre(&together, 3.0);
    let width = 2.5 + params.forecast.variance(3.0);
    assert!((ratio - width / (width + 4.5)).abs() < 1e-12, "{ratio}");
}

#[test]
fn a_path_through_ten_people_costs_more_than_one_past_a_single_person() {
    // ten people around a circle of 3 m: neighbours are 2 * 3 * sin(18 deg) = 1.85 m apart, one crowd
    let ring: Vec<[f64; 4]> = (0..10)
        .map(|i| {
            let (s, c) = crate::numerics::sin_cos(std::f64::consts::TAU * f64::from(i) / 10.0);
            [10.0 + 3.0 * c, 3.0 * s, 0.0, 0.0]
        })
        .collect();
    let x: Vec<f64> = (0..40).map(|k| 0.5 * f64::from(k)).collect();
    let y = vec![0.0; 40];
    for weighting in [Weighting::People, Weighting::Share] {
        let params = HccdmParams { weighting, ..HccdmParams::default() };
        let mut both = ring.clone();
        both.push([10.0, 30.0, 0.0, 0.0]);
        let map = build(&people(&both), &params, 40, 0.3);
        assert_eq!(map.components().iter().map(|c| c.members.len()).collect::<Vec<_>>(), [10, 1]);
        let through_crowd = map.cost(&x, &y);
        let past_one = map.cost(&x, &[30.0; 40]);
        assert!(through_crowd > 2.0 * past_one, "{weighting:?}: {through_crowd}, {past_one}");
    }
}

#[test]
fn a_farther_pedestrian_never_costs_more() {
    use {Covariance::*, Kernel::*};
    for (covariance, kernel) in [(Literal, Gaussian), (Squared, Gaussian), (Literal, Flat), (Squared, Flat)] {
        let params = HccdmParams { covariance, kernel, ..HccdmParams::default() };
        let mut before = f64::INFINITY;
        for i in 0..4000 {
            let offset = 0.002 * f64::from(i);
            let map = build(&people(&[[2.0, offset, 0.3, 0.0]]), &params, 13, 0.3);
            let x: Vec<f64> = (0..13).map(|k| 0.3 * f64::from(k)).collect();
            let cost = map.cost(&x, &[0.0; 13]);
            assert!(
                cost <= before * (1.0 + 1e-13),
                "{covariance:?} {kernel:?} at {offset} m: {cost} after {before}"
            );
            before = cost;
        }
        assert_eq!(before, 0.0, "8 m are beyond four sigma of either reading");
    }
}

#[test]
fn moving_the_world_moves_nothing() {
    for seed in 0..200 {
        let mut r = rng(seed, 9);
        let crowd = random_people(&mut r, 20, 12.0);
        let candidates = random_candidates(&mut r, 5, 13, 0.3, 12.0);
        let params = random_params(&mut r);
        let world = Pose2::new(
            between(&mut r, -50.0, 50.0),
            between(&mut r, -50.0, 50.0),
            between(&mut r, -3.0, 3.0),
        );
        let turn = Pose2::new(0.0, 0.0, world.heading);
        let rows: Vec<[f64; 4]> = (0..crowd.len())
            .map(|i| {
                let p = world.transform(crowd.position(i));
                let v = turn.transform(Point2::new(crowd.vx[i], crowd.vy[i]));
                [p.x, p.y, v.x, v.y]
            })
            .collect();
        let here = build(&crowd, &params, 13, 0.3);
        let there = build(&people(&rows), &params, 13, 0.3);
        for i in 0..5 {
            let range = candidates.range(i);
            let x = &candidates.all_states().x[range.clone()];
            let y = &candidates.all_states().y[range];
            let moved: Vec<Point2> =
                x.iter().zip(y).map(|(&x, &y)| world.transform(Point2::new(x, y))).collect();
            let (mx, my): (Vec<f64>, Vec<f64>) = moved.iter().map(|p| (p.x, p.y)).unzip();
            let a = here.cost(x, y);
            let b = there.cost(&mx, &my);
            assert!((a - b).abs() <= 1e-9 * a, "seed {seed}: {a}, moved {b}");
        }
    }
}

#[test]
fn a_moving_person_is_met_where_they_will_be() {
    // walks away at the robot's speed: the distance stays 3 m; walks towards it: they meet at 1.5 s
    let x: Vec<f64> = (0..13).map(|k| time_of(k, 0.3)).collect();
    let cost = |vx: f64, motion| {
        let params = HccdmParams { motion, ..HccdmParams::default() };
        build(&people(&[[3.0, 0.0, vx, 0.0]]), &params, 13, 0.3).cost(&x, &[0.0; 13])
    };
    assert!(cost(1.0, ComponentMotion::Moving) < 0.3 * cost(0.0, ComponentMotion::Moving));
    assert_eq!(cost(1.0, ComponentMotion::Frozen), cost(-1.0, ComponentMotion::Frozen));
}

#[test]
fn people_known_with_errors_of_zero_cost_what_people_known_without_cost() {
    let mut r = rng(4, 5);
    let crowd = random_people(&mut r, 12, 12.0);
    let candidates = random_candidates(&mut r, 20, 13, 0.3, 12.0);
    let zeros = vec![0.0; crowd.len()];
    let exact = People { position_variance: zeros.clone(), velocity_variance: zeros, ..crowd.clone() };
    let costs = evaluate(HccdmParams::default(), GroupParams::default(), &crowd, &candidates);
    assert_eq!(evaluate(HccdmParams::default(), GroupParams::default(), &exact, &candidates), costs);
    let badly = known_badly(&mut r, crowd);
    assert_ne!(evaluate(HccdmParams::default(), GroupParams::default(), &badly, &candidates), costs);
}

#[test]
fn no_people_cost_nothing_and_a_spent_budget_gives_no_half_answer() {
    let candidates = random_candidates(&mut rng(1, 10), 4, 13, 0.3, 10.0);
    assert_eq!(
        evaluate(HccdmParams::default(), GroupParams::default(), &People::default(), &candidates),
        [0.0; 4]
    );
    let evaluator =
        HccdmEvaluator { params: HccdmParams::default(), groups: GroupParams::default(), sight: None };
    assert_eq!(evaluator.evaluate(&scene(People::default()), &candidates, &|| true), Err(Stopped));
}

#[test]
fn a_parameter_out_of_range_is_named() {
    let params = HccdmParams { personal_distance: 0.0, ..HccdmParams::default() };
    let message = params.check().unwrap_err().to_string();
    assert!(message.starts_with("personal_distance: is 0; give 0.01 to 10 m: "), "{message}");
    let groups = GroupParams { social_distance: f64::NAN, ..GroupParams::default() };
    assert!(groups.check().unwrap_err().to_string().starts_with("social_distance"));
}

#[test]
fn in_a_dense_crowd_each_further_person_counts_less_and_without_saturation_as_much() {
    // So many people in one place, far from each other's crowds in time: one component each.
    let apart = GroupParams { social_distance: 0.0, ..GroupParams::default() };
    let cost = |count: usize, saturation: f64| {
        let rows: Vec<[f64; 4]> = (0..count).map(|k| [5.0 + 0.01 * k as f64, 5.0, 0.0, 0.0]).collect();
        let params = HccdmParams { saturation, ..HccdmParams::default() };
        Hccdm::build(&people(&rows), &params, &apart, None, 1, 0.3).cost(&[5.0], &[5.0])
    };
    let [one, two, eight] = [1, 2, 8].map(|count| cost(count, 0.0));
    assert!((two / one - 2.0).abs() < 0.01 && (eight / one - 8.0).abs() < 0.1, "{one}, {two}, {eight}");
    for (count, plain) in [(1, one), (2, two), (8, eight)] {
        assert!((cost(count, 0.2) - plain / (1.0 + plain / 0.2)).abs() < 1e-12);
    }
    assert!(cost(8, 0.2) - cost(7, 0.2) < 0.25 * (cost(2, 0.2) - cost(1, 0.2)));
}
