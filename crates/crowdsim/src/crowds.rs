//! Draws the people of `[[crowds]]` and the beginnings of recordings from a run's seed.
//!
//! Places are drawn uniformly over the floor. A draw that does not fit is thrown away, so that the people are spread
//! as the scenario's words say, given that all of them fit.

use curionav_planning::geometry::Point2;
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::{Cell, StaticMap};
use curionav_planning::parameters::FieldError;
use curionav_planning::random::{Rng, rng, uniform};

use crate::avoiding::route::in_sight;
use crate::scenario::{Behaviour, Crowd, Scenario, WalkMode, Walker, connected, contains, reachable};
use crate::walkers::WalkerState;

/// Random streams of crowds, apart from those of the world; each crowd of each attempt has its own.
const STREAM: u64 = 0x4352_4f57_0000_0000;
/// Random streams of the recordings' beginnings.
const RECORDED_STREAM: u64 = 0x5245_434f_0000_0000;
/// Gap that places keep to walls, beyond a person's body, metres.
const WALL_GAP_M: f64 = 0.1;
/// Gap between two bodies at the beginning, metres.
const BODY_GAP_M: f64 = 0.1;
/// Gap between the bodies of two people who stand together: they are at arm's length, metres.
const GROUP_GAP_M: f64 = 0.35;
/// Gap between the bodies of two people who walk side by side, metres.
const WALKING_GAP_M: f64 = 0.2;
/// Draws of one person or group before there is no room.
const DRAWS: usize = 2000;
/// Draws of the place that follows another one, in sight of it.
const NEXT_DRAWS: usize = 50;
/// Draws of all crowds until those who stand leave the robot a way.
const ATTEMPTS: u64 = 20;

/// The scenario with the people of its crowds among its walkers, and with its recordings from the second on that the
/// seed draws.
pub(crate) fn populated(scenario: &Scenario, map: &StaticMap, seed: u64) -> Result<Scenario, FieldError> {
    let mut populated = scenario.clone();
    for (k, recorded) in populated.recorded.iter_mut().enumerate() {
        if let Some(until) = recorded.start_until_s.take() {
            recorded.start_s = between([recorded.start_s, until], &mut rng(seed, RECORDED_STREAM + k as u64));
        }
    }
    if scenario.crowds.is_empty() {
        return Ok(populated);
    }
    let floor = Floor::new(scenario, map);
    let regions = scenario.crowds.iter().enumerate().map(|(k, crowd)| floor.regions(k, crowd));
    let regions: Vec<Vec<Vec<usize>>> = regions.collect::<Result<_, _>>()?;
    for attempt in 0..ATTEMPTS {
        let mut drawn = Drawn { floor: &floor, walkers: Vec::new(), starts: floor.given.clone() };
        for (k, (crowd, regions)) in scenario.crowds.iter().zip(&regions).enumerate() {
            let mut random = rng(seed, STREAM + (attempt << 16) + k as u64);
            drawn.add(k, crowd, regions, &mut random)?;
        }
        let standing: Vec<Point2> =
            drawn.walkers.iter().filter(|w| w.mode == WalkMode::Stand).map(|w| w.route[0]).collect();
        if floor.has_way_around(&standing) {
            populated.walkers.extend(drawn.walkers);
            return Ok(populated);
        }
    }
    let problem = format!("leave the robot no way to its goal, however they stand ({ATTEMPTS} draws)");
    Err(FieldError::new("crowds", problem, "let fewer people stand, or where there is more room"))
}

/// Where people may be.
struct Floor<'a> {
    scenario: &'a Scenario,
    map: &'a StaticMap,
    /// Cells in which a person can be and that the robot can reach.
    cells: Vec<usize>,
    /// Where the people who need no draw are at the beginning.
    given: Vec<Point2>,
}

impl<'a> Floor<'a> {
    fn new(scenario: &'a Scenario, map: &'a StaticMap) -> Self {
        let robot = &scenario.robot;
        let keep = scenario.people.radius + WALL_GAP_M;
        let reached =
            reachable(map, robot.start.position(), |cell| has_room(map, cell, robot.model.radius()));
        Self {
            scenario,
            map,
            cells: (0..reached.len()).filter(|i| reached[*i] && map.to_obstacle.cell(*i) >= keep).collect(),
            given: scenario.walkers.iter().map(|w| WalkerState::new(w).position()).collect(),
        }
    }

