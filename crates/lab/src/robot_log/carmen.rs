//! Logs of the Carmen robot navigation toolkit, in which most published recordings of planar lasers are kept: lines of
//! words, of which `ODOM`, `FLASER`, `ROBOTLASER1`, `NEFF` and two `PARAM` are read.

use curionav_planning::geometry::Pose2;
use curionav_planning::sensor::LaserModel;

use super::{Clock, Faults, Log, Reading, is_near};

/// What the log does not say.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scanner {
    /// Ranges beyond count as nothing met, metres.
    pub(crate) range_max: f64,
    /// Where the laser sits on the robot, if not as the log says.
    pub(crate) robot_from_laser: Option<Pose2>,
}

/// A pose that a log gives differs from odometry if it is anywhere this far off, metres and radians: less is what
/// happens between two lines.
const DIFFERS: f64 = 0.3;
/// A log whose scans are newer than the one before less often than this has no clock.
const CLOCK_SHARE: f64 = 0.9;

/// A line of interest.
enum Line {
    Odometry(TimedPose),
    Scan(ScanLine),
    /// How far ahead of the robot's centre the laser sits, metres.
    Offset(f64),
    /// What GMapping writes below each scan: how many particles its own are worth.
    EffectiveSize,
    Other,
}

struct TimedPose {
    stamp: f64,
    pose: Pose2,
}

struct ScanLine {
    stamp: f64,
    ranges: Vec<f32>,
    laser: LaserModel,
    /// The robot's or, if `odometry` is there, perhaps a corrected one.
    pose: Pose2,
    odometry: Option<Pose2>,
    /// The odometry line that follows the scan before and comes last before this one.
    driven_to: Option<Pose2>,
}

/// What a log says, in the order of its lines.
#[derive(Default)]
struct Lines {
    odometry: Vec<TimedPose>,
    scans: Vec<ScanLine>,
    is_of_gmapping: bool,
}

/// Reads a log. Lines that cannot be read are left out and counted.
///
/// # Errors
/// If it has no scan, or fewer lines of interest that can be read than ones that cannot.
pub(crate) fn parse(text: &str, scanner: Scanner) -> anyhow::Result<Log> {
    let mut faults = Faults::default();
    let mut lines = Lines::default();
    let mut clock = Clock::default();
    let mut driven_to = None;
    let mut offset = 0.0;
    for (number, line) in text.lines().enumerate() {
        match read(line, scanner) {
            // GMapping repeats a scan's pose as odometry, without a time.
            Ok(Line::Odometry(repeated)) if lines.ends_with_scan_at(repeated.pose) => {}
            Ok(Line::Odometry(mut odometry)) => {
                driven_to = Some(odometry.pose);
                odometry.stamp = clock.time(odometry.stamp);
                lines.odometry.push(odometry);
            }
            Ok(Line::Scan(mut scan)) => {
                if scanner.robot_from_laser.is_none() && scan.laser.robot_from_laser.x == 0.0 {
                    scan.laser.robot_from_laser.x = offset;
                }
                scan.stamp = clock.time(scan.stamp);
                scan.driven_to = driven_to.take();
                lines.scans.push(scan);
            }
            Ok(Line::Offset(ahead)) => offset = ahead,
            Ok(Line::EffectiveSize) => lines.is_of_gmapping = true,
            Ok(Line::Other) => {}
            Err(why) => {
                faults.broken_lines += 1;
                faults.first_broken.get_or_insert_with(|| format!("line {}: {why}", number + 1));
            }
        }
    }
    let first = faults.first_broken.as_deref().unwrap_or("no line begins with FLASER or ROBOTLASER1");
    anyhow::ensure!(!lines.scans.is_empty(), "it has no scan that can be read ({first})");
    let good = lines.scans.len() + lines.odometry.len();
    anyhow::ensure!(faults.broken_lines <= good, "most of its lines cannot be read ({first})");
    if lines.is_of_gmapping {
        return Ok(Log::of(lines.of_gmapping(&mut faults), faults));
    }
    faults.clock_set_back = clock.set_back;
    Ok(Log::of(lines.of_carmen(), faults))
}

impl Lines {
    fn ends_with_scan_at(&self, pose: Pose2) -> bool {
        self.scans.last().is_some_and(|scan| scan.pose == pose)
    }

