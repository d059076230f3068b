//! Experiments with whole deployments.
//!
//! [`embedded`] runs all services of one robot in this process, [`supervised`] runs them as processes, [`follow`] plays
//! a scenario that [`package`] has read. On top of them stand [`bench`](mod@bench) (planners compared over many runs),
//! [`tune`] (a search for better settings) and [`scale`] (what more replicas bring). [`mod@scenario_reference`] is the
//! page of the scenario file. [`paper`] draws the paper's scenes and holds the numbers it prints.

pub mod bench;
pub mod csv_row;
pub mod embedded;
pub mod follow;
mod out_folder;
pub mod package;
pub mod paper;
mod plural;
pub mod scale;
pub mod scenario_reference;
pub mod service_kind;
pub mod supervised;
pub mod tune;
