//! What the HRVO people's behaviour depends on.

use serde::{Deserialize, Serialize};

/// Parameters of people who walk by hybrid reciprocal velocity obstacles. Their radius is
/// `people.radius`, their preferred speed the walker's own. The library of the method's authors has no
/// defaults; these are for people in metres (`docs/methods.md` 10.2).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HrvoParams {
    /// Others farther away than this, centre to centre, are not minded, metres. Default 5: some four
    /// seconds ahead when two people walk towards each other.
    pub neighbor_distance: f64,
    /// Most others minded at once, the nearest. The work grows with its third power. Default 10, as in
    /// the authors' example.
    pub max_neighbors: u32,
    /// A route's corner is reached this near to it, metres. Default 0.3: about a body.
    pub goal_radius: f64,
    /// Fastest a person walks to get out of the way, as a factor of the preferred speed. Default 1.3.
    pub max_speed_factor: f64,
    /// Greatest change of velocity, m/s2. Default 2: a walker stops within a step.
    pub max_accel: f64,
    /// Others' velocities are trusted less by moving every obstacle's apex towards the person by this,
    /// m/s, once for each combined radius of distance. Default 0: the simulator knows them.
    pub uncertainty_offset: f64,
    /// Speed towards a wall is at most what would close the gap to it in this time, seconds. Default 0.5:
    /// people walk close along walls but not into them.
    pub wall_horizon_s: f64,
}

impl Default for HrvoParams {
    fn default() -> Self {
        Self {
            neighbor_distance: 5.0,
            max_neighbors: 10,
            goal_radius: 0.3,
            max_speed_factor: 1.3,
            max_accel: 2.0,
            uncertainty_offset: 0.0,
            wall_horizon_s: 0.5,
        }
    }
}

impl HrvoParams {
    /// Whether all values are the default's.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}
