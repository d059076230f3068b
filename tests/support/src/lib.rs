//! What the tests of all crates share: an example of every message, the files of datasets, and the list of what was
//! skipped.

mod datasets;
pub mod golden;

pub use datasets::{downloaded_data, reference_data, skip};
