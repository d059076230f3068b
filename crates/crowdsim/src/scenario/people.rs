//! The people of a scenario: scripted walkers, recordings, and who of them the planner is told about.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::hrvo::HrvoParams;
use curionav_planning::parameters::Range;

use super::arrays;
use crate::social_force::SocialForceParams;

curionav_planning::parameters! {
    /// Which people the planner is told about, and how they are known.
    #[derive(Copy, Eq, Default)]
    #[serde(default)]
    pub struct Perception {
        /// Which people the planner is told about.
        pub people: PerceivedPeople [words],
        /// Where from people are known.
        pub frame: PeopleFrame [words],
        /// What the planner's knowledge of people comes from.
        #[serde(skip_serializing_if = "is_default")]
        pub source: PeopleSource [words],
    }
}

curionav_planning::parameters! {
    /// What the planner's knowledge of people comes from.
    #[derive(Default)]
    pub enum PeopleSource {
        /// From the simulator, which says their true positions and velocities as `people` and `frame` say.
        #[default]
        Truth,
        /// From the service `tracker`, which has nothing but the laser and the robot's belief. The simulator says
        /// nothing of people; `people` and `frame` have no effect.
        Tracker,
    }
}

curionav_planning::parameters! {
    /// In which frame the planner is told where people are.
    #[derive(Default)]
    pub enum PeopleFrame {
        /// The map's, without error, however wrong the robot is about itself: as in the paper (D10).
        #[default]
        Map,
        /// The robot's, as a tracker on the robot sees them: the planner puts them on the map with its own belief, so
        /// that they are as far off as it is itself.
        Robot,
    }
}

curionav_planning::parameters! {
    /// Which people the planner is told about; always their true positions and velocities (D10, A33).
    #[derive(Default)]
    pub enum PerceivedPeople {
        /// All people; the arbiter keeps those inside the Working Zone around its own belief.
        #[default]
        All,
        /// Those within 9.5 m of the robot's true position, the Working Zone.
        WorkingZone,
        /// People in the laser's sight: within its range and field of view, and with a free line of sight past
        /// walls and other people.
        Laser,
    }
}

impl PerceivedPeople {
    /// Radius of the Working Zone, metres: (1 + 1 m/s) * 4 s + 1.5 m (A21).
    pub const WORKING_ZONE_M: f64 = 9.5;
}

curionav_planning::parameters! {
    /// What all people of the scenario have in common.
    #[derive(Copy)]
    pub struct PeopleParams {
        /// Radius of the disc that stands for one person, metres. Default 0.25: Stage's 0.5 m walkers.
        pub radius: f64 [0.05, 2.0, "m", "thinner bodies are poles, wider ones are groups"] = 0.25,
        /// What the laser sees of a person. Touching is judged by the disc, whatever the laser sees.
        #[serde(skip_serializing_if = "is_default")]
        pub shape: PeopleShape [words] = PeopleShape::Disc,
        /// Where people come from: the scenario alone, or also from outside while the run goes on.
        #[serde(skip_serializing_if = "is_default")]
        pub kind: PeopleKind [words] = PeopleKind::Scenario,
        /// How long a run waits for live people before it is given up, seconds of wall time. Default 10: the program
        /// that plays a crowd may start after the run, or load a model first.
        #[serde(skip_serializing_if = "is_default_patience")]
        pub live_patience_s: f64 [0.1, 600.0, "s", "a run that waits longer is forgotten"] = LIVE_PATIENCE_S,
        /// How the people of `[[walkers]]` and `[[crowds]]` move; the recorded and the live ones move as they were
        /// told.
        #[serde(skip_serializing_if = "is_default")]
        pub motion: Motion [words] = Motion::Scripted,
        /// Parameters of `motion = "hrvo"`; without effect on scripted people.
        #[serde(skip_serializing_if = "is_default")]
        pub hrvo: HrvoParams [table] = HrvoParams::default(),
        /// Parameters of `motion = "social-force"`; without effect on others.
        #[serde(skip_serializing_if = "is_default")]
        pub social_force: SocialForceParams [table] = SocialForceParams::default(),
    }
}

const LIVE_PATIENCE_S: f64 = 10.0;

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

fn is_default_patience(seconds: &f64) -> bool {
    *seconds == LIVE_PATIENCE_S
}

curionav_planning::parameters! {
    /// What the laser sees of a person.
    #[derive(Default)]
    pub enum PeopleShape {
        /// The disc that stands for the person: a trunk.
        #[default]
        Disc,
        /// Two legs that swing with the walk, as a laser near the floor sees them.
        Legs,
    }
}

curionav_planning::parameters! {
    /// Where people come from.
    #[derive(Default)]
    pub enum PeopleKind {
        /// From the scenario alone.
        #[default]
        Scenario,
        /// Also from outside: whatever is published as the people of the world, tick by tick.
        Live,
    }
}

