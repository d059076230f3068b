//! The tracker of people: answers every tick of laser and belief with the people around the robot.

mod service;

pub use service::run;
