//! The world: robot, people and sensors, one tick after the other.

mod group;
mod recorded_extent;
mod truth;

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::numerics::hypot;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::parameters::{FieldError, Ranged};
use curionav_planning::random::{rng, standard_normal};
use curionav_planning::scene::People;
use curionav_planning::sight::is_free;

use crate::crowds::populated;
use crate::legs::legs;
use crate::lidar::{Bodies, View, silence};
use crate::maps::Maps;
use crate::motion::{Walkers, passer_by, robot_body};
use crate::perception::perceived;
use crate::plant::Plant;
use crate::recorded::Recording;
use crate::scenario::{LaserFaults, PeopleShape, Scenario, WalkMode, WorldEvent};
use crate::surroundings::Surroundings;
use crate::things::Things;
use curionav_planning::time_to_collision::time_to_collision;

use self::group::is_in_group;
pub use self::recorded_extent::RecordedExtent;
use self::recorded_extent::chosen;
pub use self::truth::{Overlap, Touch, Truth};

/// Random streams, apart from each other and from those of other parts that use the same seed. Noise is
/// drawn from a stream of its own for each tick, so that looking twice sees the same.
const START_STREAM: u64 = 0x5354_4152_0000_0000;
const ODOMETRY_STREAM: u64 = 0x4f44_4f4d_0000_0000;
const LASER_STREAM: u64 = 0x4c41_5345_0000_0000;
const LASER_FAULT_STREAM: u64 = 0x4641_554c_0000_0000;
const GLASS_STREAM: u64 = 0x474c_4153_0000_0000;

/// Most people of a world, walkers and recorded ones together: a message holds no more (`schemas`, `MAX_PEOPLE`).
pub const MOST_PEOPLE: usize = 1024;

/// Draws of a true start that is clear of walls and people before the nominal one is taken.
const START_DRAWS: usize = 1000;

/// Where a person's social space ends, metres of gap (Hall).
const SOCIAL_SPACE_M: f64 = 3.6;

/// Ids of live people begin here; below are walkers, then recorded people.
pub const FIRST_LIVE_ID: u32 = 1_000_000;

/// What the robot's sensors say at one tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Ticks since the start.
    pub tick: u64,
    /// Robot's clock, seconds.
    pub stamp: f64,
    /// One range a beam, metres; `range_max` where nothing was met, NaN from a beam that says nothing.
    pub ranges: Vec<f32>,
    /// Pose in the odometry frame, which begins at the origin and drifts.
    pub odometry: Pose2,
    /// Measured speed and turn rate.
    pub twist: Twist,
    /// The people the planner is told about, map frame.
    pub people: People,
}

/// What a laser had before it.
#[derive(Debug, Clone)]
struct Moment {
    robot: Pose2,
    bodies: Bodies,
    things: Things,
}

/// The simulated world. Same scenario, map, recordings, seed and commands: same run, bit for bit.
#[derive(Debug, Clone)]
pub struct World {
    scenario: Scenario,
    /// What the robot is given.
    map: StaticMap,
    /// What is solid.
    around: Surroundings,
    /// What late scans have seen, the newest first.
    past: VecDeque<Moment>,
    seed: u64,
    tick: u64,
    plant: Plant,
    walkers: Walkers,
    recordings: Vec<Recording>,
    live: People,
    people: People,
    /// The tick at which each person came into being who was not there at the start, by id.
    arrived: BTreeMap<u32, u64>,
    /// Ids of the people who overlap the robot and have done so since before it could have stopped for them.
    unavoidable: BTreeSet<u32>,
}

impl World {
    /// The world at t = 0 in which the map is true, but for its zones, which only the robot knows. `recordings` are
    /// those the scenario names, in its order. Checks the scenario against the map.
    pub fn new(
        scenario: &Scenario,
        map: StaticMap,
        recordings: Vec<Recording>,
        seed: u64,
    ) -> Result<Self, FieldError> {
        Self::on(scenario, Maps::of(map), recordings, seed)
    }

    /// The world at t = 0 in which the map may be wrong. Checks the scenario against both maps.
    pub fn on(
        scenario: &Scenario,
        maps: Maps,
        recordings: Vec<Recording>,
        seed: u64,
    ) -> Result<Self, FieldError> {
        scenario.check()?;
        let around = Surroundings::new(&maps.truth, &scenario.world);
        scenario.check_on(&maps, around.floor())?;
        let scenario = &populated(scenario, around.floor(), seed)?;
        let mut world = Self {
            plant: Plant::new(scenario.robot.model.clone(), scenario.odometry_noise, scenario.robot.start),
            walkers: Walkers::new(scenario, around.floor()),
            recordings: chosen(scenario, around.floor(), recordings)?,
            live: People::default(),
            people: People::default(),
            arrived: BTreeMap::new(),
            unavoidable: BTreeSet::new(),
            scenario: scenario.clone(),
            map: maps.given,
            around,
            past: VecDeque::new(),
            seed,
            tick: 0,
        };
        world.are_few_enough()?;
        world.people = world.all_people();
        world.plant.pose = world.draw_start();
        world.start_is_clear()?;
        world.carry(f64::NEG_INFINITY);
        world.unavoidable = world.overlapping().map(|i| world.people.id[i]).collect();
        Ok(world)
    }

