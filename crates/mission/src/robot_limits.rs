//! The robot's own limits, from the driver's configuration: no mission and no decision can widen them.

use curionav_planning::geometry::Twist;
use curionav_planning::motion::RobotModel;
use curionav_planning::parameters::FieldError;
use curionav_schemas::{Clock, MissionOrder, Refusal, Reject};

use crate::convert;

curionav_planning::parameters! {
    /// What a real base can do, and how old what it is driven by may be. A mission may ask for less speed and more
    /// room, never for more speed or less room.
    pub struct RobotLimits {
        /// Greatest forward speed, m/s.
        pub v_max: f64 [0.01, 10.0, "m/s", "slower bases never arrive, faster ones do not belong among people"],
        /// Greatest acceleration, m/s2. The driver brakes with it, however gently a mission plans.
        pub a_max: f64 [0.01, 20.0, "m/s2", "weaker brakes need a hall to stop in, stronger ones no tyre has"],
        /// Greatest turn rate, rad/s.
        pub omega_max: f64 [0.01, 20.0, "rad/s", "slower bases never turn; three turns a second are plenty"],
        /// Greatest change of turn rate, rad/s2.
        pub alpha_max: f64 [0.01, 100.0, "rad/s2", "slower bases never turn; stronger motors no base has"],
        /// Greatest speed backwards, m/s, no more than `v_max`. At 0 the robot never drives backwards.
        #[serde(default)]
        pub v_reverse: f64 [0.0, 1.0, "m/s", "backwards is for the last resort, and no robot hurries there"],
        /// Radius of the disc around the centre of rotation that holds the whole robot with what it carries, metres.
        pub radius: f64 [0.05, 5.0, "m", "a service robot is no smaller and no larger"],
        /// Seconds between two messages of odometry.
        pub tick_s: f64 [0.01, 1.0, "s", "no planar laser scans more often, and a slower base reacts too late"],
        /// Seconds from odometry until the base begins to follow the command that was made from it, with the way of
        /// both over all links. If it is left out: one `tick_s`.
        #[serde(default)]
        pub latency_s: Option<f64> [0.0, 1.0, "s", "a base that obeys later cannot be driven among people"],
        /// A belief older than this stops the robot, seconds.
        #[serde(default = "default_belief_age_max")]
        pub belief_age_max: f64 [0.01, 2.0, "s", "an older belief says nothing of where the robot is"],
        /// A scan older than this stops the robot, seconds.
        #[serde(default = "default_scan_age_max")]
        pub scan_age_max: f64 [0.01, 2.0, "s", "in an older scan people stand where they have left"],
        /// A decision older than this stops the robot, however long it says that it is valid, seconds.
        #[serde(default = "default_decision_age_max")]
        pub decision_age_max: f64 [0.01, 5.0, "s", "an older decision was made among people who have moved on"],
    } check Self::is_slower_backwards
}

impl RobotLimits {
    fn is_slower_backwards(&self) -> Result<(), FieldError> {
        if self.v_reverse <= self.v_max {
            return Ok(());
        }
        let problem = format!("is {}, and v_max {}", self.v_reverse, self.v_max);
        Err(FieldError::new("v_reverse", problem, "give no more than v_max"))
    }

    /// A velocity within these limits; standing still if it is no motion.
    pub fn clamp(&self, twist: Twist) -> Twist {
        clamped(twist, (self.v_reverse, self.v_max), self.omega_max)
    }
}

fn default_belief_age_max() -> f64 {
    Ages::DEFAULT.belief
}

fn default_scan_age_max() -> f64 {
    Ages::DEFAULT.scan
}

/// An arbiter that hangs is noticed within it; it decides ten times per second.
fn default_decision_age_max() -> f64 {
    0.6
}

/// How old what a command is made from may be, seconds of the robot's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ages {
    /// The newest belief.
    pub belief: f64,
    /// The newest scan.
    pub scan: f64,
    /// The decision that is followed, which may say less of itself.
    pub decision: f64,
}

impl Ages {
    /// Of a robot that says nothing else. A profile lets decisions be valid for 1.2 s.
    pub const DEFAULT: Self = Self { belief: 0.5, scan: 0.5, decision: 1.2 };
}

/// The base that a driver commands.
#[derive(Debug, Clone, PartialEq)]
pub enum Base {
    /// A simulated one can do whatever its scenario says, in a time that passes as the run says.
    Simulated,
    /// A real one.
    Real(RobotLimits),
}

