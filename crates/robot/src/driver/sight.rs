//! Whether a scan shows enough to drive by. A scan that shows nothing is no evidence that nothing is there.

use std::collections::VecDeque;

use curionav_mission::convert;
use curionav_mission::scanner_limits::{ScannerLimits, field_of_view};
use curionav_planning::beam::Beam;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::{RayCaster, StaticMap};
use curionav_schemas::{CommandReason, Scan};

/// Time over which scans are counted, seconds: at least this long, so that one late scan is no fault.
const RATE_WINDOW: f64 = 1.0;
/// Most scans that are counted.
const SCANS_COUNTED: usize = 256;
/// Of the scans that a robot's ticks could take, at least this share has to come, whatever the limits say.
const SHARE_OF_TICKS: f64 = 0.5;
/// Beams that are held against the map, evenly spaced.
const PROBES: usize = 72;
/// Fewer of them that should meet a wall are no evidence, not even of a belief that is certain.
const LEAST_WALLS: f64 = 8.0;
/// Share of the scanner's greatest range within which a wall has to be seen: farther ones are met at flat angles.
const WELL_WITHIN: f64 = 0.9;
/// So many standard deviations of the belief a wall may be farther, or elsewhere.
const SIGMAS: f64 = 2.0;
/// Share of the walls well within range that a scan of the same place shows at least, with everything moved that can
/// be moved.
const LEAST_CONFIRMED: f64 = 0.1;
/// How long scans have to contradict the map, seconds: the belief may jump at an update.
const CONTRADICTED: f64 = 0.25;

/// Why a scan is not driven by.
#[derive(Debug, Clone, PartialEq)]
pub struct Blind {
    /// What it lacks.
    pub reason: CommandReason,
    /// The numbers that say so.
    pub detail: String,
}

/// What a scan is held against.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// Radius of the robot, metres: beams that end within it show the robot itself, or what covers its laser.
    pub radius: f64,
    /// Seconds between two ticks.
    pub tick_s: f64,
    /// The map, and where the robot was believed to be on it when it took the scan, if both are known.
    pub on_map: Option<OnMap<'a>>,
}

/// A place on a map, as far as it is known.
#[derive(Clone, Copy)]
pub struct OnMap<'a> {
    /// The map.
    pub map: &'a StaticMap,
    /// Where the robot is believed to be.
    pub pose: Pose2,
    /// Standard deviation of the position, metres.
    pub position_sigma: f64,
    /// Standard deviation of the heading, radians.
    pub heading_sigma: f64,
}

/// Judges scan after scan.
#[derive(Debug)]
pub struct Sight {
    limits: ScannerLimits,
    /// Stamps of the newest scans, ascending.
    stamps: VecDeque<f64>,
    /// Stamp of the first scan since which all have contradicted the map.
    contradicted_since: Option<f64>,
}

impl Sight {
    /// Of a scanner with these limits.
    pub fn new(limits: ScannerLimits) -> Self {
        Self { limits, stamps: VecDeque::new(), contradicted_since: None }
    }

    /// Takes in the newest scan, which may be the one before; says why it is not driven by, if it is not.
    pub fn judge(&mut self, scan: &Scan, view: &View<'_>) -> Option<Blind> {
        let rare = self.rarity(scan.stamp, view.tick_s);
        let contradicted = self.contradiction(scan, view);
        narrowness(scan, &self.limits)
            .or_else(|| shortness(scan, &self.limits))
            .or_else(|| silence(scan, view.radius, &self.limits))
            .or(rare)
            .or(contradicted)
    }

    /// Whether scans come too rarely.
    fn rarity(&mut self, stamp: f64, tick_s: f64) -> Option<Blind> {
        // After a silence, which the scan's age tells of, or on a clock that has begun anew, counting begins anew.
        if self.stamps.back().is_some_and(|last| !(0.0..=RATE_WINDOW).contains(&(stamp - last))) {
            self.stamps.clear();
        }
        if self.stamps.back() != Some(&stamp) {
            self.stamps.push_back(stamp);
        }
        while self.stamps.len() > SCANS_COUNTED
            || self.stamps.get(1).is_some_and(|second| stamp - second >= RATE_WINDOW)
        {
            self.stamps.pop_front();
        }
        let spanned = stamp - self.stamps[0];
        let least = self.limits.rate.min(SHARE_OF_TICKS / tick_s);
        let rate = (self.stamps.len() - 1) as f64 / spanned;
        (spanned >= RATE_WINDOW && rate < least).then(|| Blind {
            reason: CommandReason::BlindRare,
            detail: format!("{rate:.1} scans per second, at least {least} are needed"),
        })
    }

