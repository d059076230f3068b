//! What the arbiter sees around the robot that is on no map.

use std::collections::BTreeMap;
use std::sync::Arc;

use curionav_mission::convert;
use curionav_planning::arbitration::Surroundings;
use curionav_planning::beam::Beam;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::{Obstacles, StaticMap};
use curionav_planning::scene as planning;
use curionav_planning::sensor::LaserModel;
use curionav_schemas::limits::MAX_OBSTACLE_CELLS;
use curionav_schemas::{Belief, Odometry, People, Scan};
use curionav_tracking_people::{self as perception, Detector, Look, TrackerParams};

/// Odometry remembered in real time, to be paired with the scans of its tick: a camera's may be half a second old.
const KEPT: usize = 8;
/// A person explains what lies so near to its disc, metres: a stride, and the delay of a tracker. People may be told on
/// the map, where the robot is only known as its belief is: three standard deviations of that come on top.
const PERSON_ERROR: f64 = 0.35;
const SIGMAS: f64 = 3.0;
/// A robot that may be anywhere sees people around it as one does that knows its place so roughly, metres.
const ROUGH_SIGMA: f64 = 0.5;
/// Where all ways are closed, what closes them is forgotten if it has not been seen for so long, seconds.
const LOOK_AGAIN: f64 = 6.0;

/// Takes scans, and says what stands where.
#[derive(Default)]
pub struct ObstacleWatch {
    recent: Vec<Odometry>,
    seen: Seen,
    obstacles: Obstacles,
    /// The scanner's newest scan.
    newest: Option<Scan>,
    /// By what rule the mission's tracker takes a beam for explained by the map.
    tracker: TrackerParams,
}

/// What explains a scan: what is on the map, and people.
pub struct Explained<'a> {
    /// Where the robot is believed to be.
    pub belief: &'a Belief,
    /// People, if they are known.
    pub people: Option<&'a People>,
    /// The map without obstacles.
    pub map: &'a Arc<StaticMap>,
    /// Standard deviation of a range, metres.
    pub range_sigma: f64,
}

impl ObstacleWatch {
    /// Uses the parameters of a mission's tracker from now on.
    pub fn follow(&mut self, tracker: TrackerParams) {
        self.tracker = tracker;
    }

    /// Forgets everything but those parameters: a run is over, or the base has started over.
    pub fn forget(&mut self) {
        *self = Self { tracker: self.tracker, ..Self::default() };
    }

    /// Forgets at `stamp` what has not been seen for a while: all ways are closed, and the robot is to look again.
    pub fn look_again(&mut self, stamp: f64) {
        self.seen.forget_unseen(stamp - LOOK_AGAIN);
    }

    /// What stands where, as cells of the map.
    pub fn obstacles(&self) -> &Obstacles {
        &self.obstacles
    }

    /// Takes note of odometry, with which the scans of its tick are then paired.
    pub fn measured(&mut self, odometry: impl IntoIterator<Item = Odometry>) {
        self.recent.extend(odometry);
        self.recent.drain(..self.recent.len().saturating_sub(KEPT));
    }

    /// Takes in a scan of the scanner, and the newest scans of further sensors by their names.
    pub fn see(&mut self, scan: Scan, further: &BTreeMap<String, Scan>, explained: &Explained<'_>) {
        let Explained { belief, people, map, range_sigma } = *explained;
        let Some(odometry) = odometry_of(&self.recent, scan.tick) else { return };
        let belief = convert::belief(belief);
        let map_from_odometry = belief.pose.compose(odometry.relative(Pose2::default()));
        let tracker = self.tracker;
        let mut place =
            Place { belief, odometry, people: planning::People::default(), map, range_sigma, tracker };
        place.people = people_at(people, &place.belief, scan.stamp);
        if self.seen.by_scanner.take(&scan, &place).is_none() {
            return;
        }
        for (sensor, scan) in further {
            let Some(odometry) = odometry_of(&self.recent, scan.tick) else { continue };
            place.odometry = odometry;
            place.belief.pose = map_from_odometry.compose(odometry);
            place.people = people_at(people, &place.belief, scan.stamp);
            self.seen.take_further(sensor, scan, &place);
        }
        let occupied = self.seen.occupied().map(|p| map_from_odometry.transform(p));
        self.obstacles = Obstacles::at(occupied, &map.grid);
        self.newest = Some(scan);
    }

    /// What the scanner sees around the robot, by its newest scan.
    pub fn surroundings(&self, range_sigma: f64) -> Option<Surroundings> {
        let (ranges, laser) = convert::scan(self.newest.as_ref()?, range_sigma).ok()?;
        let ends = (0..laser.beams).zip(&*ranges).filter_map(|(index, range)| {
            let range = match Beam::of(*range, 0.0, laser.range_max) {
                Beam::Obstacle(range) => range,
                _ => return None,
            };
            let (sin, cos) = sin_cos(laser.bearing(index));
            Some(laser.robot_from_laser.transform(Point2::new(range * cos, range * sin)))
        });
        Some(Surroundings { ends: ends.collect(), sees_all_around: laser.sees_all_around() })
    }
}

