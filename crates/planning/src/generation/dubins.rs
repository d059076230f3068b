//! Shortest paths of bounded curvature between two poses (Dubins, 1957), driven forwards only.
//!
//! Lengths of the six words follow Shkel and Lumelsky, "Classification of the Dubins set" (2001), in
//! units of the turning radius, with the line between the positions turned onto the x axis.

use std::cell::OnceCell;
use std::f64::consts::{PI, TAU};

use crate::geometry::{Direction, Facing, Point2, Pose2, Twist, wrap_angle};
use crate::motion::step_facing;
use crate::numerics::atan2;

/// How one piece of a path bends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    /// Counter-clockwise at the turning radius.
    Left,
    /// Not at all.
    Straight,
    /// Clockwise at the turning radius.
    Right,
}

impl Turn {
    fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Straight => 0.0,
            Self::Right => -1.0,
        }
    }
}

/// One path: three pieces, any of which may be empty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dubins {
    start: Facing,
    radius: f64,
    word: [Turn; 3],
    /// Length of each piece in turning radii.
    pieces: [f64; 3],
}

impl Dubins {
    /// The shortest of all six words from `from` to `to` with turning radius `radius` metres.
    pub fn shortest(from: Facing, to: Facing, radius: f64) -> Self {
        let mut best = Best { word: [Turn::Straight; 3], pieces: [0.0; 3], total: f64::INFINITY };
        Normalised::new(&from, &to, radius).offer_words(&mut best, true);
        Self { start: from, radius, word: best.word, pieces: best.pieces }
    }

    /// The shortest path if it is at most `bound` metres long. Much cheaper than [`Self::shortest`] for
    /// bounds below half a turning circle, where three turns in a row cannot be the answer.
    pub fn shortest_within(from: Facing, to: Facing, radius: f64, bound: f64) -> Option<Self> {
        let limit = bound / radius * (1.0 + 1e-12);
        let problem = Normalised::new(&from, &to, radius);
        if problem.exceeds(limit) {
            return None;
        }
        let mut best = Best { word: [Turn::Straight; 3], pieces: [0.0; 3], total: limit };
        problem.offer_words(&mut best, limit > PI);
        (best.total < limit).then_some(Self { start: from, radius, word: best.word, pieces: best.pieces })
    }

    /// The shortest path to a point, whatever the heading there: a turn and a straight piece. `None` for points inside
    /// the turning circles, to which the shortest path has two turns.
    pub fn to_point(from: Facing, to: Point2, radius: f64) -> Option<(Self, Facing)> {
        let (ahead, left) = from.direction.ahead_and_left(from.pose.position(), to);
        // In turning radii, seen from the centre of the circle on the point's side, which is then the left one.
        let side = if left < 0.0 { -1.0 } else { 1.0 };
        let x = ahead / radius;
        let y = left.abs() / radius - 1.0;
        let squared = x * x + y * y;
        if squared < 1.0 {
            return None;
        }
        // The tangent from the point touches the circle where (straight, -1), turned by the angle of the turn, is (x,
        // y).
        let straight = (squared - 1.0).sqrt();
        let by = Direction { cos: (x * straight - y) / squared, sin: (y * straight + x) / squared };
        let angle = turn(atan2(by.sin, by.cos));
        let turning = if side < 0.0 { Turn::Right } else { Turn::Left };
        let direction = from.direction.turned(Direction { sin: side * by.sin, ..by });
        let end = Pose2::new(to.x, to.y, wrap_angle(from.pose.heading + side * angle));
        let word = [turning, Turn::Straight, turning];
        Some((
            Self { start: from, radius, word, pieces: [angle, straight, 0.0] },
            Facing { pose: end, direction },
        ))
    }

    /// Metres.
    pub fn length(&self) -> f64 {
        (self.pieces[0] + self.pieces[1] + self.pieces[2]) * self.radius
    }

    /// Where the path is after `distance` metres, at most its length.
    pub fn at(&self, distance: f64) -> Facing {
        let mut at = self.start;
        let mut left = distance;
        for (turn, piece) in self.word.iter().zip(self.pieces) {
            let length = (piece * self.radius).min(left);
            at = self.advance(at, *turn, length);
            left -= length;
        }
        at
    }

