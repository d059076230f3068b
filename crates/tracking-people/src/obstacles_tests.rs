use curionav_planning::geometry::Pose2;
use curionav_planning::random::{rng, standard_normal, uniform};

use super::*;

const BEAMS: usize = 361;
const RANGE_MAX: f64 = 8.0;

/// A world of discs around a robot without a map, seen ten times a second.
struct Scene {
    obstacles: Obstacles,
    robot: Pose2,
    stamp: f64,
    /// Noise of ranges, metres.
    noise: f64,
}

impl Scene {
    fn new() -> Self {
        let obstacles = Obstacles::new(ObstacleParams::default());
        Self { obstacles, robot: Pose2::default(), stamp: 0.0, noise: 0.0 }
    }

    /// One scan of discs with these middles and radii.
    fn look(&mut self, discs: &[(f64, f64, f64)]) {
        self.stamp += 0.1;
        let mut random = rng((self.stamp * 1e3) as u64, 0);
        let angle_min = -std::f64::consts::FRAC_PI_2;
        let increment = std::f64::consts::PI / (BEAMS - 1) as f64;
        let beams: Vec<Beam> = (0..BEAMS)
            .map(|beam| {
                let direction = Direction::of(self.robot.heading + angle_min + increment * beam as f64);
                let range =
                    discs.iter().map(|disc| range(self.robot, *disc, direction)).fold(RANGE_MAX, f64::min);
                let noisy = range + self.noise * standard_normal(&mut random);
                if range < RANGE_MAX { Beam::Obstacle(noisy) } else { Beam::Free(RANGE_MAX) }
            })
            .collect();
        let explained = vec![false; BEAMS];
        let laser = self.robot.into();
        self.obstacles.see(&Look {
            stamp: self.stamp,
            laser,
            angle_min,
            increment,
            beams: &beams,
            explained: &explained,
        });
    }

    fn known(&self) -> Vec<Point2> {
        self.obstacles.occupied().collect()
    }
}

fn range(robot: Pose2, (x, y, radius): (f64, f64, f64), direction: Direction) -> f64 {
    let (x, y) = (x - robot.x, y - robot.y);
    let along = x * direction.cos + y * direction.sin;
    let across = x * direction.sin - y * direction.cos;
    let inside = radius * radius - across * across;
    if along <= 0.0 || inside < 0.0 { f64::INFINITY } else { along - inside.sqrt() }
}

const BOX: (f64, f64, f64) = (3.0, 0.5, 0.3);

#[test]
fn what_stands_is_known_after_a_few_scans_and_where_it_stands() {
    let mut scene = Scene::new();
    scene.noise = 0.03;
    (0..3).for_each(|_| scene.look(&[BOX]));
    assert!(scene.known().is_empty());
    (0..20).for_each(|_| scene.look(&[BOX]));
    let known = scene.known();
    assert!(known.len() > 5);
    for p in known {
        let off = p.distance(Point2::new(BOX.0, BOX.1)) - BOX.2;
        assert!(off.abs() < 0.15, "{p:?} is {off} m off the skin");
    }
}

#[test]
fn what_has_gone_is_forgotten_and_what_is_out_of_view_is_not_for_a_minute() {
    let mut scene = Scene::new();
    (0..30).for_each(|_| scene.look(&[BOX]));
    let known = scene.known();
    // The robot turns its back.
    scene.robot = Pose2::new(0.0, 0.0, std::f64::consts::PI);
    (0..590).for_each(|_| scene.look(&[]));
    assert_eq!(scene.known(), known);
    (0..20).for_each(|_| scene.look(&[]));
    assert!(scene.known().is_empty(), "it is remembered for longer than a minute");
    scene.robot = Pose2::default();
    (0..30).for_each(|_| scene.look(&[BOX]));
    (0..8).for_each(|_| scene.look(&[]));
    assert!(!scene.known().is_empty());
    (0..4).for_each(|_| scene.look(&[]));
    assert!(scene.known().is_empty(), "twelve scans that show nothing leave something");
}

#[test]
fn what_passes_leaves_nothing_behind() {
    let mut scene = Scene::new();
    for step in 0..60 {
        scene.look(&[(3.0, -2.0 + 0.08 * f64::from(step), 0.25)]);
        let here = Point2::new(3.0, -2.0 + 0.08 * f64::from(step));
        assert!(scene.known().iter().all(|p| p.distance(here) < 1.0), "a trail at step {step}");
    }
}

#[test]
fn a_wall_behind_hides_nothing_and_what_is_hidden_stays() {
    let mut scene = Scene::new();
    (0..30).for_each(|_| scene.look(&[BOX]));
    let known = scene.known();
    // Something nearer stands before it: no beam goes through.
    (0..100).for_each(|_| scene.look(&[(1.0, 0.15, 0.4)]));
    assert!(known.iter().all(|p| scene.known().contains(p)));
}

#[test]
fn single_beams_that_err_make_no_obstacle() {
    let mut scene = Scene::new();
    let mut random = rng(7, 0);
    for _ in 0..600 {
        let p = (1.0 + 4.0 * uniform(&mut random), 4.0 * uniform(&mut random) - 2.0, 0.02);
        scene.look(&[p]);
        assert!(scene.known().is_empty());
    }
}

#[test]
fn what_is_explained_or_far_is_no_evidence() {
    let mut obstacles = Obstacles::new(ObstacleParams::default());
    let beams = [Beam::Obstacle(2.0), Beam::Obstacle(7.0), Beam::Silent];
    for tick in 0..20 {
        obstacles.see(&Look {
            stamp: f64::from(tick),
            laser: Pose2::default().into(),
            angle_min: 0.0,
            increment: 0.1,
            beams: &beams,
            explained: &[true, false, false],
        });
    }
    assert_eq!(obstacles.occupied().count(), 0);
}
