//! What the robot is told of the walls, and what they are.

use curionav_planning::occupancy::StaticMap;

/// The maps of a world, in the same frame; origin and resolution may differ.
#[derive(Debug, Clone)]
pub struct Maps {
    /// What the robot is given, with its zones.
    pub given: StaticMap,
    /// What is there.
    pub truth: StaticMap,
}

impl Maps {
    /// A map that is true, but for its zones, which only the robot knows.
    pub fn of(given: StaticMap) -> Self {
        Self { truth: given.without_zones(), given }
    }
}
