use nalgebra::Vector3;

use super::super::tests::{corridor, drives, evaluator, map, scene, uncertain, wandering, zeta};
use super::super::{CpcParams, InformationParams};
use super::*;
use crate::geometry::{Pose2, Twist};
use crate::motion::OdometryNoise;
use crate::numerics::sin_cos;
use crate::occupancy::StaticMap;
use crate::random::{Rng, rng, uniform};
use crate::scene::People;
use crate::sensor::LaserModel;
use crate::states::States;

const RADIUS: f64 = 0.25;

fn occluded(map: &StaticMap, laser: LaserModel) -> CpcOccludedEvaluator {
    let params = InformationParams::default();
    let field = Arc::new(InformationField::new(map, &laser, &params));
    let rays = Arc::new(RayField::new(&field, map, &laser, &params));
    let cpc = CpcEvaluator::new(field, OdometryNoise::default(), CpcParams::default());
    CpcOccludedEvaluator::new(cpc, rays, ForecastParams::default())
}

fn among(people: People) -> Scene {
    Scene { people, ..uncertain() }
}

fn standing(at: &[(f64, f64)]) -> Scene {
    among(People::walking(RADIUS, &at.iter().map(|(x, y)| [*x, *y, 0.0, 0.0]).collect::<Vec<_>>()))
}

fn cost(term: &CpcOccludedEvaluator, scene: &Scene, set: &CandidateSet) -> Vec<f64> {
    term.evaluate(scene, set, &|| false).unwrap()
}

/// People who walk about in the corridor.
fn crowd(r: &mut Rng, count: usize) -> People {
    let mut person =
        || [3.0 + 24.0 * uniform(r), 7.5 + 5.0 * uniform(r), 2.0 * uniform(r) - 1.0, 2.0 * uniform(r) - 1.0];
    People::walking(RADIUS, &(0..count).map(|_| person()).collect::<Vec<_>>())
}

/// J after the first state of a candidate that stands at `pose`, map frame, as the term has it.
fn information(term: &CpcOccludedEvaluator, scene: &Scene, pose: Pose2) -> Matrix3<f64> {
    let set = standing_at(pose);
    let hidden = term.hidden(&scene.people, &set);
    let [d1, l21, l31, d2, l32, d3] = dispatch!(Level::baseline(), simd => {
        let [x, y, heading] = [pose.x, pose.y, pose.heading].map(|n| f64x8::splat(simd, n));
        hidden.factors_at(0, x, y, heading).map(|lanes| lanes[0])
    });
    let l = Matrix3::new(1.0, 0.0, 0.0, l21, 1.0, 0.0, l31, l32, 1.0);
    let turn = term.cpc.field.map_from_grid();
    turn * l * Matrix3::from_diagonal(&Vector3::new(d1, d2, d3)) * l.transpose() * turn.transpose()
}

fn standing_at(pose: Pose2) -> CandidateSet {
    let mut states = States::default();
    states.push(pose, Twist::default());
    CandidateSet::new(1, 0.3, vec![0], states).unwrap()
}

#[test]
fn where_people_hide_nothing_it_is_cpc_bit_for_bit() {
    let map = map(Pose2::new(-1.0, 2.0, 0.3), corridor);
    for laser in [
        LaserModel::default(),
        LaserModel { fov: 7.0_f64.min(std::f64::consts::TAU), ..LaserModel::default() },
        LaserModel { robot_from_laser: Pose2::new(0.2, -0.1, 0.4), ..LaserModel::default() },
    ] {
        let term = occluded(&map, laser);
        let cpc = evaluator(&map, laser);
        let set = wandering(&mut rng(5, 0), 43, 13);
        let bits = |costs: Vec<f64>| costs.into_iter().map(f64::to_bits).collect::<Vec<_>>();
        assert_eq!(bits(cost(&term, &uncertain(), &set)), bits(zeta(&cpc, &uncertain(), &set)));
        let far = standing(&[(500.0, 10.0), (-70.0, -70.0)]);
        assert_eq!(bits(cost(&term, &far, &set)), bits(zeta(&cpc, &uncertain(), &set)));
    }
    // Behind the robot, and behind the wall.
    let map = map_of_one_wall();
    let term = occluded(&map, LaserModel::default());
    let cpc = evaluator(&map, LaserModel::default());
    // What the first scan at rest tells counts from the fifth step on.
    let set = drives(&[Pose2::new(5.0, 10.0, std::f64::consts::FRAC_PI_2)], 8, |_, _| Twist::default());
    let costs = |of: &[(f64, f64)]| cost(&term, &standing(of), &set)[0];
    let plain = zeta(&cpc, &uncertain(), &set)[0];
    assert_eq!(costs(&[(5.0, 8.0)]), plain);
    assert_eq!(costs(&[(5.0, 14.0)]), plain);
    assert!(costs(&[(5.0, 11.5)]) != plain);
}