    fn are_few_enough(&self) -> Result<(), FieldError> {
        let walkers = self.scenario.walkers.len();
        let recorded: usize = self.recordings.iter().map(|recording| recording.ids().len()).sum();
        let all = walkers + recorded;
        if all <= MOST_PEOPLE {
            return Ok(());
        }
        let field = if recorded > 0 { "recorded" } else { "walkers" };
        let problem = format!("are {all} people in all: {walkers} with routes and {recorded} recorded");
        let mend = format!("have at most {MOST_PEOPLE}, `ids` chooses among the recorded");
        Err(FieldError::new(field, problem, mend))
    }

    /// Whether no person stands in the robot at its start. People who walk as they were recorded go on by themselves;
    /// one with a route would wait for the robot to go away, and the robot for the person.
    fn start_is_clear(&self) -> Result<(), FieldError> {
        let nominal = self.scenario.robot.start.position();
        let actual = self.plant.pose.position();
        for (i, walker) in self.scenario.walkers.iter().enumerate() {
            let person = self.people.position(i);
            let stands = walker.mode == WalkMode::Stand && person.distance(nominal) < self.contact_distance();
            if stands || person.distance(actual) < self.contact_distance() {
                let problem = format!(
                    "stands in the robot at its start: their centres are {:.2} m apart, and bodies touch at {:.2} m",
                    person.distance(if stands { nominal } else { actual }),
                    self.contact_distance()
                );
                let mend = "move the person or robot.start apart";
                return Err(FieldError::new(format!("walkers[{i}]"), problem, mend));
            }
        }
        Ok(())
    }

    /// The scenario, with the people whom the seed has drawn among its walkers.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Where the people of each recording are.
    pub fn recorded(&self) -> impl Iterator<Item = RecordedExtent> {
        let pairs = self.scenario.recorded.iter().zip(&self.recordings);
        pairs.map(|(setup, recording)| RecordedExtent::of(setup, self.around.floor(), recording))
    }

    /// The walls that are really there.
    pub fn walls(&self) -> &StaticMap {
        self.around.walls()
    }

    /// The map that the robot is given.
    pub fn map(&self) -> &StaticMap {
        &self.map
    }

    /// Ticks since the start.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Seconds since the start.
    pub fn time(&self) -> f64 {
        self.tick as f64 * self.scenario.clock.tick_s
    }

    /// All people there are.
    pub fn people(&self) -> &People {
        &self.people
    }

    /// What the sensors say now.
    pub fn observe(&self) -> Observation {
        let pose = self.plant.pose;
        let what = self.scenario.perception.people;
        Observation {
            tick: self.tick,
            stamp: self.time(),
            ranges: self.scan(&self.laser_faults()),
            odometry: self.plant.odometry,
            twist: self.plant.twist,
            people: perceived(what, &self.people, pose, &self.scenario.laser, self.around.floor()),
        }
    }

    /// How the laser fails now.
    fn laser_faults(&self) -> LaserFaults {
        let now = self.time();
        let so_far = self.scenario.world.events.iter().take_while(|event| event.at_s <= now);
        so_far.filter_map(|event| event.laser).last().unwrap_or(self.scenario.laser_faults)
    }

    fn scan(&self, faults: &LaserFaults) -> Vec<f32> {
        let laser = &self.scenario.laser;
        let [x, y, heading] = faults.moved;
        let mounted = laser.robot_from_laser.compose(Pose2::new(x, y, heading));
        let walls = self.around.walls();
        let now = self.bodies();
        let view = match self.seen_late(faults.late_s) {
            Some(then) => {
                let at = then.robot.compose(mounted);
                View { laser, at, walls, people: &then.bodies, things: &then.things }
            }
            None => {
                let at = self.plant.pose.compose(mounted);
                View { laser, at, walls, people: &now, things: self.around.things() }
            }
        };
        // The root of a square is not always the number.
        let is_noisy = faults.noise_m > 0.0;
        let sigma = if is_noisy { hypot(laser.range_sigma, faults.noise_m) } else { laser.range_sigma };
        let mut noise = rng(self.seed, LASER_STREAM + self.tick);
        let mut glass = rng(self.seed, GLASS_STREAM + self.tick);
        let mut ranges = view.scan(sigma, &mut noise, &mut glass);
        if faults.silent_share > 0.0 {
            let mut chance = rng(self.seed, LASER_FAULT_STREAM + self.tick);
            silence(&mut ranges, faults.silent_share, &mut chance);
        }
        ranges
    }

