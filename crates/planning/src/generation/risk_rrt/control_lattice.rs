//! The parameters of Risk-RRT, and the controls a node may be left by: a lattice over what acceleration allows.

use crate::geometry::Twist;
use crate::motion::RobotModel;
use crate::parameters::{FieldError, Range};

crate::parameters! {
    /// Parameters of the tree of Risk-RRT. K, dt and the weights of risk are said elsewhere in the profile.
    #[non_exhaustive]
    pub struct RiskRrtParams {
        /// Nodes added in a cycle.
        pub nodes: u32 [1.0, 8000.0, "nodes", "each looks at all nodes, and a cycle must end"] = 800,
        /// Most nodes a tree may have.
        pub max_nodes: u32 [1.0, 8000.0, "nodes", "two trees have to fit into one message of 16384 nodes"] = 3000,
        /// Deepest node, steps from the root; less if K leaves no room to brake after it.
        pub max_depth: u32 [1.0, 200.0, "steps", "a candidate has no more states"] = 50,
        /// Speeds a node may be left with.
        pub v_controls: u32 [1.0, 128.0, "speeds", "a node marks its used controls in 128 bits"] = 5,
        /// Turn rates a node may be left with.
        pub omega_controls: u32 [1.0, 128.0, "turn rates", "a node marks its used controls in 128 bits"] = 9,
        /// A node with a greater probability of collision is not gone on from, (0, 1].
        pub threshold: f64 [1e-6, 1.0, "", "it is a probability, and at none no node is ever gone on from"] = 0.9,
        /// Share of samples that are the goal itself.
        pub goal_bias: f64 [in Range::SHARE] = 0.01,
        /// Samples lie within this many metres of the best node to every side.
        pub window: f64
            [0.1, 1000.0, "m", "a smaller window holds no other node, a greater one is the whole map"] = 5.0,
        /// Farther from its path than this the robot starts a new tree, metres.
        pub off_path: f64 [0.0, 100.0, "m", "farther away than that the tree says nothing about the robot"] = 0.3,
        /// Most paths offered.
        pub max_candidates: u32
            [1.0, 512.0, "paths", "the candidates of eight trees fit into one message of 4096"] = 100,
    } check Self::fits_its_bits
}

impl RiskRrtParams {
    /// Whether a node has a bit for each of its controls.
    fn fits_its_bits(&self) -> Result<(), FieldError> {
        if self.v_controls * self.omega_controls <= ControlLattice::MOST {
            return Ok(());
        }
        Err(FieldError::new(
            "omega_controls",
            format!("makes {} controls with v_controls", self.v_controls * self.omega_controls),
            format!("keep their product at {} or below", ControlLattice::MOST),
        ))
    }
}

/// `v_count * omega_count` twists a step, from the slowest and rightmost on.
///
/// Both ranges are cut evenly into as many parts as there are values, each represented by its lower end,
/// as in the authors' code: the upper end is left out, so a robot cruises half an acceleration step below
/// its top speed.
#[derive(Debug, Clone)]
pub struct ControlLattice<'a> {
    /// Limits on speed, turn rate and their changes.
    pub robot: &'a RobotModel,
    /// Seconds a control lasts.
    pub dt: f64,
    /// Where the speeds lie between the least and the greatest that can be reached, [0, 1).
    speeds: Vec<f64>,
    /// The same of the turn rates.
    rates: Vec<f64>,
}

impl<'a> ControlLattice<'a> {
    /// Most controls a lattice may have: one bit each in [`super::TimeTree`].
    pub const MOST: u32 = 128;

    /// Controls of `dt` seconds for `robot`: so many speeds times so many turn rates.
    pub fn new(robot: &'a RobotModel, dt: f64, speeds: u32, rates: u32) -> Self {
        let shares = |count: u32| (0..count).map(|k| f64::from(k) / f64::from(count)).collect();
        Self { robot, dt, speeds: shares(speeds), rates: shares(rates) }
    }

    /// Number of controls.
    pub fn count(&self) -> u32 {
        (self.speeds.len() * self.rates.len()) as u32
    }

    /// The speeds after `current`, ascending, m/s: one, the hardest braking, if the robot cannot get below its greatest
    /// speed within a step.
    pub fn speeds(&self, current: Twist) -> impl ExactSizeIterator<Item = f64> {
        let change = self.robot.a_max * self.dt;
        parts(current.v, change, 0.0, self.robot.v_max.max(current.v - change), &self.speeds)
    }

