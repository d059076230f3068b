//! How candidates come to be (Alg. 1).

pub mod dubins;
pub mod path;
pub mod rollout;
pub mod rrt_star;
pub mod tree;
pub mod update;
