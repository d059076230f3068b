//! The lines of the protocol: one JSON object each.

use curionav_planning::generation::GenerationInput;
use curionav_planning::generation::own::Proposal;
use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::motion::{Footprint, RobotModel};
use curionav_planning::occupancy::{Cell, OccupancyGrid};
use curionav_schemas::{Pose, Scan, hex};
use serde::{Deserialize, Serialize};

/// Of the protocol.
const VERSION: u32 = 1;
/// Between two points of the way that is told, and how far it is told, metres.
const WAY_SPACING: f64 = 0.25;
const WAY_AHEAD: f64 = 5.0;
/// How long a twist is driven unless the answer says so, seconds: two cycles, so that one late answer is bridged.
const SECONDS: f64 = 0.6;

/// What is asked.
#[derive(Debug, Serialize)]
#[serde(tag = "ask", rename_all = "lowercase")]
pub(crate) enum Question<'a> {
    /// Who are you?
    Hello { protocol: u32 },
    /// A run begins.
    Begin(Box<Begin<'a>>),
    /// What could the robot do now?
    Decide(Box<Decide<'a>>),
}

impl Question<'_> {
    pub(crate) fn hello() -> Self {
        Self::Hello { protocol: VERSION }
    }
}

/// What stays the same for a run.
#[derive(Debug, Serialize)]
pub(crate) struct Begin<'a> {
    robot: &'a str,
    seed: u64,
    goal: [f64; 2],
    limits: Limits,
    footprint: Outline,
    /// States of a candidate at most, and seconds from one to the next.
    steps: usize,
    dt: f64,
    map: Map,
}

#[derive(Debug, Serialize)]
struct Limits {
    v_max: f64,
    v_reverse: f64,
    a_max: f64,
    omega_max: f64,
    alpha_max: f64,
}

#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Outline {
    Disc { radius: f64 },
    Polygon { vertices: Vec<[f64; 2]>, radius: f64 },
}

/// A map. Its cells are a character each, the lowest row first: `.` free, `#` occupied, `?` unknown. They are sent once
/// to each process.
#[derive(Debug, Serialize)]
struct Map {
    sha256: String,
    width: usize,
    height: usize,
    resolution: f64,
    origin: [f64; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    cells: Option<String>,
}

/// What is known in a cycle.
#[derive(Debug, Serialize)]
pub(crate) struct Decide<'a> {
    time: f64,
    belief: Believed,
    goal: [f64; 2],
    /// Metres to the goal along the shortest way; nothing if there is no way.
    to_go: Option<f64>,
    /// That way, from the robot on.
    way: Vec<[f64; 2]>,
    people: People<'a>,
    obstacles: Obstacles,
    #[serde(skip_serializing_if = "Option::is_none")]
    scan: Option<&'a ScanView>,
}

#[derive(Debug, Serialize)]
struct Believed {
    x: f64,
    y: f64,
    heading: f64,
    v: f64,
    omega: f64,
    /// Of (x, y, heading), row by row.
    covariance: Vec<f64>,
    /// Whether the position counts as uncertain.
    uncertain: bool,
}

#[derive(Debug, Serialize)]
struct People<'a> {
    radius: f64,
    id: &'a [u32],
    x: &'a [f64],
    y: &'a [f64],
    vx: &'a [f64],
    vy: &'a [f64],
}

/// Squares on which something stands that is on no map, by their centres.
#[derive(Debug, Serialize)]
struct Obstacles {
    side: f64,
    x: Vec<f64>,
    y: Vec<f64>,
}

/// A scan as planners are told it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScanView {
    /// Robot's clock, seconds.
    pub time: f64,
    /// First beam, laser frame, radians.
    pub angle_min: f64,
    /// From beam to beam, radians.
    pub angle_increment: f64,
    /// A beam that meets nothing has this range, metres.
    pub range_max: f64,
    /// The laser in the robot's frame: x, y (metres) and heading (radians).
    pub laser: [f64; 3],
    /// Metres; nothing for a beam that has failed.
    pub ranges: Vec<Option<f32>>,
}

