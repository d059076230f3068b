//! Experiments with whole deployments: [`bench`](mod@bench) compares planners over many runs, [`tune`] searches for
//! better settings, [`scale`] measures what more replicas bring, and [`localize`](mod@localize) drives the log of a
//! robot. [`paper`] draws the paper's scenes and holds the numbers that it prints of them; [`suites`] has all scenarios
//! that are committed.

pub mod bench;
pub mod localize;
pub mod paper;
mod plural;
pub mod scale;
mod statistics;
pub mod suites;
pub mod tune;
