//! Floors that are not as their maps have them.
//!
//! On each floor furniture has been moved, boxes and chairs have been put down, and perhaps a passage is closed, a wall
//! is gone or a trolley is pushed to and fro. The robot can still get to its goal, but for `closed`.

use std::f64::consts::PI;

use anyhow::{Context, ensure};
use curionav_crowdsim::scenario::{Behaviour, Crowd, Region, WorldObject, WorldSetup};
use curionav_crowdsim::{Scenario, World};
use curionav_planning::geometry::{Point2, Pose2, bearing};
use curionav_planning::occupancy::{Cell, GeodesicField, StaticMap};
use curionav_planning::random::{Rng, rng, uniform};

use super::files::{File, between, map_files, region, scenario_file};
use super::floor_plan::{FloorPlan, Use};
use super::rooms::drawn_task;
use crate::paper::{Polygon, bounds, rounded};

/// Floors of each use.
const FLOORS: u64 = 7;
/// Floors whose only way is closed.
const CLOSED: u64 = 4;
/// Side of a cell, metres.
const CELL_M: f64 = 0.1;
/// Random streams of the floors, others than those of `rooms` and `training`.
const STREAM: u64 = 0x4348_414e;
const CLOSED_STREAM: u64 = 0x434c_4f53;
/// Room between the robot's centre and anything on a way that counts as one, metres.
const ROOM: f64 = 0.45;
/// Things keep this distance from start and goal, metres.
const CLEAR: f64 = 1.2;
/// Seeds for which the people are looked at.
const SEEDS: [u64; 10] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10];
/// Draws before a floor counts as too small.
const DRAWS: u64 = 200;
/// When a closed way is opened again, seconds.
const OPENED_S: f64 = 20.0;

pub(super) fn files() -> anyhow::Result<Vec<File>> {
    let mut files = Vec::new();
    for (kind, purpose) in Use::ALL.into_iter().enumerate() {
        for k in 0..FLOORS {
            let mut random = rng(STREAM + kind as u64, k);
            let name = format!("{}-{}", purpose.name(), k + 1);
            files.extend(changed_floor(&name, purpose, k, &mut random)?);
        }
    }
    files.extend(closed_floors()?);
    Ok(files)
}

/// A floor, its changed self with and without people, and the same with a map that has the changes.
fn changed_floor(name: &str, purpose: Use, k: u64, random: &mut Rng) -> anyhow::Result<Vec<File>> {
    let floor = Floor::draw(name, purpose, k, random)?;
    let (world, truth) = floor.changed(random).with_context(|| name.to_owned())?;
    let mut scenario = floor.scenario.clone();
    scenario.description += " Since the map was made things have been moved and put down.";
    let pushed = WorldSetup {
        objects: world.objects.iter().filter(|object| !object.route.is_empty()).cloned().collect(),
        ..WorldSetup::default()
    };
    let mut files = Vec::new();
    for (folder, map, world) in [("changed", &floor.map, world), ("changed-mapped", &truth, pushed)] {
        files.extend(map_files(folder, name, &map.grid)?);
        scenario.world = world;
        files.push(scenario_file(folder, &scenario)?);
        let empty = Scenario { name: format!("{name}-empty"), crowds: Vec::new(), ..scenario.clone() };
        files.push(scenario_file(folder, &empty)?);
    }
    Ok(files)
}

/// Floors on which the only way is closed for good, and the same opened again.
fn closed_floors() -> anyhow::Result<Vec<File>> {
    let mut files = Vec::new();
    let mut found = 0;
    for k in 0..DRAWS {
        if found == CLOSED {
            return Ok(files);
        }
        let floor =
            Floor::draw(&format!("closed-{}", found + 1), Use::Offices, 0, &mut rng(CLOSED_STREAM, k))?;
        let Some(door) = floor.closing() else { continue };
        if floor
            .is_passable(&floor.truth(&WorldSetup { objects: vec![door.clone()], ..WorldSetup::default() })?)
        {
            continue;
        }
        // Who stands has to leave the robot a way, which a closed floor does not have.
        let mut scenario = floor.scenario.clone();
        scenario.crowds.retain(|crowd| crowd.behaviour == Behaviour::Walk);
        scenario.world.objects = vec![door.clone()];
        let floor = Floor { scenario, ..floor };
        if !floor.has_room_for_people(&floor.scenario.world) {
            continue;
        }
        found += 1;
        let until = [("closed", None), ("reopened", Some(OPENED_S))];
        for (folder, until_s) in until {
            let name = format!("{folder}-{found}");
            files.extend(map_files(folder, &name, &floor.map.grid)?);
            let mut scenario = floor.scenario.clone();
            scenario.map.file = format!("maps/{name}.yaml");
            scenario.name = name;
            scenario.description = match until_s {
                None => "The only way to the goal is closed.".to_owned(),
                Some(s) => format!("The only way to the goal is closed for {s} s."),
            };
            scenario.world.objects = vec![WorldObject { until_s, ..door.clone() }];
            files.push(scenario_file(folder, &scenario)?);
            let empty = Scenario { name: format!("{}-empty", scenario.name), crowds: Vec::new(), ..scenario };
            files.push(scenario_file(folder, &empty)?);
        }
    }
    anyhow::bail!("only {found} of {CLOSED} floors have a single way")
}

