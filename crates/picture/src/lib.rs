//! Pure drawing of what a robot did, as SVG files that need nothing else and print sharply.
//!
//! [`run_svg`] puts a run on one page: the map with all tracks, a few planning cycles enlarged, and plots over time.
//! [`scene_svg`] shows a scenario before anything moves, and [`tracks_svg`] draws any tracks on a map.
//! [`people_svg`] draws the people around a robot.
//! Coordinates are in metres in the map frame, angles in radians.

mod axes;
mod chart;
mod heading;
mod legend;
mod map_layer;
mod overview;
mod page;
mod palette;
mod people;
mod plots;
mod run;
mod run_page;
mod scene;
mod snapshot;
mod snapshots;
mod symbols;
mod thing;
mod trace_columns;
mod tracks;
mod viewport;

pub use people::{Marks, people_svg};
pub use run::Run;
pub use run_page::run_svg;
pub use scene::{Person, SceneSketch, scene_svg};
pub use thing::Thing;
pub use tracks::{Track, tracks_svg};
