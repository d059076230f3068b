//! The tracker of people against the simulated truth.

mod claims;
mod ospa;
mod scene;
