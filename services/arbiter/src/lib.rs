//! The arbiter: asks for candidates and their costs, and decides.
//!
//! Read [`cycle::plan`] first.

pub mod context;
pub mod cycle;
pub mod dispatch;
pub mod peers;
mod pool;
mod report;
mod service;

pub use service::run;