/// A wall 3 m above the line y = 10.
fn map_of_one_wall() -> StaticMap {
    map(Pose2::default(), |_, y| y > 13.0)
}

/// The formula, ray by ray, with the library's error function and the Gaussian cut at four deviations, for a laser in
/// the middle of the robot.
fn reference(term: &CpcOccludedEvaluator, scene: &Scene, pose: Pose2, t: f64) -> Matrix3<f64> {
    let field = &*term.cpc.field;
    let p = field.grid_from_map(pose.position());
    let place = dispatch!(Level::baseline(), simd => {
        let [x, y, heading] = [pose.x, pose.y, pose.heading].map(|n| f64x8::splat(simd, n));
        field.places(&field.laser_at(x, y, heading))[0]
    });
    let Some((block, heading)) = field.seeing_at(place) else { return Matrix3::zeros() };
    let block = &term.rays.blocks[block];
    let view = &term.rays.views[heading];
    let unit = |x: f64| erf(x * std::f64::consts::FRAC_1_SQRT_2);
    let normal = |x: f64| 0.5 + 0.5 * unit(x.clamp(-4.0, 4.0)) / unit(4.0);
    let mut sum = Matrix3::zeros();
    for ray in 0..GROUPS * LANES {
        let group = ray / LANES;
        let lane = ray % LANES;
        let beta = ray as f64 * std::f64::consts::TAU / (GROUPS * LANES) as f64;
        let range = f64::from(block.range[group][lane]);
        let mut survival = 1.0;
        for i in 0..scene.people.len() {
            let person = field.grid_from_map(scene.people.position_after(i, t));
            let px = person.x - p.x;
            let py = person.y - p.y;
            let rho = px.hypot(py);
            let phi = py.atan2(px);
            let sigma = (term.forecast.variance(t) + scene.people.variance_after(i, t)).sqrt();
            let delta = rho * (beta - phi).sin();
            let along = rho * (beta - phi).cos();
            if along > 0.0 && along < range {
                survival *= 2.0 - normal((RADIUS - delta) / sigma) - normal((RADIUS + delta) / sigma);
            }
        }
        let [x, y] = [0, 1].map(|k| f64::from(block.row[k][group][lane]));
        let h = Vector3::new(x, y, range * (y * beta.cos() - x * beta.sin()));
        sum += view.weights[group][lane] * survival * h * h.transpose();
    }
    let turn = field.map_from_grid();
    turn * sum * turn.transpose()
}

#[test]
fn equals_the_formula_ray_by_ray() {
    let seed = 6;
    let map = map(Pose2::new(-1.0, 2.0, 0.3), corridor);
    let shift = Pose2::new(-1.0, 2.0, 0.3);
    let mut r = rng(seed, 0);
    for fov in [std::f64::consts::PI, std::f64::consts::TAU] {
        let term = occluded(&map, LaserModel { fov, ..LaserModel::default() });
        let mut hid = 0;
        for _ in 0..300 {
            let here =
                Pose2::new(3.0 + 24.0 * uniform(&mut r), 8.2 + 3.6 * uniform(&mut r), 7.0 * uniform(&mut r));
            let mut people = crowd(&mut r, 12);
            people.position_variance = (0..12).map(|_| 0.05 * uniform(&mut r)).collect();
            people.velocity_variance = vec![0.02; 12];
            for i in 0..12 {
                let at = shift.transform(people.position(i));
                (people.x[i], people.y[i]) = (at.x, at.y);
            }
            let scene = among(people);
            let pose = shift.compose(here);
            let fast = information(&term, &scene, pose);
            let slow = reference(&term, &scene, pose, 0.3);
            let size = slow.norm().max(1.0);
            assert!((fast - slow).norm() < 1e-4 * size, "seed {seed}, {pose:?}: {fast} vs {slow}");
            hid += usize::from((information(&term, &uncertain(), pose) - slow).norm() > 0.1 * size);
        }
        assert!(hid > 100, "seed {seed}: people hide something {hid} times");
    }
}

#[test]
fn rays_add_up_to_what_cpc_looks_up() {
    let map = map(Pose2::default(), corridor);
    let laser = LaserModel::default();
    let term = occluded(&map, laser);
    let mut r = rng(7, 0);
    for _ in 0..300 {
        let pose =
            Pose2::new(3.0 + 24.0 * uniform(&mut r), 8.2 + 3.6 * uniform(&mut r), 7.0 * uniform(&mut r));
        let summed = term.cpc.field.at(pose);
        let one_by_one = reference(&term, &uncertain(), pose, 0.3);
        assert!((summed - one_by_one).norm() < 1e-5 * summed.norm(), "{pose:?}: {summed} vs {one_by_one}");
        // What is read of the field beside the other information at the same place.
        assert_eq!(information(&term, &uncertain(), pose), summed);
    }
}

