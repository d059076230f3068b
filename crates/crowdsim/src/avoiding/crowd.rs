//! All people of a scenario who avoid others, step by step.

use curionav_planning::geometry::Point2;
use curionav_planning::hrvo::{Body, HrvoParams, Velocity, VelocityObstacle, velocity};
use curionav_planning::occupancy::StaticMap;

use super::route::Route;
use super::wall_rim::{NearWall, nearest_walls};
use crate::scenario::{PeopleParams, WalkMode, Walker};
use crate::social_force::{SocialForceParams, acceleration};
use crate::walls::wall_distance;

/// Times a step slides along what is in its way before it is shortened.
const SLIDES: usize = 3;
/// Parts of a step tried, longest first, when sliding does not help.
const STEP_PARTS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];
/// Walls farther off than this many of their force's reaches are not felt.
const WALL_REACHES: f64 = 5.0;
/// Nearer by less than this is rounding, metres.
const ROUNDING_M: f64 = 1e-9;

/// How a person chooses its velocity.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Law {
    Hrvo(HrvoParams),
    SocialForce(SocialForceParams),
}

/// The people of `[[walkers]]` as they walk around each other. All choose at once, then all move.
#[derive(Debug, Clone)]
pub(crate) struct AvoidingCrowd {
    law: Law,
    walkers: Vec<Person>,
    /// The walkers in their order, then the robot if there is one, then the others that were seen at the last step.
    bodies: Vec<Body>,
    /// The same without the robot, as the heedless see them at this step.
    without_robot: Vec<Body>,
    /// Distance from a wall that a walker's centre keeps, metres.
    wall_gap: f64,
}

#[derive(Debug, Clone)]
struct Person {
    route: Route,
    speed: f64,
    stands: bool,
    heedless: bool,
}

impl AvoidingCrowd {
    /// All walkers at the starts of their routes, standing.
    pub(crate) fn new(law: Law, walkers: &[Walker], people: &PeopleParams, map: &StaticMap) -> Self {
        let starts = walkers.iter().map(|walker| {
            let (route, position) = Route::new(walker);
            let stands = walker.mode == WalkMode::Stand;
            let body = Body {
                position,
                velocity: Velocity::zeros(),
                preferred: Velocity::zeros(),
                radius: people.radius,
                yields: !stands,
            };
            (Person { route, speed: walker.speed, stands, heedless: walker.heedless }, body)
        });
        let (walkers, bodies): (Vec<Person>, Vec<Body>) = starts.unzip();
        // Routes keep their distance from centres of cells; measured exactly that can be a diagonal less.
        let diagonal = std::f64::consts::SQRT_2 * map.grid.resolution();
        let wall_gap = (people.radius - diagonal).max(0.01);
        Self { law, walkers, bodies, without_robot: Vec::new(), wall_gap }
    }

    pub(crate) fn people(&self) -> &[Body] {
        &self.bodies[..self.walkers.len()]
    }

    /// All walk for `dt` seconds, seeing each other, `others`, who move by their own law, and the robot unless they are
    /// heedless.
    pub(crate) fn step(
        &mut self,
        dt: f64,
        map: &StaticMap,
        robot: Option<Body>,
        others: impl IntoIterator<Item = Body>,
    ) {
        let count = self.walkers.len();
        self.bodies.truncate(count);
        self.bodies.extend(robot);
        self.bodies.extend(others);
        let goal_radius = match &self.law {
            Law::Hrvo(params) => params.goal_radius,
            Law::SocialForce(params) => params.goal_radius,
        };
        for (person, body) in self.walkers.iter_mut().zip(&mut self.bodies) {
            if !person.stands {
                person.route.advance(body.position, goal_radius, dt);
                body.preferred = person.preferred(body, map, dt);
            }
        }
        self.without_robot.clear();
        self.without_robot.extend_from_slice(&self.bodies[..count]);
        self.without_robot.extend_from_slice(&self.bodies[count + usize::from(robot.is_some())..]);
        let chosen: Vec<_> = (0..count).map(|i| self.choose(i, dt, map)).collect();
        // One after the other, seeing where those before have gone, so that none steps into another.
        for (i, (velocity, wall)) in chosen.into_iter().enumerate() {
            let velocity = self.clipped(i, velocity, wall, dt, map);
            let body = &mut self.bodies[i];
            body.velocity = velocity;
            body.position = moved(body.position, velocity, dt);
        }
    }

    /// The velocity of one walker for this step, and the nearest wall.
    fn choose(&self, i: usize, dt: f64, map: &StaticMap) -> (Velocity, Option<NearWall>) {
        let person = &self.walkers[i];
        match &self.law {
            _ if person.stands => (Velocity::zeros(), None),
            Law::Hrvo(params) => self.by_velocity_obstacles(i, params, dt, map),
            Law::SocialForce(params) => self.by_forces(i, params, dt, map),
        }
    }

