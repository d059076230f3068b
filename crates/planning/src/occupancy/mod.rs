//! The static world: occupancy grid, its map_server files, and the fields derived from it.

mod distance_transform;
mod geodesic;
mod grid;
mod static_map;

pub use distance_transform::DistanceField;
pub use geodesic::GeodesicField;
pub use grid::{Cell, GridError, MapHash, OccupancyGrid};
pub use static_map::StaticMap;