impl ScanView {
    /// What planners are told of a message.
    pub fn of(scan: &Scan) -> Self {
        let Pose { x, y, heading } = scan.laser;
        Self {
            time: scan.stamp,
            angle_min: scan.angle_min,
            angle_increment: scan.angle_increment,
            range_max: scan.range_max,
            laser: [x, y, heading],
            ranges: scan.ranges.iter().copied().map(measured).collect(),
        }
    }
}

/// A range; nothing for a beam that has failed.
fn measured(range: f32) -> Option<f32> {
    (range.is_finite() && range > 0.0).then_some(range)
}

/// What `begin` tells beside the input of a cycle.
pub(crate) struct Beginning<'a> {
    pub(crate) robot: &'a str,
    pub(crate) seed: u64,
    pub(crate) map: &'a OccupancyGrid,
    pub(crate) with_cells: bool,
}

impl<'a> Begin<'a> {
    pub(crate) fn new(beginning: &Beginning<'a>, input: &GenerationInput<'_>) -> Self {
        let RobotModel { v_max, v_reverse, a_max, omega_max, alpha_max, .. } = *input.robot;
        let footprint = &input.robot.footprint;
        let radius = footprint.circumscribed_radius();
        Self {
            robot: beginning.robot,
            seed: beginning.seed,
            goal: [input.goal.x, input.goal.y],
            limits: Limits { v_max, v_reverse, a_max, omega_max, alpha_max },
            footprint: match footprint {
                Footprint::Disc { .. } => Outline::Disc { radius },
                Footprint::Polygon { vertices } => {
                    Outline::Polygon { vertices: vertices.iter().map(|v| [v.x, v.y]).collect(), radius }
                }
            },
            steps: input.params.steps,
            dt: input.params.dt,
            map: Map::new(beginning.map, beginning.with_cells),
        }
    }
}

impl Map {
    fn new(grid: &OccupancyGrid, with_cells: bool) -> Self {
        let origin = grid.origin();
        Self {
            sha256: hex(&grid.hash()),
            width: grid.width(),
            height: grid.height(),
            resolution: grid.resolution(),
            origin: [origin.x, origin.y, origin.heading],
            cells: with_cells.then(|| {
                (0..grid.width() * grid.height()).map(|index| character(grid.cell(index))).collect()
            }),
        }
    }
}

fn character(cell: Cell) -> char {
    match cell {
        Cell::Free => '.',
        Cell::Occupied => '#',
        Cell::Unknown => '?',
    }
}

impl<'a> Decide<'a> {
    pub(crate) fn new(input: &GenerationInput<'a>, scan: Option<&'a ScanView>) -> Self {
        let scene = input.scene;
        let belief = &scene.belief;
        let here = belief.pose.position();
        let grid = &input.map.grid;
        let way = input.geodesic.descend_for(here, WAY_SPACING, WAY_AHEAD);
        let centres = scene.obstacles.places(grid).map(|(column, row)| grid.centre(column, row));
        let (x, y) = centres.map(|centre| (centre.x, centre.y)).unzip();
        let people = &scene.people;
        let to_go = input.geodesic.at(here);
        Self {
            time: scene.stamp,
            belief: Believed {
                x: belief.pose.x,
                y: belief.pose.y,
                heading: belief.pose.heading,
                v: belief.twist.v,
                omega: belief.twist.omega,
                covariance: belief.covariance.transpose().as_slice().to_vec(),
                uncertain: scene.uncertain,
            },
            goal: [input.goal.x, input.goal.y],
            to_go: to_go.is_finite().then_some(to_go),
            way: way.into_iter().map(|point| [point.x, point.y]).collect(),
            people: People {
                radius: people.radius,
                id: &people.id,
                x: &people.x,
                y: &people.y,
                vx: &people.vx,
                vy: &people.vy,
            },
            obstacles: Obstacles { side: grid.resolution(), x, y },
            scan,
        }
    }
}

/// An answer to `begin` or `decide`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Answer {
    #[serde(default)]
    error: Option<String>,
    #[serde(default)]
    v: Option<f64>,
    #[serde(default)]
    omega: Option<f64>,
    #[serde(default)]
    seconds: Option<f64>,
    #[serde(default)]
    poses: Option<Vec<[f64; 3]>>,
    #[serde(default)]
    candidates: Option<Vec<Answer>>,
}

