//! The parameters of Risk-RRT.

use crate::generation::risk_rrt::control_lattice::ControlLattice;
use crate::parameters::{FieldError, Range};

crate::parameters! {
    /// Parameters of the tree of Risk-RRT. K, dt and the weights of risk are said elsewhere in the profile.
    #[non_exhaustive]
    pub struct RiskRrtParams {
        /// Nodes added in a cycle.
        pub nodes: u32 [1.0, 8000.0, "nodes", "each looks at all nodes, and a cycle must end"] = 800,
        /// Most nodes a tree may have.
        pub max_nodes: u32 [1.0, 8000.0, "nodes", "two trees have to fit into one message of 16384 nodes"] = 3000,
        /// Deepest node, steps from the root; less if K leaves no room to brake after it.
        pub max_depth: u32 [1.0, 200.0, "steps", "a candidate has no more states"] = 50,
        /// Speeds a node may be left with.
        pub v_controls: u32 [1.0, 128.0, "speeds", "a node marks its used controls in 128 bits"] = 5,
        /// Turn rates a node may be left with.
        pub omega_controls: u32 [1.0, 128.0, "turn rates", "a node marks its used controls in 128 bits"] = 9,
        /// A node with a greater probability of collision is not gone on from, (0, 1].
        pub threshold: f64 [1e-6, 1.0, "", "it is a probability, and at none no node is ever gone on from"] = 0.9,
        /// Share of samples that are the goal itself.
        pub goal_bias: f64 [in Range::SHARE] = 0.01,
        /// Samples lie within this many metres of the best node to every side.
        pub window: f64
            [0.1, 1000.0, "m", "a smaller window holds no other node, a greater one is the whole map"] = 5.0,
        /// Farther from its path than this the robot starts a new tree, metres.
        pub off_path: f64 [0.0, 100.0, "m", "farther away than that the tree says nothing about the robot"] = 0.3,
        /// Most paths offered.
        pub max_candidates: u32
            [1.0, 512.0, "paths", "the candidates of eight trees fit into one message of 4096"] = 100,
    } check Self::fits_its_bits
}

impl RiskRrtParams {
    /// Whether a node has a bit for each of its controls.
    fn fits_its_bits(&self) -> Result<(), FieldError> {
        if self.v_controls * self.omega_controls <= ControlLattice::MOST {
            return Ok(());
        }
        Err(FieldError::new(
            "omega_controls",
            format!("makes {} controls with v_controls", self.v_controls * self.omega_controls),
            format!("keep their product at {} or below", ControlLattice::MOST),
        ))
    }
}