    /// The turn rates after `current`, ascending, rad/s.
    pub fn rates(&self, current: Twist) -> impl ExactSizeIterator<Item = f64> {
        let most = self.robot.omega_max;
        parts(current.omega, self.robot.alpha_max * self.dt, -most, most, &self.rates)
    }

    /// Control number `control` of a node that was reached with `current`: the turn rates of the least speed come
    /// first. At rest beyond the last.
    pub fn twist(&self, current: Twist, control: u32) -> Twist {
        let speed = control as usize / self.rates.len();
        let rate = control as usize % self.rates.len();
        Twist {
            v: self.speeds(current).nth(speed).unwrap_or_default(),
            omega: self.rates(current).nth(rate).unwrap_or_default(),
        }
    }

    /// The number of the control that is `wanted`, if there is one.
    pub fn control(&self, current: Twist, wanted: Twist) -> Option<u32> {
        let speed = self.speeds(current).position(|v| v == wanted.v)?;
        let rate = self.rates(current).position(|omega| omega == wanted.omega)?;
        Some((speed * self.rates.len() + rate) as u32)
    }

    /// The twist one step of hardest braking later, on the same curve as far as turning can be slowed.
    pub fn braked(&self, current: Twist) -> Twist {
        let v = (current.v - self.robot.a_max * self.dt).max(0.0);
        let wanted = if current.v > 0.0 { current.omega * v / current.v } else { 0.0 };
        let change = self.robot.alpha_max * self.dt;
        Twist { v, omega: wanted.clamp(current.omega - change, current.omega + change) }
    }

    /// Steps of braking from top speed and fastest turning.
    pub fn braking_steps(&self) -> u32 {
        let fastest = Twist { v: self.robot.v_max, omega: self.robot.omega_max };
        let braking = std::iter::successors(Some(fastest), |&twist| Some(self.braked(twist)));
        braking.take(usize::from(u16::MAX)).take_while(|&twist| twist != Twist::default()).count() as u32
    }
}

/// The `shares` of what can be reached from `current` by a change of `change`, within the limits.
fn parts(
    current: f64,
    change: f64,
    low: f64,
    high: f64,
    shares: &[f64],
) -> impl ExactSizeIterator<Item = f64> {
    let (low, high) = ((current - change).clamp(low, high), (current + change).clamp(low, high));
    shares.iter().map(move |share| low + share * (high - low))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(robot: &RobotModel) -> ControlLattice<'_> {
        ControlLattice::new(robot, 0.3, 3, 5)
    }

    #[test]
    fn controls_are_distinct_and_within_reach() {
        let robot = RobotModel::default();
        let lattice = lattice(&robot);
        for current in [(0.0, 0.0), (0.5, 0.9), (1.0, -1.0), (0.97, 0.2)] {
            let current = Twist { v: current.0, omega: current.1 };
            for k in 0..lattice.count() {
                let t = lattice.twist(current, k);
                assert!((0.0..=1.0).contains(&t.v) && t.omega.abs() <= 1.0);
                assert!(
                    (t.v - current.v).abs() <= 0.15 + 1e-12 && (t.omega - current.omega).abs() <= 0.3 + 1e-12
                );
                assert_eq!(lattice.control(current, t), Some(k));
            }
        }
    }

    #[test]
    fn the_cruising_speed_is_half_an_acceleration_step_below_the_top() {
        let robot = RobotModel::default();
        let lattice = lattice(&robot);
        let mut twist = Twist::default();
        for _ in 0..100 {
            twist = lattice.twist(twist, lattice.count() - 1);
        }
        // v* = v* - a dt + 2/3 (v_max - v* + a dt), so v* = v_max - a dt / 2
        assert!((twist.v - 0.925).abs() < 1e-9, "{}", twist.v);
    }

    #[test]
    fn braking_ends_in_standing_still() {
        let robot = RobotModel::default();
        let lattice = lattice(&robot);
        let mut twist = Twist { v: 1.0, omega: 0.8 };
        for _ in 0..7 {
            let next = lattice.braked(twist);
            assert!(twist.v - next.v <= 0.15 + 1e-12 && (twist.omega - next.omega).abs() <= 0.3 + 1e-12);
            twist = next;
        }
        assert_eq!(twist, Twist::default());
    }
}
