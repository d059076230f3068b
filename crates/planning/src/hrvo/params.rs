//! What the HRVO people's behaviour depends on.

use crate::parameters::Range;

crate::parameters! {
    /// Parameters of people who walk by hybrid reciprocal velocity obstacles. Their radius is
    /// `people.radius`, their preferred speed the walker's own. The library of the method's authors has no
    /// defaults; these are for people in metres.
    #[derive(Copy)]
    pub struct HrvoParams {
        /// Others farther away than this, centre to centre, are not minded, metres. Default 5: some four
        /// seconds ahead when two people walk towards each other.
        pub neighbor_distance: f64
            [0.1, 100.0, "m", "people nearer than that touch, and people farther away do not matter"] = 5.0,
        /// Most others minded at once, the nearest. The work grows with its third power. Default 10, as in
        /// the authors' example.
        pub max_neighbors: u32 [1.0, 64.0, "people", "the work grows with the third power"] = 10,
        /// A route's corner is reached this near to it, metres. Default 0.3: about a body.
        pub goal_radius: f64 [in Range::GOAL_TOLERANCE] = 0.3,
        /// Fastest a person walks to get out of the way, as a factor of the preferred speed. Default 1.3.
        pub max_speed_factor: f64 [1.0, 10.0, "", "a person can at least walk as fast as preferred"] = 1.3,
        /// Greatest change of velocity, m/s2. Default 2: a walker stops within a step.
        pub max_accel: f64
            [0.01, 1000.0, "m/s2", "at none people never walk, and beyond the greatest every stop is at once"] = 2.0,
        /// Others' velocities are trusted less by moving every obstacle's apex towards the person by this,
        /// m/s, once for each combined radius of distance. Default 0: the simulator knows them.
        pub uncertainty_offset: f64 [0.0, 10.0, "m/s", "no person runs faster"] = 0.0,
        /// Speed towards a wall is at most what would close the gap to it in this time, seconds. Default 0.5:
        /// people walk close along walls but not into them.
        pub wall_horizon_s: f64
            [0.01, 10.0, "s", "below a tick people walk into walls, and above they do not go near them"] = 0.5,
    }
}
