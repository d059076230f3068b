//! What to compare, and where to keep what comes out.

use std::path::PathBuf;

/// What a bench is asked for.
#[derive(Debug, Clone)]
pub struct Options {
    /// Built-in profiles or profile files; all built-in ones if empty.
    pub planners: Vec<String>,
    /// Scenario files, as patterns with `*` and `?`.
    pub scenarios: Vec<String>,
    /// Runs of each planner in each scenario, with consecutive seeds.
    pub repeats: u32,
    /// First seed.
    pub first_seed: u64,
    /// Runs at the same time; one per core if absent.
    pub jobs: Option<u16>,
    /// Directory of results and journal.
    pub out: PathBuf,
    /// Whether finished runs of another build of this program count.
    pub any_build: bool,
}
