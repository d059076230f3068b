//! What of a scenario is real and on no map: things, walls that are gone, and what happens to robot and laser.

use std::f64::consts::TAU;

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::motion::Footprint;
use curionav_planning::numerics::sin_cos;
use curionav_planning::parameters::{FieldError, Range, Ranged};

use super::arrays;
use super::crowd::Region;
use super::people::{WalkMode, Walker};

/// Corners that stand for a disc in pictures.
const DISC_CORNERS: u32 = 24;

/// Times within a run.
const TIMES: Range = Range { least: 0.0, most: 864_000.0, unit: "s", why: "no run lasts longer" };

curionav_planning::parameters! {
    /// What really is, where the map says otherwise. Laser, bodies and people meet it. Neither localiser nor planner is
    /// told. People know what is there at the start, and walk around what comes later if they avoid each other.
    pub struct WorldSetup {
        /// What is really there: a `map_server` YAML file, named as that of the map, of any origin and resolution in
        /// the frame of the map. Laser, collisions, people and pictures take their walls from it, and `openings` are
        /// in it. Outside it nothing can be driven. By default the map is true.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub file: Option<String> = None,
        /// Parts of the floor where the walls of the map are gone.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        pub openings: Vec<Region> [table; 0.0, 64.0, "with more, draw another map"] = Vec::new(),
        /// Things that are on no map.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        pub objects: Vec<WorldObject> [table; 0.0, 256.0, "with more, draw them on the map"] = Vec::new(),
        /// What happens to the robot and its laser, in the order of their times.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        pub events: Vec<WorldEvent> [table; 0.0, 64.0, "a run has no more to tell"] = Vec::new(),
    } check Self::is_in_order
}

curionav_planning::parameters! {
    /// A thing: a disc, a box or another convex polygon. It is solid for the robot and for people.
    pub struct WorldObject {
        /// Where it stands, `[x, y, heading]`. With a `route`, where the route begins.
        #[serde(with = "arrays::pose")]
        pub at: Pose2 [in Range::POSITION, Range::POSITION, Range::HEADING],
        /// Radius of a disc, metres.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub radius: Option<f64> [0.01, 5.0, "m", "a thinner one no laser meets, and a wider one is a building"],
        /// Length and width of a box, metres: along its heading and across.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub size: Option<Vec<f64>> [
            0.01, 10.0, "m", "a thinner one no laser meets, and a longer one is a wall";
            2.0, 2.0, "it is length and width"
        ],
        /// Corners of a convex polygon, counter-clockwise, in its own frame.
        #[serde(default, skip_serializing_if = "Vec::is_empty", with = "arrays::points")]
        pub corners: Vec<Point2>
            [-10.0, 10.0, "m", "a larger thing is a building"; 0.0, 64.0, "more corners are a disc"],
        /// When it comes, seconds after the start. It comes later if the robot is in its place.
        #[serde(default, skip_serializing_if = "is_zero")]
        pub from_s: f64 [in TIMES],
        /// When it goes, seconds after the start. By default it stays.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub until_s: Option<f64> [in TIMES],
        /// Places that it is pushed to from `at`, and back: a trolley. It waits while the robot is in its way, and
        /// turns into the direction in which it moves.
        #[serde(default, skip_serializing_if = "Vec::is_empty", with = "arrays::points")]
        pub route: Vec<Point2> [in Range::POSITION; 0.0, 100.0, "a longer way is one of a person"],
        /// How fast it is pushed, m/s.
        #[serde(default = "default_speed")]
        pub speed: f64 [0.01, 3.0, "m/s", "faster things do not belong among people"],
        /// Whether it stands below the laser's plane: the laser does not see it, and the robot still runs into it.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        pub low: bool,
        /// Share of the beams that pass through it, as through glass.
        #[serde(default, skip_serializing_if = "is_zero")]
        pub glass: f64 [0.0, 1.0, "", "a share of all beams"],
    } check Self::is_a_thing
}

curionav_planning::parameters! {
    /// What happens at a time.
    pub struct WorldEvent {
        /// Seconds after the start.
        pub at_s: f64 [in TIMES],
        /// The robot is carried to `[x, y, heading]`, and its odometry does not notice.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub carried_to: Option<Vec<f64>>
            [in Range::POSITION, Range::POSITION, Range::HEADING; 3.0, 3.0, "it is x, y and heading"],
        /// The laser fails like this from then on, until another event says otherwise.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub laser: Option<LaserFaults> [table],
    } check Self::is_something
}

