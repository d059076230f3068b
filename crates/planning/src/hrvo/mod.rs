//! How one disc among others avoids them: by hybrid reciprocal velocity obstacles. Simulated people and the planner
//! `hrvo-robot` use it.
//!
//! Snape, van den Berg, Guy and Manocha, "The Hybrid Reciprocal Velocity Obstacle", IEEE Transactions on
//! Robotics 27(4), 2011. Read in this order: [`VelocityObstacle`] (which velocities another body
//! forbids) and [`velocity`] (the best of those left for one body among others).

mod choice;
mod params;
mod velocity_obstacle;

pub use choice::velocity;
pub use params::HrvoParams;
pub use velocity_obstacle::{Body, VelocityObstacle};

/// A velocity in the map frame, m/s.
pub type Velocity = nalgebra::Vector2<f64>;

#[cfg(test)]
mod reference_tests;
