//! The static world: occupancy grid, its map_server files, and the fields derived from it.

mod distance_transform;
mod front;
mod geodesic;
mod grid;
mod map_server;
mod map_yaml;
mod obstacles;
mod ray_cast;
mod static_map;
mod survey;
mod way;
mod zones;

pub use distance_transform::DistanceField;
pub(crate) use front::Front;
pub use geodesic::GeodesicField;
pub use geodesic::coarse::CoarseFloor;
pub use geodesic::detour::Detour;
pub use grid::{Cell, GridError, MAX_CELLS, OccupancyGrid};
pub use map_server::{encode_pgm, load_map};
pub use map_yaml::{MapMode, MapServerError, MapYaml};
pub use obstacles::Obstacles;
pub use ray_cast::{Hit, RayCaster};
pub use static_map::StaticMap;
pub use survey::MapSurvey;
pub use way::{OffWay, Way, WayError};
pub use zones::{MaskError, SpeedScale};
