//! The parameters of all generators.

use crate::collision::CollisionParams;
use crate::collision_risk::RiskParams;
use crate::generation::bi_risk_rrt::BiRiskRrtParams;
use crate::generation::candidate_params::CandidateParams;
use crate::generation::risk_rrt::RiskRrtParams;
use crate::generation::rollout::RolloutParams;
use crate::generation::rrt_star::RrtStarParams;
use crate::parameters;

parameters! {
    /// Parameters of the generators.
    #[derive(Default)]
    #[serde(default)]
    #[non_exhaustive]
    pub struct GenerationParams {
        /// How the tree grows.
        pub tree: RrtStarParams [table],
        /// How its branches are driven.
        pub rollout: RolloutParams [table],
        /// What is offered.
        pub candidates: CandidateParams [table],
        /// The tree of the Risk-RRT baselines.
        pub risk_rrt: RiskRrtParams [table],
        /// What Bi-Risk-RRT does besides.
        pub bi_risk_rrt: BiRiskRrtParams [table],
        /// How much room is kept. Skipped: a profile says it once for all parts.
        #[serde(skip)]
        pub collision: CollisionParams,
        /// How the baselines weigh risk. Skipped likewise.
        #[serde(skip)]
        pub risk: RiskParams,
    }
}
