//! A planner that is not built in, as a robot asks it.

use curionav_planning::candidates::CandidateSet;
use curionav_planning::generation::GenerationInput;
use curionav_schemas::{Mission, Scan};

/// What proposes what the robot could do, in the place of a built-in generator.
pub trait OwnPlanner: Send {
    /// Takes note of the newest scan.
    fn see(&mut self, scan: &Scan);

    /// What the robot could do on its `mission`, the first choice first. Nothing if the planner has failed: the cycle
    /// then holds what was decided before, or stops.
    fn candidates(&mut self, mission: &Mission, input: &GenerationInput<'_>) -> CandidateSet;
}
