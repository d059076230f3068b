//! How what the scan shows moves: by comparing it with two earlier scans, moved by odometry.
//!
//! A point that lies where an earlier beam went through has come there since. How fast and from where, the nearest
//! point of that scan says. A point behind what an earlier beam had met was hidden, and nothing is known of it.

use curionav_mission::guard_settings::GuardSettings;
use curionav_planning::geometry::Point2;
use curionav_planning::motion::OdometryNoise;

use super::sweep::Sweep;

/// Within this distance of the robot motion is looked for, metres. At 2 m/s towards 1.6 m/s it is 2.2 s ahead.
const FARTHEST: f64 = 8.0;
/// What noise of ranges and of the way a surface is cut by beams amounts to, metres: twice the deviation of 0.03 m of
/// a usual laser.
const NOISE: f64 = 0.06;
/// Standard deviations of odometry's error that count as its error. With fewer, a mistake lets all walls come at once.
const DRIFT_SIGMAS: f64 = 2.0;
/// Slower motion is not told from a mistake, m/s.
const SLOWEST: f64 = 0.15;
/// Neighbours on either side with which a point's comparison is averaged.
const NEIGHBOURS: usize = 2;
/// Points of one surface are no farther apart than this, metres, and this share of their range for each radian
/// between their beams: a wall that is seen at 10 degrees (Borges and Aldon, 2004).
const GAP: f64 = 0.1;
/// See [`GAP`].
const GAP_PER_RADIAN: f64 = 6.0;
/// At most this share of the range, for scans of few beams.
const GAP_SHARE_MAX: f64 = 0.6;
/// Over so many beams that say nothing a surface goes on.
const SILENT_MAX: usize = 3;

/// What moves, or may move: one array for each quantity. Positions are those of the newest scan.
#[derive(Debug, Default)]
pub(super) struct Movers {
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
    pub(super) vx: Vec<f64>,
    pub(super) vy: Vec<f64>,
    /// So many of them, the first, have been seen to move; of the rest nothing is known.
    pub(super) seen: usize,
}

impl Movers {
    pub(super) fn clear(&mut self) {
        self.x.clear();
        self.y.clear();
        self.vx.clear();
        self.vy.clear();
        self.seen = 0;
    }

    fn push(&mut self, at: Point2, velocity: Point2) {
        self.x.push(at.x);
        self.y.push(at.y);
        self.vx.push(velocity.x);
        self.vy.push(velocity.y);
    }
}

/// What is known of one point's motion.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Motion {
    /// No earlier beam looked there.
    Unknown,
    /// It was there.
    Still,
    /// It has come with this velocity, m/s.
    Moving(Point2),
    /// It has come, and no scan says from where.
    Appeared,
}

/// Buffers that are used again for each scan, with one entry for each beam.
#[derive(Debug, Default)]
pub(super) struct Approach {
    /// Number of the surface; 0 for beams that show none near by.
    surface: Vec<u32>,
    /// How far the point lies within what was free, metres; negative if it was hidden, not a number if not seen.
    entered: Vec<f64>,
    motion: Vec<Motion>,
}

impl Approach {
    /// Finds what moves in `now`, as compared with `earlier` scans, around a robot at `robot`. The last one is asked
    /// for surfaces of which the others know nothing.
    pub(super) fn find(
        &mut self,
        now: &Sweep,
        earlier: [Option<&Sweep>; 3],
        robot: Point2,
        settings: &GuardSettings,
        movers: &mut Movers,
    ) {
        self.part_into_surfaces(now);
        self.motion.clear();
        self.motion.resize(now.free.len(), Motion::Unknown);
        let [fast, slow, newest] = earlier;
        for then in [fast, slow].into_iter().flatten() {
            let comparison = Comparison::new(now, then, settings);
            self.judge(now, &comparison, robot);
        }
        self.spread();
        if let Some(then) = newest {
            self.ask_of_unknown(now, &Comparison::new(now, then, settings));
            self.spread();
        }
        self.list(now, robot, settings, movers);
    }

