//! Shortest paths of bounded curvature between two poses (Dubins, 1957), driven forwards only.
//!
//! Lengths of the six words follow Shkel and Lumelsky, "Classification of the Dubins set" (2001), in
//! units of the turning radius, with the line between the positions turned onto the x axis.

use std::f64::consts::{PI, TAU};

use crate::geometry::{Pose2, Twist, bearing};
use crate::motion::step;
use crate::numerics::{atan2, sin_cos};

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
    start: Pose2,
    radius: f64,
    word: [Turn; 3],
    /// Length of each piece in turning radii.
    pieces: [f64; 3],
}

impl Dubins {
    /// The shortest of all six words from `from` to `to` with turning radius `radius` metres.
    pub fn shortest(from: Pose2, to: Pose2, radius: f64) -> Self {
        let mut best = Best { word: [Turn::Straight; 3], pieces: [0.0; 3], total: f64::INFINITY };
        Normalised::new(from, to, radius).offer_words(&mut best, true);
        Self { start: from, radius, word: best.word, pieces: best.pieces }
    }

    /// The shortest path if it is at most `bound` metres long. Much cheaper than [`Self::shortest`] for
    /// bounds below half a turning circle, where three turns in a row cannot be the answer.
    pub fn shortest_within(from: Pose2, to: Pose2, radius: f64, bound: f64) -> Option<Self> {
        if from.position().distance(to.position()) > bound {
            return None;
        }
        let limit = bound / radius * (1.0 + 1e-12);
        let mut best = Best { word: [Turn::Straight; 3], pieces: [0.0; 3], total: limit };
        Normalised::new(from, to, radius).offer_words(&mut best, limit > PI);
        (best.total < limit).then_some(Self { start: from, radius, word: best.word, pieces: best.pieces })
    }

    /// Metres.
    pub fn length(&self) -> f64 {
        (self.pieces[0] + self.pieces[1] + self.pieces[2]) * self.radius
    }

    /// Walks along the path: `visit` gets each pose and answers how far to go before the next one,
    /// metres (at least a millimetre is taken), or `None` to stop. Every piece's ends are visited, the
    /// path's start is not. Returns whether the end was reached.
    pub fn walk(&self, mut stride: f64, mut visit: impl FnMut(Pose2) -> Option<f64>) -> bool {
        let mut pose = self.start;
        for (turn, piece) in self.word.iter().zip(self.pieces) {
            let length = piece * self.radius;
            if length <= 0.0 {
                continue;
            }
            let base = pose;
            let mut s = 0.0;
            while s < length {
                s = (s + stride.max(1e-3)).min(length);
                pose = self.advance(base, *turn, s);
                match visit(pose) {
                    Some(next) => stride = next,
                    None => return false,
                }
            }
        }
        true
    }