    /// What was before the laser `late` seconds ago, or at the start if that is longer ago; nothing if that is now.
    fn seen_late(&self, late: f64) -> Option<&Moment> {
        let ticks = (late / self.scenario.clock.tick_s).round() as usize;
        ticks.checked_sub(1).and_then(|ago| self.past.get(ago).or(self.past.back()))
    }

    /// Remembers what is before the laser for as long as any scan is late.
    fn remember(&mut self) {
        let events = self.scenario.world.events.iter().filter_map(|event| event.laser);
        let faults = std::iter::once(self.scenario.laser_faults).chain(events);
        let latest = faults.map(|faults| faults.late_s).fold(0.0, f64::max);
        if latest > 0.0 {
            let things = self.around.things().clone();
            self.past.push_front(Moment { robot: self.plant.pose, bodies: self.bodies(), things });
            self.past.truncate((latest / self.scenario.clock.tick_s).round() as usize);
        }
    }

    /// What really is now.
    pub fn truth(&self) -> Truth {
        let pose = self.plant.pose;
        let twist = self.plant.twist;
        let mut person_distance = f64::INFINITY;
        let mut seen_person_distance = f64::INFINITY;
        for person in (0..self.people.len()).map(|i| self.people.position(i)) {
            let distance = person.distance(pose.position());
            person_distance = person_distance.min(distance);
            if distance < seen_person_distance && is_free(self.around.walls(), pose.position(), person) {
                seen_person_distance = distance;
            }
        }
        let (held_up, held_up_near) = self.held_up();
        let touched = self.overlapping().filter(|i| !self.unavoidable.contains(&self.people.id[*i]));
        Truth {
            tick: self.tick,
            time: self.time(),
            pose,
            twist,
            person_distance,
            seen_person_distance,
            person_clearance: person_distance - self.contact_distance(),
            wall_clearance: self.around.distance(pose.position()) - self.plant.radius(),
            wall_impact: self.plant.wall_impact,
            touching: touched.map(|i| Touch::of(pose, twist, &self.people, i)).collect(),
            overlaps: self.overlapping().map(|i| Overlap::of(pose, &self.people, i)).collect(),
            is_in_group: is_in_group(pose.position(), self.plant.radius(), &self.people),
            held_up,
            held_up_near,
            time_to_collision: time_to_collision(pose, twist, self.plant.radius(), &self.people),
        }
    }

    /// [`Truth::held_up`] and [`Truth::held_up_near`].
    fn held_up(&self) -> (f64, f64) {
        let robot = self.plant.pose.position();
        let reach = self.contact_distance() + SOCIAL_SPACE_M;
        let mut all = 0.0;
        let mut near = 0.0;
        for (i, lost) in self.walkers.lost_shares().enumerate() {
            all += lost;
            if self.people.position(i).distance(robot) < reach {
                near += lost;
            }
        }
        (all, near)
    }

    /// One tick: the robot moves towards the commanded twist, then the people move, seeing it there.
    pub fn step(&mut self, command: Twist) {
        let dt = self.scenario.clock.tick_s;
        let mut noise = rng(self.seed, ODOMETRY_STREAM + self.tick);
        self.remember();
        self.plant.step(command, dt, &self.around, &mut noise);
        let robot = robot_body(self.plant.pose, self.plant.twist, self.plant.radius());
        let people = &self.people;
        let others = (self.scenario.walkers.len()..people.len()).map(|i| passer_by(people, i));
        let others = others.chain(self.around.things().pushed());
        self.walkers.step(dt, self.around.floor(), people.radius, robot, others);
        let before = self.time();
        self.tick += 1;
        let here = self.plant.pose.position();
        self.around.step(self.time(), dt, here, self.plant.radius());
        self.carry(before);
        self.renew_people();
    }

    /// Carries the robot where an event after `before`, and up to now, has it.
    fn carry(&mut self, before: f64) {
        let now = self.time();
        let due = self.scenario.world.events.iter().filter(|event| before < event.at_s && event.at_s <= now);
        if let Some(place) = due.filter_map(WorldEvent::place).next_back() {
            self.plant.pose = place;
            self.plant.twist = Twist::default();
        }
    }

