//! Where wire types and domain types meet. Decoded messages are already finite, shaped and within
//! limits; what a domain type demands beyond that is checked here, once. `*_to_wire` functions cannot
//! fail.

mod model;
mod parameters;
mod plan;
mod scene;
mod sensing;

pub use model::*;
pub use parameters::*;
pub use plan::*;
pub use scene::*;
pub use sensing::*;
