//! Why a scene could not be made.

use curionav_planning::occupancy::{GridError, MapServerError};

/// Why a scene could not be made.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// Not one of the thirteen.
    #[error("the paper has no Env{environment} {scenario}; it has Env1 to Env4 with s1 to s3, and Env3 sx")]
    Unpublished {
        /// Environment asked for.
        environment: u8,
        /// Scenario asked for.
        scenario: String,
    },
    /// The floor plan cannot give the cells.
    #[error("the floor plan offers {found} {what} cells, {wanted} are wanted")]
    Counts {
        /// Kind of cell.
        what: &'static str,
        /// Cells to reach.
        wanted: usize,
        /// Cells there are.
        found: usize,
    },
    /// The crowd zones are too small or too cluttered.
    #[error("no room for another patrol after {placed} people; enlarge the crowd zones")]
    NoRoom {
        /// People placed so far.
        placed: usize,
    },
    /// The scenario has no TOML form.
    #[error(transparent)]
    Toml(#[from] toml::ser::Error),
    /// The map has no YAML form.
    #[error(transparent)]
    Map(#[from] MapServerError),
    /// The drawing is not a grid.
    #[error(transparent)]
    Grid(#[from] GridError),
}
