//! What can be said about a scenario once its map is known.

use std::fmt;

use curionav_planning::collision::CollisionChecker;
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::{Cell, GeodesicField, StaticMap};
use curionav_planning::parameters::FieldError;

use super::{Scenario, WalkMode, Walker};
use crate::maps::Maps;

impl Scenario {
    /// Whether the scenario fits its maps, and the `floor` as it is at the start, which is the truth and what stands
    /// there. On the given map, start and goal are clear of walls and keepout zones, and connected by a way as wide as
    /// the robot. On the floor the start is clear, and walkers' routes touch nothing. The first fault names its field
    /// and the mend.
    pub fn check_on(&self, maps: &Maps, floor: &StaticMap) -> Result<(), FieldError> {
        let map = &maps.given;
        let radius = self.robot.model.radius();
        robot_fits(map, "robot.start", self.robot.start.position(), radius)?;
        robot_fits(map, "robot.goal", self.robot.goal, radius)?;
        let start = self.robot.start.position();
        if !connected(map, start, self.robot.goal, |cell| has_room(map, cell, radius)) {
            let problem = format!("cannot be reached from the start by a robot of radius {radius} m");
            let mend = "move the goal or the start, or widen the passage between them";
            return Err(FieldError::new("robot.goal", problem, mend));
        }
        self.is_really_there(&maps.truth, floor, radius)
    }

    /// What takes place on the floor.
    fn is_really_there(&self, truth: &StaticMap, floor: &StaticMap, radius: f64) -> Result<(), FieldError> {
        let really = |fault: FieldError| match &self.world.file {
            Some(file) => {
                FieldError { problem: format!("{} in `world.file`, {file}", fault.problem), ..fault }
            }
            None => fault,
        };
        robot_fits(floor, "robot.start", self.robot.start.position(), radius).map_err(really)?;
        for (i, event) in self.world.events.iter().enumerate() {
            if let Some(place) = event.place() {
                let field = format!("world.events[{i}].carried_to");
                robot_fits(floor, &field, place.position(), radius).map_err(really)?;
            }
        }
        for (i, object) in self.world.objects.iter().enumerate() {
            let fits = object.walker().map_or(Ok(()), |walker| walker_fits(truth, "", &walker, 0.0));
            fits.map_err(|e| really(FieldError { field: format!("world.objects[{i}].route"), ..e }))?;
        }
        for (i, walker) in self.walkers.iter().enumerate() {
            walker_fits(floor, &format!("walkers[{i}]"), walker, self.people.radius).map_err(really)?;
        }
        Ok(())
    }
}

/// Halvings of the difference between what fits and what does not: to a thousandth of it.
const BISECTIONS: u32 = 10;

/// The narrowest place of a way that a planner does not pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NarrowPlace {
    /// Map frame.
    pub at: Point2,
    /// Room between walls there, metres.
    pub width: f64,
    /// Room that every planner asks for, metres: the robot, and [`CollisionChecker::GUARD`] on both sides.
    pub needed: f64,
}

impl fmt::Display for NarrowPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { at: Point2 { x, y }, width, needed } = self;
        write!(
            f,
            "the way is too narrow for this robot: about {width:.2} m at ({x:.2}, {y:.2}), and planners need \
             {needed:.2} m; widen the way, or make the robot smaller"
        )
    }
}

impl Scenario {
    /// Where the way to the goal is too narrow for planners, although the robot fits through; nothing if there is a
    /// way.
    pub fn too_narrow(&self, map: &StaticMap) -> Option<NarrowPlace> {
        let start = self.robot.start.position();
        let radius = self.robot.model.radius();
        let half = radius + CollisionChecker::GUARD;
        let passes = |radius: f64| connected(map, start, self.robot.goal, |cell| has_room(map, cell, radius));
        if passes(half) {
            return None;
        }
        let way =
            GeodesicField::new(map, self.robot.goal, radius).descend(start, 0.5 * map.grid.resolution());
        let room = |p: &Point2| map.to_obstacle.exact_clearance(&map.grid, *p);
        let at = way.into_iter().min_by(|a, b| room(a).total_cmp(&room(b))).unwrap_or(self.robot.goal);
        Some(NarrowPlace { at, width: 2.0 * widest(radius, half, passes), needed: 2.0 * half })
    }
}

