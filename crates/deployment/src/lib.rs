//! Deployments: [`embedded`] runs all services of one robot in this process, and [`supervised`] runs them as
//! processes. [`follow`](mod@follow) plays a scenario on either, which [`package`] has read, from files or from what
//! is [`built_in`]. [`scenario_reference`](mod@scenario_reference) is the page of the scenario file.

pub mod built_in;
pub mod csv_row;
pub mod embedded;
pub mod files;
pub mod follow;
pub mod package;
mod pulse;
pub mod scenario_reference;
pub mod service_kind;
pub mod supervised;
