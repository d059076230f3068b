//! People who walk around each other, the robot and walls, by one of two laws.
//!
//! Read in this order: [`route`] (where a person wants to go), [`wall_rim`] (which walls are near), then how it gets
//! there: [`curionav_planning::hrvo`] or [`crate::social_force`], and [`AvoidingCrowd`] (all of them, step by step).

mod crowd;
pub(crate) mod route;
pub(crate) mod wall_rim;

pub(crate) use crowd::{AvoidingCrowd, Law};

#[cfg(test)]
mod tests;
