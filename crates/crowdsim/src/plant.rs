//! The robot as it really moves, and the odometry it believes in.

use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::motion::{OdometryNoise, RobotModel, step};
use curionav_planning::random::{Rng, standard_normal};

use crate::surroundings::Surroundings;

/// A unicycle with speed and acceleration limits, drifting odometry, and walls and things that are solid.
///
/// Its body is the disc that circumscribes the footprint. People do not stop it: driving into one is a
/// contact, which is counted, and the run goes on (A37).
#[derive(Debug, Clone)]
pub(crate) struct Plant {
    model: RobotModel,
    noise: OdometryNoise,
    /// True pose, map frame.
    pub pose: Pose2,
    /// True speed and turn rate. Also what the base reports: it measures its wheels well; what drifts is
    /// the pose that is summed up from them.
    pub twist: Twist,
    /// Pose in the odometry frame: the sum of noisy increments.
    pub odometry: Pose2,
    /// Speed at which a wall or a thing stopped the robot in the last step, m/s; none when none did.
    pub wall_impact: Option<f64>,
}

impl Plant {
    /// A robot at rest at its true `start`; its odometry begins at the origin of its own frame.
    pub(crate) fn new(model: RobotModel, noise: OdometryNoise, start: Pose2) -> Self {
        Self {
            model,
            noise,
            pose: start,
            twist: Twist::default(),
            odometry: Pose2::default(),
            wall_impact: None,
        }
    }

    /// Radius of the body, metres.
    pub(crate) fn radius(&self) -> f64 {
        self.model.radius()
    }

    /// Moves for `dt` seconds towards the twist `wanted`. A wall or a thing ends the translation where the body touches
    /// it; the robot may still turn on the spot.
    pub(crate) fn step(&mut self, wanted: Twist, dt: f64, around: &Surroundings, rng: &mut Rng) {
        let twist = self.model.limit(self.twist, wanted, dt);
        let before = self.pose;
        let free = self.free_time(twist, dt, around);
        self.wall_impact = (free < dt).then_some(twist.v.abs());
        self.pose = step(before, twist, free);
        if free < dt {
            self.pose = step(self.pose, Twist { v: 0.0, omega: twist.omega }, dt - free);
        }
        self.twist = if free < dt { Twist { v: 0.0, ..twist } } else { twist };

        // D6: the increment in the robot frame, plus noise whose variance grows with travel and turn.
        let increment = before.relative(self.pose);
        let variance = self.noise.variances(twist.v * free, twist.omega * dt);
        let off = variance.map(|v| v.sqrt() * standard_normal(rng));
        let noisy = Pose2::new(increment.x + off[0], increment.y + off[1], increment.heading + off[2]);
        self.odometry = self.odometry.compose(noisy);
    }

    /// How long, up to `dt` seconds, the arc from here stays clear of what is solid. Looked at every half cell,
    /// then bisected.
    fn free_time(&self, twist: Twist, dt: f64, around: &Surroundings) -> f64 {
        let pieces = (twist.v.abs() * dt / (0.5 * around.walls().grid.resolution())).ceil();
        for k in 1..=(pieces as u32) {
            let mut good = dt * f64::from(k - 1) / pieces;
            let mut bad = dt * f64::from(k) / pieces;
            if self.is_clear(twist, bad, around) {
                continue;
            }
            for _ in 0..30 {
                let middle = 0.5 * (good + bad);
                if self.is_clear(twist, middle, around) { good = middle } else { bad = middle }
            }
            return good;
        }
        dt
    }