    /// The bodies that one walker takes notice of, its own among them.
    fn seen_by(&self, i: usize) -> &[Body] {
        if self.walkers[i].heedless { &self.without_robot } else { &self.bodies }
    }

    /// Chosen among what others and walls leave, as far as it can be taken up.
    fn by_velocity_obstacles(
        &self,
        i: usize,
        params: &HrvoParams,
        dt: f64,
        map: &StaticMap,
    ) -> (Velocity, Option<NearWall>) {
        let body = self.bodies[i];
        let max_speed = self.walkers[i].speed * params.max_speed_factor;
        let horizon = params.wall_horizon_s;
        let walls = nearest_walls(map, body.position, body.radius + max_speed * horizon);
        let obstacles = walls
            .iter()
            .map(|wall| VelocityObstacle::of_wall(wall.towards, wall.distance - body.radius, horizon));
        let wanted = velocity(i, self.seen_by(i), obstacles, max_speed, dt, params);
        let change = wanted - body.velocity;
        let most = params.max_accel * dt;
        let taken_up =
            if change.norm() > most { body.velocity + change * (most / change.norm()) } else { wanted };
        (taken_up, walls.first().copied())
    }

    /// Where forces drive it from its present velocity.
    fn by_forces(
        &self,
        i: usize,
        params: &SocialForceParams,
        dt: f64,
        map: &StaticMap,
    ) -> (Velocity, Option<NearWall>) {
        let body = &self.bodies[i];
        let max_speed = self.walkers[i].speed * params.max_speed_factor;
        let walls = nearest_walls(
            map,
            body.position,
            body.radius + max_speed * dt + WALL_REACHES * params.wall_reach,
        );
        let driven = body.velocity + acceleration(i, self.seen_by(i), &walls, params) * dt;
        let speed = driven.norm();
        let kept = if speed > max_speed { driven * (max_speed / speed) } else { driven };
        (kept, walls.first().copied())
    }

    /// What is left of a walker's velocity when its step must end clear of walls and of people: without
    /// its parts towards what is in the way, then shorter, then none.
    fn clipped(
        &self,
        i: usize,
        mut velocity: Velocity,
        wall: Option<NearWall>,
        dt: f64,
        map: &StaticMap,
    ) -> Velocity {
        for _ in 0..SLIDES {
            let Some(towards) = self.in_the_way(i, velocity, wall, dt, map) else { return velocity };
            velocity -= towards * velocity.dot(&towards).max(0.0);
        }
        let mut shorter = STEP_PARTS.into_iter().map(|part| velocity * part);
        shorter.find(|v| self.in_the_way(i, *v, wall, dt, map).is_none()).unwrap_or_default()
    }

    /// The direction of a wall or person too near to where this step would end, if there is one. A walker
    /// that is too near already may go wherever that gets no worse.
    fn in_the_way(
        &self,
        i: usize,
        velocity: Velocity,
        wall: Option<NearWall>,
        dt: f64,
        map: &StaticMap,
    ) -> Option<Velocity> {
        let body = &self.bodies[i];
        let end = moved(body.position, velocity, dt);
        let wall = wall.filter(|wall| {
            let keep = self.wall_gap.min(wall.distance);
            wall_distance(map, end) < keep - ROUNDING_M
        });
        let mut others = self.bodies.iter().enumerate().filter(|(j, _)| *j != i);
        wall.map(|wall| wall.towards).or_else(|| others.find_map(|(_, other)| bump(body, end, other)))
    }
}

/// The direction of `other`, if a step of `body` to `end` ends nearer to it than bodies can be or are.
fn bump(body: &Body, end: Point2, other: &Body) -> Option<Velocity> {
    let touch = body.radius + other.radius;
    if end.distance_squared(other.position) >= touch * touch {
        return None;
    }
    let before = body.position.distance(other.position);
    let after = end.distance(other.position);
    (after < before.min(touch) - ROUNDING_M && before > 0.0).then(|| {
        let dx = other.position.x - body.position.x;
        let dy = other.position.y - body.position.y;
        Velocity::new(dx / before, dy / before)
    })
}

impl Person {
    /// Towards the route's next point in sight, at the preferred speed or just as fast as to land on it.
    fn preferred(&self, body: &Body, map: &StaticMap, dt: f64) -> Velocity {
        let Some(aim) = self.route.aim(body.position, map, body.radius) else { return Velocity::zeros() };
        let way = Velocity::new(aim.x - body.position.x, aim.y - body.position.y);
        let length = way.norm();
        if length < self.speed * dt { way / dt } else { way * (self.speed / length) }
    }
}

fn moved(p: Point2, velocity: Velocity, dt: f64) -> Point2 {
    Point2::new(p.x + velocity.x * dt, p.y + velocity.y * dt)
}