    /// Walks along the path: `visit` gets each pose and answers how far to go before the next one,
    /// metres (at least a millimetre is taken), or `None` to stop. Every piece's ends are visited, the
    /// path's start is not. Returns whether the end was reached.
    pub fn walk(&self, mut stride: f64, mut visit: impl FnMut(Pose2) -> Option<f64>) -> bool {
        let mut at = self.start;
        for (turn, piece) in self.word.iter().zip(self.pieces) {
            let length = piece * self.radius;
            if length <= 0.0 {
                continue;
            }
            let base = at;
            let mut s = 0.0;
            while s < length {
                s = (s + stride.max(1e-3)).min(length);
                at = self.advance(base, *turn, s);
                match visit(at.pose) {
                    Some(next) => stride = next,
                    None => return false,
                }
            }
        }
        true
    }

    fn advance(&self, from: Facing, turn: Turn, distance: f64) -> Facing {
        step_facing(from, Twist { v: 1.0, omega: turn.sign() / self.radius }, distance)
    }
}

struct Best {
    word: [Turn; 3],
    pieces: [f64; 3],
    total: f64,
}

impl Best {
    /// Strictly shorter only, so that equal words are decided by their order.
    fn offer(&mut self, word: [Turn; 3], pieces: [f64; 3]) {
        let total = pieces[0] + pieces[1] + pieces[2];
        if total < self.total {
            *self = Self { word, pieces, total };
        }
    }
}

/// Distance in radii and both headings relative to the line between the positions.
#[derive(Clone, Copy)]
struct Normalised {
    d: f64,
    /// Along the line between the positions, in radii.
    line: (f64, f64),
    headings: [f64; 2],
    /// 1, or -1 seen in a mirror.
    side: f64,
    sin: [f64; 2],
    cos: [f64; 2],
}

impl Normalised {
    fn new(from: &Facing, to: &Facing, radius: f64) -> Self {
        let dx = (to.pose.x - from.pose.x) / radius;
        let dy = (to.pose.y - from.pose.y) / radius;
        let d = (dx * dx + dy * dy).sqrt();
        let line =
            if d > 0.0 { Direction { cos: dx / d, sin: dy / d } } else { Direction { cos: 1.0, sin: 0.0 } };
        let [a, b] = [from, to].map(|end| {
            let Direction { cos, sin } = end.direction;
            (cos * line.cos + sin * line.sin, sin * line.cos - cos * line.sin)
        });
        let headings = [from.pose.heading, to.pose.heading];
        Self { d, line: (dx, dy), headings, side: 1.0, sin: [a.1, b.1], cos: [a.0, b.0] }
    }

    /// Whether no path of at most `limit` radii can be, which is seen without any angle.
    ///
    /// A path turns by its length at most, in radians, and while that is at most half a turn, the line between its ends
    /// is off its headings at the ends by at most half of it. An angle is at least its chord, `2 - 2 cos`, squared.
    fn exceeds(&self, limit: f64) -> bool {
        let ([sa, sb], [ca, cb]) = (self.sin, self.cos);
        let squared = limit * limit * (1.0 + 1e-9) + 1e-12;
        self.d > limit
            || 2.0 - 2.0 * (ca * cb + sa * sb) > squared
            || (limit <= PI && self.d > 0.0 && 8.0 - 8.0 * ca.min(cb) > squared)
    }

    /// Both headings relative to the line, whose angle is computed when it is first needed.
    fn angles(&self, line: &OnceCell<f64>) -> (f64, f64) {
        let line = line.get_or_init(|| atan2(self.line.1, self.line.0));
        (self.side * (self.headings[0] - line), self.side * (self.headings[1] - line))
    }

    /// The same seen in a mirror: left turns are right turns.
    fn mirrored(&self) -> Self {
        Self { side: -self.side, sin: self.sin.map(|s| -s), ..*self }
    }

