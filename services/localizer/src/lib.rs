//! The localizer: answers every tick of odometry and laser with a belief about the pose (AMCL).

mod keeping;
mod particle_cloud;
mod service;

pub use service::run;