impl Base {
    /// Refuses an order that asks the base for more than it can do, or to see itself smaller than it is. Planner and
    /// driver then agree about every order that is not refused.
    pub fn check_order(&self, order: &MissionOrder) -> Result<(), Reject> {
        let Self::Real(own) = self else { return Ok(()) };
        let robot = convert::robot_model(&order.robot_model);
        let most = |field: &str, found: f64, most: f64| within(field, found, (0.0, most));
        most("robot_model.v_max", robot.v_max, own.v_max)?;
        most("robot_model.v_reverse", robot.v_reverse, own.v_reverse)?;
        most("robot_model.a_max", robot.a_max, own.a_max)?;
        most("robot_model.omega_max", robot.omega_max, own.omega_max)?;
        most("robot_model.alpha_max", robot.alpha_max, own.alpha_max)?;
        within("robot_model.footprint", robot.radius(), (own.radius, RADIUS_MAX))?;
        within("tick_s", order.tick_s, (own.tick_s - TICK_ROUNDING, own.tick_s + TICK_ROUNDING))?;
        if order.clock != Clock::Realtime {
            return Err(Refusal::RealtimeOnly.at("clock"));
        }
        within("time_scale", order.time_scale, (1.0, 1.0))
    }

    /// What the base does when it has to stop: `robot` with the base's own brakes, which are as strong as what a
    /// mission may plan with, or stronger.
    pub fn stopping(&self, robot: &RobotModel) -> RobotModel {
        match self {
            Self::Simulated => robot.clone(),
            Self::Real(own) => RobotModel { a_max: own.a_max, alpha_max: own.alpha_max, ..robot.clone() },
        }
    }

    /// How old what a command is made from may be.
    pub fn ages(&self) -> Ages {
        match self {
            // The profile of a simulated mission says how long a decision is valid.
            Self::Simulated => Ages { decision: f64::INFINITY, ..Ages::DEFAULT },
            Self::Real(own) => {
                Ages { belief: own.belief_age_max, scan: own.scan_age_max, decision: own.decision_age_max }
            }
        }
    }

    /// Seconds from odometry until the base follows the command made from it, when its ticks are `period` seconds
    /// apart. In lockstep the base carries out every command before it measures.
    pub fn latency(&self, clock: Clock, period: f64) -> f64 {
        match (self, clock) {
            (_, Clock::Lockstep) => 0.0,
            (Self::Simulated, Clock::Realtime) => period,
            (Self::Real(own), Clock::Realtime) => own.latency_s.unwrap_or(period),
        }
    }

    /// The command that reaches the base instead of `twist`: within the limits of base and mission, and standing still
    /// if `twist` is no motion.
    pub fn clamp(&self, twist: Twist, robot: &RobotModel) -> Twist {
        let within = clamped(twist, (robot.v_reverse, robot.v_max), robot.omega_max);
        match self {
            Self::Simulated => within,
            Self::Real(own) => own.clamp(within),
        }
    }
}

/// A velocity that is no faster backwards, forwards, and turning than these; standing still if it is no motion.
fn clamped(twist: Twist, (v_reverse, v_max): (f64, f64), omega_max: f64) -> Twist {
    if !(twist.v.is_finite() && twist.omega.is_finite()) {
        return Twist::default();
    }
    Twist { v: twist.v.clamp(0.0 - v_reverse, v_max), omega: twist.omega.clamp(-omega_max, omega_max) }
}

/// Footprints are no larger.
const RADIUS_MAX: f64 = 5.0;
/// The tick of a mission may be the base's own rounded to single precision, seconds.
const TICK_ROUNDING: f64 = 1e-6;

fn within(field: &str, found: f64, (least, most): (f64, f64)) -> Result<(), Reject> {
    if (least..=most).contains(&found) {
        return Ok(());
    }
    Err(Refusal::BeyondRobot { found, least, most }.at(field))
}

#[cfg(test)]
mod tests {
    use curionav_planning::parameters::Ranged;
    use curionav_testing::golden;

    use super::*;

    fn own() -> RobotLimits {
        toml::from_str(
            "v_max = 1.0\na_max = 0.5\nomega_max = 1.0\nalpha_max = 1.0\nradius = 0.3\ntick_s = 0.1",
        )
        .unwrap()
    }

    fn order() -> MissionOrder {
        let mut order = golden::mission().order;
        order.robot_model = convert::robot_model_to_wire(&RobotModel::default());
        (order.clock, order.time_scale, order.tick_s) = (Clock::Realtime, 1.0, 0.1);
        order
    }

