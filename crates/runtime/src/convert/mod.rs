//! Where wire types and domain types meet. Decoded messages are already finite, shaped and within
//! limits; what a domain type demands beyond that is checked here, once. `*_to_wire` functions cannot
//! fail.

mod model;
mod parameters;
mod plan;
mod scene;

pub use model::{
    laser, laser_to_wire, noise, noise_to_wire, occupancy_grid, occupancy_grid_to_wire, pose, pose_to_wire,
    robot_model, robot_model_to_wire,
};
pub use parameters::{check_order, checked, from_value, parameters, refusal, to_value};
pub use plan::{
    candidates, candidates_to_wire, previous, previous_to_wire, shard_to_wire, trajectory, tree, tree_to_wire,
};
pub use scene::{
    belief, belief_to_wire, covariance, initial_belief, people, people_to_wire, scene, scene_to_wire,
};
