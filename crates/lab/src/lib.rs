//! Experiments with whole deployments: [`bench`](mod@bench) compares planners over many runs, [`tune`] searches for
//! better settings, and [`scale`] measures what more replicas bring. [`paper`] draws the paper's scenes and holds the
//! numbers that it prints.

pub mod bench;
pub mod paper;
mod plural;
pub mod scale;
mod statistics;
pub mod tune;