    #[test]
    fn a_mission_that_asks_for_more_is_refused_by_field_with_the_limit() {
        let base = Base::Real(own());
        assert_eq!(base.check_order(&order()), Ok(()));
        type Asks = fn(&mut MissionOrder);
        let hostile: [(Asks, &str); 13] = [
            (|o| o.robot_model.v_max = 1e9, "robot_model.v_max"),
            (|o| o.robot_model.v_max = f64::NAN, "robot_model.v_max"),
            (|o| o.robot_model.v_reverse = 0.1, "robot_model.v_reverse"),
            (|o| o.robot_model.v_reverse = f64::NAN, "robot_model.v_reverse"),
            (|o| o.robot_model.a_max = 0.51, "robot_model.a_max"),
            (|o| o.robot_model.omega_max = f64::INFINITY, "robot_model.omega_max"),
            (|o| o.robot_model.alpha_max = 1.01, "robot_model.alpha_max"),
            (
                |o| o.robot_model.footprint = curionav_schemas::Footprint::Disc { radius: 1e-6 },
                "robot_model.footprint",
            ),
            (|o| o.tick_s = 10.0, "tick_s"),
            (|o| o.tick_s = 0.001, "tick_s"),
            (|o| o.tick_s = f64::NAN, "tick_s"),
            (|o| o.time_scale = 0.001, "time_scale"),
            (|o| o.clock = Clock::Lockstep, "clock"),
        ];
        for (asks, field) in hostile {
            let mut order = order();
            asks(&mut order);
            let reject = base.check_order(&order).unwrap_err();
            assert_eq!(reject.field.as_deref(), Some(field), "{reject}");
            assert_eq!(
                Base::Simulated.check_order(&order),
                Ok(()),
                "a simulated base is what its scenario says"
            );
        }
        let fast = MissionOrder {
            robot_model: curionav_schemas::RobotModel { v_max: 1.5, ..order().robot_model },
            ..order()
        };
        let said = base.check_order(&fast).unwrap_err().to_string();
        assert_eq!(said, "robot_model.v_max: 1.5 is not within 0 to 1, the robot's own limits");
    }

    #[test]
    fn a_mission_may_tighten_and_the_base_still_brakes_with_all_it_has() {
        let base = Base::Real(own());
        let mut gentle = order();
        (gentle.robot_model.v_max, gentle.robot_model.a_max, gentle.robot_model.alpha_max) =
            (0.3, 0.01, 0.01);
        gentle.robot_model.footprint = curionav_schemas::Footprint::Disc { radius: 0.6 };
        assert_eq!(base.check_order(&gentle), Ok(()));
        let stopping = base.stopping(&convert::robot_model(&gentle.robot_model));
        assert_eq!((stopping.v_max, stopping.a_max, stopping.alpha_max), (0.3, 0.5, 1.0));
    }

    #[test]
    fn what_is_no_motion_becomes_a_stand_and_what_is_too_much_the_limit() {
        let robot = RobotModel { v_max: 3.0, ..RobotModel::default() };
        for (base, v_max) in [(Base::Real(own()), 1.0), (Base::Simulated, 3.0)] {
            for (v, omega) in
                [(f64::NAN, 0.0), (0.0, f64::NAN), (f64::INFINITY, 0.0), (1.0, f64::NEG_INFINITY)]
            {
                assert_eq!(base.clamp(Twist { v, omega }, &robot), Twist::default());
            }
            let clamped = base.clamp(Twist { v: 1e9, omega: -1e9 }, &robot);
            assert_eq!(clamped, Twist { v: v_max, omega: -1.0 });
            assert_eq!(base.clamp(Twist { v: -1.0, omega: 0.5 }, &robot), Twist { v: 0.0, omega: 0.5 });
        }
        let backs = RobotModel { v_reverse: 0.3, ..robot };
        let back = |base: Base| base.clamp(Twist { v: -1.0, omega: 0.5 }, &backs).v;
        assert_eq!([back(Base::Simulated), back(Base::Real(own()))], [-0.3, 0.0]);
        assert_eq!(back(Base::Real(RobotLimits { v_reverse: 0.2, ..own() })), -0.2);
    }

    #[test]
    fn a_base_is_one_tick_late_unless_it_says_otherwise() {
        let late = Base::Real(RobotLimits { latency_s: Some(0.25), ..own() });
        assert_eq!(late.latency(Clock::Realtime, 0.1), 0.25);
        assert_eq!(Base::Real(own()).latency(Clock::Realtime, 0.1), 0.1);
        assert_eq!(Base::Simulated.latency(Clock::Realtime, 0.05), 0.05);
        assert_eq!(Base::Simulated.latency(Clock::Lockstep, 0.05), 0.0);
        let said = RobotLimits { latency_s: Some(2.0), ..own() }.check().unwrap_err().to_string();
        assert!(said.starts_with("latency_s: is 2; give 0 to 1 s"), "{said}");
    }

    #[test]
    fn limits_that_make_no_sense_are_refused() {
        let said = RobotLimits { radius: 0.0, ..own() }.check().unwrap_err().to_string();
        assert!(said.starts_with("radius: is 0"), "{said}");
        let error = toml::from_str::<RobotLimits>("v_max = 1.0").unwrap_err().to_string();
        assert!(error.contains("missing field"), "{error}");
    }
}
