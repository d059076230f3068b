//! Experiments with whole deployments: [`bench`](mod@bench) compares planners over many runs, [`tune`] searches for
//! better settings, [`scale`] measures what more replicas bring, and [`localize`](mod@localize) drives the log of a
//! robot, read by [`robot_log`], on a map that [`map_build`] may have made of it. [`track`](mod@track) follows the
//! people in its scans. [`paper`] draws the paper's scenes and holds the numbers that it prints of them; [`suites`] has
//! all scenarios that are committed.

pub mod bench;
pub mod localize;
pub mod map_build;
pub mod paper;
mod plural;
pub mod robot_log;
pub mod scale;
mod statistics;
pub mod suites;
pub mod track;
pub mod tune;