    /// Whether the scan shows free floor where the map has walls, and has done so for a while.
    fn contradiction(&mut self, scan: &Scan, view: &View<'_>) -> Option<Blind> {
        let walls = Walls::of(scan, &view.on_map?);
        let expected = walls.expected as f64;
        if expected < walls.least || walls.confirmed as f64 > LEAST_CONFIRMED * expected {
            self.contradicted_since = None;
            return None;
        }
        let since = *self.contradicted_since.get_or_insert(scan.stamp);
        if since > scan.stamp {
            self.contradicted_since = Some(scan.stamp);
        }
        (scan.stamp - since >= CONTRADICTED).then(|| Blind {
            reason: CommandReason::BlindMap,
            detail: format!("{} of {} walls in range are seen", walls.confirmed, walls.expected),
        })
    }
}

/// Whether the beams look over too small an angle.
fn narrowness(scan: &Scan, limits: &ScannerLimits) -> Option<Blind> {
    let fov = field_of_view(scan.ranges.len(), scan.angle_increment);
    (fov < limits.fov).then(|| Blind {
        reason: CommandReason::BlindNarrow,
        detail: format!("it looks over {fov:.2} rad, at least {:.2} are needed", limits.fov),
    })
}

/// Whether the scanner does not reach far enough.
fn shortness(scan: &Scan, limits: &ScannerLimits) -> Option<Blind> {
    (scan.range_max < limits.range).then(|| Blind {
        reason: CommandReason::BlindShort,
        detail: format!("it reaches {:.2} m, at least {:.2} are needed", scan.range_max, limits.range),
    })
}

/// Whether too few beams say anything about what is around the robot.
fn silence(scan: &Scan, radius: f64, limits: &ScannerLimits) -> Option<Blind> {
    let laser = convert::pose(scan.laser);
    // No beam that ends farther from the laser than this ends on the robot.
    let farthest = radius + laser.position().distance(Point2::default());
    let count = scan.ranges.len();
    let speaking = convert::beams(scan).enumerate().filter(|(i, beam)| match *beam {
        Beam::Silent => false,
        Beam::Obstacle(metres) if metres < farthest => {
            end(scan, laser, *i, metres).distance(Point2::default()) >= radius
        }
        Beam::Obstacle(_) | Beam::Free(_) => true,
    });
    let speaking = speaking.count();
    ((speaking as f64) < limits.valid_share * count as f64).then(|| Blind {
        reason: CommandReason::BlindSilent,
        detail: format!(
            "{speaking} of {count} beams say anything, at least {:.0} are needed",
            (limits.valid_share * count as f64).ceil()
        ),
    })
}

/// Where beam `i` is after so many metres, robot frame.
pub(crate) fn end(scan: &Scan, laser: Pose2, i: usize, metres: f64) -> Point2 {
    let (sin, cos) = sin_cos(scan.angle_min + scan.angle_increment * i as f64);
    laser.transform(Point2::new(metres * cos, metres * sin))
}

/// How many walls of the map that are well within range a scan shows.
struct Walls {
    /// Probes that should meet one.
    expected: usize,
    /// Those of them that have met something.
    confirmed: usize,
    /// Fewer expected ones are no evidence: all of them may lie beside what the belief says.
    least: f64,
}

impl Walls {
    fn of(scan: &Scan, place: &OnMap<'_>) -> Self {
        let OnMap { map, pose, position_sigma, heading_sigma } = *place;
        let count = scan.ranges.len();
        let probes = PROBES.min(count);
        let step = scan.angle_increment.abs() * count as f64 / probes.max(1) as f64;
        let from_laser = pose.compose(convert::pose(scan.laser));
        let per_metre = 1.0 / map.grid.resolution();
        let corner = map.grid.from_corner(from_laser.position());
        let origin = (corner.x * per_metre, corner.y * per_metre);
        let reach = (WELL_WITHIN * scan.range_max - SIGMAS * position_sigma) * per_metre;
        let heading = from_laser.heading - map.grid.origin().heading + scan.angle_min;
        let rays = RayCaster::new(map);
        let least = LEAST_WALLS + SIGMAS * heading_sigma / step.max(1e-9);
        let mut walls = Self { expected: 0, confirmed: 0, least };
        let shortest = scan.range_min.unwrap_or(0.0);
        for i in (0..probes).map(|k| k * count / probes) {
            let (sin, cos) = sin_cos(heading + scan.angle_increment * i as f64);
            if rays.range(origin, (cos, sin), reach).is_some() {
                let beam = Beam::of(scan.ranges[i], shortest, scan.range_max);
                walls.expected += 1;
                walls.confirmed += usize::from(matches!(beam, Beam::Obstacle(_)));
            }
        }
        walls
    }
}

#[cfg(test)]
#[path = "sight_tests.rs"]
mod tests;
