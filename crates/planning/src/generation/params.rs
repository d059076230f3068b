//! What generators take from a profile.

use crate::collision::CollisionParams;
use crate::collision_risk::RiskParams;
use crate::forecast::ForecastParams;
use crate::generation::bi_risk_rrt::BiRiskRrtParams;
use crate::generation::candidate_params::CandidateParams;
use crate::generation::risk_rrt::RiskRrtParams;
use crate::generation::rollout::RolloutParams;
use crate::generation::rrt_star::RrtStarParams;
use crate::parameters;
use crate::parameters::Range;

parameters! {
    /// Parameters that only generators have.
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
    }
}

parameters! {
    /// The part of a profile that a generator needs, as it travels to one: any replica then computes the same.
    #[non_exhaustive]
    pub struct GeneratorPart {
        /// States per candidate.
        pub steps: usize [in GeneratorPart::STEPS],
        /// Seconds between states.
        pub dt: f64 [in GeneratorPart::DT],
        /// Average speed below which a candidate counts as slow, m/s (D4).
        pub min_speed: f64 [in GeneratorPart::MIN_SPEED],
        /// The tree and its candidates.
        pub generation: GenerationParams [table],
        /// How much room is kept.
        pub collision: CollisionParams [table],
        /// How the baselines weigh risk.
        pub risk: RiskParams [table],
        /// How people move on.
        pub forecast: ForecastParams [table],
    }
}

impl GeneratorPart {
    /// What K may be.
    pub const STEPS: Range = Range {
        least: 1.0,
        most: 200.0,
        unit: "states",
        why: "a message takes 256 per candidate, and the previous one's are added while braking",
    };
    /// What the time step may be.
    pub const DT: Range = Range {
        least: 0.02,
        most: 2.0,
        unit: "s",
        why: "a shorter step is no cycle, and in a longer one people pass unseen between two states",
    };

    /// What the slowest speed may be.
    pub const MIN_SPEED: Range = Range { least: 0.0, most: 10.0, unit: "m/s", why: "no robot drives faster" };
}
