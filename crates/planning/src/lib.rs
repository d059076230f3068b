//! Pure planning: what a robot knows about space, motion and people, and how it decides.
//!
//! No I/O, no clock, no global randomness, no threads, no Zenoh: time, seeds and parameters are
//! arguments, so every result can be replayed bit for bit. Poses are in the map frame unless a name
//! says otherwise; units are SI and radians.
//!
//! Read in this order: [`scene`] (what is known now), [`candidates`] (what could be done),
//! [`generation`] (how candidates come to be), [`evaluation`] (what each costs),
//! [`arbitration`] (which one is taken), [`tracking`] (how it is driven).

pub mod arbitration;
pub mod candidates;
pub mod collision;
pub mod collision_risk;
pub mod evaluation;
pub mod footprint;
pub mod forecast;
pub mod generation;
pub mod geometry;
pub mod motion;
pub mod numerics;
pub mod occupancy;
pub mod profile;
pub mod random;
pub mod scene;
pub mod sensor;
pub mod tracking;