    /// Offers LSL, RSR, LSR and RSL, and with `three_turns` RLR and LRL.
    fn offer_words(&self, best: &mut Best, three_turns: bool) {
        let line = &OnceCell::new();
        let sides = [(self, Turn::Left, Turn::Right), (&self.mirrored(), Turn::Right, Turn::Left)];
        for (problem, side, _) in sides {
            problem.equal_turns(side, line, best);
        }
        for (problem, first, last) in sides {
            problem.opposite_turns([first, last], line, best);
        }
        for (problem, middle, outer) in sides.into_iter().filter(|_| three_turns) {
            problem.three_turns([outer, middle], line, best);
        }
    }

    /// LSL. Like the next, it is bounded from below by its straight piece, before any angle is computed.
    fn equal_turns(&self, side: Turn, line: &OnceCell<f64>, best: &mut Best) {
        let ([sa, sb], [ca, cb], d) = (self.sin, self.cos, self.d);
        let squared = 2.0 + d * d - 2.0 * (ca * cb + sa * sb) + 2.0 * d * (sa - sb);
        if squared >= 0.0 && squared < best.total * best.total {
            let (alpha, beta) = self.angles(line);
            let angle = atan2(cb - ca, d + sa - sb);
            let pieces = [turn(angle - alpha), squared.sqrt(), turn(beta - angle)];
            best.offer([side, Turn::Straight, side], pieces);
        }
    }

    /// LSR.
    fn opposite_turns(&self, [first, last]: [Turn; 2], line: &OnceCell<f64>, best: &mut Best) {
        let ([sa, sb], [ca, cb], d) = (self.sin, self.cos, self.d);
        let squared = -2.0 + d * d + 2.0 * (ca * cb + sa * sb) + 2.0 * d * (sa + sb);
        if squared >= 0.0 && squared < best.total * best.total {
            let (alpha, beta) = self.angles(line);
            let p = squared.sqrt();
            let angle = atan2(-ca - cb, d + sa + sb) - atan2(-2.0, p);
            best.offer([first, Turn::Straight, last], [turn(angle - alpha), p, turn(angle - beta)]);
        }
    }

    /// RLR: the middle turn is longer than half a circle.
    fn three_turns(&self, [outer, middle]: [Turn; 2], line: &OnceCell<f64>, best: &mut Best) {
        let ([sa, sb], [ca, cb], d) = (self.sin, self.cos, self.d);
        let cosine = (6.0 - d * d + 2.0 * (ca * cb + sa * sb) + 2.0 * d * (sa - sb)) / 8.0;
        if cosine.abs() <= 1.0 {
            let (alpha, beta) = self.angles(line);
            let p = turn(TAU - arc_cosine(cosine));
            let t = turn(alpha - atan2(ca - cb, d - sa + sb) + 0.5 * p);
            best.offer([outer, middle, outer], [t, p, turn(alpha - beta - t + p)]);
        }
    }
}

/// The angle in [0, 2 pi); a hair below a full turn is none, or rounding would add a circle.
fn turn(angle: f64) -> f64 {
    // A remainder takes long, and most angles need none.
    let a = match angle.abs() < TAU {
        true if angle < 0.0 => angle + TAU,
        true => angle,
        false => angle.rem_euclid(TAU),
    };
    if a > TAU - 1e-9 { 0.0 } else { a }
}

