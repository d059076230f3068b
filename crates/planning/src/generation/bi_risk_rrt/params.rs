//! The parameters of Bi-Risk-RRT.

use crate::parameters::Range;

crate::parameters! {
    /// What Bi-Risk-RRT does besides Risk-RRT, whose parameters hold for both its trees.
    #[non_exhaustive]
    pub struct BiRiskRrtParams {
        /// Nodes of the two trees this near to each other make the reverse tree's way the heuristic, metres.
        pub connect_distance: f64 [0.01, 100.0, "m", "nearer nodes never meet, farther ones always do"] = 1.0,
        /// Greedy extensions of one tree towards each new node of the other.
        pub connect_steps: u32 [0.0, 1000.0, "steps", "each looks at all nodes, and a cycle must end"] = 5,
        /// Once there is a heuristic, the share of samples that are still drawn from the whole map.
        pub uniform_share: f64 [in Range::SHARE] = 0.5,
        /// Standard deviation of the others around the nodes of the heuristic on each axis, metres.
        pub spread: f64
            [0.01, 1000.0, "m", "below all samples are on the heuristic, above anywhere on the map"] = 3.0,
        /// Deepest node of the reverse tree.
        pub reverse_depth: u32 [1.0, 10_000.0, "steps", "the whole tree has no more nodes"] = 300,
    }
}
