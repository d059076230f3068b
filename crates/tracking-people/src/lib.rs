//! Pure detection and tracking of people in the scans of a planar laser.
//!
//! No I/O, no clock, no randomness: stamps are arguments, so the same scans, odometry and beliefs give the same people
//! bit for bit. Units are SI and radians.
//!
//! Read [`Tracker`] first; it strings together, in the order of one scan: where the robot is to be expected
//! (`ego_motion`); [`Detector`] with the beams that the map does not explain (`alignment`, `background`), the pieces
//! they make (`segments`) and what those may be (`shape`); then which detection is of which person (`assignment`),
//! where each person is (`track`) and how it moves (`motion`). [`Obstacles`] gathers what is neither map nor person.
//! [`ospa()`] and [`matches()`] say how well tracks agree with where people are known to be.

mod alignment;
mod assignment;
mod background;
mod detector;
mod ego_motion;
mod motion;
mod obstacles;
mod ospa;
mod params;
mod segments;
mod shape;
mod track;
mod tracker;

pub use detector::{Detection, Detector, Kind, Seen};
pub use obstacles::{Look, ObstacleParams, Obstacles};
pub use ospa::{Partner, matches, ospa, partners};
pub use params::TrackerParams;
pub use track::Person;
pub use tracker::{Observation, Tracker};