#[test]
fn a_person_nearer_to_the_middle_of_a_ray_never_raises_what_it_tells() {
    for sigma in [0.02, 0.1, 0.25, 0.6, 3.0] {
        let per_sigma = 1.0 / sigma;
        let q = |off: f64| dispatch!(Level::new(), simd => chance(&NORMAL, RADIUS, f64x8::splat(simd, off), per_sigma)[0]);
        let chances: Vec<f64> = (0..4000).map(|k| q(0.001 * f64::from(k))).collect();
        assert!(chances.windows(2).all(|pair| pair[1] <= pair[0] + 1e-15), "sigma {sigma}");
        assert!(chances.iter().all(|q| (0.0..=1.0).contains(q)), "sigma {sigma}");
        assert_eq!(q(RADIUS + CUT * sigma + 1e-9), 0.0);
    }
    // A laser of one ray, straight at a wall.
    let map = map_of_one_wall();
    let term = occluded(&map, LaserModel { fov: 0.01, ..LaserModel::default() });
    let pose = Pose2::new(15.0, 10.0, std::f64::consts::FRAC_PI_2);
    let told = |off: f64| information(&term, &standing(&[(15.0 + off, 11.5)]), pose).trace();
    let traces: Vec<f64> = (0..400).map(|k| told(0.004 * f64::from(k))).collect();
    assert!(traces.windows(2).all(|pair| pair[0] <= pair[1] * (1.0 + 1e-6)), "{traces:?}");
    assert!(traces[0] < 0.05 * traces[399] && traces[399] == told(30.0), "{traces:?}");
}

#[test]
fn one_more_person_never_raises_what_a_scan_tells() {
    let seed = 8;
    let map = map(Pose2::default(), corridor);
    let term = occluded(&map, LaserModel::default());
    let mut r = rng(seed, 0);
    for _ in 0..200 {
        let pose =
            Pose2::new(3.0 + 24.0 * uniform(&mut r), 8.2 + 3.6 * uniform(&mut r), 7.0 * uniform(&mut r));
        let people = crowd(&mut r, 12);
        let with = |count: usize| information(&term, &among(people.pick(0..count)), pose);
        for count in 0..12 {
            let less = with(count) - with(count + 1);
            let least = less.symmetric_eigen().eigenvalues.min();
            assert!(least > -1e-5 * with(0).norm(), "seed {seed}, {count} people, {pose:?}: {less}");
        }
    }
}

#[test]
fn sharding_changes_no_cost() {
    let map = map(Pose2::default(), corridor);
    let term = occluded(&map, LaserModel::default());
    let mut r = rng(3, 0);
    let set = wandering(&mut r, 43, 13);
    let scene = among(crowd(&mut r, 20));
    let whole = cost(&term, &scene, &set);
    let plain = zeta(&evaluator(&map, LaserModel::default()), &scene, &set);
    assert!(whole.iter().zip(&plain).filter(|(a, b)| a > b).count() > 30, "people hide too little");
    for shards in 1..=43 {
        let shard = |s: usize| cost(&term, &scene, &set.pick(s * 43 / shards..(s + 1) * 43 / shards));
        let pieces: Vec<f64> = (0..shards).flat_map(shard).collect();
        let bits = |costs: &[f64]| costs.iter().map(|c| c.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&pieces), bits(&whole), "{shards} shards");
    }
}

#[test]
fn a_spent_budget_stops_it() {
    let term = occluded(&map(Pose2::default(), corridor), LaserModel::default());
    let set = wandering(&mut rng(3, 0), 3, 5);
    assert!(term.evaluate(&uncertain(), &set, &|| true).is_err());
    assert_eq!(term.evaluate(&uncertain(), &CandidateSet::empty(13, 0.3), &|| false), Ok(vec![]));
}

