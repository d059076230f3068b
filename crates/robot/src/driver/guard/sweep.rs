//! A scan as the guard keeps it: in the frame of the odometry, with one array for each quantity.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use curionav_mission::convert;
use curionav_planning::beam::Beam;
use curionav_planning::geometry::{Direction, Facing, Point2, Pose2, wrap_angle};
use curionav_planning::numerics::sin_cos;
use curionav_schemas::Scan;

/// On either side of a point, beams that end within this distance of it along a surface are averaged, metres.
const SMOOTHED_ALONG: f64 = 0.05;
/// Averaged are beams whose ranges differ by less than this, metres: three deviations of the noise of a usual laser.
const SMOOTHED_ACROSS: f64 = 0.1;

/// Directions of the beams in the laser's frame, which are computed anew only when a scan has others, and the ranges of
/// the newest scan.
#[derive(Debug, Default)]
pub(super) struct Bearings {
    angle_min: f64,
    increment: f64,
    cos: Vec<f64>,
    sin: Vec<f64>,
    /// How far away each beam has met something, metres; not a number where it has not.
    hits: Vec<f64>,
}

impl Bearings {
    /// Makes room for the ranges of a scan, and takes over its directions.
    fn take(&mut self, scan: &Scan) {
        self.hits.clear();
        let beams = scan.ranges.len();
        let same = self.angle_min == scan.angle_min && self.increment == scan.angle_increment;
        if !(same && self.cos.len() == beams) {
            self.angle_min = scan.angle_min;
            self.increment = scan.angle_increment;
            self.cos.clear();
            self.sin.clear();
            for i in 0..beams {
                let (sin, cos) = sin_cos(scan.angle_min + scan.angle_increment * i as f64);
                self.cos.push(cos);
                self.sin.push(sin);
            }
        }
    }

    /// Range of a beam as the mean of those around it that have met the same surface, metres. Beams are taken in pairs,
    /// one on each side, so that a surface which is seen at a slant stays where it is. Near by, where a few centimetres
    /// decide, many beams meet a hand's breadth, and their noise goes down with the root of their number.
    fn smoothed(&self, beam: usize) -> f64 {
        let hit = self.hits[beam];
        let most = (SMOOTHED_ALONG / (hit * self.increment.abs()).max(1e-3)) as usize;
        let mut sum = hit;
        let mut count = 1.0;
        for apart in 1..=most {
            let Some(before) = beam.checked_sub(apart).map(|other| self.hits[other]) else { break };
            let Some(behind) = self.hits.get(beam + apart) else { break };
            // A beam that has met nothing is not near either.
            let is_near = |other: f64| (other - hit).abs() < SMOOTHED_ACROSS;
            if !(is_near(before) && is_near(*behind)) {
                break;
            }
            sum += before + behind;
            count += 2.0;
        }
        sum / count
    }
}

/// One scan, beam by beam.
#[derive(Debug, Clone)]
pub(super) struct Sweep {
    /// When it was taken, seconds of the robot's clock.
    pub(super) stamp: f64,
    /// The laser then, in the odometry's frame.
    pub(super) laser: Facing,
    angle_min: f64,
    /// Angle from one beam to the next, radians.
    pub(super) increment: f64,
    /// How far each beam has seen free floor, metres; not a number where it says nothing.
    pub(super) free: Vec<f64>,
    /// Where it has met something, in the odometry's frame; not a number where it has not.
    pub(super) x: Vec<f64>,
    /// The other coordinate.
    pub(super) y: Vec<f64>,
    /// The same by the mean of the beams around it ([`Bearings::smoothed`]): where something stands.
    pub(super) smooth_x: Vec<f64>,
    /// The other coordinate.
    pub(super) smooth_y: Vec<f64>,
}

impl Default for Sweep {
    fn default() -> Self {
        Self {
            stamp: f64::NEG_INFINITY,
            laser: Pose2::default().into(),
            angle_min: 0.0,
            increment: 0.0,
            free: Vec::new(),
            x: Vec::new(),
            y: Vec::new(),
            smooth_x: Vec::new(),
            smooth_y: Vec::new(),
        }
    }
}

