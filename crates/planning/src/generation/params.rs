//! The parameters of all generators.

use serde::{Deserialize, Serialize};

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
    #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    #[non_exhaustive]
    pub struct GenerationParams {
        /// How the tree grows.
        #[field(table)]
        pub tree: RrtStarParams,
        /// How its branches are driven.
        #[field(table)]
        pub rollout: RolloutParams,
        /// What is offered.
        #[field(table)]
        pub candidates: CandidateParams,
        /// The tree of the Risk-RRT baselines.
        #[field(table)]
        pub risk_rrt: RiskRrtParams,
        /// What Bi-Risk-RRT does besides.
        #[field(table)]
        pub bi_risk_rrt: BiRiskRrtParams,
        /// How much room is kept. Skipped: a profile says it once for all parts.
        #[serde(skip)]
        pub collision: CollisionParams,
        /// How the baselines weigh risk. Skipped likewise.
        #[serde(skip)]
        pub risk: RiskParams,
    }
}
