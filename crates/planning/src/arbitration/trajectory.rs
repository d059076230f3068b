//! One timed trajectory: what a decision asks the robot to drive.

use crate::candidates::{CandidateError, CandidateSet};
use crate::geometry::{Pose2, Twist, wrap_angle};
use crate::motion;

/// K states; state k (from 0) is due `(k + 1) * dt` seconds after the stamp of its scene. Map frame,
/// finite, all arrays of equal length. A trajectory without states asks for nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    dt: f64,
    x: Vec<f64>,
    y: Vec<f64>,
    heading: Vec<f64>,
    v: Vec<f64>,
    omega: Vec<f64>,
}

impl Trajectory {
    /// Checks shapes and finiteness once, for good.
    pub fn new(
        dt: f64,
        x: Vec<f64>,
        y: Vec<f64>,
        heading: Vec<f64>,
        v: Vec<f64>,
        omega: Vec<f64>,
    ) -> Result<Self, CandidateError> {
        if [&x, &y, &heading, &v, &omega].iter().all(|array| array.is_empty()) && dt > 0.0 && dt.is_finite() {
            return Ok(Self::none(dt));
        }
        let states = x.len().max(1);
        CandidateSet::new(states, dt, vec![0], x, y, heading, v, omega).map(|set| Self::of(&set, 0))
    }

    /// No states.
    pub fn none(dt: f64) -> Self {
        Self { dt, x: Vec::new(), y: Vec::new(), heading: Vec::new(), v: Vec::new(), omega: Vec::new() }
    }

    /// Candidate `index` of a set.
    pub fn of(candidates: &CandidateSet, index: usize) -> Self {
        let states = candidates.range(index);
        Self {
            dt: candidates.dt(),
            x: candidates.x()[states.clone()].to_vec(),
            y: candidates.y()[states.clone()].to_vec(),
            heading: candidates.heading()[states.clone()].to_vec(),
            v: candidates.v()[states.clone()].to_vec(),
            omega: candidates.omega()[states].to_vec(),
        }
    }

    /// Number of states, K.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there are no states.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Seconds between states.
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Each x, metres.
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// Each y, metres.
    pub fn y(&self) -> &[f64] {
        &self.y
    }

    /// Each heading, radians.
    pub fn heading(&self) -> &[f64] {
        &self.heading
    }

    /// Each speed, m/s: the twist that led to the state.
    pub fn v(&self) -> &[f64] {
        &self.v
    }

    /// Each turn rate, rad/s.
    pub fn omega(&self) -> &[f64] {
        &self.omega
    }

    /// Pose and twist of state `k`; beyond the last state the robot rests there. `None` if there are no
    /// states.
    pub fn state(&self, k: usize) -> Option<(Pose2, Twist)> {
        let last = self.len().checked_sub(1)?;
        let i = k.min(last);
        let pose = Pose2::new(self.x[i], self.y[i], self.heading[i]);
        let twist = if k > last { Twist::default() } else { Twist { v: self.v[i], omega: self.omega[i] } };
        Some((pose, twist))
    }

    /// Where the trajectory is `t` seconds after its stamp and how it moves there. Before the first
    /// state the arc that led to it is run backwards.
    pub fn at(&self, t: f64) -> Option<(Pose2, Twist)> {
        let steps = t.max(0.0) / self.dt;
        if steps >= 1.0 {
            let (base, fraction) = split(steps - 1.0);
            let (pose, _) = self.between(base, fraction)?;
            // The twist of the interval that `t` lies in.
            let (_, twist) = self.state(if fraction > 0.0 { base + 1 } else { base })?;
            return Some((pose, twist));
        }
        let (pose, twist) = self.state(0)?;
        let back = Twist { v: -twist.v, omega: -twist.omega };
        Some((motion::step(pose, back, (1.0 - steps) * self.dt), twist))
    }

    /// The same way seen `elapsed` seconds later (not negative): as many states, the first again one step
    /// ahead, resting at the end once it is reached.
    pub fn tail(&self, elapsed: f64) -> Self {
        let mut tail = Self::none(self.dt);
        let (offset, fraction) = split(elapsed.max(0.0) / self.dt);
        for k in 0..self.len() {
            let Some((pose, twist)) = self.between(offset + k, fraction) else { break };
            tail.x.push(pose.x);
            tail.y.push(pose.y);
            tail.heading.push(pose.heading);
            tail.v.push(twist.v);
            tail.omega.push(twist.omega);
        }
        tail
    }