impl Sweep {
    /// Takes in a scan of a robot that was at `robot` of the odometry's frame.
    pub(super) fn take(&mut self, scan: &Scan, robot: Pose2, bearings: &mut Bearings) {
        bearings.take(scan);
        let on_robot = convert::pose(scan.laser);
        self.stamp = scan.stamp;
        self.laser = robot.compose(on_robot).into();
        self.angle_min = wrap_angle(scan.angle_min);
        self.increment = scan.angle_increment;
        self.free.clear();
        for of in [&mut self.x, &mut self.y, &mut self.smooth_x, &mut self.smooth_y] {
            of.clear();
        }
        let Facing { pose, direction } = self.laser;
        for beam in convert::beams(scan) {
            let (free, hit) = match beam {
                Beam::Obstacle(metres) => (metres, metres),
                Beam::Free(metres) => (metres, f64::NAN),
                Beam::Silent => (f64::NAN, f64::NAN),
            };
            self.free.push(free);
            bearings.hits.push(hit);
        }
        for (i, hit) in bearings.hits.iter().enumerate() {
            let smooth = bearings.smoothed(i);
            let x = direction.cos * bearings.cos[i] - direction.sin * bearings.sin[i];
            let y = direction.sin * bearings.cos[i] + direction.cos * bearings.sin[i];
            self.x.push(pose.x + hit * x);
            self.y.push(pose.y + hit * y);
            self.smooth_x.push(pose.x + smooth * x);
            self.smooth_y.push(pose.y + smooth * y);
        }
    }

    /// Where beams have met something, as it is or `smooth`; not numbers where they have not.
    pub(super) fn points(&self, smooth: bool) -> impl Iterator<Item = (&f64, &f64)> {
        let (x, y) = if smooth { (&self.smooth_x, &self.smooth_y) } else { (&self.x, &self.y) };
        x.iter().zip(y)
    }

    /// Whether this beam has met something.
    pub(super) fn is_hit(&self, beam: usize) -> bool {
        !self.x[beam].is_nan()
    }

    /// Distance from the laser to a point of the odometry's frame, and the place of its direction among the beams; no
    /// place where the laser does not look.
    pub(super) fn locate(&self, x: f64, y: f64) -> (f64, Option<f64>) {
        let Facing { pose, direction } = self.laser;
        let (ahead, left) = Direction::ahead_and_left(direction, pose.position(), Point2::new(x, y));
        let range = (ahead * ahead + left * left).sqrt();
        let step = self.increment.abs();
        if step == 0.0 {
            return (range, None);
        }
        let turned = (bearing(ahead, left) - self.angle_min) * self.increment.signum();
        let place = if turned < 0.0 { turned + TAU } else { turned } / step;
        // Half a beam beyond either end is still seen.
        let around = TAU / step;
        let place = if place > around - 0.5 { place - around } else { place };
        (range, (place <= self.free.len() as f64 - 0.5).then_some(place))
    }

    /// The nearest and farthest that beams around this place have seen, metres; none if they say nothing.
    pub(super) fn seen_around(&self, place: f64) -> Option<(f64, f64)> {
        let first = place.floor() - 1.0;
        let (nearest, farthest) = match self.free.get(first.max(0.0) as usize..first.max(0.0) as usize + 4) {
            Some(inside) if first >= 0.0 => range_of(inside.iter().copied()),
            _ => range_of(self.beams(first, first + 3.0).map(|beam| self.free[beam])),
        };
        (nearest <= farthest).then_some((nearest, farthest))
    }

    /// The beams between two places; those of a laser that looks all around go on over its ends.
    pub(super) fn beams(&self, first: f64, last: f64) -> impl Iterator<Item = usize> {
        let count = self.free.len() as isize;
        let around = count as f64 * self.increment.abs() > TAU - 1.5 * self.increment.abs();
        let first = first.floor() as isize;
        let last = (last.floor() as isize).min(first + count - 1);
        (first..=last).filter_map(move |beam| match beam {
            _ if (0..count).contains(&beam) => Some(beam as usize),
            _ if around => Some(beam.rem_euclid(count) as usize),
            _ => None,
        })
    }
}

/// The least and the greatest of some numbers; what is not a number counts as neither.
fn range_of(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), number| {
        (if number < least { number } else { least }, if number > most { number } else { most })
    })
}