/// A floor as it is mapped, and the task on it.
struct Floor {
    plan: FloorPlan,
    map: StaticMap,
    scenario: Scenario,
    /// Points of the shortest way.
    way: Vec<Point2>,
}

impl Floor {
    fn draw(name: &str, purpose: Use, k: u64, random: &mut Rng) -> anyhow::Result<Self> {
        let plan = purpose.draw(random);
        let map = StaticMap::new(plan.layout().grid(CELL_M, None)?);
        let lengths = if purpose == Use::Void { [14.0, 30.0] } else { [10.0, 25.0] };
        let mut scenario = drawn_task(name, &format!("maps/{name}.yaml"), &map, lengths, k, random)?;
        let field = GeodesicField::new(&map, scenario.robot.goal, ROOM);
        let way = field.descend(scenario.robot.start.position(), 0.1);
        ensure!(!way.is_empty(), "{name} has no way");
        // Floors are narrower than their maps have them.
        scenario.crowds.iter_mut().filter(|crowd| crowd.behaviour == Behaviour::Stand).for_each(halve);
        Ok(Self { plan, map, scenario, way })
    }

    /// What has changed, and the floor as it is then.
    fn changed(&self, random: &mut Rng) -> anyhow::Result<(WorldSetup, StaticMap)> {
        for _ in 0..DRAWS {
            let mut world = WorldSetup::default();
            self.move_furniture(&mut world, random);
            self.put_down_things(&mut world, random);
            if uniform(random) < 0.5 {
                world.objects.extend(self.closing());
            }
            if uniform(random) < 0.7 {
                world.openings.extend(self.opening(random));
            }
            world.objects.retain(|object| self.is_clear_of_task(object));
            let truth = self.truth(&world)?;
            if !self.is_passable(&truth) {
                continue;
            }
            if uniform(random) < 0.6 {
                world.objects.extend(self.trolley(&truth, random));
            }
            if self.has_room_for_people(&world) {
                return Ok((world, truth));
            }
        }
        anyhow::bail!("no change leaves a way")
    }

    /// Whether the people of the seeds that are usual leave the robot a way.
    fn has_room_for_people(&self, world: &WorldSetup) -> bool {
        let scenario = Scenario { world: world.clone(), ..self.scenario.clone() };
        SEEDS.into_iter().all(|seed| World::new(&scenario, self.map.clone(), Vec::new(), seed).is_ok())
    }

    /// Half of what is loose stands elsewhere, turned.
    fn move_furniture(&self, world: &mut WorldSetup, random: &mut Rng) {
        for thing in &self.plan.loose {
            if uniform(random) < 0.5 {
                continue;
            }
            let (low, high) = bounds(thing);
            let place = middle(thing);
            let x = rounded(place.x + between(-1.5, 1.5, random));
            let y = rounded(place.y + between(-1.5, 1.5, random));
            let heading = rounded(between(-0.5, 0.5, random));
            world.openings.push(grown(thing));
            let size = [rounded(high.x - low.x), rounded(high.y - low.y)];
            world
                .objects
                .push(WorldObject { size: Some(size.to_vec()), ..thing_at(Pose2::new(x, y, heading)) });
        }
    }

    /// Three to ten boxes and chairs, most of them near the way.
    fn put_down_things(&self, world: &mut WorldSetup, random: &mut Rng) {
        let count = 3 + (8.0 * uniform(random)) as usize;
        for _ in 0..count {
            let near = uniform(random) < 0.7;
            let p = if near { self.beside_the_way(random) } else { self.anywhere(random) };
            let at = Pose2::new(rounded(p.x), rounded(p.y), rounded(between(-PI, PI, random)));
            let is_chair = uniform(random) < 0.6;
            let width = rounded(between(0.3, 0.6, random));
            let length = rounded(between(0.4, 1.0, random));
            let radius = rounded(between(0.18, 0.25, random));
            world.objects.push(if is_chair {
                WorldObject { radius: Some(radius), ..thing_at(at) }
            } else {
                WorldObject { size: Some(vec![length, width]), ..thing_at(at) }
            });
        }
    }

    fn beside_the_way(&self, random: &mut Rng) -> Point2 {
        let p = self.way[(uniform(random) * self.way.len() as f64) as usize % self.way.len()];
        Point2::new(p.x + between(-1.2, 1.2, random), p.y + between(-1.2, 1.2, random))
    }