/// What is wrong with an answer.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Unusable {
    /// The planner says that it has failed.
    Failed(String),
    /// It is no answer.
    Refused(String),
}

/// The longest text of an answer that is repeated, characters.
const SHOWN: usize = 200;

/// The first characters of a text on one line.
pub(crate) fn shown(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(SHOWN).collect()
}

fn read(line: &[u8]) -> Result<Answer, Unusable> {
    let answer: Answer = serde_json::from_slice(line).map_err(|error| {
        let text = shown(&String::from_utf8_lossy(line));
        let has_none = ["NaN", "Infinity"].iter().any(|word| text.contains(word));
        let why = if has_none { "has a number that is not finite".to_owned() } else { error.to_string() };
        Unusable::Refused(format!("answered `{text}`: {why}"))
    })?;
    match answer.error {
        Some(error) => Err(Unusable::Failed(shown(&error))),
        None => Ok(answer),
    }
}

/// Whether a planner has begun.
pub(crate) fn read_begun(line: &[u8]) -> Result<(), Unusable> {
    read(line).map(|_| ())
}

/// What a planner proposes, its first choice first.
pub(crate) fn read_proposals(line: &[u8]) -> Result<Vec<Proposal>, Unusable> {
    let mut answer = read(line)?;
    match answer.candidates.take() {
        Some(candidates) => candidates.into_iter().map(proposal).collect(),
        None => Ok(vec![proposal(answer)?]),
    }
}

fn proposal(answer: Answer) -> Result<Proposal, Unusable> {
    match answer {
        Answer { v: Some(v), omega: Some(omega), seconds, poses: None, candidates: None, error: None } => {
            Ok(Proposal::Drive { twist: Twist { v, omega }, seconds: seconds.unwrap_or(SECONDS) })
        }
        Answer { poses: Some(poses), v: None, omega: None, seconds: None, candidates: None, error: None } => {
            Ok(Proposal::Poses(poses.into_iter().map(|[x, y, heading]| Pose2::new(x, y, heading)).collect()))
        }
        _ => {
            let forms = "`v` and `omega`, or `poses`, or `candidates` with these";
            Err(Unusable::Refused(format!("its answer has to have {forms}, each as numbers")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn proposals(line: &str) -> Result<Vec<Proposal>, Unusable> {
        read_proposals(line.as_bytes())
    }

    #[test]
    fn an_answer_is_a_twist_or_poses_or_several_of_them() {
        let drive = |seconds| vec![Proposal::Drive { twist: Twist { v: 0.5, omega: -0.25 }, seconds }];
        assert_eq!(proposals(r#"{"v": 0.5, "omega": -0.25}"#).unwrap(), drive(0.6));
        assert_eq!(proposals(r#"{"v": 0.5, "omega": -0.25, "seconds": 1}"#).unwrap(), drive(1.0));
        let poses = Proposal::Poses(vec![Pose2::new(1.0, 2.0, 0.5)]);
        assert_eq!(proposals(r#"{"poses": [[1, 2, 0.5]]}"#).unwrap(), vec![poses.clone()]);
        let both = r#"{"candidates": [{"v": 0.5, "omega": -0.25}, {"poses": [[1, 2, 0.5]]}]}"#;
        assert_eq!(proposals(both).unwrap(), [drive(0.6), vec![poses]].concat());
        assert_eq!(proposals(r#"{"candidates": []}"#).unwrap(), Vec::new());
    }

    #[test]
    fn what_is_no_answer_is_refused_with_a_reason() {
        let refused = |line: &str| match proposals(line) {
            Err(Unusable::Refused(why)) => why,
            other => panic!("{line}: {other:?}"),
        };
        assert!(refused(r#"{"v": NaN, "omega": 0}"#).ends_with("has a number that is not finite"));
        assert!(refused(r#"{"v": 1}"#).contains("`v` and `omega`, or `poses`"));
        assert!(refused(r#"{"v": 1, "omega": 0, "poses": []}"#).contains("`v` and `omega`, or"));
        assert!(refused(r#"{"speed": 1}"#).contains("unknown field `speed`"));
        assert!(refused("go").starts_with("answered `go`: "));
        assert_eq!(proposals(r#"{"error": "no\nway"}"#), Err(Unusable::Failed("no way".into())));
    }
}
