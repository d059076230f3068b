//! People who avoid each other and the robot by hybrid reciprocal velocity obstacles (HRVO).

mod params;

pub use params::HrvoParams;