    /// Odometry as it stands with the scans, or as the lines around them tell. The poses of the scans are references,
    /// unless they move as odometry does all along.
    fn of_carmen(mut self) -> Vec<Reading> {
        self.odometry.sort_by(|a, b| a.stamp.total_cmp(&b.stamp));
        let odometry = self.odometry;
        let readings = self.scans.into_iter().map(|scan| {
            let own = scan.odometry.or_else(|| between(&odometry, scan.stamp)).unwrap_or(scan.pose);
            scan.reading(own)
        });
        let mut readings: Vec<Reading> = readings.collect();
        let start = (readings[0].odometry, readings[0].reference.unwrap_or_default());
        let corrected = readings.iter().any(|reading| {
            let by_pose = reading.reference.map(|pose| start.1.relative(pose));
            by_pose.is_some_and(|moved| !is_near(start.0.relative(reading.odometry), moved, DIFFERS))
        });
        if !corrected {
            readings.iter_mut().for_each(|reading| reading.reference = None);
        }
        readings
    }

    /// GMapping writes its own pose in place of odometry with each scan, and carries on from there with the increments
    /// of odometry. So these are what lies between a scan's pose and the last line of odometry before the next scan.
    fn of_gmapping(self, faults: &mut Faults) -> Vec<Reading> {
        let stamps: Vec<f64> = self.scans.iter().map(|scan| scan.stamp).collect();
        let newer = stamps.windows(2).filter(|pair| pair[1] > pair[0]).count();
        faults.without_clock = (newer as f64) < CLOCK_SHARE * (stamps.len() - 1) as f64;
        let mut last: Option<Pose2> = None;
        let mut odometry = Pose2::default();
        let mut readings = Vec::with_capacity(self.scans.len());
        for (number, mut scan) in self.scans.into_iter().enumerate() {
            odometry = match last.zip(scan.driven_to) {
                Some((last, driven_to)) => odometry.compose(last.relative(driven_to)),
                None => odometry,
            };
            last = Some(scan.pose);
            if faults.without_clock {
                scan.stamp = number as f64;
            }
            readings.push(scan.reading(odometry));
        }
        readings
    }
}

impl ScanLine {
    fn reading(self, odometry: Pose2) -> Reading {
        let Self { stamp, ranges, laser, pose, .. } = self;
        Reading { stamp, ranges, laser, odometry, reference: Some(pose) }
    }
}

/// Odometry at `stamp`, between the lines around it.
fn between(odometry: &[TimedPose], stamp: f64) -> Option<Pose2> {
    let next = odometry.partition_point(|line| line.stamp < stamp);
    let after = odometry.get(next);
    let before = next.checked_sub(1).map(|at| &odometry[at]);
    match (before, after) {
        // Across a restart there is nothing in between.
        (Some(a), Some(b)) if b.stamp > a.stamp && is_near(a.pose, b.pose, 1.0) => {
            Some(a.pose.toward(b.pose, (stamp - a.stamp) / (b.stamp - a.stamp)))
        }
        (Some(line), _) | (None, Some(line)) => Some(line.pose),
        (None, None) => None,
    }
}

/// The words of a line, taken one by one.
struct Words<'a>(std::str::SplitAsciiWhitespace<'a>);

impl Words<'_> {
    fn number(&mut self, what: &str) -> Result<f64, String> {
        let word = self.0.next().ok_or_else(|| format!("it ends before {what}"))?;
        let number: f64 = word.parse().map_err(|_| format!("{what} is no number: {word:.40}"))?;
        if number.is_finite() { Ok(number) } else { Err(format!("{what} is {word:.40}")) }
    }

    fn pose(&mut self, what: &str) -> Result<Pose2, String> {
        Ok(Pose2::new(self.number(what)?, self.number(what)?, self.number(what)?))
    }

    fn count(&mut self, what: &str, most: f64) -> Result<usize, String> {
        let number = self.number(what)?;
        if number.fract() == 0.0 && (0.0..=most).contains(&number) {
            Ok(number as usize)
        } else {
            Err(format!("{what} is {number}; it must be a whole number up to {most}"))
        }
    }

    /// So many ranges; one that is no number, 0 or negative says nothing.
    fn ranges(&mut self) -> Result<Vec<f32>, String> {
        let count = self.count("the number of readings", 8192.0)?;
        if count < 2 {
            return Err(format!("a scan of {count} readings has no spacing"));
        }
        let range = |word: &str| word.parse::<f32>().ok().filter(|range| *range > 0.0).unwrap_or(f32::NAN);
        let ranges: Vec<f32> = self.0.by_ref().take(count).map(range).collect();
        if ranges.len() == count { Ok(ranges) } else { Err("it ends within the ranges".into()) }
    }
}

