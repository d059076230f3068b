//! What can be wrong with a map as ROS map_server keeps it.

use super::grid::{GridError, MAX_CELLS};

/// What is wrong with a map's yaml or image, and how to mend it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MapServerError {
    /// Not yaml, an unknown or repeated field, or longer than a description can be.
    #[error("the map's yaml cannot be read: {0}")]
    Yaml(String),
    /// A required field is absent.
    #[error("`{field}` is missing from the map's yaml: add a line such as `{example}`")]
    Missing {
        /// Its name.
        field: &'static str,
        /// A line that would do.
        example: &'static str,
    },
    /// A field's value cannot be used.
    #[error("`{field}` in the map's yaml is {found}: {mend}")]
    Field {
        /// Its name.
        field: &'static str,
        /// What was found.
        found: String,
        /// What it has to be.
        mend: &'static str,
    },
    /// The image is neither PNM nor PNG.
    #[error("the map's image is neither PGM/PNM nor PNG: convert it to one of these")]
    Format,
    /// The image is damaged, or too large for the decoder.
    #[error("the map's image cannot be decoded: {0}")]
    Image(#[from] image::ImageError),
    /// More pixels than a map may have.
    #[error(
        "the map's image has {width} x {height} pixels, a map has at most {MAX_CELLS} cells: crop it or lower its resolution"
    )]
    TooLarge {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The header promises more pixels than the file can hold.
    #[error(
        "the map's image should have {width} x {height} pixels but is only {bytes} bytes long: copy it again, it is cut off"
    )]
    Truncated {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Length of the file.
        bytes: usize,
    },
    /// The cells do not form a grid.
    #[error(transparent)]
    Grid(#[from] GridError),
}
