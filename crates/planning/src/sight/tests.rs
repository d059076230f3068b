use nalgebra::Matrix3;

use super::*;
use crate::candidates::CandidateSet;
use crate::crowd_cluster::{GroupParams, crowd_clusters};
use crate::evaluation::Evaluator;
use crate::evaluation::collision_risk::CollisionRiskEvaluator;
use crate::evaluation::hccdm::{Hccdm, HccdmEvaluator, HccdmParams};
use crate::evaluation::human_space::{DopplerEvaluator, HumanSpaceEvaluator, HumanSpaceParams};
use crate::forecast::ForecastParams;
use crate::geometry::{Pose2, Twist};
use crate::lanes::tests::levels;
use crate::occupancy::OccupancyGrid;
use crate::random::{Rng, rng, uniform};
use crate::scene::{Belief, Scene};
use crate::states::States;

const V_MAX: f64 = 1.0;

/// 12 m by 8 m: a corridor below, a room above, a wall of 0.2 m at y = 4 between them, and a door from x = 8 to 9.
fn floor() -> Sight {
    let cell = |i: usize| match (i % 120, i / 120) {
        (80..90, _) => 0,
        (_, 40 | 41) => 100,
        _ => 0,
    };
    let cells = (0..120 * 80).map(cell).collect();
    sight(OccupancyGrid::new(120, 80, 0.1, Pose2::default(), cells).unwrap())
}

fn sight(grid: OccupancyGrid) -> Sight {
    Sight::new(Arc::new(StaticMap::new(grid)), V_MAX)
}

fn scene(pose: Pose2, people: People) -> Scene {
    let belief = Belief { pose, covariance: Matrix3::identity() * 0.01, twist: Twist::default() };
    Scene::new(belief, people)
}