fn odometry_of(recent: &[Odometry], tick: u64) -> Option<Pose2> {
    let odometry = recent.iter().find(|odometry| odometry.tick == tick)?;
    Some(Pose2::new(odometry.x, odometry.y, odometry.heading))
}

fn people_at(people: Option<&People>, belief: &planning::Belief, stamp: f64) -> planning::People {
    people.map(|people| convert::people_at(people, belief, stamp)).unwrap_or_default()
}

/// Where a scan was taken, and what explains it.
struct Place<'a> {
    /// Where the robot is believed to have been.
    belief: planning::Belief,
    /// Where odometry had it.
    odometry: Pose2,
    people: planning::People,
    map: &'a Arc<StaticMap>,
    /// Standard deviation of a range, metres.
    range_sigma: f64,
    tracker: TrackerParams,
}

/// The evidence of each sensor. They are kept apart, because a laser looks through under the table that a camera sees.
#[derive(Default)]
struct Seen {
    by_scanner: BySensor,
    further: BTreeMap<String, BySensor>,
}

impl Seen {
    fn take_further(&mut self, sensor: &str, scan: &Scan, place: &Place<'_>) {
        let seen = self.further.entry(sensor.to_owned()).or_default();
        if seen.stamp != scan.stamp {
            // What describes no scanner is no evidence.
            let _ = seen.take(scan, place);
        }
    }

    fn forget_unseen(&mut self, stamp: f64) {
        let all = std::iter::once(&mut self.by_scanner).chain(self.further.values_mut());
        all.for_each(|seen| seen.obstacles.forget_unseen(stamp));
    }

    /// Places of obstacles in the frame of odometry: the scanner's first, and no more than a scene holds.
    fn occupied(&self) -> impl Iterator<Item = Point2> {
        let all = std::iter::once(&self.by_scanner).chain(self.further.values());
        all.flat_map(|seen| seen.obstacles.occupied()).take(MAX_OBSTACLE_CELLS)
    }
}

/// The evidence of one sensor.
struct BySensor {
    /// Stamp of its newest scan.
    stamp: f64,
    obstacles: perception::Obstacles,
}

impl Default for BySensor {
    fn default() -> Self {
        let obstacles = perception::Obstacles::new(perception::ObstacleParams::default());
        Self { stamp: f64::NEG_INFINITY, obstacles }
    }
}

impl BySensor {
    /// Takes in a scan; nothing if it describes no scanner.
    fn take(&mut self, scan: &Scan, place: &Place<'_>) -> Option<()> {
        let Place { belief, odometry, people, map, range_sigma, tracker } = place;
        let (ranges, laser) = convert::scan(scan, *range_sigma).ok()?;
        let beams = beams(&ranges, &laser);
        let detector = Detector::new(Arc::clone(map), *tracker);
        let mut explained = detector.explained(&ranges, &laser, belief.pose, &belief.covariance);
        explain_people(&mut explained, &beams, &laser, belief, people);
        self.stamp = scan.stamp;
        self.obstacles.see(&Look {
            stamp: scan.stamp,
            laser: odometry.compose(laser.robot_from_laser).into(),
            angle_min: laser.bearing(0),
            increment: laser.bearing(1) - laser.bearing(0),
            beams: &beams,
            explained: &explained,
        });
        Some(())
    }
}

fn beams(ranges: &[f32], laser: &LaserModel) -> Vec<Beam> {
    ranges.iter().map(|range| Beam::of(*range, 0.0, laser.range_max)).collect()
}