    /// Puts live people into the world in place of those given before; their ids are counted from
    /// [`FIRST_LIVE_ID`]. They stay where they are until told otherwise.
    pub fn replace_live_people(&mut self, people: &People) {
        self.live = people.clone();
        self.renew_people();
    }

    /// Takes over where all people are now.
    fn renew_people(&mut self) {
        let now = self.all_people();
        let before = std::mem::replace(&mut self.people, now);
        let people = &self.people.id;
        if before.id != *people {
            self.arrived.retain(|id, _| people.contains(id));
            self.arrived
                .extend(people.iter().filter(|id| !before.id.contains(id)).map(|id| (*id, self.tick)));
        }
        let ids = self.overlapping().map(|i| people[i]);
        self.unavoidable =
            ids.filter(|id| self.unavoidable.contains(id) || self.came_too_late(*id)).collect();
    }

    /// Whether a person has been there for less time than the robot needs to stop.
    fn came_too_late(&self, id: u32) -> bool {
        self.arrived.get(&id).is_some_and(|arrived| {
            (self.tick - arrived) as f64 * self.scenario.clock.tick_s < self.seconds_to_stop()
        })
    }

    /// The people who overlap the robot, as indices.
    fn overlapping(&self) -> impl Iterator<Item = usize> {
        let robot = self.plant.pose.position();
        let contact = self.contact_distance();
        (0..self.people.len()).filter(move |&i| self.people.position(i).distance(robot) < contact)
    }

    /// Seconds after which a robot at full speed can stand still because of something that it did not know of: until
    /// its next plan, and to brake.
    fn seconds_to_stop(&self) -> f64 {
        let clock = &self.scenario.clock;
        let robot = &self.scenario.robot.model;
        f64::from(clock.plan_every) * clock.tick_s + robot.v_max / robot.a_max
    }

    /// Distance between centres at which the robot touches a person, metres.
    fn contact_distance(&self) -> f64 {
        self.plant.radius() + self.scenario.people.radius
    }

    /// What the laser meets of people.
    fn bodies(&self) -> Bodies {
        match self.scenario.people.shape {
            PeopleShape::Disc => Bodies::discs(&self.people),
            PeopleShape::Legs => legs(&self.people),
        }
    }

    fn all_people(&self) -> People {
        let mut all = People { radius: self.scenario.people.radius, ..People::default() };
        let walkers = self.walkers.states();
        let mut first = walkers.len() as u32;
        for (id, (position, velocity)) in (0..).zip(walkers) {
            add(&mut all, id, position, velocity);
        }
        for (setup, recording) in self.scenario.recorded.iter().zip(&self.recordings) {
            let time = setup.start_s + self.time();
            let turn = Pose2::new(0.0, 0.0, setup.pose.heading);
            for p in recording.at(if setup.r#loop { recording.wrapped(time) } else { time }) {
                let velocity = turn.transform(p.velocity);
                let id = first + p.index as u32;
                add(&mut all, id, setup.pose.transform(p.position), (velocity.x, velocity.y));
            }
            first += recording.ids().len() as u32;
        }
        for i in 0..self.live.len() {
            let velocity = (self.live.vx[i], self.live.vy[i]);
            add(&mut all, FIRST_LIVE_ID.saturating_add(self.live.id[i]), self.live.position(i), velocity);
        }
        all
    }

    /// The true start (D8): nominal plus noise, redrawn while beyond two standard deviations on any axis
    /// or not clear of walls and people.
    fn draw_start(&self) -> Pose2 {
        let robot = &self.scenario.robot;
        let mut noise = rng(self.seed, START_STREAM);
        for _ in 0..START_DRAWS {
            let z: [f64; 3] = std::array::from_fn(|_| standard_normal(&mut noise));
            let offset: [f64; 3] = std::array::from_fn(|i| robot.start_noise * robot.initial_sigma[i] * z[i]);
            let p = Point2::new(robot.start.x + offset[0], robot.start.y + offset[1]);
            let clear = self.around.distance(p) >= robot.model.radius()
                && (0..self.people.len())
                    .all(|i| self.people.position(i).distance(p) >= self.contact_distance());
            if z.iter().all(|z| z.abs() <= 2.0) && clear {
                return Pose2::default().compose(Pose2::new(p.x, p.y, robot.start.heading + offset[2]));
            }
        }
        robot.start
    }
}

fn add(people: &mut People, id: u32, position: Point2, velocity: (f64, f64)) {
    people.id.push(id);
    people.x.push(position.x);
    people.y.push(position.y);
    people.vx.push(velocity.0);
    people.vy.push(velocity.1);
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod open_tests;