    /// The cells of each region of a crowd; of the whole floor if it names none.
    fn regions(&self, crowd_index: usize, crowd: &Crowd) -> Result<Vec<Vec<usize>>, FieldError> {
        if crowd.regions.is_empty() {
            return Ok(vec![not_empty(self.cells.clone(), format!("crowds[{crowd_index}]"))?]);
        }
        let regions = crowd.regions.iter().enumerate().map(|(j, region)| {
            let inside =
                self.cells.iter().copied().filter(|&i| contains(&region.corners, self.centre(i))).collect();
            not_empty(inside, format!("crowds[{crowd_index}].regions[{j}]"))
        });
        regions.collect()
    }

    fn centre(&self, index: usize) -> Point2 {
        let grid = &self.map.grid;
        grid.centre(index % grid.width(), index / grid.width())
    }

    /// A place in one of `cells`.
    fn place(&self, cells: &[usize], random: &mut Rng) -> Point2 {
        let index = cells[(uniform(random) * cells.len() as f64) as usize % cells.len()];
        let centre = self.centre(index);
        let cell = self.map.grid.resolution();
        let x = centre.x + (uniform(random) - 0.5) * cell;
        let y = centre.y + (uniform(random) - 0.5) * cell;
        Point2::new(x, y)
    }

    /// Whether a person can stand at `p`, or go straight from there to `to`.
    fn is_straight(&self, p: Point2, to: Point2) -> bool {
        let room = self.scenario.people.radius + 0.5 * WALL_GAP_M;
        self.map.grid.at(to) == Cell::Free
            && self.map.to_obstacle.at(&self.map.grid, to) >= room
            && in_sight(self.map, p, to, room)
    }

    /// Whether a person can walk a route to and fro.
    fn is_walkable(&self, route: &[Point2]) -> bool {
        route.windows(2).all(|pair| self.is_straight(pair[0], pair[1]) && self.is_straight(pair[1], pair[0]))
    }

    /// Whether the robot can reach its goal past people who stand.
    fn has_way_around(&self, standing: &[Point2]) -> bool {
        let robot = &self.scenario.robot;
        let radius = robot.model.radius();
        let keep = radius + self.scenario.people.radius + BODY_GAP_M;
        standing.is_empty()
            || connected(self.map, robot.start.position(), robot.goal, |cell| {
                let centre = self.centre(cell);
                has_room(self.map, cell, radius) && standing.iter().all(|p| p.distance(centre) >= keep)
            })
    }
}

/// Whether a body of this radius fits wherever in a cell it is, by the distances between the centres of cells.
fn has_room(map: &StaticMap, cell: usize, radius: f64) -> bool {
    map.to_obstacle.cell(cell) >= radius + std::f64::consts::SQRT_2 * map.grid.resolution()
}

/// The cells, unless there are none.
fn not_empty(cells: Vec<usize>, field: String) -> Result<Vec<usize>, FieldError> {
    if cells.is_empty() {
        let problem = "has no floor that the robot can reach and on which a person has room";
        let mend = "draw it on free cells of the map, in front of the same walls as the start";
        return Err(FieldError::new(field, problem, mend));
    }
    Ok(cells)
}

/// The people drawn so far.
struct Drawn<'a> {
    floor: &'a Floor<'a>,
    walkers: Vec<Walker>,
    starts: Vec<Point2>,
}