#[test]
fn moving_the_world_moves_nothing() {
    let mut r = rng(4, 0);
    let set = wandering(&mut r, 30, 13);
    let people = crowd(&mut r, 20);
    let here = occluded(&map(Pose2::default(), corridor), LaserModel::default());
    let here = cost(&here, &among(people.clone()), &set);
    for shift in [Pose2::new(-12.3, 40.0, 0.0), Pose2::new(3.0, -7.0, 1.1), Pose2::new(0.5, 0.0, -2.8)] {
        let (s, c) = sin_cos(shift.heading);
        let mut moved = States::default();
        for i in 0..set.len() {
            let states = set.states(i);
            (0..states.len()).for_each(|k| moved.push(shift.compose(states.pose(k)), states.at(k).1));
        }
        let there = CandidateSet::new(set.steps(), set.dt(), set.id().to_vec(), moved).unwrap();
        let each: Vec<[f64; 4]> = (0..people.len())
            .map(|i| {
                let at = shift.transform(people.position(i));
                let (vx, vy) = (people.vx[i], people.vy[i]);
                [at.x, at.y, c * vx - s * vy, s * vx + c * vy]
            })
            .collect();
        let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        let covariance = turn * uncertain().belief.covariance * turn.transpose();
        let scene = Scene { people: People::walking(RADIUS, &each), ..scene(covariance) };
        let costs = cost(&occluded(&map(shift, corridor), LaserModel::default()), &scene, &there);
        for (a, b) in here.iter().zip(&costs) {
            assert!((a / b - 1.0).abs() < 1e-6, "{a} vs {b} after {shift:?}");
        }
    }
}

#[test]
fn on_a_map_of_350_000_cells_the_rays_take_a_fifth_of_100_megabytes_at_most() {
    // A hall of 35 m x 25 m at 0.05 m with pillars everywhere, so that every block sees something.
    let cells = (0..700 * 500).map(|i| if i % 700 % 60 < 3 && i / 700 % 60 < 3 { 100 } else { 0 }).collect();
    let grid = crate::occupancy::OccupancyGrid::new(700, 500, 0.05, Pose2::default(), cells).unwrap();
    let map = StaticMap::new(grid);
    let laser = LaserModel::default();
    let params = InformationParams::default();
    let field = InformationField::new(&map, &laser, &params);
    let rays = RayField::new(&field, &map, &laser, &params);
    assert!(rays.blocks.len() > 20_000, "{}", rays.blocks.len());
    assert!(rays.bytes() < 20_000_000, "{}", rays.bytes());
    assert!(field.bytes() + rays.bytes() < 35_000_000, "{}", field.bytes());
}

#[test]
fn of_two_equal_lanes_the_one_whose_landmarks_no_one_hides_is_chosen() {
    // Two walls with niches, equal on both sides of the line y = 10. Lanes run 3 m from one and out of range of the
    // other.
    let map = map(Pose2::default(), |x, y| {
        let depth = if x % 3.0 < 1.0 { 4.4 } else { 4.0 };
        (y - 10.0).abs() > depth
    });
    let term = occluded(&map, LaserModel::default());
    let cpc = evaluator(&map, LaserModel::default());
    let seed = 9;
    let count = 200;
    let mut r = rng(seed, 0);
    let mut by_term = 0;
    let mut by_cpc = 0;
    for _ in 0..count {
        let mut between = |low: f64, high: f64| low + (high - low) * uniform(&mut r);
        // Nearly in the middle: one of the lanes is as good as the other but for chance.
        let start = Pose2::new(between(6.0, 8.0), 10.0 + between(-0.004, 0.004), between(-0.002, 0.002));
        let lanes = drives(&[start, start], 13, |i, k| {
            let turn = match k {
                0..3 => 0.6,
                8..11 => -0.6,
                _ => 0.0,
            };
            Twist { v: 0.9, omega: if i == 0 { turn } else { -turn } }
        });
        let side = if between(0.0, 1.0) < 0.5 { 1.0 } else { -1.0 };
        let lane_y = (lanes.states(0).pose(12).y - 10.0).abs();
        let people: Vec<(f64, f64)> = (0..8)
            .map(|k| {
                let off = lane_y + between(1.8, 2.5);
                (start.x + 3.0 + 1.2 * f64::from(k) + between(-0.4, 0.4), 10.0 + side * off)
            })
            .collect();
        // As unsure to one side as to the other.
        let covariance = Matrix3::from_diagonal(&Vector3::new(0.12, 0.12, 0.03));
        let scene = Scene { people: standing(&people).people, ..scene(covariance) };
        let clear = usize::from(side > 0.0);
        let chosen = |costs: Vec<f64>| usize::from(costs[1] < costs[0]);
        by_term += usize::from(chosen(cost(&term, &scene, &lanes)) == clear);
        by_cpc += usize::from(chosen(zeta(&cpc, &scene, &lanes)) == clear);
    }
    assert!(by_term * 10 >= count * 9, "seed {seed}: the clear lane {by_term} of {count} times");
    assert!(
        (count * 2 / 5..count * 3 / 5).contains(&by_cpc),
        "seed {seed}: by cpc {by_cpc} of {count} times"
    );
}