/// The greatest radius that passes, if `least` does and `most` does not.
fn widest(mut least: f64, mut most: f64, passes: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..BISECTIONS {
        let between = 0.5 * (least + most);
        if passes(between) { least = between } else { most = between }
    }
    least
}

fn robot_fits(map: &StaticMap, field: &str, p: Point2, radius: f64) -> Result<(), FieldError> {
    if map.grid.locate(p).is_none() {
        let problem = format!("({}, {}) lies outside the map", p.x, p.y);
        return Err(FieldError::new(field, problem, "give a point inside the map"));
    }
    let clearance = map.to_obstacle.exact_clearance(&map.grid, p);
    if clearance < radius {
        let zone = if map.grid.limits().is_empty() { "" } else { ", a keepout zone" };
        let problem =
            format!("({}, {}) is {clearance:.2} m from a wall, a thing{zone} or unknown space", p.x, p.y);
        return Err(FieldError::new(field, problem, format!("keep the robot's radius, {radius} m, clear")));
    }
    Ok(())
}

/// For each cell, whether a way over cells that are `open` leads there from `from`: a flood fill over the four
/// neighbours of a cell.
pub(crate) fn reachable(map: &StaticMap, from: Point2, open: impl Fn(usize) -> bool) -> Vec<bool> {
    let grid = &map.grid;
    let mut seen = vec![false; grid.cells().len()];
    let mut ahead: Vec<usize> =
        grid.locate(from).map(|(column, row)| grid.index(column, row)).into_iter().collect();
    ahead.iter().for_each(|&index| seen[index] = true);
    while let Some(index) = ahead.pop() {
        for next in grid.neighbours(index) {
            if !seen[next] && open(next) {
                seen[next] = true;
                ahead.push(next);
            }
        }
    }
    seen
}

/// Whether a body of this radius fits somewhere in a cell: at its centre, or in the middle of one of its sides, where
/// the middle of a gap of an even number of cells is.
fn has_room(map: &StaticMap, cell: usize, radius: f64) -> bool {
    let grid = &map.grid;
    let centre = grid.centre(cell % grid.width(), cell / grid.width());
    let half = 0.5 * grid.resolution();
    let places = [(0.0, 0.0), (half, 0.0), (-half, 0.0), (0.0, half), (0.0, -half)];
    let fits = |p: Point2| map.to_obstacle.clearance(grid, p, radius) >= radius;
    places.iter().any(|(dx, dy)| fits(Point2::new(centre.x + dx, centre.y + dy)))
}

/// Whether a way over cells that are `open` leads from `from` to `to`.
pub(crate) fn connected(map: &StaticMap, from: Point2, to: Point2, open: impl Fn(usize) -> bool) -> bool {
    let target = map.grid.locate(to).map(|(column, row)| map.grid.index(column, row));
    target.is_some_and(|target| reachable(map, from, open)[target])
}

