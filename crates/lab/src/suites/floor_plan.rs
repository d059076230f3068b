//! Floor plans drawn at random: offices, shops, corridors and halls that are void but for their rim.

use curionav_planning::geometry::Point2;
use curionav_planning::random::{Rng, uniform};

use super::files::{between, rectangle};
use crate::paper::{Layout, Polygon, rounded};

/// Thickness of inner walls, metres: two cells.
const WALL_M: f64 = 0.2;
/// Width of a door, metres: a double one, as in hospitals.
const DOOR_M: f64 = 1.6;

/// What a floor is used as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Use {
    Offices,
    Shops,
    Corridors,
    Void,
}

impl Use {
    pub(super) const ALL: [Self; 4] = [Self::Offices, Self::Shops, Self::Corridors, Self::Void];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Offices => "offices",
            Self::Shops => "shops",
            Self::Corridors => "corridors",
            Self::Void => "void",
        }
    }

    /// A floor plan in the rectangle from (0, 0) to its size, walled in.
    pub(super) fn draw(self, random: &mut Rng) -> FloorPlan {
        let (width, depth) = match self {
            Self::Offices => (length_between(26.0, 34.0, random), 13.4),
            Self::Shops => (length_between(22.0, 28.0, random), length_between(18.0, 24.0, random)),
            Self::Corridors => (length_between(24.0, 32.0, random), length_between(20.0, 26.0, random)),
            Self::Void => (length_between(30.0, 40.0, random), length_between(24.0, 32.0, random)),
        };
        let mut plan = FloorPlan { width, depth, walls: Vec::new(), loose: Vec::new() };
        match self {
            Self::Offices => plan.offices(random),
            Self::Shops => plan.loose = shops(width, depth, random),
            Self::Corridors => plan.walls = corridors(width, depth, random),
            Self::Void => {}
        }
        plan
    }
}

/// A floor, metres.
#[derive(Debug, Clone)]
pub(super) struct FloorPlan {
    pub(super) width: f64,
    pub(super) depth: f64,
    /// Inner walls and blocks.
    pub(super) walls: Vec<Polygon>,
    /// What may be moved: tables and shelves.
    pub(super) loose: Vec<Polygon>,
}

impl FloorPlan {
    pub(super) fn layout(&self) -> Layout {
        let margin = 1.0;
        Layout {
            outline: rectangle(0.0, 0.0, self.width, self.depth),
            masonry: vec![rectangle(-margin, -margin, self.width + margin, self.depth + margin)],
            furniture: [self.walls.clone(), self.loose.clone()].concat(),
        }
    }

    /// Two rows of rooms along a corridor 2.6 m wide; every room has a door to it and perhaps a table.
    fn offices(&mut self, random: &mut Rng) {
        let Self { width, depth, walls, loose } = self;
        let width = *width;
        let depth = *depth;
        let corridor = (0.5 * depth - 1.3, 0.5 * depth + 1.3);
        for (from, to) in [(0.0, corridor.0), (corridor.1, depth)] {
            let wall = if from == 0.0 { corridor.0 } else { corridor.1 - WALL_M };
            let mut west = 0.0;
            while west < width {
                let wanted = west + length_between(4.0, 7.0, random);
                let east = if width - wanted < 3.5 { width } else { wanted };
                let door = length_between(west + 0.6, east - DOOR_M - 0.6, random);
                walls.push(rectangle(west, wall, door, wall + WALL_M));
                walls.push(rectangle(door + DOOR_M, wall, east, wall + WALL_M));
                if east < width {
                    walls.push(rectangle(east - 0.5 * WALL_M, from, east + 0.5 * WALL_M, to));
                }
                if uniform(random) < 0.6 {
                    let table =
                        Point2::new(length_between(west + 1.4, east - 1.4, random), 0.5 * (from + to));
                    loose.push(rectangle(table.x - 0.4, table.y - 0.7, table.x + 0.4, table.y + 0.7));
                }
                west = east;
            }
        }
    }
}

/// Rows of shelves, each with gaps, and a few baskets of goods.
fn shops(width: f64, depth: f64, random: &mut Rng) -> Vec<Polygon> {
    let mut things = Vec::new();
    let mut row = 2.6;
    while row < depth - 3.2 {
        let mut west = length_between(1.8, 4.0, random);
        while west < width - 4.0 {
            let east = (west + length_between(2.5, 6.0, random)).min(width - 1.8);
            things.push(rectangle(west, row, east, row + 0.8));
            west = east + length_between(1.6, 2.6, random);
        }
        row += 0.8 + length_between(2.0, 3.2, random);
    }
    things
}

/// Blocks between corridors 2.2 to 3.2 m wide, some of them joined.
fn corridors(width: f64, depth: f64, random: &mut Rng) -> Vec<Polygon> {
    let cuts = |length: f64, random: &mut Rng| {
        let mut blocks = Vec::new();
        let mut at = length_between(2.2, 3.2, random);
        while at < length - 5.0 {
            let end = (at + length_between(3.0, 6.0, random)).min(length - 2.4);
            blocks.push((at, end));
            at = end + length_between(2.2, 3.2, random);
        }
        blocks
    };
    let columns = cuts(width, random);
    let rows = cuts(depth, random);
    let mut things = Vec::new();
    for &(south, north) in &rows {
        for (k, &(west, east)) in columns.iter().enumerate() {
            let joined = uniform(random) < 0.25;
            let end = columns.get(k + 1).filter(|_| joined).map_or(east, |next| next.0);
            things.push(rectangle(west, south, end, north));
        }
    }
    things
}

/// A whole number of millimetres between two lengths, metres.
fn length_between(least: f64, most: f64, random: &mut Rng) -> f64 {
    rounded(between(least, most, random))
}