    fn anywhere(&self, random: &mut Rng) -> Point2 {
        Point2::new(between(0.5, self.plan.width - 0.5, random), between(0.5, self.plan.depth - 0.5, random))
    }

    /// A barrier across the narrowest place in the middle of the way.
    fn closing(&self) -> Option<WorldObject> {
        let count = self.way.len();
        let room = |i: usize| self.map.to_obstacle.at(&self.map.grid, self.way[i]);
        let narrowest = (count / 5..4 * count / 5).min_by(|a, b| room(*a).total_cmp(&room(*b)))?;
        if room(narrowest) > 2.0 {
            return None;
        }
        let before = self.way[narrowest.saturating_sub(3)];
        let after = self.way[(narrowest + 3).min(count - 1)];
        let along = bearing(before, after);
        let at = Pose2::new(rounded(self.way[narrowest].x), rounded(self.way[narrowest].y), rounded(along));
        let length = rounded((4.0 * room(narrowest)).min(4.0));
        Some(WorldObject { size: Some(vec![0.3, length]), ..thing_at(at) })
    }

    /// An inner wall that is gone.
    fn opening(&self, random: &mut Rng) -> Option<Region> {
        let walls = &self.plan.walls;
        let wall = walls.get((uniform(random) * walls.len() as f64) as usize)?;
        Some(grown(wall))
    }

    /// A trolley that is pushed along a straight stretch of free floor.
    fn trolley(&self, truth: &StaticMap, random: &mut Rng) -> Option<WorldObject> {
        for _ in 0..DRAWS {
            let from = self.anywhere(random);
            let length = between(4.0, 8.0, random);
            let to = if uniform(random) < 0.5 {
                Point2::new(from.x + length, from.y)
            } else {
                Point2::new(from.x, from.y + length)
            };
            let is_free = (0..=80).all(|i| {
                let p = from.toward(to, f64::from(i) / 80.0);
                truth.grid.at(p) == Cell::Free && truth.to_obstacle.at(&truth.grid, p) > 0.8
            });
            let object = WorldObject {
                size: Some(vec![0.9, 0.5]),
                route: vec![Point2::new(rounded(to.x), rounded(to.y))],
                ..thing_at(Pose2::new(rounded(from.x), rounded(from.y), 0.0))
            };
            if is_free && self.is_clear_of_task(&object) {
                return Some(object);
            }
        }
        None
    }

    /// Whether a thing is away from start and goal, also where it is pushed to.
    fn is_clear_of_task(&self, object: &WorldObject) -> bool {
        let robot = &self.scenario.robot;
        let corners = object.corners_on_map().into_iter().chain(object.route.iter().copied());
        let places = corners.chain([object.at.position()]);
        places
            .into_iter()
            .all(|p| p.distance(robot.start.position()) > CLEAR && p.distance(robot.goal) > CLEAR)
    }

    /// The floor as it is, without what is pushed.
    fn truth(&self, world: &WorldSetup) -> anyhow::Result<StaticMap> {
        let mut layout = self.plan.layout();
        layout.furniture.retain(|polygon| !is_gone(polygon, &world.openings));
        let things = world.objects.iter().filter(|object| object.route.is_empty());
        layout.furniture.extend(things.map(WorldObject::corners_on_map));
        Ok(StaticMap::new(layout.grid(CELL_M, None)?))
    }

    fn is_passable(&self, truth: &StaticMap) -> bool {
        let robot = &self.scenario.robot;
        let field = GeodesicField::new(truth, robot.goal, ROOM);
        field.at(robot.start.position()).is_finite()
    }
}

fn halve(crowd: &mut Crowd) {
    crowd.count = crowd.count.div_ceil(2);
}

/// A thing at a place that needs an outline yet.
fn thing_at(at: Pose2) -> WorldObject {
    WorldObject {
        at,
        radius: None,
        size: None,
        corners: Vec::new(),
        from_s: 0.0,
        until_s: None,
        route: Vec::new(),
        speed: 0.5,
        low: false,
        glass: 0.0,
    }
}

fn middle(polygon: &Polygon) -> Point2 {
    let (low, high) = bounds(polygon);
    Point2::new(0.5 * (low.x + high.x), 0.5 * (low.y + high.y))
}

/// Whether one of the openings is where this polygon was.
fn is_gone(polygon: &Polygon, openings: &[Region]) -> bool {
    openings.iter().any(|region| middle(polygon).distance(middle(&region.corners)) < 0.01)
}

/// The rectangle around a polygon, with all cells that it has touched.
fn grown(polygon: &Polygon) -> Region {
    let (low, high) = bounds(polygon);
    region(rounded(low.x - 0.05), rounded(low.y - 0.05), rounded(high.x + 0.05), rounded(high.y + 0.05))
}
