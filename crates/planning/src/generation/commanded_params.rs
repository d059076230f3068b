//! Parameters of the generators that choose by themselves.

use crate::hrvo::HrvoParams;

crate::parameters! {
    /// Parameters of the planner by transient goals.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct TransientGoalParams {
        /// Distance of the waypoint along the shortest way, metres.
        pub waypoint: f64 [0.1, 100.0, "m", "nearer ones are the goals themselves"] = 4.0,
        /// Bearings of goals to each side, in steps of ten degrees.
        pub bearings: u32 [0.0, 17.0, "bearings", "more would lie behind the robot"] = 9,
        /// Cost of a person where the goal is.
        pub people: f64 [0.0, 1e6, "m", "costs have to stay finite"] = 2.0,
        /// Distance in which that falls to 0.6 of it, metres.
        pub people_sigma: f64 [0.01, 100.0, "m", "farther away people do not matter"] = 0.8,
        /// Cost of a radian between the goal's bearing and that of the last one.
        pub change: f64 [0.0, 1e6, "m/rad", "costs have to stay finite"] = 0.3,
        /// What a person is worth who walks the same way, within 3 m ahead.
        pub follow: f64 [0.0, 1e6, "m", "costs have to stay finite"] = 0.5,
        /// Longest time that a goal is kept, seconds.
        pub keep: f64 [0.0, 60.0, "s", "no goal nearby holds for a minute"] = 2.0,
        /// A goal is reached this near to it, metres.
        pub reached: f64 [0.01, 10.0, "m", "farther away it is another place"] = 0.3,
        /// Speed per metre to the goal, 1/s.
        pub speed_gain: f64 [0.01, 100.0, "1/s", "the limits of the robot hold anyway"] = 0.8,
        /// Turn rate per radian to the goal, 1/s.
        pub turn_gain: f64 [0.01, 100.0, "1/s", "the limits of the robot hold anyway"] = 1.5,
        /// Least time to collision of the first command, seconds.
        pub least_time: f64 [0.0, 60.0, "s", "no forecast holds for a minute"] = 1.0,
        /// Most goals offered.
        pub offers: u32 [1.0, 512.0, "candidates", "the candidates of eight trees fit into one message of 4096"] = 20,
    }
}

crate::parameters! {
    /// Parameters of model predictive path integral control.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct MppiParams {
        /// Rollouts of a cycle.
        pub rollouts: u32 [2.0, 20_000.0, "rollouts", "a cycle must end"] = 2000,
        /// Commands of a sequence.
        pub commands: u32 [2.0, 256.0, "commands", "a cycle must end, and no forecast holds longer"] = 56,
        /// Seconds that each lasts.
        pub period: f64 [0.01, 1.0, "s", "shorter ones change nothing, in longer ones people pass unseen"] = 0.05,
        /// Commands in a row that are perturbed alike. Nav2 has 1, for robots that follow at once; one that gains 0.5
        /// m/s in a second averages such perturbations out.
        pub hold: u32 [1.0, 256.0, "commands", "longer than a sequence is no different"] = 14,
        /// Standard deviation of the perturbation of speed, m/s.
        pub sigma_v: f64 [1e-3, 10.0, "m/s", "without any there is nothing to choose from"] = 0.4,
        /// Standard deviation of the perturbation of turn rate, rad/s.
        pub sigma_omega: f64 [1e-3, 20.0, "rad/s", "without any there is nothing to choose from"] = 0.6,
        /// Cost by which a rollout weighs a third of another.
        pub temperature: f64 [1e-4, 1e6, "", "at none the best rollout is taken alone"] = 0.3,
        /// How much a perturbation against the present sequence costs.
        pub gamma: f64 [0.0, 1e6, "", "costs have to stay finite"] = 0.015,
        /// Cost of a metre to go at the end.
        pub goal: f64 [0.0, 1e6, "1/m", "costs have to stay finite"] = 5.0,
        /// Cost of ending with the back to the way on.
        pub angle: f64 [0.0, 1e6, "", "costs have to stay finite"] = 2.0,
        /// Cost of a second as near to a wall or a person as the final check allows.
        pub obstacle: f64 [0.0, 1e6, "1/s", "costs have to stay finite"] = 10.0,
        /// How fast that falls with the gap, per metre.
        pub decay: f64 [0.0, 1000.0, "1/m", "faster is touching alone"] = 5.0,
        /// Cost of coming nearer.
        pub contact: f64 [0.0, 1e9, "", "costs have to stay finite"] = 1000.0,
        /// Whether people are expected to walk on. If not, they count where they are, as in a costmap.
        pub forecast: bool = true,
        /// People slower than this, m/s, are on the map of the shortest way, as in a costmap. At 0 no one is.
        pub around: f64 [0.0, 100.0, "m/s", "no person is faster"] = 0.2,
        /// Most candidates offered.
        pub offers: u32 [1.0, 512.0, "candidates", "the candidates of eight trees fit into one message of 4096"] = 24,
    }
}

crate::parameters! {
    /// Parameters of the dynamic window approach.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct DwaParams {
        /// Speeds tried, and as many turn rates.
        pub samples: u32 [2.0, 64.0, "values", "the work grows with the square"] = 20,
        /// Seconds an arc is looked ahead.
        pub look_ahead: f64 [0.1, 20.0, "s", "shorter shows nothing, and no forecast holds longer"] = 1.7,
        /// Cost of a metre from the shortest way to the goal, at the end of the arc.
        pub path: f64 [0.0, 1e6, "1/m", "costs have to stay finite"] = 16.0,
        /// Cost of a metre to go.
        pub goal: f64 [0.0, 1e6, "1/m", "costs have to stay finite"] = 12.0,
        /// How far ahead of the robot both are measured once more, so that it faces its way, metres.
        pub ahead: f64 [0.0, 10.0, "m", "farther ahead is another place"] = 0.325,
        /// Cost of being as near to a wall or a person as the final check allows.
        pub obstacle: f64 [0.0, 1e6, "", "costs have to stay finite"] = 5.04,
        /// How fast that falls with the gap, per metre.
        pub decay: f64 [0.0, 1000.0, "1/m", "faster is touching alone"] = 3.0,
        /// People slower than this, m/s, are on the map of the shortest way, as in a costmap. At 0 no one is.
        pub around: f64 [0.0, 100.0, "m/s", "no person is faster"] = 0.2,
        /// Most candidates offered, two for each arc.
        pub offers: u32 [1.0, 512.0, "candidates", "the candidates of eight trees fit into one message of 4096"] = 60,
    }
}

crate::parameters! {
    /// Parameters of the robot as an agent among others.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct HrvoRobotParams {
        /// Distance of the point on the shortest way that it wants to go to, metres.
        pub ahead: f64 [0.1, 20.0, "m", "nearer points are no direction, farther ones lie behind walls"] = 1.0,
        /// How far ahead of the axis the body's centre is, metres: less asks for faster turns, more for more room.
        pub lead: f64 [0.01, 10.0, "m", "at none it cannot go in any direction, farther is another body"] = 0.2,
        /// People slower than this, m/s, are on the map of the shortest way, as in a costmap. At 0 no one is.
        pub around: f64 [0.0, 100.0, "m/s", "no person is faster"] = 0.2,
        /// Candidates offered, each with a lower greatest speed.
        pub offers: u32 [1.0, 64.0, "candidates", "slower ones hardly differ"] = 5,
        /// The law, as people have it.
        pub law: HrvoParams [table] = HrvoParams::default(),
    }
}
