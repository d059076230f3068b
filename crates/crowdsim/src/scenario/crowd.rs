//! People whom the run's seed draws, within what a scenario says of them.

use curionav_planning::geometry::Point2;
use curionav_planning::parameters::{FieldError, Range};

use super::arrays;

curionav_planning::parameters! {
    /// People who are drawn when a run begins. The same scenario, map and seed give the same people, another seed gives
    /// others. They move as `people.motion` says, like those of `[[walkers]]`.
    pub struct Crowd {
        /// How many they are, for every seed.
        pub count: u32 [1.0, 1000.0, "people", "twenty times the densest published scenario"],
        /// What they do.
        #[serde(default)]
        pub behaviour: Behaviour [words],
        /// Where they are. None means the whole floor that the robot can reach from its start. With several, the people
        /// who walk go from a place in the first to one in the second and so on, and back.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub regions: Vec<Region> [table; 0.0, 16.0, "a way with more turns is one of many `[[walkers]]`"],
        /// How many places those who walk go between, if there are fewer than two regions.
        #[serde(default = "default_places")]
        pub places: u32 [2.0, 16.0, "places", "a way with one place leads nowhere"],
        /// Least and greatest length of a straight stretch between two places, metres.
        #[serde(default = "default_stretch", deserialize_with = "arrays::fixed")]
        pub stretch_m: [f64; 2] [0.1, 1000.0, "m", "a shorter one is no way, a longer one is on no map"],
        /// Least and greatest walking speed, m/s. Default: those of the paper's people (A31).
        #[serde(default = "default_speed", deserialize_with = "arrays::fixed")]
        pub speed: [f64; 2] [0.01, 10.0, "m/s", "no person runs faster, and one who does not walk stands"],
        /// Least and greatest rest at each end of the way, seconds.
        #[serde(default, deserialize_with = "arrays::fixed")]
        pub pause_s: [f64; 2] [0.0, 3600.0, "s", "a longer rest outlasts the run"],
        /// Least and greatest size of a group. Those who stand face each other; those who walk go side by side.
        #[serde(default = "default_group", deserialize_with = "arrays::fixed")]
        pub group: [u32; 2] [1.0, 10.0, "people", "a larger one is several groups"],
        /// Distance that they keep at the beginning from the robot's start and goal, and for as long as they stand,
        /// between centres, metres.
        #[serde(default = "default_apart")]
        pub apart_m: f64 [0.0, 100.0, "m", "farther away they are on no map"],
        /// The chance of each person to take no notice of the robot (`walkers.heedless`).
        #[serde(default, skip_serializing_if = "is_zero")]
        pub heedless: f64 [0.0, 1.0, "", "a chance"],
    } check Self::is_consistent
}

curionav_planning::parameters! {
    /// What drawn people do.
    #[derive(Default)]
    pub enum Behaviour {
        /// They walk to and fro between places, in straight stretches clear of walls, and are anywhere on their way at
        /// the beginning.
        #[default]
        Walk,
        /// They stand in groups, face to face, and leave the robot a way.
        Stand,
    }
}

curionav_planning::parameters! {
    /// A part of the floor.
    pub struct Region {
        /// Corners `[[x, y], ...]` of a simple polygon, either way round.
        #[serde(with = "arrays::points")]
        pub corners: Vec<Point2> [in Range::POSITION; 3.0, 100.0, "fewer enclose nothing"],
    }
}

fn is_zero(share: &f64) -> bool {
    *share == 0.0
}

fn default_places() -> u32 {
    2
}

fn default_stretch() -> [f64; 2] {
    [2.0, 20.0]
}

fn default_speed() -> [f64; 2] {
    [0.3, 1.0]
}

fn default_group() -> [u32; 2] {
    [1, 1]
}

fn default_apart() -> f64 {
    1.5
}

impl Crowd {
    fn is_consistent(&self) -> Result<(), FieldError> {
        let group = self.group.map(f64::from);
        let pairs = [
            ("stretch_m", self.stretch_m),
            ("speed", self.speed),
            ("pause_s", self.pause_s),
            ("group", group),
        ];
        match pairs.into_iter().find(|(_, [least, most])| least > most) {
            Some((field, [least, most])) => {
                let problem = format!("has {least} as the least and {most} as the greatest");
                Err(FieldError::new(field, problem, "give the least first"))
            }
            None => Ok(()),
        }
    }
}

/// Whether a point lies inside a polygon (even-odd rule).
pub fn contains(polygon: &[Point2], p: Point2) -> bool {
    let mut inside = false;
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        if (a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x {
            inside = !inside;
        }
    }
    inside
}
