//! Which people the planner is told about: all, those near, or those the laser could see.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::scene::People;
use curionav_planning::sensor::LaserModel;

use crate::beams::{Rays, disc_range};
use crate::scenario::PerceivedPeople;

/// Parts of a person that are looked at, as offsets across the line of sight in radii.
const LOOKED_AT: [f64; 3] = [0.0, -0.8, 0.8];

/// The people of the truth that the planner is told about, at their true positions (D10).
pub(crate) fn perceived(
    what: PerceivedPeople,
    people: &People,
    robot: Pose2,
    laser: &LaserModel,
    map: &StaticMap,
) -> People {
    match what {
        PerceivedPeople::All => people.clone(),
        PerceivedPeople::WorkingZone => {
            let reach = PerceivedPeople::WORKING_ZONE_M;
            people.pick(
                (0..people.len())
                    .filter(|i| people.position(*i).distance_squared(robot.position()) <= reach * reach),
            )
        }
        PerceivedPeople::Laser => seen(people, robot.compose(laser.robot_from_laser), laser, map),
    }
}

/// Those with a part inside range and field of view on a line free of walls and other people.
fn seen(people: &People, map_from_laser: Pose2, laser: &LaserModel, map: &StaticMap) -> People {
    let view = View {
        rays: Rays::new(map, map_from_laser.position()),
        turn: sin_cos(map_from_laser.heading),
        least_cos: sin_cos((0.5 * laser.fov).min(std::f64::consts::PI)).1,
        range_max: laser.range_max,
        centres: (0..people.len()).map(|i| map_from_laser.inverse_transform(people.position(i))).collect(),
        radius: people.radius,
    };
    people.pick((0..people.len()).filter(|i| LOOKED_AT.iter().any(|offset| view.shows(*i, *offset))))
}

/// What a laser has before it.
struct View<'a> {
    rays: Rays<'a>,
    /// Sine and cosine of its heading on the map.
    turn: (f64, f64),
    /// Cosine of the greatest bearing.
    least_cos: f64,
    range_max: f64,
    /// Of people, laser frame.
    centres: Vec<Point2>,
    /// Of each person, metres.
    radius: f64,
}

impl View<'_> {
    /// Whether the part of person `i` that lies `offset` radii across the line of sight can be seen.
    fn shows(&self, i: usize, offset: f64) -> bool {
        let centre = self.centres[i];
        let to_centre = centre.distance(Point2::default());
        if to_centre <= self.radius {
            return true;
        }
        let across = offset * self.radius / to_centre;
        let part = Point2::new(centre.x - across * centre.y, centre.y + across * centre.x);
        let distance = part.distance(Point2::default());
        let x = part.x / distance;
        let y = part.y / distance;
        let range = disc_range(centre, self.radius, (x, y));
        if x < self.least_cos - 1e-12 || range > self.range_max {
            return false;
        }
        let (sin, cos) = self.turn;
        let is_hidden = self
            .centres
            .iter()
            .enumerate()
            .any(|(j, other)| j != i && disc_range(*other, self.radius, (x, y)) < range);
        self.rays.range((cos * x - sin * y, sin * x + cos * y), range) >= range && !is_hidden
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::occupancy::OccupancyGrid;

    use super::*;

    #[test]
    fn the_laser_sees_neither_past_walls_nor_people_nor_its_limits() {
        // a wall across x = 8 between y = 7 and y = 10
        let cells = (0..40_000).map(|i| if i % 200 == 80 && i / 200 >= 70 { 100 } else { 0 }).collect();
        let map = StaticMap::new(OccupancyGrid::new(200, 200, 0.1, Pose2::default(), cells).unwrap());
        let at = [(7.0, 5.0), (9.0, 5.0), (3.0, 5.0), (9.0, 9.0), (5.0, 8.0), (11.0, 6.5)];
        let people = People {
            id: (0..6).collect(),
            x: at.map(|p| p.0).to_vec(),
            y: at.map(|p| p.1).to_vec(),
            vx: vec![0.0; 6],
            vy: vec![0.0; 6],
            radius: 0.25,
            ..People::default()
        };
        let robot = Pose2::new(5.0, 5.0, 0.0);
        let ids = |what| perceived(what, &people, robot, &LaserModel::default(), &map).id;
        // 1 stands behind 0, 2 behind the robot, 3 behind the wall, 5 is farther than 5 m
        assert_eq!(ids(PerceivedPeople::Laser), [0, 4]);
        assert_eq!(ids(PerceivedPeople::All), [0, 1, 2, 3, 4, 5]);
        let near =
            perceived(PerceivedPeople::WorkingZone, &people, Pose2::default(), &LaserModel::default(), &map);
        assert_eq!(near.id, [0, 2, 4]); // 8.6, 5.8 and 9.4 m from the origin
    }
}
