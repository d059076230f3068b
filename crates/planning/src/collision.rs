//! Whether a timed trajectory stays clear of walls and of people as they are forecast to move.
//!
//! One checker serves a whole cycle: generators drop colliding candidates with it, and arbitration asks
//! it once more before a decision goes out. Both see the same margins.

use serde::{Deserialize, Serialize};

use crate::forecast::{ForecastParams, PedestrianForecast};
use crate::geometry::{Point2, Pose2, closest_approach};
use crate::motion::RobotModel;
use crate::occupancy::StaticMap;
use crate::scene::Scene;

/// How much room is kept around the robot (D12).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CollisionParams {
    /// Standard deviations of position (belief and forecast together) added to every distance, D12's k.
    pub sigma_factor: f64,
    /// Cap of that addition, metres: beyond it uncertainty would close every passage.
    pub max_inflation: f64,
    /// Room kept to walls whatever the uncertainty, metres: what tracking a trajectory may miss it by.
    pub wall_margin: f64,
    /// Room kept to people whatever the uncertainty, metres.
    pub person_margin: f64,
}

impl Default for CollisionParams {
    fn default() -> Self {
        Self { sigma_factor: 0.5, max_inflation: 0.25, wall_margin: 0.05, person_margin: 0.1 }
    }
}

/// What a trajectory runs into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Obstacle {
    /// The static map: occupied or unknown cells, or its edge.
    Wall,
    /// The person with this id.
    Person(u32),
}

/// The first place where a trajectory comes too near to something.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collision {
    /// Index of the state at the end of the offending segment.
    pub step: usize,
    /// Start of that segment, seconds after the scene's stamp: until then the trajectory is free.
    pub time: f64,
    /// What is in the way.
    pub with: Obstacle,
}

/// Checks poses and timed trajectories of one scene.
///
/// Where the robot already stands closer than its margins ask, they shrink to the present distance
/// (less a little slack) but not below bodily contact, so that margins alone can never freeze the robot.
/// If the estimate even says contact, going away stays legal and nothing else does.
#[derive(Debug, Clone)]
pub struct CollisionChecker<'a> {
    map: &'a StaticMap,
    forecast: PedestrianForecast<'a>,
    params: CollisionParams,
    start: Pose2,
    /// Variance of the robot's position, m2.
    belief_variance: f64,
    /// Clearance asked of every pose, metres.
    wall_distance: f64,
    /// Clearance now, metres, if the robot is said to touch a wall.
    touching_wall: Option<f64>,
    /// Centre distance at which bodies touch, metres.
    contact: f64,
    /// Most that may be asked of the distance to each person, metres.
    person_cap: Vec<f64>,
}

impl<'a> CollisionChecker<'a> {
    /// How much nearer than now the robot may come to something inside its margin, metres: what
    /// the first moments of turning away need.
    pub const SLACK: f64 = 0.02;
    /// Distance above contact where that ends, metres: what is tracked is not tracked exactly.
    pub const GUARD: f64 = 0.03;
    /// Greatest distance between wall checks along a segment, metres.
    pub const WALL_SPACING: f64 = 0.1;

    /// A checker for `robot` in `scene`, whose people move as `forecast` says.
    pub fn new(
        map: &'a StaticMap,
        robot: &RobotModel,
        scene: &'a Scene,
        forecast: ForecastParams,
        params: &CollisionParams,
    ) -> Self {
        let start = scene.belief.pose;
        let sigma = scene.belief.position_sigma();
        let radius = robot.radius();
        let inflation = (params.sigma_factor * sigma).min(params.max_inflation);
        let clearance = map.to_obstacle.clearance(&map.grid, start.position());
        // The distance field is constant inside a cell: moving along a wall may change it by one cell.
        let wall_cap =
            (clearance - map.grid.resolution()).max(if clearance >= radius { radius } else { 0.0 });
        let wall_distance = (radius + params.wall_margin + inflation).min(wall_cap);
        let contact = radius + scene.people.radius;
        let person_cap = (0..scene.people.len())
            .map(|i| {
                let now = scene.people.position(i).distance(start.position());
                if now > contact + Self::GUARD {
                    (now - Self::SLACK).max(contact + Self::GUARD)
                } else {
                    now - 1e-3
                }
            })
            .collect();
        Self {
            map,
            forecast: PedestrianForecast::new(&scene.people, forecast),
            params: *params,
            start,
            belief_variance: sigma * sigma,
            wall_distance,
            touching_wall: (clearance < radius).then_some(clearance),
            contact,
            person_cap,
        }
    }