fn arc_cosine(x: f64) -> f64 {
    atan2((1.0 - x * x).max(0.0).sqrt(), x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::step;
    use crate::random::{rng, uniform};

    fn random_pose(r: &mut crate::random::Rng) -> Pose2 {
        Pose2::new(6.0 * uniform(r) - 3.0, 6.0 * uniform(r) - 3.0, TAU * uniform(r) - PI)
    }

    fn shortest(a: Pose2, b: Pose2) -> Dubins {
        Dubins::shortest(a.into(), b.into(), 0.6)
    }

    fn apart(a: Pose2, b: Pose2) -> f64 {
        a.position().distance(b.position()).max(wrap_angle(a.heading - b.heading).abs())
    }

    #[test]
    fn paths_end_at_the_goal_pose_and_are_no_shorter_than_the_straight_line() {
        let mut r = rng(1, 0);
        for _ in 0..20_000 {
            let a = random_pose(&mut r);
            let b = random_pose(&mut r);
            let path = shortest(a, b);
            assert!(apart(path.at(path.length()).pose, b) < 1e-7, "{a:?} {b:?} {path:?}");
            assert!(path.length() >= a.position().distance(b.position()) - 1e-9);
        }
    }

    #[test]
    fn length_survives_rigid_motion_and_driving_the_way_back() {
        let mut r = rng(2, 0);
        for _ in 0..5_000 {
            let a = random_pose(&mut r);
            let b = random_pose(&mut r);
            let frame = random_pose(&mut r);
            let length = shortest(a, b).length();
            let moved = shortest(frame.compose(a), frame.compose(b)).length();
            assert!((length - moved).abs() < 1e-6, "{a:?} {b:?}");
            // turned about, the same curve leads from the goal back to the start
            let about = |p: Pose2| Pose2::new(p.x, p.y, wrap_angle(p.heading + PI));
            let back = shortest(about(b), about(a)).length();
            assert!((length - back).abs() < 1e-6, "{a:?} {b:?}");
        }
    }

    #[test]
    fn no_other_drivable_way_is_shorter() {
        // Any path made of pieces of allowed curvature bounds the shortest from above.
        let mut r = rng(3, 0);
        for _ in 0..5_000 {
            let a = random_pose(&mut r);
            let mut p = a;
            let mut driven = 0.0;
            for _ in 0..4 {
                let s = 1.5 * uniform(&mut r);
                let curvature = (2.0 * uniform(&mut r) - 1.0) / 0.6;
                p = step(p, Twist { v: 1.0, omega: curvature }, s);
                driven += s;
            }
            assert!(shortest(a, p).length() <= driven + 1e-7);
        }
    }

    #[test]
    fn the_bounded_search_agrees_with_the_full_one() {
        let mut r = rng(4, 0);
        for _ in 0..20_000 {
            let a = random_pose(&mut r);
            let b = random_pose(&mut r);
            let full = shortest(a, b);
            for bound in [1.0, 1.8, 3.0, 8.0] {
                match Dubins::shortest_within(a.into(), b.into(), 0.6, bound) {
                    Some(found) => assert_eq!(found, full),
                    None => assert!(full.length() >= bound - 1e-9),
                }
            }
        }
    }

    #[test]
    fn nothing_leads_to_a_point_on_a_shorter_way_whatever_the_heading_there() {
        let mut r = rng(5, 0);
        let mut found = 0;
        for _ in 0..2_000 {
            let a = random_pose(&mut r);
            let b = random_pose(&mut r);
            let Some((path, end)) = Dubins::to_point(a.into(), b.position(), 0.6) else { continue };
            found += 1;
            assert!(apart(path.at(path.length()).pose, end.pose) < 1e-7, "{a:?} {b:?} {path:?}");
            assert!(
                apart(Facing::from(end.pose).pose, end.pose) == 0.0 && end.pose.position() == b.position()
            );
            let expected = Direction::of(end.pose.heading);
            assert!(
                (expected.cos - end.direction.cos).abs() + (expected.sin - end.direction.sin).abs() < 1e-12
            );
            assert!((shortest(a, end.pose).length() - path.length()).abs() < 1e-7, "{a:?} {b:?}");
            for k in 0..32 {
                let other = Pose2 { heading: TAU * f64::from(k) / 32.0, ..b };
                assert!(shortest(a, other).length() >= path.length() - 1e-9, "{a:?} {b:?} {k}");
            }
        }
        assert!(found > 1_500, "{found}");
    }

    #[test]
    fn walking_visits_the_whole_path_in_order() {
        let a = Pose2::new(0.0, 0.0, 0.0);
        let b = Pose2::new(2.0, 1.0, 1.0);
        let path = shortest(a, b);
        let mut last = a;
        let mut travelled = 0.0;
        assert!(path.walk(0.05, |p| {
            travelled += last.position().distance(p.position());
            last = p;
            Some(0.05)
        }));
        assert!(apart(last, b) < 1e-9 && (travelled - path.length()).abs() < 0.01);
        assert!(!path.walk(0.05, |_| None));
    }
}