curionav_planning::parameters! {
    /// How the people of `[[walkers]]` and `[[crowds]]` move along their routes.
    #[derive(Default)]
    pub enum Motion {
        /// In straight lines at constant speed, through each other; only the robot in the way stops them
        /// (D11).
        #[default]
        Scripted,
        /// From corner to corner of the route, around each other, the robot and walls by hybrid reciprocal
        /// velocity obstacles.
        Hrvo,
        /// From corner to corner by social forces, which also push people back and aside.
        SocialForce,
    }
}

curionav_planning::parameters! {
    /// How a walker goes along its route.
    #[derive(Default)]
    pub enum WalkMode {
        /// To the last point, back to the first, and so on.
        #[default]
        BackAndForth,
        /// To the last point, where it stays.
        Once,
        /// Round and round: from the last point straight to the first.
        Loop,
        /// Does not move from where `start_offset` puts it.
        Stand,
    }
}

curionav_planning::parameters! {
    /// A person with a route. Scripted, it does not react, except that it waits while the robot stands in its
    /// way (D11); see [`Motion`].
    pub struct Walker {
        /// Corners of the route `[[x, y], ...]`, walked in straight lines; at least two unless it stands.
        #[serde(with = "arrays::points")]
        pub route: Vec<Point2>
            [in Range::POSITION; 1.0, 1000.0, "one point is enough to stand, and every point is checked against walls"],
        /// Walking speed, m/s.
        #[serde(default = "default_speed")]
        pub speed: f64 [0.01, 10.0, "m/s", "no person runs faster, and one who does not walk has mode = \"stand\""],
        /// How the route is walked.
        #[serde(default)]
        pub mode: WalkMode [words],
        /// Metres along the route at t = 0. For `back-and-forth` up to twice the route's length: the second
        /// half is the way back. For `loop` up to the length of the closed route.
        #[serde(default)]
        pub start_offset: f64 [0.0, 1e6, "m", "it lies on the route"],
        /// Rest at each end of the route, seconds; for `loop` at the first point.
        #[serde(default)]
        pub pause_s: f64 [0.0, 3600.0, "s", "a longer rest outlasts the run"],
        /// Whether this person takes no notice of the robot, and walks into it where their ways meet: only its body
        /// stops one.
        #[serde(default, skip_serializing_if = "is_default")]
        pub heedless: bool,
    } check Self::leads_somewhere
}

fn default_speed() -> f64 {
    0.8
}

curionav_planning::parameters! {
    /// How a recording is written.
    pub enum RecordingFormat {
        /// Eight columns `frame id x z y vx vz vy` (OpenTraj).
        Obsmat,
        /// Four columns `frame id x y` (Social-GAN and its descendants), with blanks or commas between them.
        Text,
    }
}

curionav_planning::parameters! {
    /// Pedestrians that walk as they were recorded. They do not react.
    pub struct Recorded {
        /// The recording: a path relative to the scenario file, or `dataset:NAME/FILE` for a file of a dataset.
        pub file: String [name, "name a recording"],
        /// How it is written.
        pub format: RecordingFormat [words],
        /// Frames per second: a frame number divided by it is the time in seconds. No default: it differs
        /// between recordings that look alike.
        pub fps: f64 [0.1, 1000.0, "1/s", "recordings of people have between one and some hundred frames per second"],
        /// Time in the recording at t = 0, seconds.
        #[serde(default)]
        pub start_s: f64 [0.0, 1e6, "s", "eleven days are longer than any recording"],
        /// If given, the run's seed draws the time in the recording at t = 0 between `start_s` and this, seconds.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub start_until_s: Option<f64> [0.0, 1e6, "s", "eleven days are longer than any recording"],
        /// `map_from_recording` as `[x, y, heading]`.
        #[serde(default, with = "arrays::pose")]
        pub pose: Pose2 [in Range::POSITION, Range::POSITION, Range::HEADING],
        /// Only these people of the recording; none means all of them.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub ids: Option<Vec<u32>>
            [0.0, 4_294_967_295.0, "", "identities are 32 bits wide";
             1.0, 100_000.0, "without any, leave it out; and no recording has more people"],
        /// Begin again with the first frame after the last. If it is left out, people are gone after the last.
        #[serde(default)]
        pub r#loop: bool,
    } check Self::begins_in_order
}

impl Walker {
    /// Metres walked until everything repeats (or ends): the range of `start_offset`.
    pub fn cycle_length(&self) -> f64 {
        let length: f64 = self.route.windows(2).map(|w| w[0].distance(w[1])).sum();
        match (self.mode, self.route.first(), self.route.last()) {
            (WalkMode::BackAndForth, ..) => 2.0 * length,
            (WalkMode::Loop, Some(first), Some(last)) => length + last.distance(*first),
            _ => length,
        }
    }
}