    /// Numbers the surfaces that neighbouring beams show.
    fn part_into_surfaces(&mut self, now: &Sweep) {
        self.surface.clear();
        let mut number = 0;
        let mut last: Option<usize> = None;
        for beam in 0..now.free.len() {
            if !now.is_hit(beam) || now.free[beam] > FARTHEST {
                if !now.free[beam].is_nan() {
                    last = None;
                }
                self.surface.push(0);
                continue;
            }
            if !last.is_some_and(|last| is_one_surface(now, last, beam)) {
                number += 1;
            }
            self.surface.push(number);
            last = Some(beam);
        }
    }

    /// Whether neighbouring beams show the same surface: what one or two beams show may be noise.
    fn has_company(&self, beam: usize) -> bool {
        self.neighbours(beam).count() > 2
    }

    /// The beams around this one that show the same surface, itself included.
    fn neighbours(&self, beam: usize) -> impl Iterator<Item = usize> {
        let first = beam.saturating_sub(NEIGHBOURS);
        let last = (beam + NEIGHBOURS).min(self.surface.len() - 1);
        let surface = self.surface[beam];
        (first..=last).filter(move |other| self.surface[*other] == surface)
    }

    /// Compares each point with what was seen there, and concludes how it moves.
    fn judge(&mut self, now: &Sweep, with: &Comparison<'_>, robot: Point2) {
        self.entered.clear();
        for beam in 0..now.free.len() {
            let entered =
                if self.surface[beam] == 0 { f64::NAN } else { with.entered(now.x[beam], now.y[beam]) };
            self.entered.push(entered);
        }
        for beam in (0..now.free.len()).filter(|beam| self.surface[*beam] != 0) {
            let at = Point2::new(now.x[beam], now.y[beam]);
            let found = self.conclude(beam, at, with);
            self.motion[beam] = nearer_to_danger(self.motion[beam], found, at, robot);
        }
    }

    /// As [`Self::judge`], for points of which nothing is known but what a newer scan says.
    fn ask_of_unknown(&mut self, now: &Sweep, with: &Comparison<'_>) {
        for beam in 0..now.free.len() {
            self.entered[beam] = f64::NAN;
            if self.motion[beam] == Motion::Unknown && self.surface[beam] != 0 {
                self.entered[beam] = with.entered(now.x[beam], now.y[beam]);
            }
        }
        for beam in 0..now.free.len() {
            if !self.entered[beam].is_nan() {
                let at = Point2::new(now.x[beam], now.y[beam]);
                let found = self.conclude(beam, at, with);
                if found != Motion::Unknown {
                    self.motion[beam] = found;
                }
            }
        }
    }

    /// How a point moves, from the mean of how far it and its neighbours lie within what was free.
    fn conclude(&self, beam: usize, at: Point2, with: &Comparison<'_>) -> Motion {
        let mut sum = 0.0;
        let mut count = 0.0;
        for entered in self.neighbours(beam).map(|other| self.entered[other]).filter(|e| !e.is_nan()) {
            sum += entered;
            count += 1.0;
        }
        let mean = sum / count;
        if mean > with.tolerance {
            with.velocity(at)
        } else if mean >= -with.tolerance {
            Motion::Still
        } else {
            // Hidden, or not looked at: the mean of nothing is not a number.
            Motion::Unknown
        }
    }

    /// Of one surface what is known holds for all: it moves as the nearest beam that knows.
    fn spread(&mut self) {
        for beam in 1..self.motion.len() {
            self.take_over(beam - 1, beam);
        }
        for beam in (1..self.motion.len()).rev() {
            self.take_over(beam, beam - 1);
        }
    }

    fn take_over(&mut self, from: usize, to: usize) {
        if self.motion[to] == Motion::Unknown && self.surface[from] == self.surface[to] {
            self.motion[to] = self.motion[from];
        }
    }

    fn list(&self, now: &Sweep, robot: Point2, settings: &GuardSettings, movers: &mut Movers) {
        movers.clear();
        let points =
            || (0..now.free.len()).filter(|beam| self.surface[*beam] != 0 && self.has_company(*beam));
        let at = |beam: usize| Point2::new(now.x[beam], now.y[beam]);
        for beam in points() {
            match self.motion[beam] {
                Motion::Moving(velocity) => movers.push(at(beam), velocity),
                Motion::Appeared => movers.push(at(beam), towards(at(beam), robot, settings.approach)),
                Motion::Still | Motion::Unknown => {}
            }
        }
        movers.seen = movers.x.len();
        for beam in points().filter(|beam| self.motion[*beam] == Motion::Unknown) {
            if at(beam).distance(robot) <= settings.unknown_within {
                movers.push(at(beam), towards(at(beam), robot, settings.approach));
            }
        }
    }
}

