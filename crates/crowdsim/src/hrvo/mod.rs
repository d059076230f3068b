//! People who avoid each other, the robot and walls by hybrid reciprocal velocity obstacles.
//!
//! Snape, van den Berg, Guy and Manocha, "The Hybrid Reciprocal Velocity Obstacle", IEEE Transactions on
//! Robotics 27(4), 2011. Read in this order: [`velocity_obstacle`] (which velocities another body
//! forbids), [`choice`] (the best of those left for one body among others), [`wall_rim`]
//! (walls, which the method itself lacks), [`route`] (where a person wants to go) and [`HrvoCrowd`] (all
//! of them, step by step).

pub(crate) mod choice;
mod crowd;
mod params;
pub(crate) mod route;
pub(crate) mod velocity_obstacle;
pub(crate) mod wall_rim;

pub(crate) use crowd::HrvoCrowd;
pub(crate) use params::HrvoParams;

/// A velocity in the map frame, m/s.
pub(crate) type Velocity = nalgebra::Vector2<f64>;

#[cfg(test)]
mod reference_tests;
#[cfg(test)]
mod tests;
