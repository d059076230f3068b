//! Zones of the map, as every generator takes them.

use super::*;

/// 20 m by 10 m of free floor in cells of 0.1 m with these limits.
fn floor(limit: impl Fn(f64, f64) -> u8) -> StaticMap {
    let grid = OccupancyGrid::new(200, 100, 0.1, Pose2::default(), vec![0; 20_000]).unwrap();
    let limits = (0..20_000).map(|i| limit((i % 200) as f64 / 10.0, (i / 200) as f64 / 10.0)).collect();
    StaticMap::new(grid.with_limits(limits).unwrap())
}

fn generated(kind: &GeneratorKind, world: &World, v: f64) -> CandidateSet {
    let generator = Generator::new(kind.name, Profile::default().generator_part());
    let pose = Pose2::new(5.0, 5.0, 0.0);
    let belief = Belief { pose, covariance: Matrix3::identity() * 0.0025, twist: Twist { v, omega: 0.0 } };
    let scene = Scene::new(belief, People::default());
    let candidates = generator.generate(&world.input(&scene, None), None, 1, &|| 0.0).candidates;
    assert!(!candidates.is_empty(), "{}, {v} m/s", kind.name);
    candidates
}

#[test]
fn on_slow_floor_no_candidate_is_faster_than_allowed_or_brakes_harder_than_the_robot_can() {
    let world = World::new(floor(|_, _| 30), Point2::new(18.0, 5.0));
    let a_max = world.robot.a_max;
    for kind in GENERATORS {
        for v in [0.0, 0.2, 0.3, 0.8] {
            let candidates = generated(kind, &world, v);
            let dt = candidates.dt();
            for i in 0..candidates.len() {
                let mut before = v;
                for (k, at) in candidates.range(i).enumerate() {
                    let now = candidates.all_states().v[at];
                    let most = (v - a_max * dt * (k + 1) as f64).max(0.3);
                    assert!(now <= most + 1e-9, "{}: {now} m/s in step {k} from {v} m/s", kind.name);
                    let braked = before - now;
                    assert!(braked <= a_max * dt + 1e-9, "{}: brakes by {braked} m/s in step {k}", kind.name);
                    before = now;
                }
            }
        }
    }
}

#[test]
fn no_candidate_enters_keepout() {
    let is_kept = |x: f64, y: f64| (7.0..9.0).contains(&x) && (3.0..9.0).contains(&y);
    let world = World::new(floor(|x, y| if is_kept(x, y) { 0 } else { 100 }), Point2::new(18.0, 5.0));
    for kind in GENERATORS {
        let candidates = generated(kind, &world, 0.5);
        for i in 0..candidates.len() {
            for at in candidates.range(i) {
                let p = candidates.all_states().position(at);
                let room = world.map.to_obstacle.at(&world.map.grid, p);
                assert!(room >= world.robot.radius(), "{}: {room} m at {p:?}", kind.name);
            }
        }
    }
}

#[test]
fn ways_lead_round_keepout_and_none_through_it() {
    let ring = |x: f64, y: f64| {
        let far = (x - 15.0).abs().max((y - 5.0).abs());
        if (2.0..2.5).contains(&far) { 0 } else { 100 }
    };
    let closed = World::new(floor(ring), Point2::new(15.0, 5.0));
    assert!(closed.geodesic.at(Point2::new(5.0, 5.0)).is_infinite());
    let is_kept = |x: f64, y: f64| (7.0..9.0).contains(&x) && y > 3.0;
    let open = World::new(floor(|x, y| if is_kept(x, y) { 0 } else { 100 }), Point2::new(15.0, 5.0));
    let way = open.geodesic.descend(Point2::new(5.0, 5.0), 0.1);
    assert!(way.iter().all(|p| open.map.grid.is_drivable_at(*p)) && way.iter().any(|p| p.y < 3.0), "{way:?}");
}