fn is_one_surface(now: &Sweep, last: usize, beam: usize) -> bool {
    let beams = beam - last;
    let apart = (GAP_PER_RADIAN * now.increment.abs() * beams as f64).min(GAP_SHARE_MAX);
    let gap = GAP + apart * now.free[last].min(now.free[beam]);
    let dx = now.x[beam] - now.x[last];
    let dy = now.y[beam] - now.y[last];
    beams <= SILENT_MAX + 1 && dx * dx + dy * dy <= gap * gap
}

/// The velocity from `at` straight to `robot` with this speed.
fn towards(at: Point2, robot: Point2, speed: f64) -> Point2 {
    let distance = at.distance(robot).max(1e-6);
    Point2::new((robot.x - at.x) * speed / distance, (robot.y - at.y) * speed / distance)
}

/// What brings a point nearer to the robot, of two conclusions.
fn nearer_to_danger(one: Motion, other: Motion, at: Point2, robot: Point2) -> Motion {
    if closing(one, at, robot) >= closing(other, at, robot) { one } else { other }
}

/// How fast a point comes closer, m/s; below any speed of a point that is known to move or to be still, if nothing is
/// known.
fn closing(motion: Motion, at: Point2, robot: Point2) -> f64 {
    match motion {
        Motion::Unknown => f64::NEG_INFINITY,
        // Something seen to move, to whichever side, says more than that it was there before.
        Motion::Still => -1e3,
        Motion::Appeared => f64::INFINITY,
        Motion::Moving(velocity) => {
            let to_robot = towards(at, robot, 1.0);
            velocity.x * to_robot.x + velocity.y * to_robot.y
        }
    }
}

/// An earlier scan to compare with.
struct Comparison<'a> {
    then: &'a Sweep,
    /// Seconds between the two.
    apart: f64,
    /// Farther within what was free than this a point has moved, metres.
    tolerance: f64,
    /// Nothing comes farther in this time, metres.
    farthest: f64,
}

impl<'a> Comparison<'a> {
    fn new(now: &Sweep, then: &'a Sweep, settings: &GuardSettings) -> Self {
        let apart = now.stamp - then.stamp;
        let driven = now.laser.pose.position().distance(then.laser.pose.position());
        let drift = (OdometryNoise::default().position_per_metre * driven).sqrt();
        let tolerance = NOISE + DRIFT_SIGMAS * drift;
        Self { then, apart, tolerance, farthest: settings.approach * apart + tolerance }
    }

    /// How far a point lies within what was free, metres; at most as far as anything comes.
    fn entered(&self, x: f64, y: f64) -> f64 {
        let (range, place) = self.then.locate(x, y);
        let Some((nearest, farthest)) = place.and_then(|place| self.then.seen_around(place)) else {
            return f64::NAN;
        };
        if range < nearest {
            (nearest - range).min(self.farthest)
        } else if range > farthest {
            (farthest - range).max(-self.farthest)
        } else {
            0.0
        }
    }

    /// The velocity of a point that has come: from the nearest point of then.
    fn velocity(&self, at: Point2) -> Motion {
        let then = self.then;
        let (range, Some(place)) = then.locate(at.x, at.y) else { return Motion::Unknown };
        let angle = if range > self.farthest { 1.6 * self.farthest / range } else { std::f64::consts::PI };
        let reach = angle / then.increment.abs() + 1.0;
        let mut best = self.farthest * self.farthest;
        let mut from = None;
        for beam in then.beams(place - reach, place + reach) {
            let dx = at.x - then.x[beam];
            let dy = at.y - then.y[beam];
            let squared = dx * dx + dy * dy;
            if squared < best {
                best = squared;
                from = Some(Point2::new(dx, dy));
            }
        }
        let Some(way) = from else { return Motion::Appeared };
        if best.sqrt() < SLOWEST * self.apart {
            return Motion::Still;
        }
        Motion::Moving(Point2::new(way.x / self.apart, way.y / self.apart))
    }
}