/// Marks the beams that may have ended on a person.
fn explain_people(
    explained: &mut [bool],
    beams: &[Beam],
    laser: &LaserModel,
    belief: &planning::Belief,
    people: &planning::People,
) {
    let near = people.radius + PERSON_ERROR + SIGMAS * belief.position_sigma().min(ROUGH_SIGMA);
    let at = belief.pose.compose(laser.robot_from_laser);
    for (index, (beam, explained)) in beams.iter().zip(explained).enumerate() {
        let Beam::Obstacle(range) = *beam else { continue };
        let (sin, cos) = sin_cos(laser.bearing(index as u32));
        let end = at.transform(Point2::new(range * cos, range * sin));
        *explained |= (0..people.len()).any(|i| people.position(i).distance(end) < near);
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Twist;
    use curionav_planning::occupancy::OccupancyGrid;
    use curionav_schemas::Pose;
    use nalgebra::{Matrix3, Vector3};

    use super::*;

    #[test]
    fn beams_that_may_have_ended_on_a_person_are_explained() {
        let laser = LaserModel { beams: 3, fov: 0.2, ..LaserModel::default() };
        let pose = Pose2::new(5.0, 5.0, 0.0);
        let people = planning::People::walking(0.25, &[[8.0, 5.0, 0.0, 0.0]]);
        let beams = [Beam::Obstacle(2.75), Beam::Free(8.0), Beam::Obstacle(1.0)];
        let explained = |sigma: f64| {
            let covariance = Matrix3::from_diagonal(&Vector3::new(sigma * sigma, sigma * sigma, 1e-4));
            let belief = planning::Belief { pose, covariance, twist: Twist::default() };
            let mut explained = vec![false, true, false];
            explain_people(&mut explained, &beams, &laser, &belief, &people);
            explained
        };
        assert_eq!(explained(0.02), [true, true, false]);
        assert_eq!(explained(0.5), [true, true, true]);
    }

    const BEAMS: usize = 180;
    const RANGE_MAX: f64 = 5.0;

    /// A look all around from the robot's middle.
    fn all_around(stamp: f64, range: impl Fn(f64) -> f32) -> Scan {
        let angle_increment = std::f64::consts::TAU / BEAMS as f64;
        let angle_min = -std::f64::consts::PI;
        let ranges = (0..BEAMS).map(|beam| range(angle_min + angle_increment * beam as f64));
        Scan {
            tick: 0,
            stamp,
            angle_min,
            angle_increment,
            range_min: None,
            range_max: RANGE_MAX,
            laser: Pose::default(),
            ranges: ranges.collect(),
        }
    }

    #[test]
    fn a_box_that_the_camera_alone_sees_is_an_obstacle_until_the_camera_looks_through() {
        let grid = OccupancyGrid::new(400, 400, 0.05, Pose2::default(), vec![0; 160_000]).unwrap();
        let map = Arc::new(StaticMap::new(grid));
        let covariance = Matrix3::from_diagonal(&Vector3::new(1e-4, 1e-4, 1e-5));
        let place = Place {
            belief: planning::Belief {
                pose: Pose2::new(10.0, 10.0, 0.0),
                covariance,
                twist: Twist::default(),
            },
            odometry: Pose2::default(),
            people: planning::People::default(),
            map: &map,
            range_sigma: 0.03,
            tracker: TrackerParams::default(),
        };
        let mut seen = Seen::default();
        let look = |seen: &mut Seen, tick: i32, camera: &dyn Fn(f64) -> f32| {
            let stamp = 0.1 * f64::from(tick);
            // Ahead the laser sees over the box as far as it sees at all.
            seen.by_scanner.take(&all_around(stamp, |_| RANGE_MAX as f32), &place).unwrap();
            seen.take_further("camera", &all_around(stamp, camera), &place);
            seen.occupied().collect::<Vec<Point2>>()
        };
        let of_box = |bearing: f64| if bearing.abs() < 0.15 { 2.0 } else { f32::NAN };
        for tick in 0..3 {
            assert!(look(&mut seen, tick, &of_box).is_empty());
        }
        let known = look(&mut seen, 3, &of_box);
        assert!(known.len() >= 4 && known.iter().all(|p| (p.distance(Point2::default()) - 2.0).abs() < 0.1));
        // Of where a camera sees nothing it says nothing.
        let blank = |_: f64| f32::NAN;
        assert_eq!(look(&mut seen, 4, &blank), known);
        let behind = |bearing: f64| if bearing.abs() < 0.3 { 3.5 } else { f32::NAN };
        let after: Vec<usize> = (5..10).map(|tick| look(&mut seen, tick, &behind).len()).collect();
        let near = |p: &Point2| p.distance(Point2::default()) < 3.0;
        assert!(!seen.occupied().any(|p| near(&p)), "{after:?}");
    }

    #[test]
    fn what_the_map_explains_is_for_the_parameters_of_the_tracker_to_say() {
        // A wall from 2 m ahead on, and something that seems to stand 0.2 m before it.
        let cells = (0..160_000).map(|cell| if cell % 400 >= 240 { 100 } else { 0 }).collect();
        let grid = OccupancyGrid::new(400, 400, 0.05, Pose2::default(), cells).unwrap();
        let map = Arc::new(StaticMap::new(grid));
        let obstacles = |map_sigma: f64| {
            let place = Place {
                belief: planning::Belief {
                    pose: Pose2::new(10.0, 10.0, 0.0),
                    covariance: Matrix3::from_diagonal(&Vector3::new(1e-4, 1e-4, 1e-5)),
                    twist: Twist::default(),
                },
                odometry: Pose2::default(),
                people: planning::People::default(),
                map: &map,
                range_sigma: 0.03,
                tracker: TrackerParams { map_sigma, ..TrackerParams::default() },
            };
            let mut seen = Seen::default();
            for tick in 0..6 {
                let ahead = |bearing: f64| if bearing.abs() < 0.15 { 1.8 } else { RANGE_MAX as f32 };
                seen.by_scanner.take(&all_around(0.1 * f64::from(tick), ahead), &place).unwrap();
            }
            seen.occupied().count()
        };
        assert!(obstacles(0.05) > 0);
        assert_eq!(obstacles(0.1), 0);
    }
}