/// Direction of a point, radians, to 2e-5: far finer than beams are. Abramowitz and Stegun, 4.4.49, in half of the time
/// of the exact one.
fn bearing(ahead: f64, left: f64) -> f64 {
    let most = ahead.abs().max(left.abs());
    if most == 0.0 {
        return 0.0;
    }
    let z = ahead.abs().min(left.abs()) / most;
    let square = z * z;
    let series = -0.330_299_5 + square * (0.180_141 + square * (-0.085_133 + square * 0.020_835_1));
    let octant = z * (0.999_866 + square * series);
    let quadrant = if left.abs() > ahead.abs() { FRAC_PI_2 - octant } else { octant };
    let half = if ahead < 0.0 { PI - quadrant } else { quadrant };
    if left < 0.0 { -half } else { half }
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_schemas::{F32Array, Pose};

    fn scan(angle_min: f64, increment: f64, ranges: Vec<f32>) -> Scan {
        Scan {
            tick: 0,
            stamp: 1.0,
            angle_min,
            angle_increment: increment,
            range_min: None,
            range_max: 5.0,
            laser: Pose { x: 0.1, y: 0.0, heading: 0.0 },
            ranges: F32Array::from(ranges),
        }
    }

    #[test]
    fn every_point_lies_at_the_place_of_its_beam_whichever_way_the_laser_turns() {
        let degree = std::f64::consts::PI / 180.0;
        for (angle_min, increment, beams) in
            [(-90.0, 1.0, 181), (90.0, -1.0, 181), (0.0, 1.0, 360), (180.0, -1.0, 360), (10.0, 0.5, 40)]
        {
            let mut sweep = Sweep::default();
            let ranges = (0..beams).map(|i| 1.0 + i as f32 / 512.0).collect();
            let scan = scan(angle_min * degree, increment * degree, ranges);
            sweep.take(&scan, Pose2::new(3.0, -1.0, 2.0), &mut Bearings::default());
            for beam in 0..beams {
                let (range, place) = sweep.locate(sweep.x[beam], sweep.y[beam]);
                assert!((range - sweep.free[beam]).abs() < 1e-9);
                assert!((place.unwrap() - beam as f64).abs() < 0.01, "beam {beam}: {place:?}");
            }
        }
    }

    #[test]
    fn a_laser_that_looks_all_around_has_no_ends() {
        let mut sweep = Sweep::default();
        let ranges = (0..360).map(|i| if i == 359 { 1.0 } else { 3.0 }).collect();
        let degree = std::f64::consts::PI / 180.0;
        sweep.take(&scan(0.0, degree, ranges), Pose2::default(), &mut Bearings::default());
        assert_eq!(sweep.seen_around(0.3), Some((1.0, 3.0)));
        assert_eq!(sweep.beams(358.5, 361.5).collect::<Vec<_>>(), [358, 359, 0, 1]);
        let ranges = vec![3.0; 100];
        sweep.take(&scan(0.0, degree, ranges), Pose2::default(), &mut Bearings::default());
        assert_eq!(sweep.beams(-1.0, 1.0).collect::<Vec<_>>(), [0, 1]);
    }

    #[test]
    fn a_bearing_is_that_of_the_exact_function() {
        for k in 0..1000 {
            let angle = wrap_angle(TAU * f64::from(k) / 1000.0);
            let found = bearing(3.0 * angle.cos(), 3.0 * angle.sin());
            assert!(wrap_angle(found - angle).abs() < 2e-5, "{angle}: {found}");
        }
        assert_eq!(bearing(0.0, 0.0), 0.0);
    }

    #[test]
    fn what_says_nothing_is_neither_free_nor_in_the_way() {
        let mut sweep = Sweep::default();
        let ranges = vec![2.0, f32::NAN, 5.0, 1.0];
        sweep.take(&scan(0.0, 0.1, ranges), Pose2::default(), &mut Bearings::default());
        let hits: Vec<bool> = (0..4).map(|beam| sweep.is_hit(beam)).collect();
        assert_eq!(hits, [true, false, false, true]);
        assert!(sweep.free[1].is_nan() && sweep.free[2] == 5.0);
        assert_eq!(sweep.seen_around(1.0), Some((1.0, 5.0)));
        assert_eq!(sweep.locate(-1.0, 0.0).1, None, "the laser does not look back");
    }
}
