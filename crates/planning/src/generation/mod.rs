//! How candidates come to be (Alg. 1): a tree lives across cycles as a value (D15), and each cycle its
//! branches, timed and checked, become the candidates (D14).
//!
//! Read in this order: [`rrt_star`] (how the tree grows), [`update`] (how it follows the robot),
//! [`candidates`] (what is offered), [`rollout`] (how a path becomes a trajectory). The baselines are
//! [`risk_rrt`], [`bi_risk_rrt`] and [`transient_goal`]; what users would take instead are [`mppi`], [`dwa`] and
//! [`hrvo_robot`].

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
pub use registry::{GENERATORS, GeneratorKind, find, known, tables_of_others};
pub use risk_rrt::RiskRrtParams;
pub use rollout::RolloutParams;
pub use rrt_star::{Landmarks, RrtStar, RrtStarParams, SampleSpace};
pub use tree::Tree;

#[cfg(test)]
mod tests;