    /// Whether the robot standing at `pose` keeps its distance from walls.
    pub fn wall_clear(&self, pose: Pose2) -> bool {
        self.wall_spare(pose) >= 0.0
    }

    /// How far the robot may move from `pose` in any way before its distance from walls has to be
    /// looked at again, metres; negative when it is too near already.
    pub fn wall_spare(&self, pose: Pose2) -> f64 {
        self.map.to_obstacle.clearance(&self.map.grid, pose.position()) - self.wall_distance
    }

    /// Whether the straight way from `from` to `to` keeps the distance from walls, `from` excluded.
    pub fn segment_wall_clear(&self, from: Pose2, to: Pose2) -> bool {
        let pieces = (from.position().distance(to.position()) / Self::WALL_SPACING).ceil().max(1.0);
        (1..=pieces as usize).all(|k| {
            let s = k as f64 / pieces;
            self.wall_clear(Pose2::new(
                from.x + s * (to.x - from.x),
                from.y + s * (to.y - from.y),
                to.heading,
            ))
        })
    }

    /// Distance asked between the robot's centre and any person's `t` seconds from now, metres, before
    /// it is relaxed for people who are already nearer.
    pub fn person_distance(&self, t: f64) -> f64 {
        let sigma = (self.belief_variance + self.forecast.variance(t)).sqrt();
        let inflation = (self.params.sigma_factor * sigma).min(self.params.max_inflation);
        self.contact + self.params.person_margin + inflation
    }

    /// The first collision of the trajectory that starts at the belief's pose at time 0 and reaches
    /// (`x[k]`, `y[k]`, `heading[k]`) at `(k + 1) * dt`; between states robot and people move in straight
    /// lines, checked continuously. Nothing is checked beyond the last state: there the robot stands.
    pub fn first_collision(&self, x: &[f64], y: &[f64], heading: &[f64], dt: f64) -> Option<Collision> {
        let mut from = self.start;
        for step in 0..x.len() {
            let to = Pose2::new(x[step], y[step], heading[step]);
            let time = step as f64 * dt;
            let with = if self.segment_wall_clear(from, to) {
                self.person_hit(from.position(), to.position(), time, dt).map(Obstacle::Person)
            } else {
                Some(Obstacle::Wall)
            };
            if let Some(with) = with {
                return Some(Collision { step, time, with });
            }
            from = to;
        }
        // Away from the wall it touches, not along it: or every cycle could go one cell nearer.
        let end = self.map.to_obstacle.clearance(&self.map.grid, from.position());
        let stays = !x.is_empty() && self.touching_wall.is_some_and(|now| end <= now);
        stays.then(|| Collision { step: x.len() - 1, time: (x.len() - 1) as f64 * dt, with: Obstacle::Wall })
    }

