//! How candidates are made (Alg. 1). A search tree is kept from cycle to cycle, as a value that a generator gets and
//! gives back (D15). In each cycle the branches of the tree become the candidates: each is driven at several speeds and
//! checked for collisions (D14). `docs/methods.md` has D14 and D15.
//!
//! Read in this order: [`rrt_star`] (how the tree grows), [`update`] (how it follows the robot), [`candidates`] (what
//! is offered), [`rollout`] (how a path becomes a trajectory). A generator looks at [`Pace`] to see how much of its
//! time is over. [`Besides`] says which paths are offered that are no branches.
//!
//! [`risk_rrt`], [`bi_risk_rrt`] and [`transient_goal`] are the generators of planners that the paper compares with.
//! [`mppi`], [`dwa`] and [`hrvo_robot`] are common planners, for comparison as well. The last four try out commands,
//! and `commanded` makes candidates of these. `way_past` finds a way between people who stand in the way. [`own`] makes
//! candidates of what a planner proposes that is not built in.

pub mod bi_risk_rrt;
pub mod branches;
pub mod candidates;
mod commanded;
mod commanded_params;
pub mod dubins;
pub mod dwa;
mod generator;
pub mod hrvo_robot;
pub mod mppi;
mod neighbours;
pub mod own;
mod pace;
mod params;
pub mod path;
pub mod pose_tree;
mod recovery;
mod registry;
pub mod risk_rrt;
pub mod rollout;
pub mod rrt_star;
pub mod rrt_star_generator;
pub mod transient_goal;
pub mod tree;
pub mod update;
mod way_past;

pub use bi_risk_rrt::BiRiskRrtParams;
pub use candidates::find_candidates;
pub use commanded_params::{DwaParams, HrvoRobotParams, MppiParams, TransientGoalParams};
pub use generator::{Generated, GenerationInput};
pub use pace::Pace;
pub use params::{Besides, CandidateParams, GenerationParams, GeneratorPart, RecoveryParams};
pub use pose_tree::PoseTree;
pub use registry::{GENERATORS, GeneratorKind, find, generator_names, tables_not_read_by};
pub use risk_rrt::RiskRrtParams;
pub use rollout::RolloutParams;
pub use rrt_star::{Landmarks, RrtStar, RrtStarParams, SampleSpace};
pub use tree::Tree;

#[cfg(test)]
mod tests;