impl Drawn<'_> {
    fn add(
        &mut self,
        crowd_index: usize,
        crowd: &Crowd,
        regions: &[Vec<usize>],
        random: &mut Rng,
    ) -> Result<(), FieldError> {
        let mut left = crowd.count as usize;
        while left > 0 {
            let found = (0..DRAWS).find_map(|_| {
                let people = match crowd.behaviour {
                    Behaviour::Walk => self.walkers(crowd, regions, left, random)?,
                    Behaviour::Stand => self.group(crowd, regions, left, random)?,
                };
                let starts: Vec<Point2> = people.iter().map(|w| WalkerState::new(w).position()).collect();
                starts.iter().all(|&start| self.is_clear(crowd, start)).then_some((people, starts))
            });
            let Some((people, starts)) = found else {
                let placed = crowd.count as usize - left;
                let problem = format!("has room for {placed} of its {} people", crowd.count);
                let mend =
                    "have fewer of them, larger regions, other lengths of stretches or a smaller apart_m";
                return Err(FieldError::new(format!("crowds[{crowd_index}]"), problem, mend));
            };
            left -= people.len();
            self.walkers.extend(people);
            self.starts.extend(starts);
        }
        Ok(())
    }

    /// People who walk side by side, each in parallel to the first.
    fn walkers(
        &self,
        crowd: &Crowd,
        regions: &[Vec<usize>],
        left: usize,
        random: &mut Rng,
    ) -> Option<Vec<Walker>> {
        let size = group_size(crowd, left, random);
        let first = self.walker(crowd, regions, random)?;
        let length = first.route[0].distance(first.route[1]);
        let across_x = (first.route[0].y - first.route[1].y) / length;
        let across_y = (first.route[1].x - first.route[0].x) / length;
        let apart = 2.0 * self.floor.scenario.people.radius + WALKING_GAP_M;
        let members = (0..size).map(|k| {
            let aside = k as f64 * apart;
            let beside =
                first.route.iter().map(|p| Point2::new(p.x + aside * across_x, p.y + aside * across_y));
            let member = Walker { route: beside.collect(), ..first.clone() };
            let fits = k == 0 || self.floor.is_walkable(&member.route);
            fits.then(|| Walker { heedless: is_heedless(crowd, random), ..member })
        });
        members.collect()
    }

    fn walker(&self, crowd: &Crowd, regions: &[Vec<usize>], random: &mut Rng) -> Option<Walker> {
        let stops = if regions.len() > 1 { regions.len() } else { crowd.places as usize };
        let [least, most] = crowd.stretch_m;
        let mut route = vec![self.floor.place(&regions[0], random)];
        for k in 1..stops {
            let last = route[k - 1];
            let next = (0..NEXT_DRAWS).find_map(|_| {
                let place = self.floor.place(&regions[k % regions.len()], random);
                let length = last.distance(place);
                (length >= least && length <= most && self.floor.is_straight(last, place)).then_some(place)
            });
            route.push(next?);
        }
        let mut walker = Walker {
            route,
            speed: between(crowd.speed, random),
            mode: WalkMode::BackAndForth,
            start_offset: 0.0,
            pause_s: between(crowd.pause_s, random),
            heedless: false,
        };
        walker.start_offset = uniform(random) * walker.cycle_length();
        Some(walker)
    }

    /// People on a circle, an arm's length apart.
    fn group(
        &self,
        crowd: &Crowd,
        regions: &[Vec<usize>],
        left: usize,
        random: &mut Rng,
    ) -> Option<Vec<Walker>> {
        let size = group_size(crowd, left, random);
        let region = (uniform(random) * regions.len() as f64) as usize % regions.len();
        let middle = self.floor.place(&regions[region], random);
        let first = std::f64::consts::TAU * uniform(random);
        let apart = 2.0 * self.floor.scenario.people.radius + GROUP_GAP_M;
        let step = std::f64::consts::TAU / size as f64;
        let radius = if size > 1 { 0.5 * apart / sin_cos(0.5 * step).0 } else { 0.0 };
        let members = (0..size).map(|k| {
            let (sine, cosine) = sin_cos(first + k as f64 * step);
            let place = Point2::new(middle.x + radius * cosine, middle.y + radius * sine);
            let stands = Walker {
                route: vec![place],
                speed: crowd.speed[0],
                mode: WalkMode::Stand,
                start_offset: 0.0,
                pause_s: 0.0,
                heedless: false,
            };
            self.floor.is_straight(middle, place).then_some(stands)
        });
        members.collect()
    }

    fn is_clear(&self, crowd: &Crowd, start: Point2) -> bool {
        let robot = &self.floor.scenario.robot;
        let bodies = 2.0 * self.floor.scenario.people.radius + BODY_GAP_M;
        start.distance(robot.start.position()) >= crowd.apart_m
            && start.distance(robot.goal) >= crowd.apart_m
            && self.starts.iter().all(|other| other.distance(start) >= bodies)
    }
}

/// How many of the `left` people of a crowd make the next group. Crowds of people who are alone draw no number for it.
fn group_size(crowd: &Crowd, left: usize, random: &mut Rng) -> usize {
    let [least, most] = crowd.group.map(|size| size as usize);
    if crowd.behaviour == Behaviour::Walk && most == 1 {
        return 1;
    }
    (least + (uniform(random) * (most - least + 1) as f64) as usize).min(most).min(left)
}

/// Whether the next person takes no notice of the robot. A crowd without heedless people draws no number for it.
fn is_heedless(crowd: &Crowd, random: &mut Rng) -> bool {
    crowd.heedless > 0.0 && uniform(random) < crowd.heedless
}

fn between([least, most]: [f64; 2], random: &mut Rng) -> f64 {
    least + (most - least) * uniform(random)
}

#[cfg(test)]
mod tests;