    fn advance(&self, pose: Pose2, turn: Turn, distance: f64) -> Pose2 {
        step(pose, Twist { v: 1.0, omega: turn.sign() / self.radius }, distance)
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
struct Normalised {
    d: f64,
    alpha: f64,
    beta: f64,
    sin: [f64; 2],
    cos: [f64; 2],
}

impl Normalised {
    fn new(from: Pose2, to: Pose2, radius: f64) -> Self {
        let d = from.position().distance(to.position()) / radius;
        let line = if d > 0.0 { bearing(from.position(), to.position()) } else { 0.0 };
        let (alpha, beta) = (from.heading - line, to.heading - line);
        let ((sa, ca), (sb, cb)) = (sin_cos(alpha), sin_cos(beta));
        Self { d, alpha, beta, sin: [sa, sb], cos: [ca, cb] }
    }

    /// The same seen in a mirror: left turns are right turns.
    fn mirrored(&self) -> Self {
        Self { alpha: -self.alpha, beta: -self.beta, sin: self.sin.map(|s| -s), ..*self }
    }

    /// Offers LSL, RSR, LSR and RSL, and with `three_turns` RLR and LRL.
    fn offer_words(&self, best: &mut Best, three_turns: bool) {
        let sides = [(self, Turn::Left, Turn::Right), (&self.mirrored(), Turn::Right, Turn::Left)];
        for (problem, side, _) in sides {
            problem.equal_turns(side, best);
        }
        for (problem, first, last) in sides {
            problem.opposite_turns(first, last, best);
        }
        for (problem, middle, outer) in sides.into_iter().filter(|_| three_turns) {
            problem.three_turns(outer, middle, best);
        }
    }

    /// LSL. Like the next, it is bounded from below by its straight piece, before any angle is computed.
    fn equal_turns(&self, side: Turn, best: &mut Best) {
        let ([sa, sb], [ca, cb], d) = (self.sin, self.cos, self.d);
        let squared = 2.0 + d * d - 2.0 * (ca * cb + sa * sb) + 2.0 * d * (sa - sb);
        if squared >= 0.0 && squared < best.total * best.total {
            let angle = atan2(cb - ca, d + sa - sb);
            let pieces = [turn(angle - self.alpha), squared.sqrt(), turn(self.beta - angle)];
            best.offer([side, Turn::Straight, side], pieces);
        }
    }

    /// LSR.
    fn opposite_turns(&self, first: Turn, last: Turn, best: &mut Best) {
        let ([sa, sb], [ca, cb], d) = (self.sin, self.cos, self.d);
        let squared = -2.0 + d * d + 2.0 * (ca * cb + sa * sb) + 2.0 * d * (sa + sb);
        if squared >= 0.0 && squared < best.total * best.total {
            let p = squared.sqrt();
            let angle = atan2(-ca - cb, d + sa + sb) - atan2(-2.0, p);
            best.offer([first, Turn::Straight, last], [turn(angle - self.alpha), p, turn(angle - self.beta)]);
        }
    }

    /// RLR: the middle turn is longer than half a circle.
    fn three_turns(&self, outer: Turn, middle: Turn, best: &mut Best) {
        let ([sa, sb], [ca, cb], d) = (self.sin, self.cos, self.d);
        let cosine = (6.0 - d * d + 2.0 * (ca * cb + sa * sb) + 2.0 * d * (sa - sb)) / 8.0;
        if cosine.abs() <= 1.0 {
            let p = turn(TAU - arc_cosine(cosine));
            let t = turn(self.alpha - atan2(ca - cb, d - sa + sb) + 0.5 * p);
            best.offer([outer, middle, outer], [t, p, turn(self.alpha - self.beta - t + p)]);
        }
    }
}

/// The angle in [0, 2 pi); a hair below a full turn is none, or rounding would add a circle.
fn turn(angle: f64) -> f64 {
    let a = angle.rem_euclid(TAU);
    if a > TAU - 1e-9 { 0.0 } else { a }
}

fn arc_cosine(x: f64) -> f64 {
    atan2((1.0 - x * x).max(0.0).sqrt(), x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::wrap_angle;
    use crate::random::{rng, uniform};

    fn random_pose(r: &mut crate::random::Rng) -> Pose2 {
        Pose2::new(6.0 * uniform(r) - 3.0, 6.0 * uniform(r) - 3.0, TAU * uniform(r) - PI)
    }

    fn apart(a: Pose2, b: Pose2) -> f64 {
        a.position().distance(b.position()).max(wrap_angle(a.heading - b.heading).abs())
    }

    #[test]
    fn paths_end_at_the_goal_pose_and_are_no_shorter_than_the_straight_line() {
        let mut r = rng(1, 0);
        for _ in 0..20_000 {
            let (a, b) = (random_pose(&mut r), random_pose(&mut r));
            let path = Dubins::shortest(a, b, 0.6);
            let end = path
                .word
                .iter()
                .zip(path.pieces)
                .fold(a, |pose, (turn, piece)| path.advance(pose, *turn, piece * path.radius));
            assert!(apart(end, b) < 1e-7, "{a:?} {b:?} {path:?}");
            assert!(path.length() >= a.position().distance(b.position()) - 1e-9);
        }
    }

    #[test]
    fn length_survives_rigid_motion_and_driving_the_way_back() {
        let mut r = rng(2, 0);
        for _ in 0..5_000 {
            let (a, b, frame) = (random_pose(&mut r), random_pose(&mut r), random_pose(&mut r));
            let length = Dubins::shortest(a, b, 0.6).length();
            let moved = Dubins::shortest(frame.compose(a), frame.compose(b), 0.6).length();
            assert!((length - moved).abs() < 1e-6, "{a:?} {b:?}");
            // turned about, the same curve leads from the goal back to the start
            let about = |p: Pose2| Pose2::new(p.x, p.y, wrap_angle(p.heading + PI));
            let back = Dubins::shortest(about(b), about(a), 0.6).length();
            assert!((length - back).abs() < 1e-6, "{a:?} {b:?}");
        }
    }

    #[test]
    fn no_other_drivable_way_is_shorter() {
        // Any path made of pieces of allowed curvature bounds the shortest from above.
        let mut r = rng(3, 0);
        for _ in 0..5_000 {
            let a = random_pose(&mut r);
            let (mut p, mut driven) = (a, 0.0);
            for _ in 0..4 {
                let (s, curvature) = (1.5 * uniform(&mut r), (2.0 * uniform(&mut r) - 1.0) / 0.6);
                p = step(p, Twist { v: 1.0, omega: curvature }, s);
                driven += s;
            }
            assert!(Dubins::shortest(a, p, 0.6).length() <= driven + 1e-7);
        }
    }

    #[test]
    fn the_bounded_search_agrees_with_the_full_one() {
        let mut r = rng(4, 0);
        for _ in 0..20_000 {
            let (a, b) = (random_pose(&mut r), random_pose(&mut r));
            let full = Dubins::shortest(a, b, 0.6);
            for bound in [1.0, 1.8, 3.0, 8.0] {
                match Dubins::shortest_within(a, b, 0.6, bound) {
                    Some(found) => assert_eq!(found, full),
                    None => assert!(full.length() >= bound - 1e-9),
                }
            }
        }
    }

    #[test]
    fn walking_visits_the_whole_path_in_order() {
        let (a, b) = (Pose2::new(0.0, 0.0, 0.0), Pose2::new(2.0, 1.0, 1.0));
        let path = Dubins::shortest(a, b, 0.6);
        let (mut last, mut travelled) = (a, 0.0);
        assert!(path.walk(0.05, |p| {
            travelled += last.position().distance(p.position());
            last = p;
            Some(0.05)
        }));
        assert!(apart(last, b) < 1e-9 && (travelled - path.length()).abs() < 0.01);
        assert!(!path.walk(0.05, |_| None));
    }
}