fn read(line: &str, scanner: Scanner) -> Result<Line, String> {
    let mut words = Words(line.split_ascii_whitespace());
    match words.0.next() {
        Some("ODOM") => {
            let pose = words.pose("the pose")?;
            for what in ["the speed", "the turn rate", "the acceleration"] {
                words.number(what)?;
            }
            Ok(Line::Odometry(TimedPose { stamp: words.number("the time")?, pose }))
        }
        Some("FLASER") => {
            let ranges = words.ranges()?;
            let pose = words.pose("the pose")?;
            let odometry = words.pose("odometry")?;
            let stamp = words.number("the time")?;
            // Half a turn: 180 readings are the first 180 of 181.
            let gaps = ranges.len() - ranges.len() % 2;
            let step = std::f64::consts::PI / if gaps == 0 { 1.0 } else { gaps as f64 };
            let laser = laser(ranges.len(), -std::f64::consts::FRAC_PI_2, step, Pose2::default(), scanner)?;
            Ok(Line::Scan(ScanLine { stamp, ranges, laser, pose, odometry: Some(odometry), driven_to: None }))
        }
        Some("ROBOTLASER1") => {
            words.number("the type")?;
            let start = words.number("the start")?;
            let _ = words.number("the field of view")?;
            let step = words.number("the resolution")?;
            let (most, ..) = (
                words.number("the greatest range")?,
                words.number("the accuracy")?,
                words.number("the mode")?,
            );
            let ranges = words.ranges()?;
            for _ in 0..words.count("the number of remissions", 8192.0)? {
                words.0.next();
            }
            let on_map = words.pose("the laser's pose")?;
            let pose = words.pose("the robot's pose")?;
            for what in ["the speed", "the turn rate", "a distance", "a distance", "the axis"] {
                words.number(what)?;
            }
            let stamp = words.number("the time")?;
            let scanner = Scanner { range_max: scanner.range_max.min(most.max(0.1)), ..scanner };
            let laser = laser(ranges.len(), start, step, pose.relative(on_map), scanner)?;
            Ok(Line::Scan(ScanLine { stamp, ranges, laser, pose, odometry: None, driven_to: None }))
        }
        Some("PARAM") => match words.0.next() {
            Some("robot_frontlaser_offset" | "robot_front_laser_offset") => {
                Ok(Line::Offset(words.number("the laser's offset")?))
            }
            _ => Ok(Line::Other),
        },
        Some("NEFF") => Ok(Line::EffectiveSize),
        _ => Ok(Line::Other),
    }
}