    /// `fraction` of the way from state `base` to the next, with the mean twist of the step that ends
    /// there: it straddles two steps, and a mean of speeds over time is linear in the fraction.
    fn between(&self, base: usize, fraction: f64) -> Option<(Pose2, Twist)> {
        let (a, twist_a) = self.state(base)?;
        if fraction <= 0.0 {
            return Some((a, twist_a));
        }
        let (b, twist_b) = self.state(base + 1)?;
        let mix = |from: f64, to: f64| from + fraction * (to - from);
        let turn = wrap_angle(b.heading - a.heading);
        let heading = if turn == 0.0 { a.heading } else { wrap_angle(a.heading + fraction * turn) };
        let pose = Pose2::new(mix(a.x, b.x), mix(a.y, b.y), heading);
        Some((pose, Twist { v: mix(twist_a.v, twist_b.v), omega: mix(twist_a.omega, twist_b.omega) }))
    }
}

/// Whole steps and the rest, [0, 1). A rest that is only rounding of stamps counts as none, so that a
/// whole number of cycles shifts states without touching them.
fn split(steps: f64) -> (usize, f64) {
    let nearest = steps.round();
    if (steps - nearest).abs() < 1e-6 {
        (nearest as usize, 0.0)
    } else {
        (steps.floor() as usize, steps - steps.floor())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Speeds up, turns, brakes: exact arcs from the origin, 0.3 s apart.
    fn curve() -> Trajectory {
        let mut pose = Pose2::default();
        let mut t = Trajectory::none(0.3);
        for (v, omega) in [(0.2, 0.0), (0.4, 0.5), (0.6, 0.5), (0.4, -0.5), (0.2, 0.0), (0.0, 0.0)] {
            pose = motion::step(pose, Twist { v, omega }, 0.3);
            t.x.push(pose.x);
            t.y.push(pose.y);
            t.heading.push(pose.heading);
            t.v.push(v);
            t.omega.push(omega);
        }
        t
    }

    #[test]
    fn a_whole_step_later_states_are_the_same_bits() {
        let t = curve();
        // 0.3 s between stamps that are themselves rounded
        let tail = t.tail(4.2 - 3.9);
        assert_eq!(tail.x[..5], t.x[1..]);
        assert_eq!(tail.omega[..5], t.omega[1..]);
        assert_eq!((tail.x[5], tail.v[5]), (t.x[5], 0.0));
        assert_eq!(t.tail(0.0), t);
    }

    #[test]
    fn a_tail_of_a_tail_ends_where_one_tail_does() {
        let (once, twice) = (curve().tail(0.9), curve().tail(0.3).tail(0.6));
        assert_eq!(once, twice);
        assert_eq!(curve().tail(99.0).state(0), Some((curve().state(5).unwrap().0, Twist::default())));
    }

    #[test]
    fn the_tail_passes_through_the_same_poses_at_the_same_times() {
        let t = curve();
        for tenth in 0..20 {
            let elapsed = 0.1 * f64::from(tenth);
            for ahead in 1..5 {
                let time = 0.3 * f64::from(ahead);
                let (a, _) = t.at(elapsed + time).unwrap();
                let (b, _) = t.tail(elapsed).at(time).unwrap();
                assert!(a.position().distance(b.position()) < 1e-12, "{elapsed} {ahead}");
            }
        }
    }

    #[test]
    fn a_tail_covers_the_ground_its_speeds_say() {
        let mut t = Trajectory::none(0.3);
        for v in [0.2, 0.5, 0.9, 0.4, 0.0] {
            let x = t.x.last().copied().unwrap_or(0.0) + 0.3 * v;
            let arrays = [&mut t.x, &mut t.v, &mut t.y, &mut t.heading, &mut t.omega];
            arrays.into_iter().zip([x, v, 0.0, 0.0, 0.0]).for_each(|(array, n)| array.push(n));
        }
        let tail = t.tail(0.1);
        let mut from = t.at(0.1).unwrap().0.x;
        for k in 0..4 {
            assert!((tail.x[k] - from - 0.3 * tail.v[k]).abs() < 1e-12, "{k}");
            from = tail.x[k];
        }
    }

    #[test]
    fn arrays_of_different_length_are_refused_even_when_some_are_empty() {
        let none = Vec::new;
        assert!(Trajectory::new(0.3, none(), none(), none(), none(), none()).is_ok());
        assert!(Trajectory::new(0.3, none(), vec![1.0], none(), none(), none()).is_err());
        assert!(Trajectory::new(0.0, none(), none(), none(), none(), none()).is_err());
        assert!(Trajectory::new(0.3, vec![1.0], none(), none(), none(), none()).is_err());
    }

    #[test]
    fn before_its_first_state_a_trajectory_is_where_it_started() {
        let (start, twist) = curve().at(0.0).unwrap();
        assert!(start.position().distance(Pose2::default().position()) < 1e-12);
        assert_eq!(twist.v, 0.2);
        assert_eq!(Trajectory::none(0.3).at(0.0), None);
    }
}
