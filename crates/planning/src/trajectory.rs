//! One timed trajectory: what a decision asks the robot to drive.
//!
//! Arbitration and driver read it with the same interpolation, so what is checked for collisions is what is
//! driven.

use crate::candidates::CandidateSet;
use crate::geometry::{Pose2, Twist, wrap_angle};
use crate::states::{Columns, States, StatesError};

/// A motion from a start through K states; state k (from 0) is due `(k + 1) * dt` seconds after the stamp of
/// its scene, at which the robot is at the start. Map frame, finite.
///
/// Between two states, and between the start and the first state, the position moves in a straight line and
/// heading and twist change linearly; beyond the last state the robot rests there. A trajectory without states
/// asks for nothing.
///
/// ```
/// use curionav_planning::geometry::{Pose2, Twist};
/// use curionav_planning::{states::States, trajectory::Trajectory};
///
/// let start = (Pose2::new(0.0, 0.0, 0.0), Twist { v: 0.5, omega: 0.0 });
/// let mut states = States::default();
/// states.push(Pose2::new(0.2, 0.0, 0.0), Twist { v: 0.7, omega: 0.0 });
/// let trajectory = Trajectory::new(start, 0.3, states)?;
/// let (pose, twist) = trajectory.at(0.15);
/// assert!((pose.x - 0.1).abs() < 1e-12 && (twist.v - 0.6).abs() < 1e-12);
/// # Ok::<(), curionav_planning::states::StatesError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    dt: f64,
    start: (Pose2, Twist),
    states: States,
}

impl Trajectory {
    /// From `start` through `states`, `dt` seconds apart. Shapes and finiteness are checked once, for good.
    pub fn new(start: (Pose2, Twist), dt: f64, states: States) -> Result<Self, StatesError> {
        let (pose, twist) = start;
        let finite = [pose.x, pose.y, pose.heading, twist.v, twist.omega].iter().all(|n| n.is_finite());
        if !(finite && dt > 0.0 && dt.is_finite()) {
            return Err(StatesError::Shape);
        }
        states.check(states.len(), Columns::ALL)?;
        Ok(Self { dt, start, states })
    }

    /// From the first of `knots`, `dt` seconds apart, through the others: [`Trajectory::knots`] undone.
    pub fn through(knots: &States, dt: f64) -> Result<Self, StatesError> {
        if knots.is_empty() {
            return Err(StatesError::Shape);
        }
        knots.check(knots.len(), Columns::ALL)?;
        Self::new(knots.at(0), dt, knots.map(|array| array[1..].to_vec()))
    }

    /// No states, from nowhere in particular.
    pub fn none(dt: f64) -> Self {
        Self { dt, start: Default::default(), states: States::default() }
    }

    /// Candidate `index` of a set, driven from `start`.
    pub fn of(candidates: &CandidateSet, index: usize, start: (Pose2, Twist)) -> Self {
        Self { dt: candidates.dt(), start, states: candidates.states(index) }
    }

    /// Number of states, K.
    pub fn len(&self) -> usize {
        self.states.len()
    }

    /// Whether there are no states.
    pub fn is_empty(&self) -> bool {
        self.states.is_empty()
    }

    /// Seconds between states.
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Seconds from the stamp to the last state.
    pub fn duration(&self) -> f64 {
        self.len() as f64 * self.dt
    }

    /// The states, without the start.
    pub fn states(&self) -> &States {
        &self.states
    }

    /// The start and the states behind it.
    pub fn knots(&self) -> States {
        let mut knots = States::default();
        knots.push(self.start.0, self.start.1);
        knots.append(self.states.clone());
        knots
    }

    /// Where the trajectory is `t` seconds after its stamp and how it moves there.
    pub fn at(&self, t: f64) -> (Pose2, Twist) {
        let steps = t.max(0.0) / self.dt;
        let whole = steps.floor();
        self.between(whole as usize, steps - whole)
    }

    /// The same motion seen `elapsed` seconds later (not negative) by a robot that is then at `start`: as many
    /// states, the first again one step ahead, resting at the end once it is reached.
    ///
    /// A rest of a step that is only rounding of stamps counts as none, so that a whole number of cycles shifts
    /// states without touching them. The twist of a state that lies between two others is the mean over the step
    /// that ends there: that step straddles two, and a mean of speeds over time is linear in the fraction.
    pub fn tail(&self, elapsed: f64, start: (Pose2, Twist)) -> Self {
        let steps = elapsed.max(0.0) / self.dt;
        let nearest = steps.round();
        let is_whole = (steps - nearest).abs() < 1e-6;
        let (whole, rest) = if is_whole { (nearest, 0.0) } else { (steps.floor(), steps - steps.floor()) };
        let mut states = States::default();
        for k in 1..=self.len() {
            let (pose, twist) = self.between((whole as usize).saturating_add(k), rest);
            states.push(pose, twist);
        }
        Self { dt: self.dt, start, states }
    }

    /// `fraction` of the way from knot `base` to the next. Knot 0 is the start, knot k is state k - 1.
    fn between(&self, base: usize, fraction: f64) -> (Pose2, Twist) {
        let from = self.knot(base);
        if fraction <= 0.0 {
            return from;
        }
        let to = self.knot(base.saturating_add(1));
        let mix = |a: f64, b: f64| a + fraction * (b - a);
        let twist = Twist { v: mix(from.1.v, to.1.v), omega: mix(from.1.omega, to.1.omega) };
        let pose = from.0.toward(to.0, fraction);
        (Pose2 { heading: wrap_angle(pose.heading), ..pose }, twist)
    }