/// A scanner whose first of `count` beams is at `start` and the next `step` further, radians, `on_robot`.
fn laser(
    count: usize,
    start: f64,
    step: f64,
    on_robot: Pose2,
    scanner: Scanner,
) -> Result<LaserModel, String> {
    let fov = step * (count - 1) as f64;
    if !(0.01..=std::f64::consts::TAU).contains(&fov) {
        return Err(format!("its {count} readings cover {fov} rad"));
    }
    // Ours has its first beam at -fov/2.
    let turn = Pose2::new(0.0, 0.0, start + 0.5 * fov);
    let robot_from_laser = scanner.robot_from_laser.unwrap_or(on_robot).compose(turn);
    let laser = LaserModel {
        robot_from_laser,
        fov,
        beams: count as u32,
        range_max: scanner.range_max,
        ..LaserModel::default()
    };
    let sits = robot_from_laser.position().distance(Default::default()) <= 10.0;
    if sits { Ok(laser) } else { Err("its laser is more than 10 m from the robot".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCANNER: Scanner = Scanner { range_max: 30.0, robot_from_laser: None };

    fn ranges(count: usize) -> String {
        let mut text = count.to_string();
        (0..count).for_each(|i| text += &format!(" {}", 1.0 + 0.01 * i as f64));
        text
    }

    #[test]
    fn a_front_laser_looks_forwards_and_its_poses_are_told_apart() {
        let line = |x: f64, stamp: f64| {
            format!("FLASER {} {} 2 0.5 {x} 0 0 {stamp} host {stamp}\n", ranges(181), x + 10.0)
        };
        let log = parse(&(line(0.0, 1.0) + &line(0.1, 1.2)), SCANNER).unwrap();
        let reading = &log.readings[1];
        assert_eq!((reading.odometry, reading.reference), (Pose2::new(0.1, 0.0, 0.0), None));
        assert!((reading.laser.fov - std::f64::consts::PI).abs() < 1e-12);
        assert!(reading.laser.robot_from_laser.heading.abs() < 1e-12 && reading.laser.beams == 181);
        // A corrected pose that drifts away from odometry is a reference.
        let corrected = |x: f64, y: f64, stamp: f64| {
            format!("FLASER {} {x} {y} 0 {x} 0 0 {stamp} host {stamp}\n", ranges(180))
        };
        let log = parse(&(corrected(0.0, 0.0, 1.0) + &corrected(1.0, 0.5, 2.0)), SCANNER).unwrap();
        assert_eq!(log.readings[1].reference, Some(Pose2::new(1.0, 0.5, 0.0)));
        // Of 180 readings the last is at 89 degrees.
        let laser = log.readings[0].laser;
        let last = laser.robot_from_laser.heading + laser.bearing(179);
        assert!((last.to_degrees() - 89.0).abs() < 1e-9, "{last}");
    }

    #[test]
    fn a_new_style_line_says_where_its_laser_sits_and_odometry_is_between_its_lines() {
        let robotlaser = |stamp: f64| {
            format!(
                "ROBOTLASER1 0 -1.5 3.0 0.01 20.0 0.01 0 {} 2 7 7 5.1 1 0 5 1 0 0.4 0 0 0 1e6 {stamp} host {stamp}\n",
                ranges(301)
            )
        };
        let text = "ODOM 0 0 0 0.4 0 0 1.0 h 1.0\n".to_owned()
            + &robotlaser(1.1)
            + "ODOM 0.2 0 0 0.4 0 0 1.2 h 1.2\n"
            + &robotlaser(1.25);
        let log = parse(&text, SCANNER).unwrap();
        let reading = &log.readings[0];
        assert!((reading.laser.robot_from_laser.x - 0.1).abs() < 1e-12 && reading.laser.range_max == 20.0);
        assert!((reading.laser.bearing(0) + 1.5).abs() < 1e-12 && reading.ranges.len() == 301);
        assert!((reading.odometry.x - 0.1).abs() < 1e-12);
        // Both at (5, 1): no line says that it is anything but odometry in another frame.
        assert_eq!(log.readings.len(), 2);
    }

    #[test]
    fn odometry_of_gmapping_is_what_it_drove_between_its_own_poses() {
        // It drives 1 m ahead by odometry, and GMapping puts it 0.9 m ahead and 0.1 m to the left each time.
        let scan = |x: f64, y: f64| format!("FLASER {} {x} {y} 0 {x} {y} 0 5e8 h 5e8\n", ranges(180));
        let text: String = (0..4)
            .map(|k| {
                let x = 0.9 * f64::from(k);
                let y = 0.1 * f64::from(k);
                let before = y - 0.1;
                let driven = |x: f64| format!("ODOM {x} {before} 0 0 0 0 5e8 h 5e8\n");
                driven(x - 0.5)
                    + &driven(x + 0.1)
                    + &scan(x, y)
                    + &format!("ODOM {x} {y} 0 0 0 0 0 h 0\nNEFF 20\n")
            })
            .collect();
        let log = parse(&text, SCANNER).unwrap();
        let odometry: Vec<Pose2> = log.readings.iter().map(|reading| reading.odometry).collect();
        for (k, pose) in odometry.iter().enumerate() {
            let expected = Pose2::new(k as f64, 0.0, 0.0);
            assert!(is_near(*pose, expected, 1e-9), "{k}: {pose:?}");
        }
        assert_eq!(log.readings[3].reference, Some(Pose2::new(0.9 * 3.0, 0.1 * 3.0, 0.0)));
        assert!(log.faults.without_clock && log.readings[3].stamp == 3.0);
    }

    #[test]
    fn broken_lines_are_left_out_and_the_first_is_told() {
        let good = |stamp: f64| format!("FLASER {} 0 0 0 0 0 0 {stamp} h {stamp}\n", ranges(3));
        let text = "# comment\nPARAM robot_frontlaser_offset 0.2\n".to_owned()
            + &good(1.0)
            + "FLASER 3 1.0 2.0\nODOM a 0 0 0 0 0 1 h 1\n"
            + &good(1.2)
            + "FLASER 99999999 1 1\nFLASER 3 1 1 1 nan 0 0 0 0 0 1.4 h 1.4\n"
            + &good(1.6)
            + &good(1.8)
            + "FLASER 3 1.0";
        let log = parse(&text, SCANNER);
        assert!(log.unwrap_err().to_string().contains("most of its lines"), "5 broken of 9");
        let log = parse(&(text + "\n" + &good(2.0) + "RLASER 1 2 3\n"), SCANNER).unwrap();
        assert_eq!((log.readings.len(), log.faults.broken_lines), (5, 5));
        assert_eq!(log.faults.first_broken.as_deref(), Some("line 4: it ends within the ranges"));
        assert_eq!(log.readings[0].laser.robot_from_laser.x, 0.2);
    }

    #[test]
    fn a_file_of_something_else_is_refused() {
        for text in
            ["", "hello\nworld", "{\"a\": 1}", "ODOM 0 0 0 0 0 0 1 h 1\n", "FLASER 1 1.0 0 0 0 0 0 0 1 h 1\n"]
        {
            assert!(parse(text, SCANNER).is_err(), "{text}");
        }
    }
}
