//! The parameters of Bi-Risk-RRT.

use serde::{Deserialize, Serialize};

use crate::parameters;

parameters! {
    /// What Bi-Risk-RRT does besides Risk-RRT, whose parameters hold for both its trees.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    #[non_exhaustive]
    pub struct BiRiskRrtParams {
        /// Nodes of the two trees this near to each other make the reverse tree's way the heuristic, metres.
        #[field(0.01, 100.0, "m", "nearer nodes never meet, farther ones always do")]
        pub connect_distance: f64 = 1.0,
        /// Greedy extensions of one tree towards each new node of the other.
        #[field(0.0, 1000.0, "steps", "each looks at all nodes, and a cycle must end")]
        pub connect_steps: u32 = 5,
        /// Once there is a heuristic, the share of samples that are still drawn from the whole map.
        #[field(0.0, 1.0, "", "it is a share")]
        pub uniform_share: f64 = 0.5,
        /// Standard deviation of the others around the nodes of the heuristic on each axis, metres.
        #[field(0.01, 1000.0, "m", "below all samples are on the heuristic, above anywhere on the map")]
        pub spread: f64 = 3.0,
        /// Deepest node of the reverse tree.
        #[field(1.0, 10_000.0, "steps", "the whole tree has no more nodes")]
        pub reverse_depth: u32 = 300,
    }
}
