//! The parameters of the candidates that a tree offers.

use serde::{Deserialize, Serialize};

use crate::parameters;

parameters! {
    /// Parameters of candidates.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    #[non_exhaustive]
    pub struct CandidateParams {
        /// States per candidate, K (A26): with `dt` the horizon. Skipped, as are `dt` and `slow`: a profile
        /// says them once for all parts.
        #[serde(skip)]
        pub steps: u32 = 13,
        /// Seconds between states (A26).
        #[serde(skip)]
        pub dt: f64 = 0.3,
        /// Cruising speeds each path is timed with, as fractions of the greatest.
        #[field(
            0.01, 1.0, "",
            "it is a share of the greatest speed, and a robot at rest gets nowhere"; 1.0, 8.0, "every \
             branch is timed with each"
        )]
        pub profiles: Vec<f64> = vec![1.0, 0.7, 0.45],
        /// Cruising speed tried when too few candidates are free otherwise.
        #[field(0.01, 1.0, "", "it is a share of the greatest speed, and a robot at rest gets nowhere")]
        pub creep: f64 = 0.2,
        /// Most candidates, I (A24).
        #[field(1.0, 512.0, "candidates", "the candidates of eight trees fit into one message of 4096")]
        pub max_candidates: u32 = 100,
        /// With fewer free candidates than this, straight ways in all directions and creeping are tried too.
        #[field(0.0, 512.0, "candidates", "more than max_candidates there never are")]
        pub min_candidates: u32 = 20,
        /// Most branches of the tree that are timed.
        #[field(1.0, 1000.0, "branches", "each is timed with every profile, and a cycle must end")]
        pub max_branches: u32 = 72,
        /// Candidates slower than this on average compete only if no faster one is free, m/s (D4). Meant at
        /// cruising speed: from lower speeds it shrinks as the fastest mean that acceleration allows does.
        #[serde(skip)]
        pub slow: f64 = 0.35,
        /// The goal is reached within this distance, metres: a candidate that stops there is not slow.
        #[field(0.01, 10.0, "m", "no pose is exact, and beyond some metres it is another place")]
        pub goal_tolerance: f64 = 0.5,
        /// Time at which candidates have to differ, seconds.
        #[field(0.0, 1000.0, "s", "beyond the horizon the last state counts")]
        pub differ_by: f64 = 2.0,
        /// Cell side that tells positions at that time apart, metres.
        #[field(0.001, 100.0, "m", "below all positions differ, above none")]
        pub near_cell: f64 = 0.1,
        /// Angle that tells headings at that time apart, radians: from rest, little else differs by then.
        #[field(0.001, 6.3, "rad", "below all headings differ, above none")]
        pub near_angle: f64 = 0.2,
        /// Cell side that tells final positions apart, metres.
        #[field(0.001, 100.0, "m", "below all positions differ, above none")]
        pub end_cell: f64 = 0.3,
        /// From this angle between heading and way on, turning on the spot first is offered, radians.
        #[field(0.01, 3.15, "rad", "no angle is greater than half a turn")]
        pub turn_from: f64 = std::f64::consts::FRAC_PI_3,
    }
}