/// The four terms, with or without walls that hide people.
fn terms(sight: Option<&Sight>) -> [(&'static str, Box<dyn Evaluator>); 4] {
    let sight = sight.cloned();
    let params = HumanSpaceParams::default();
    let forecast = ForecastParams::default();
    let hccdm = HccdmParams::default();
    let groups = GroupParams::default();
    [
        ("cnc", Box::new(HccdmEvaluator { params: hccdm, groups, sight: sight.clone() })),
        ("human-space", Box::new(HumanSpaceEvaluator { params, groups, sight: sight.clone() })),
        ("doppler", Box::new(DopplerEvaluator { params, sight: sight.clone() })),
        (
            "collision-risk",
            Box::new(CollisionRiskEvaluator {
                radius: 0.3,
                v_max: 1.0,
                standing_share: 1.0,
                forecast,
                belief: None,
                sight,
            }),
        ),
    ]
}

/// What it costs to stand at a place.
fn costs(sight: Option<&Sight>, at: (f64, f64), people: &[[f64; 4]]) -> [(&'static str, f64); 4] {
    let pose = Pose2::new(at.0, at.1, 0.0);
    let mut states = States::default();
    (0..10).for_each(|_| states.push(pose, Twist::default()));
    let set = CandidateSet::new(10, 0.3, vec![0], states).unwrap();
    let scene = scene(pose, People::walking(0.25, people));
    terms(sight).map(|(name, term)| (name, term.evaluate(&scene, &set, &|| false).unwrap()[0]))
}

#[test]
fn a_person_behind_a_wall_costs_nothing_and_counts_again_past_the_door() {
    let sight = floor();
    let person = [[4.0, 4.7, 0.0, 0.0]];
    for (name, cost) in costs(Some(&sight), (4.0, 3.4), &person) {
        assert_eq!(cost, 0.0, "{name}");
    }
    assert!(costs(None, (4.0, 3.4), &person).iter().all(|(_, cost)| *cost > 0.0));
    // In the room, and in the door.
    for at in [(4.8, 4.9), (5.0, 5.0)] {
        assert_eq!(costs(Some(&sight), at, &person), costs(None, at, &person));
    }
    let beside_door = [[8.2, 4.9, 0.0, 0.0]];
    let in_door = (8.6, 4.1);
    assert_eq!(costs(Some(&sight), in_door, &beside_door), costs(None, in_door, &beside_door));
}

#[test]
fn one_who_would_walk_into_a_wall_stays_behind_it() {
    let sight = floor();
    let walks = [[4.0, 5.5, 0.0, -0.8]];
    for (name, cost) in costs(Some(&sight), (4.0, 3.4), &walks) {
        assert_eq!(cost, 0.0, "{name}");
    }
    // Through the door there is nothing in the way: it is hidden, and then it is not.
    let through = [[8.5, 6.0, 0.0, -0.8]];
    let [hidden, seen] = [Some(&sight), None].map(|sight| costs(sight, (6.5, 3.6), &through));
    for ((name, some), (_, all)) in hidden.into_iter().zip(seen) {
        assert!(0.0 < some && some < all || name == "collision-risk", "{name}: {some} of {all}");
    }
}

#[test]
fn people_on_two_sides_of_a_wall_are_not_linked() {
    let sight = floor();
    let rows = [[4.0, 3.5, 0.0, 0.0], [4.0, 4.6, 0.0, 0.0], [4.5, 4.8, 0.0, 0.0]];
    let people = People::walking(0.25, &rows);
    assert_eq!(crowd_clusters(&people, &GroupParams::default(), None), [vec![0, 1, 2]]);
    assert_eq!(crowd_clusters(&people, &GroupParams::default(), Some(&sight)), [vec![0], vec![1, 2]]);
    let map = Hccdm::build(&people, &HccdmParams::default(), &GroupParams::default(), Some(&sight), 3, 0.3);
    assert_eq!(map.components().iter().map(|c| c.weight).collect::<Vec<_>>(), [1.0, 2.0]);
}

#[test]
fn a_group_weighs_as_many_as_it_has_members_in_view() {
    let sight = floor();
    // They see each other through the door, and the robot sees only the one who is on its side.
    let two = [[7.8, 3.5, 0.0, 0.0], [8.4, 4.6, 0.0, 0.0]];
    let at = (6.6, 3.5);
    let [(_, some), (_, room), ..] = costs(Some(&sight), at, &two);
    let [(_, all), (_, whole), ..] = costs(None, at, &two);
    assert!((some / all - 127.0 / 255.0).abs() < 1e-9, "{some} of {all}");
    assert_eq!(room, whole, "the room of a group is that of all of it");
}

#[test]
fn nothing_is_hidden_from_a_place_in_a_wall_or_outside_the_map() {
    let sight = floor();
    let above = Point2::new(4.0, 5.0);
    assert!(!sight.is_free(above, Point2::new(4.0, 3.0)));
    assert!(sight.is_free(above, Point2::new(4.0, 4.05)) && sight.is_free(Point2::new(4.0, 4.05), above));
    assert!(sight.is_free(above, above));
    assert!(sight.is_free(Point2::new(8.5, 6.0), Point2::new(8.5, 2.0)));
    assert!(sight.is_free(above, Point2::new(4.0, 1e300)) && sight.is_free(Point2::new(-5.0, 6.0), above));
}

fn between(r: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * uniform(r)
}

/// A floor of 15 m by 15 m, turned, with walls at random.
fn random_floor(r: &mut Rng, walls: usize) -> Sight {
    let mut cells = vec![0; 150 * 150];
    for _ in 0..walls {
        let long = between(r, 5.0, 40.0) as usize;
        let from = (between(r, 0.0, 150.0) as usize, between(r, 0.0, 150.0) as usize);
        let upright = uniform(r) < 0.5;
        for k in 0..long {
            for w in 0..2 {
                let (c, row) = if upright { (from.0 + w, from.1 + k) } else { (from.0 + k, from.1 + w) };
                if c < 150 && row < 150 {
                    cells[row * 150 + c] = 100;
                }
            }
        }
    }
    sight(OccupancyGrid::new(150, 150, 0.1, Pose2::new(0.3, -0.2, 0.1), cells).unwrap())
}

fn random_people(r: &mut Rng, count: usize, speed: f64) -> People {
    let row = |_| {
        let v = [between(r, -speed, speed), between(r, -speed, speed)];
        [between(r, 0.0, 15.0), between(r, 0.0, 15.0), v[0], v[1]]
    };
    People::walking(0.25, &(0..count).map(row).collect::<Vec<_>>())
}

/// Straight drives from (7.5, 7.5).
fn random_drives(r: &mut Rng, count: usize, steps: usize, dt: f64) -> CandidateSet {
    let mut states = States::default();
    for _ in 0..count {
        let heading = between(r, -3.0, 3.0);
        let v = between(r, 0.1, V_MAX);
        let (s, c) = crate::numerics::sin_cos(heading);
        for k in 1..=steps {
            let way = v * dt * k as f64;
            states.push(Pose2::new(7.5 + way * c, 7.5 + way * s, heading), Twist { v, omega: 0.0 });
        }
    }
    CandidateSet::new(steps, dt, (0..count as u32).collect(), states).unwrap()
}

/// The coordinate of the centre of a place.
fn centre(of: f64) -> f64 {
    ((of / 0.5).floor() + 0.5) * 0.5
}

/// Whether person `i` is in view of the centre of the place of a state after `t` seconds: one ray.
fn plain(sight: &Sight, people: &People, i: usize, state: Point2, t: f64) -> bool {
    // A small step at a time until the person would be in a wall.
    let rays = RayCaster::new(&sight.map);
    let grid = &sight.map.grid;
    let steps = 4000;
    let mut at = people.position(i);
    if is_in_wall(&rays, grid.grid_from_map(at)) {
        return true;
    }
    for step in 1..=steps {
        let next = people.position_after(i, t * f64::from(step) / f64::from(steps));
        if is_in_wall(&rays, grid.grid_from_map(next)) {
            break;
        }
        at = next;
    }
    sight.is_free(at, Point2::new(centre(state.x), centre(state.y)))
}

#[test]
fn who_is_in_view_is_what_a_plain_ray_per_person_and_state_says() {
    let mut seen = [0, 0];
    let mut differ = 0;
    for seed in 0..12 {
        let mut r = rng(seed, 50);
        let sight = random_floor(&mut r, 40);
        let people = random_people(&mut r, 11, if seed % 2 == 0 { 0.0 } else { 1.0 });
        let scene = scene(Pose2::new(7.5, 7.5, 0.0), people.clone());
        let set = random_drives(&mut r, 10, 13, 0.29);
        let alone: Vec<Vec<usize>> = (0..people.len()).map(|i| vec![i]).collect();
        let mut view = View::new(&sight, &scene, &alone, 13, 0.29);
        for candidate in 0..set.len() {
            for k in 0..13 {
                let place = view.place_of(&set, candidate, k);
                assert!(place > 0, "seed {seed}: state {k} is out of reach");
                // The middle of each 3 states, and the last one, which is alone.
                let middle = (k / 3 * 3 + 1).min(12);
                let p = set.all_states().position(set.range(candidate).start + middle);
                for i in 0..people.len() {
                    let shown = view.shows(place, i);
                    let expected = plain(&sight, &people, i, p, (middle + 1) as f64 * 0.29);
                    differ += usize::from(shown != expected);
                    seen[usize::from(shown)] += 1;
                }
            }
        }
    }
    // Who stops at a wall does so a hundredth of a cell before it, and the plain one up to a step of 2 mm.
    assert!(differ * 500 < seen[0] + seen[1], "{differ} of {seen:?}");
    assert!(seen[0] > 2000 && seen[1] > 2000, "{seen:?}");
}

#[test]
fn the_crowd_cost_is_the_sum_over_those_that_a_plain_ray_shows() {
    for seed in 0..6 {
        let mut r = rng(seed, 51);
        let sight = random_floor(&mut r, 40);
        let params = HccdmParams::default();
        let groups = GroupParams { social_distance: 0.0, ..GroupParams::default() };
        // People and robots that stand, robots in the centres of places: nothing is rounded.
        let people = random_people(&mut r, 20, 0.0);
        let scene = scene(Pose2::new(7.5, 7.5, 0.0), people.clone());
        let mut states = States::default();
        for _ in 0..40 {
            let at = [0, 1].map(|_| centre(between(&mut r, 6.0, 9.0)));
            (0..8).for_each(|_| states.push(Pose2::new(at[0], at[1], 0.0), Twist::default()));
        }
        let set = CandidateSet::new(8, 0.3, (0..40).collect(), states).unwrap();
        let evaluator = HccdmEvaluator { params, groups, sight: Some(sight.clone()) };
        let found = evaluator.evaluate(&scene, &set, &|| false).unwrap();
        for (candidate, cost) in found.iter().enumerate() {
            let p = set.all_states().position(set.range(candidate).start);
            let mut expected = 0.0;
            for i in (0..people.len()).filter(|&i| sight.is_free(people.position(i), p)) {
                let alone = Hccdm::build(&people.pick([i]), &params, &groups, None, 8, 0.3);
                expected += alone.cost(&[p.x; 8], &[p.y; 8]);
            }
            assert!((cost - expected).abs() < 1e-9, "seed {seed}: {cost} {expected}");
        }
    }
}

#[test]
fn with_no_wall_between_anybody_costs_are_as_before_bit_for_bit() {
    for seed in 0..4 {
        let mut r = rng(seed, 52);
        let open = random_floor(&mut r, 0);
        let people = random_people(&mut r, 30, 1.0);
        let scene = scene(Pose2::new(7.5, 7.5, 0.0), people);
        let set = random_drives(&mut r, 40, 13, 0.3);
        for ((name, with), (_, without)) in terms(Some(&open)).into_iter().zip(terms(None)) {
            let cost = |term: &dyn Evaluator| term.evaluate(&scene, &set, &|| false).unwrap();
            let bits = |costs: Vec<f64>| costs.into_iter().map(f64::to_bits).collect::<Vec<_>>();
            assert_eq!(bits(cost(&*with)), bits(cost(&*without)), "seed {seed}, {name}");
        }
    }
}

#[test]
fn neither_vectors_nor_other_candidates_change_a_cost() {
    for seed in 0..4 {
        let mut r = rng(seed, 53);
        let sight = random_floor(&mut r, 40);
        let scene = scene(Pose2::new(7.5, 7.5, 0.0), random_people(&mut r, 30, 1.0));
        let set = random_drives(&mut r, 40, 13, 0.3);
        let cnc = HccdmEvaluator {
            params: HccdmParams::default(),
            groups: GroupParams::default(),
            sight: Some(sight.clone()),
        };
        let first = cnc.evaluate(&scene, &set, &|| false).unwrap();
        for level in levels() {
            let costs = cnc.evaluate_at(level, &scene, &set, &|| false).unwrap();
            assert_eq!(costs, first, "seed {seed}, {level:?}");
        }
        assert_ne!(first, terms(None)[0].1.evaluate(&scene, &set, &|| false).unwrap(), "walls hide people");
        for (name, term) in terms(Some(&sight)) {
            let all = term.evaluate(&scene, &set, &|| false).unwrap();
            for i in [0, 17, 39] {
                let alone = term.evaluate(&scene, &set.pick(i..i + 1), &|| false).unwrap();
                assert_eq!(alone[0].to_bits(), all[i].to_bits(), "seed {seed}, {name}");
            }
        }
    }
}