    /// Whether the body touches nothing solid `t` seconds along the arc from here.
    fn is_clear(&self, twist: Twist, t: f64, around: &Surroundings) -> bool {
        around.is_clear(step(self.pose, twist, t).position(), self.radius())
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
    use curionav_planning::random::{rng, uniform};

    use super::*;
    use crate::scenario::WorldSetup;

    /// A room of 10 m x 10 m with walls of one cell, 0.05 m.
    fn room() -> Surroundings {
        let wall = |i: usize| [0, 199].contains(&(i % 200)) || [0, 199].contains(&(i / 200));
        let cells = (0..40_000).map(|i| if wall(i) { 100 } else { 0 }).collect();
        let map = StaticMap::new(OccupancyGrid::new(200, 200, 0.05, Pose2::default(), cells).unwrap());
        Surroundings::new(&map, &WorldSetup::default())
    }

    fn plant(start: Pose2) -> Plant {
        Plant::new(RobotModel::default(), OdometryNoise::default(), start)
    }

    #[test]
    fn it_follows_the_exact_arc_within_its_limits() {
        let (map, mut r) = (room(), rng(1, 0));
        let mut p = plant(Pose2::new(5.0, 5.0, 0.0));
        p.step(Twist { v: 1.0, omega: 0.0 }, 0.1, &map, &mut r);
        // from rest at 0.5 m/s2 for 0.1 s: 0.05 m/s, held over the tick: 5 mm
        assert!((p.twist.v - 0.05).abs() < 1e-12 && (p.pose.x - 5.005).abs() < 1e-12);
        assert_eq!(p.wall_impact, None);
    }

    #[test]
    fn it_never_enters_a_wall_however_it_is_driven() {
        let map = room();
        for seed in 0..20 {
            let mut r = rng(seed, 0);
            let mut p = plant(Pose2::new(5.0, 5.0, 0.3 * seed as f64));
            let mut impacts = 0;
            for _ in 0..1500 {
                let wanted = Twist { v: 1.0, omega: 0.6 * uniform(&mut r) - 0.3 };
                p.step(wanted, 0.1, &map, &mut r);
                assert!(map.distance(p.pose.position()) >= 0.3 - 1e-9, "seed {seed}");
                impacts += u32::from(p.wall_impact.is_some());
            }
            assert!(impacts > 0, "seed {seed} never met a wall");
        }
    }

    #[test]
    fn a_wall_is_met_at_full_speed_and_the_robot_stands() {
        let (map, mut r) = (room(), rng(1, 0));
        let mut p = plant(Pose2::new(7.0, 5.0, 0.0));
        let mut hit = None;
        for _ in 0..100 {
            p.step(Twist { v: 1.0, omega: 0.0 }, 0.1, &map, &mut r);
            hit = hit.or(p.wall_impact);
        }
        // the wall's face is at 9.95, the body's radius 0.3
        assert!((p.pose.x - 9.65).abs() < 1e-6, "{:?}", p.pose);
        assert!((hit.unwrap() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn backwards_it_is_as_fast_as_its_model_says_and_stops_at_a_wall() {
        let (map, mut r) = (room(), rng(1, 0));
        let model = RobotModel { v_reverse: 0.3, ..RobotModel::default() };
        let mut p = Plant::new(model, OdometryNoise::default(), Pose2::new(1.0, 5.0, 0.0));
        let mut hit = None;
        for _ in 0..60 {
            p.step(Twist { v: -1.0, omega: 0.0 }, 0.1, &map, &mut r);
            hit = hit.or(p.wall_impact);
        }
        // the wall's face is at 0.05, the body's radius 0.3
        assert!((p.pose.x - 0.35).abs() < 1e-6, "{:?}", p.pose);
        assert!((hit.unwrap() - 0.3).abs() < 1e-9);
    }

    #[test]
    fn odometry_noise_has_the_declared_variance_whatever_the_step() {
        // 5 m straight: position variance 0.004 * 5 on the axis of travel, heading 0.004 * 5.
        let map = StaticMap::new(OccupancyGrid::new(200, 20, 0.1, Pose2::default(), vec![0; 4000]).unwrap());
        let map = Surroundings::new(&map, &WorldSetup::default());
        for dt in [0.1, 0.05] {
            let (mut along, mut heading, runs) = (0.0, 0.0, 4000);
            for seed in 0..runs {
                let mut r = rng(seed, 3);
                let mut p = plant(Pose2::new(2.0, 1.0, 0.0));
                p.twist.v = 1.0;
                (0..(5.0_f64 / dt).round() as u32)
                    .for_each(|_| p.step(Twist { v: 1.0, omega: 0.0 }, dt, &map, &mut r));
                // the heading error bends the track: along = 5 - integral of (1 - cos), second order
                along += (p.odometry.x - 5.0).powi(2);
                heading += p.odometry.heading.powi(2);
            }
            let (along, heading) = (along / runs as f64, heading / runs as f64);
            assert!((along / 0.02 - 1.0).abs() < 0.1, "dt {dt}: {along}");
            assert!((heading / 0.02 - 1.0).abs() < 0.1, "dt {dt}: {heading}");
        }
    }
}
