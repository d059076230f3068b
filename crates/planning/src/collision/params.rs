//! What decides how much room is kept.

crate::parameters! {
    /// How much room is kept around the robot (D12).
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct CollisionParams {
        /// Standard deviations of position (belief and forecast together) added to every distance, D12's k.
        pub sigma_factor: f64 [0.0, 10.0, "standard deviations", "ten are certainty"] = 0.5,
        /// Cap of that addition, metres: beyond it uncertainty would close every passage.
        pub max_inflation: f64 [0.0, 10.0, "m", "more room than that no passage has"] = 0.25,
        /// Room kept to walls whatever the uncertainty, metres: what tracking a trajectory may miss it by.
        pub wall_margin: f64 [0.0, 10.0, "m", "more room than that no passage has"] = 0.05,
        /// Room kept to people whatever the uncertainty, metres.
        pub person_margin: f64 [0.0, 10.0, "m", "more room than that no passage has"] = 0.1,
        /// Whether candidates from which the robot could still be stopped short of people, if they stopped walking
        /// right now, are preferred to all others. The paper has no such rule.
        pub stop_short: bool = true,
        /// Seconds of a trajectory that are checked: the same for every planner, however far it looks ahead. Beyond, a
        /// forecast at constant velocity says little, and the next cycles look again.
        pub horizon: f64 [0.1, 60.0, "s", "a decision is followed for a second, and no forecast holds for a minute"] = 3.9,
        /// The same of people for a robot that is impatient, seconds: it counts on those who are farther away to make way.
        /// At 0 that makes no difference.
        pub impatient_horizon: f64 [0.0, 60.0, "s", "no forecast holds for a minute"] = 0.0,
        /// People who are slower than this stand, m/s: they are forecast to stay where they are, and to be known there
        /// as well as now. At 0 all people are forecast to walk on.
        pub standing: f64 [0.0, 1.0, "m/s", "people walk faster than that"] = 0.0,
        /// Seconds in one place after which no more than 0.03 m is asked of walls and of people
        /// who stand: a robot between people who wait for it leaves by a narrow way. At 0 that never happens.
        pub tight_after: f64 [0.0, 1000.0, "s", "a mission does not last longer"] = 0.0,
        /// Whether people are forecast to stop before they walk into the robot where it is, if nothing is free
        /// otherwise. Without it nothing is free where a person comes, not even to stand.
        pub people_stop: bool = false,
        /// Whether the arbiter checks what it takes for collisions before it goes out. Without it the driver's guard
        /// alone keeps the robot from what its laser sees: for comparing planners that are to answer for themselves.
        pub final_check: bool = true,
    }
}

impl CollisionParams {
    /// Seconds of a trajectory for which people are in the way of a robot that is impatient or not.
    pub(super) fn people_horizon(&self, impatient: bool) -> f64 {
        let shorter = impatient && self.impatient_horizon > 0.0;
        if shorter { self.horizon.min(self.impatient_horizon) } else { self.horizon }
    }
}