fn walker_fits(map: &StaticMap, field: &str, walker: &Walker, radius: f64) -> Result<(), FieldError> {
    let closing = (walker.mode == WalkMode::Loop).then(|| walker.route[0]);
    let corners: Vec<Point2> = walker.route.iter().copied().chain(closing).collect();
    let spacing = 0.5 * map.grid.resolution();
    for (i, corner) in corners.iter().enumerate() {
        let next = corners.get(i + 1).unwrap_or(corner);
        let steps = (corner.distance(*next) / spacing).ceil().max(1.0);
        for k in 0..=(steps as usize) {
            let p = corner.toward(*next, k as f64 / steps);
            if map.grid.at(p) != Cell::Free || map.to_obstacle.at(&map.grid, p) < radius {
                let field = format!("{field}.route[{}]", i.min(walker.route.len() - 1));
                let place = format!("({:.2}, {:.2})", p.x, p.y);
                let problem =
                    format!("the way from here touches a wall, a thing or unknown space at {place}");
                let mend = format!("keep the people's radius, {radius} m, clear");
                return Err(FieldError::new(field, problem, mend));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Pose2;
    use curionav_planning::occupancy::OccupancyGrid;

    use super::*;
    use crate::scenario::WorldSetup;

    /// 10 m x 10 m at 0.1 m; a wall at x = 5 with a gap of `gap` cells from row 40 on.
    fn two_rooms(gap: usize) -> StaticMap {
        let cells = (0..10_000)
            .map(|i| if i % 100 == 50 && !(40..40 + gap).contains(&(i / 100)) { 100 } else { 0 })
            .collect();
        StaticMap::new(OccupancyGrid::new(100, 100, 0.1, Pose2::default(), cells).unwrap())
    }

    fn scenario(goal: &str, walker: &str) -> Scenario {
        Scenario::from_toml(&format!(
            "name = \"t\"\nmap = {{ file = \"m\" }}\n[robot]\nstart = [2, 5, 0]\ngoal = {goal}\n\
             [[walkers]]\nroute = {walker}\n"
        ))
        .unwrap()
    }

    #[test]
    fn a_fitting_scenario_passes() {
        let rooms = two_rooms(20);
        scenario("[8, 5]", "[[1, 1], [4, 1]]").check_on(&Maps::of(rooms.clone()), &rooms).unwrap();
    }

    #[test]
    fn a_way_that_is_too_narrow_for_the_planner_is_told() {
        let scenario = scenario("[8, 5]", "[[1, 1], [4, 1]]");
        assert_eq!(scenario.too_narrow(&two_rooms(7)), None);
        // In a gap of six cells, which are 0.6 m, there is no room beside the robot.
        let tight = scenario.too_narrow(&two_rooms(6)).unwrap();
        assert!((tight.width - 0.6).abs() < 1e-2 && (tight.needed - 0.66).abs() < 1e-9, "{tight:?}");
        assert!((tight.at.x - 5.05).abs() < 0.2 && (tight.at.y - 4.3).abs() < 0.1, "{tight:?}");
    }

    #[test]
    fn what_is_in_a_keepout_zone_or_in_a_wall_of_the_truth_is_refused() {
        let rooms = two_rooms(20);
        let scenario = Scenario { world: truth(), ..scenario("[8, 5]", "[[1, 1], [4, 1]]") };
        let fault = |maps: &Maps| {
            let error = scenario.check_on(maps, &maps.truth).unwrap_err();
            (error.field.clone(), error.to_string())
        };
        let zoned = |is_kept: fn(f64, f64) -> bool| {
            let limit =
                |i: usize| if is_kept((i % 100) as f64 / 10.0, (i / 100) as f64 / 10.0) { 0 } else { 100 };
            let grid = rooms.grid.with_limits((0..10_000).map(limit).collect()).unwrap();
            Maps::of(StaticMap::new(grid))
        };
        let (field, said) = fault(&zoned(|x, y| (x - 8.0).abs() < 0.2 && (y - 5.0).abs() < 0.2));
        assert!(field == "robot.goal" && said.contains("a keepout zone"), "{said}");
        // Across the gap.
        let (field, said) = fault(&zoned(|x, _| (x - 3.5).abs() < 0.2));
        assert!(field == "robot.goal" && said.contains("cannot be reached"), "{said}");
        // People may walk there.
        let beside = zoned(|x, y| (x - 3.5).abs() < 0.2 && y < 2.0);
        scenario.check_on(&beside, &beside.truth).unwrap();
        // Shelves of the truth where the robot starts, and where a person walks.
        for (at, expected) in [(2.0, "robot.start"), (3.5, "walkers[0].route[0]")] {
            let wall = |i: usize, value| if ((i % 100) as f64 / 10.0 - at).abs() < 0.2 { 100 } else { value };
            let truth = StaticMap::new(rooms.grid.changed(wall));
            let (field, said) = fault(&Maps { given: rooms.clone(), truth });
            assert!(field == expected && said.contains("in `world.file`, truth.yaml"), "{said}");
        }
    }

    fn truth() -> WorldSetup {
        WorldSetup { file: Some("truth.yaml".to_owned()), ..WorldSetup::default() }
    }

    #[test]
    fn each_misfit_names_its_field() {
        let fits = "[[1, 1], [4, 1]]";
        for (goal, walker, gap, field) in [
            ("[18, 5]", fits, 20, "robot.goal"),
            ("[5.3, 8]", fits, 20, "robot.goal"),
            // the gap is 0.5 m, the robot 0.6 m
            ("[8, 5]", fits, 5, "robot.goal"),
            ("[8, 5]", "[[1, 1], [8, 1]]", 20, "walkers[0].route[0]"),
            ("[8, 5]", "[[1, 1], [1, 4], [8, 1]]", 20, "walkers[0].route[1]"),
        ] {
            let rooms = two_rooms(gap);
            let error = scenario(goal, walker).check_on(&Maps::of(rooms.clone()), &rooms).unwrap_err();
            assert_eq!(error.field, field, "{error}");
        }
    }
}