    fn knot(&self, k: usize) -> (Pose2, Twist) {
        let last = self.len();
        let (pose, twist) = if last == 0 || k == 0 { self.start } else { self.states.at(k.min(last) - 1) };
        (pose, if k > last { Twist::default() } else { twist })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion;

    /// Speeds up, turns, brakes: exact arcs from the origin, 0.3 s apart.
    fn curve() -> Trajectory {
        let mut pose = Pose2::default();
        let mut states = States::default();
        for (v, omega) in [(0.2, 0.0), (0.4, 0.5), (0.6, 0.5), (0.4, -0.5), (0.2, 0.0), (0.0, 0.0)] {
            let twist = Twist { v, omega };
            pose = motion::step(pose, twist, 0.3);
            states.push(pose, twist);
        }
        Trajectory::new(Default::default(), 0.3, states).unwrap()
    }

    /// What is left of `t` for a robot that is on it.
    fn left(t: &Trajectory, elapsed: f64) -> Trajectory {
        t.tail(elapsed, t.at(elapsed))
    }

    #[test]
    fn a_whole_step_later_states_are_the_same_bits() {
        let t = curve();
        // 0.3 s between stamps that are themselves rounded
        let tail = left(&t, 4.2 - 3.9);
        assert_eq!(tail.states.x[..5], t.states.x[1..]);
        assert_eq!(tail.states.omega[..5], t.states.omega[1..]);
        assert_eq!((tail.states.x[5], tail.states.v[5]), (t.states.x[5], 0.0));
        assert_eq!(left(&t, 0.0), t);
    }

    #[test]
    fn a_tail_of_a_tail_ends_where_one_tail_does() {
        let once = left(&curve(), 0.9);
        let twice = left(&left(&curve(), 0.3), 0.6);
        assert_eq!(once.states, twice.states);
        assert_eq!(left(&curve(), 99.0).states.at(0), (curve().states.at(5).0, Twist::default()));
    }

    #[test]
    fn the_tail_passes_through_the_same_poses_at_the_same_times() {
        let t = curve();
        for tenth in 0..20 {
            let elapsed = 0.1 * f64::from(tenth);
            for ahead in 1..5 {
                let time = 0.3 * f64::from(ahead);
                let (a, _) = t.at(elapsed + time);
                let (b, _) = left(&t, elapsed).at(time);
                assert!(a.position().distance(b.position()) < 1e-12, "{elapsed} {ahead}");
            }
        }
    }

    #[test]
    fn a_tail_covers_the_ground_its_speeds_say() {
        let mut states = States::default();
        let mut x = 0.0;
        for v in [0.2, 0.5, 0.9, 0.4, 0.0] {
            x += 0.3 * v;
            states.push(Pose2::new(x, 0.0, 0.0), Twist { v, omega: 0.0 });
        }
        let t = Trajectory::new(Default::default(), 0.3, states).unwrap();
        let tail = left(&t, 0.1);
        let mut from = t.at(0.1).0.x;
        for k in 0..4 {
            assert!((tail.states.x[k] - from - 0.3 * tail.states.v[k]).abs() < 1e-12, "{k}");
            from = tail.states.x[k];
        }
    }

    #[test]
    fn at_its_stamp_a_trajectory_is_at_its_start_and_after_its_end_it_rests() {
        let start = (Pose2::new(0.1, -0.2, 0.3), Twist { v: 0.4, omega: 0.1 });
        let t = Trajectory { start, ..curve() };
        assert_eq!(t.at(0.0), start);
        assert_eq!(t.at(-1.0), start);
        let half_way = t.at(0.15);
        assert_eq!(half_way.0.x, 0.1 + 0.5 * (t.states.x[0] - 0.1));
        assert_eq!(half_way.1.v, 0.4 + 0.5 * (0.2 - 0.4));
        assert_eq!(t.at(1e300), (t.states.at(5).0, Twist::default()));
        assert_eq!(Trajectory::none(0.3).at(1.0), Default::default());
    }

    #[test]
    fn knots_make_the_same_trajectory_again() {
        let t = left(&curve(), 0.1);
        assert_eq!(Trajectory::through(&t.knots(), 0.3), Ok(t));
        assert_eq!(Trajectory::through(&States::default(), 0.3), Err(StatesError::Shape));
    }

    #[test]
    fn what_is_no_trajectory_is_refused() {
        let new = |dt, x: &[f64], y: &[f64]| {
            let states = States { x: x.to_vec(), y: y.to_vec(), ..States::default() };
            Trajectory::new(Default::default(), dt, states)
        };
        assert_eq!(new(0.3, &[], &[]), Ok(Trajectory::none(0.3)));
        assert_eq!(new(0.0, &[], &[]), Err(StatesError::Shape));
        assert_eq!(new(0.3, &[], &[1.0]), Err(StatesError::Length { array: "y", found: 1, expected: 0 }));
        assert_eq!(new(0.3, &[1.0], &[]), Err(StatesError::Length { array: "y", found: 0, expected: 1 }));
        assert_eq!(new(0.3, &[f64::NAN], &[1.0]), Err(StatesError::NotFinite { array: "x", index: 0 }));
    }
}
