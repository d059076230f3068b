//! What can be wrong with a map as ROS map_server keeps it.

use super::grid::{GridError, MAX_CELLS};

/// What is wrong with a map's yaml or image, and how to mend it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MapServerError {
    /// Not yaml, an unknown or repeated field, or longer than a description can be.
    #[error("the map's yaml cannot be read: {0}")]
    Yaml(String),
    /// A required field is absent, and a line that would do.
    #[error("`{0}` is missing from the map's yaml: add a line such as `{1}`")]
    Missing(&'static str, &'static str),
    /// A field's value, found as it says, cannot be used, and what it has to be.
    #[error("`{0}` in the map's yaml is {1}: {2}")]
    Field(&'static str, String, &'static str),
    /// The image is neither PNM nor PNG.
    #[error("the map's image is neither PGM/PNM nor PNG: convert it to one of these")]
    Format,
    /// The image is damaged, or too large for the decoder.
    #[error("the map's image cannot be decoded: {0}")]
    Image(#[from] image::ImageError),
    /// More pixels, in columns and rows, than a map may have.
    #[error(
        "the map's image has {0} x {1} pixels, a map has at most {MAX_CELLS} cells: crop it or lower its resolution"
    )]
    TooLarge(u32, u32),
    /// The header promises more pixels, in columns and rows, than a file of so many bytes can hold.
    #[error(
        "the map's image should have {0} x {1} pixels but is only {2} bytes long: copy it again, it is cut off"
    )]
    Truncated(u32, u32, usize),
    /// The cells do not form a grid.
    #[error(transparent)]
    Grid(#[from] GridError),
}