curionav_planning::parameters! {
    /// How the simulated laser fails. Neither localiser nor planner is told.
    #[derive(Copy)]
    pub struct LaserFaults {
        /// Share of the beams that say nothing, drawn anew for every beam of every scan.
        pub silent_share: f64 [0.0, 1.0, "", "a share of all beams"] = 0.0,
        /// Standard deviation of what is added to the usual noise of every range, metres.
        pub noise_m: f64 [0.0, 5.0, "m", "noisier ranges say nothing"] = 0.0,
        /// Where it really is, seen from where it is said to be: `[x, y, heading]`, metres and radians.
        #[serde(deserialize_with = "arrays::fixed")]
        pub moved: [f64; 3] [-3.2, 3.2, "m or rad", "a mounting errs by no more"] = [0.0; 3],
        /// Scans say what was seen so long ago, and are stamped as if it were now, seconds.
        pub late_s: f64 [0.0, 1.0, "s", "later scans are lost ones"] = 0.0,
    }
}

impl LaserFaults {
    /// Whether the laser is well.
    pub(super) fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

fn default_speed() -> f64 {
    0.5
}

fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

impl WorldSetup {
    /// Whether the map is true and nothing happens.
    pub(super) fn is_as_mapped(&self) -> bool {
        *self == Self::default()
    }

    fn is_in_order(&self) -> Result<(), FieldError> {
        let late = self.events.windows(2).position(|pair| pair[1].at_s < pair[0].at_s);
        match late {
            Some(i) => Err(FieldError::new(
                format!("events[{}].at_s", i + 1),
                format!("is before that of the event above it, {} s", self.events[i].at_s),
                "list events in the order of their times",
            )),
            None => Ok(()),
        }
    }
}

impl WorldObject {
    /// Its outline in its own frame.
    pub fn outline(&self) -> Footprint {
        match (self.radius, self.size.as_deref()) {
            (Some(radius), _) => Footprint::Disc { radius },
            (None, Some(&[length, width])) => {
                let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
                let vertices = corners.map(|(ahead, left)| Point2::new(ahead * length, left * width));
                Footprint::Polygon { vertices: vertices.to_vec() }
            }
            _ => Footprint::Polygon { vertices: self.corners.clone() },
        }
    }

    /// How it is pushed along its route, if it has one.
    pub(crate) fn walker(&self) -> Option<Walker> {
        let start = std::iter::once(self.at.position());
        (!self.route.is_empty()).then(|| Walker {
            route: start.chain(self.route.iter().copied()).collect(),
            speed: self.speed,
            mode: WalkMode::BackAndForth,
            start_offset: 0.0,
            pause_s: 0.0,
            heedless: false,
        })
    }

    /// Its corners at `at`, map frame; those of a disc lie on its rim.
    pub fn corners_on_map(&self) -> Vec<Point2> {
        match self.outline() {
            Footprint::Polygon { vertices } => vertices.iter().map(|v| self.at.transform(*v)).collect(),
            Footprint::Disc { radius } => (0..DISC_CORNERS)
                .map(|k| sin_cos(TAU * f64::from(k) / f64::from(DISC_CORNERS)))
                .map(|(sin, cos)| self.at.transform(Point2::new(radius * cos, radius * sin)))
                .collect(),
        }
    }

    fn is_a_thing(&self) -> Result<(), FieldError> {
        let given = [self.radius.is_some(), self.size.is_some(), !self.corners.is_empty()];
        if given.iter().filter(|given| **given).count() != 1 {
            let mend = "give `radius` of a disc, `size` of a box, or `corners` of a polygon";
            return Err(FieldError::new("", "has not exactly one outline", mend));
        }
        if !self.corners.is_empty() {
            self.outline().check().map_err(|e| FieldError { field: "corners".to_owned(), ..e })?;
        }
        let until = self.until_s.unwrap_or(f64::INFINITY);
        if until <= self.from_s {
            let problem = format!("is {until} s, and it comes at {} s", self.from_s);
            return Err(FieldError::new("until_s", problem, "give a later time, or leave it out"));
        }
        Ok(())
    }
}

impl WorldEvent {
    /// Where the robot is carried to, if it is.
    pub fn place(&self) -> Option<Pose2> {
        let &[x, y, heading] = self.carried_to.as_deref()? else { return None };
        Some(Pose2::new(x, y, heading))
    }

    fn is_something(&self) -> Result<(), FieldError> {
        if self.carried_to.is_none() && self.laser.is_none() {
            return Err(FieldError::new("", "says nothing that happens", "give `carried_to` or `laser`"));
        }
        Ok(())
    }
}