    /// Id of the first person who comes too near while the robot moves from `from` to `to` during
    /// [t, t + dt].
    fn person_hit(&self, from: Point2, to: Point2, t: f64, dt: f64) -> Option<u32> {
        let asked = self.person_distance(t + dt);
        let people = self.forecast.people();
        for i in 0..people.len() {
            let (p, q) = (self.forecast.position(i, t), self.forecast.position(i, t + dt));
            let start = Point2::new(from.x - p.x, from.y - p.y);
            let end = Point2::new(to.x - q.x, to.y - q.y);
            if closest_approach(start, end) < asked.min(self.person_cap[i]) {
                return Some(people.id[i]);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Twist;
    use crate::occupancy::OccupancyGrid;
    use crate::scene::{Belief, People};
    use nalgebra::Matrix3;

    /// 20 m x 20 m, free but for a wall along x = 15.
    fn map() -> StaticMap {
        let mut cells = vec![0_i8; 200 * 200];
        for row in 0..200 {
            cells[row * 200 + 150] = 100;
        }
        StaticMap::new(OccupancyGrid::new(200, 200, 0.1, Pose2::default(), cells).unwrap())
    }

    fn scene(pose: Pose2, people: &[(f64, f64, f64, f64)]) -> Scene {
        Scene {
            tick: 0,
            stamp: 0.0,
            belief: Belief { pose, covariance: Matrix3::identity() * 0.01, twist: Twist::default() },
            people: People {
                id: (0..people.len() as u32).map(|i| 10 + i).collect(),
                x: people.iter().map(|p| p.0).collect(),
                y: people.iter().map(|p| p.1).collect(),
                vx: people.iter().map(|p| p.2).collect(),
                vy: people.iter().map(|p| p.3).collect(),
                radius: 0.3,
            },
            uncertain: false,
        }
    }

    /// Straight along +x from (5, 10) at `v` for 10 steps of 0.3 s.
    fn straight(v: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        ((1..=10).map(|k| 5.0 + v * 0.3 * f64::from(k)).collect(), vec![10.0; 10], vec![0.0; 10])
    }

    fn first(scene: &Scene, v: f64) -> Option<Collision> {
        let (map, robot) = (map(), RobotModel::default());
        let c = CollisionChecker::new(
            &map,
            &robot,
            scene,
            ForecastParams::default(),
            &CollisionParams::default(),
        );
        let (x, y, h) = straight(v);
        c.first_collision(&x, &y, &h, 0.3)
    }

    #[test]
    fn a_wall_ahead_is_met_and_an_empty_hall_is_not() {
        let s = scene(Pose2::new(5.0, 10.0, 0.0), &[]);
        assert_eq!(first(&s, 1.0), None);
        // 9.4 m from the wall: reached at 3.2 m/s within 3 s
        let hit = first(&s, 3.3).unwrap();
        assert_eq!(hit.with, Obstacle::Wall);
        assert!(hit.step >= 8, "{hit:?}");
    }

    #[test]
    fn people_are_met_where_they_will_be_not_where_they_are() {
        // stands on the way, but walks off to the side in time
        assert_eq!(first(&scene(Pose2::new(5.0, 10.0, 0.0), &[(7.0, 10.0, 0.0, 1.0)]), 1.0), None);
        // stays on the way: met after at most 2 m - contact
        let hit = first(&scene(Pose2::new(5.0, 10.0, 0.0), &[(7.0, 10.0, 0.0, 0.0)]), 1.0).unwrap();
        assert_eq!(hit.with, Obstacle::Person(10));
        assert!(hit.time > 0.5 && hit.time < 1.4, "{hit:?}");
        // crosses from the side and arrives at the same time
        let crossing = scene(Pose2::new(5.0, 10.0, 0.0), &[(6.5, 8.5, 0.0, 1.0)]);
        assert!(first(&crossing, 1.0).is_some());
    }

    #[test]
    fn two_who_swap_places_within_one_step_still_meet() {
        let (map, robot) = (map(), RobotModel::default());
        let s = scene(Pose2::new(5.0, 10.0, 0.0), &[(6.5, 10.0, -2.0, 0.0)]);
        let c =
            CollisionChecker::new(&map, &robot, &s, ForecastParams::default(), &CollisionParams::default());
        // states alone are far apart: robot 5 -> 8, person 6.5 -> 4.5 in one step of 1 s
        assert!(c.first_collision(&[8.0], &[10.0], &[0.0], 1.0).is_some());
    }

    #[test]
    fn a_violated_margin_forbids_going_nearer_but_not_leaving() {
        // contact at 0.6 m; a person 0.65 m ahead is inside the margin
        let ahead = scene(Pose2::new(5.0, 10.0, 0.0), &[(5.65, 10.0, 0.0, 0.0)]);
        assert!(first(&ahead, 0.2).is_some());
        assert_eq!(first(&ahead, 0.0), None);
        let behind = scene(Pose2::new(5.0, 10.0, 0.0), &[(4.35, 10.0, 0.0, 0.0)]);
        assert_eq!(first(&behind, 0.2), None);
        // even when the estimate says contact
        let touching = scene(Pose2::new(5.0, 10.0, 0.0), &[(4.5, 10.0, 0.0, 0.0)]);
        assert_eq!(first(&touching, 0.2), None);
        // the same with the wall 0.4 m away on one side
        let by_wall = scene(Pose2::new(14.6, 10.0, 0.0), &[]);
        let (map, robot) = (map(), RobotModel::default());
        let c = CollisionChecker::new(
            &map,
            &robot,
            &by_wall,
            ForecastParams::default(),
            &CollisionParams::default(),
        );
        assert_eq!(c.first_collision(&[14.4, 14.2], &[10.0, 10.0], &[0.0, 0.0], 0.3), None);
        assert!(c.first_collision(&[14.8], &[10.0], &[0.0], 0.3).is_some());
    }

    #[test]
    fn more_uncertainty_never_makes_a_trajectory_free() {
        for lateral in 0..20 {
            let y = 10.0 + 0.1 * f64::from(lateral);
            let mut s = scene(Pose2::new(5.0, 10.0, 0.0), &[(7.0, y, 0.0, 0.0)]);
            let sure = first(&s, 1.0).is_some();
            s.belief.covariance = Matrix3::identity() * 0.25;
            let unsure = first(&s, 1.0).is_some();
            assert!(unsure || !sure, "lateral {lateral}");
        }
    }
}
