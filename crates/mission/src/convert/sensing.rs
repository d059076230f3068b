//! What a laser saw.

use std::borrow::Cow;

use curionav_planning::beam::Beam;
use curionav_planning::geometry::Pose2;
use curionav_planning::sensor::LaserModel;
use curionav_schemas::{Reject, Scan};

use super::{checked, pose, pose_to_wire};

/// The ranges of a scan in order of rising bearing, and the scanner as the scan describes it, with noise of
/// `range_sigma` metres. If the first and the last beam of a full turn look the same way, one of them is left out.
/// What is nearer than the least range is there, as [`Beam`] says.
///
/// # Errors
/// If the scan describes no scanner.
pub fn scan(scan: &Scan, range_sigma: f64) -> Result<(Cow<'_, [f32]>, LaserModel), Reject> {
    const SLACK: f64 = 1e-6;
    let turn = std::f64::consts::TAU;
    let gap = scan.angle_increment.abs();
    let count = scan.ranges.len().min(((turn + SLACK) / gap) as usize);
    let beams = count as u32;
    let last = count.saturating_sub(1) as f64;
    let fov = if gap * f64::from(beams) > turn - SLACK { turn } else { gap * last };
    let clockwise = scan.angle_increment < 0.0;
    let mut ranges = match &scan.ranges[..count] {
        ranges if clockwise => ranges.iter().rev().copied().collect(),
        ranges => Cow::Borrowed(ranges),
    };
    if let Some(least) = scan.range_min.filter(|least| *least > 0.0) {
        ranges.to_mut().iter_mut().for_each(|range| *range = Beam::of(*range, least, scan.range_max).range());
    }
    let first = if clockwise { scan.angle_min - gap * last } else { scan.angle_min };
    // The model's beams lie evenly on both sides of its heading; those of the scan need not.
    let middle = first + 0.5 * fov;
    let mut robot_from_laser = pose(scan.laser);
    if middle.abs() > 1e-9 {
        robot_from_laser = robot_from_laser.compose(Pose2::new(0.0, 0.0, middle));
    }
    let laser = LaserModel { robot_from_laser, fov, beams, range_max: scan.range_max, range_sigma };
    Ok((ranges, checked("scan", laser)?))
}

/// What each beam of a scan says, in their order.
pub fn beams(scan: &Scan) -> impl Iterator<Item = Beam> {
    let least = scan.range_min.unwrap_or(0.0);
    scan.ranges.iter().map(move |range| Beam::of(*range, least, scan.range_max))
}

/// What a scanner like `laser` has measured: a range for each of its beams, metres.
pub fn scan_to_wire(laser: &LaserModel, ranges: Vec<f32>, tick: u64, stamp: f64) -> Scan {
    Scan {
        tick,
        stamp,
        angle_min: laser.bearing(0),
        angle_increment: laser.bearing(1) - laser.bearing(0),
        range_min: None,
        range_max: laser.range_max,
        laser: pose_to_wire(laser.robot_from_laser),
        ranges: ranges.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_planning::geometry::wrap_angle;
    use curionav_schemas as wire;

    /// Ranges that tell the beams apart.
    fn swept(angle_min: f64, angle_increment: f64, beams: u16) -> Scan {
        let ranges = (0..beams).map(|i| 1.0 + f32::from(i) / 1024.0).collect();
        let laser = wire::Pose { x: 0.1, y: 0.0, heading: 0.0 };
        let range_min = None;
        Scan { tick: 0, stamp: 0.0, angle_min, angle_increment, range_min, range_max: 20.0, laser, ranges }
    }

    #[test]
    fn a_scan_that_is_no_scan_is_refused() {
        let refused = |scan: &Scan| super::scan(scan, 0.03).is_err();
        assert!(refused(&swept(0.0, 0.01, 1)));
        assert!(refused(&swept(0.0, 0.0, 100)));
        assert!(refused(&Scan { range_max: 1e12, ..swept(-0.5, 0.01, 101) }));
    }

    #[test]
    fn what_is_too_near_to_be_measured_is_there() {
        let mut scan = Scan { range_min: Some(0.2), ..swept(-1.0, 0.5, 5) };
        scan.ranges = vec![f32::NAN, 0.0, 0.05, 1.5, 25.0].into();
        let (ranges, _) = super::scan(&scan, 0.03).unwrap();
        assert!(ranges[0].is_nan() && ranges[1].is_nan());
        assert_eq!(ranges[2..], [0.2, 1.5, 20.0]);
    }

    #[test]
    fn what_a_scanner_measured_is_read_as_it_was_written() {
        let mounted = LaserModel { robot_from_laser: Pose2::new(0.2, -0.1, 0.3), ..LaserModel::default() };
        let around = LaserModel { fov: std::f64::consts::TAU, beams: 360, ..mounted };
        for laser in [mounted, around] {
            let ranges: Vec<f32> = (0..laser.beams).map(|i| 0.01 * i as f32).collect();
            let sent = scan_to_wire(&laser, ranges.clone(), 7, 0.7);
            let (read, found) = scan(&sent, laser.range_sigma).unwrap();
            assert_eq!((&*read, sent.tick, sent.stamp), (&ranges[..], 7, 0.7));
            assert_eq!((found.beams, found.range_max), (laser.beams, laser.range_max));
            assert!((found.fov - laser.fov).abs() < 1e-9, "{found:?}");
            let aims = |l: &LaserModel| l.robot_from_laser.compose(Pose2::new(0.0, 0.0, l.bearing(0)));
            assert!((aims(&found).heading - aims(&laser).heading).abs() < 1e-9, "{found:?}");
            assert_eq!(found.robot_from_laser.position(), laser.robot_from_laser.position());
        }
    }

    #[test]
    fn beams_point_where_the_scan_says() {
        let degree = std::f64::consts::PI / 180.0;
        // To one side, clockwise, all around, all around and the first beam once more, mounted backwards.
        let scans = [
            (swept(0.2, 0.01, 101), 101),
            (swept(0.5, -0.01, 101), 101),
            (swept(0.0, degree, 360), 360),
            (swept(-180.0 * degree, degree, 361), 360),
            (swept(180.0 * degree, -degree, 361), 360),
            (
                Scan {
                    laser: wire::Pose { x: 0.0, y: 0.0, heading: std::f64::consts::PI },
                    ..swept(0.0, degree, 360)
                },
                360,
            ),
        ];
        for (scan, beams) in scans {
            let (ranges, laser) = super::scan(&scan, 0.03).unwrap();
            assert_eq!((ranges.len(), laser.beams), (beams, beams as u32));
            for (i, range) in ranges.iter().enumerate() {
                // The beam of the scan that has this range.
                let k = f64::from((range - 1.0) * 1024.0);
                let said = scan.laser.heading + scan.angle_min + scan.angle_increment * k;
                let taken = laser.robot_from_laser.heading + laser.bearing(i as u32);
                assert!(wrap_angle(said - taken).abs() < 1e-9, "{scan:?}: beam {i}");
            }
        }
    }
}
