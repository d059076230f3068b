//! The gateway to a robot of ROS 2: it plays the robot's base for curionav, and curionav's navigation for the robot.
//!
//! One session is curionav's, the other is a client of the robot's own router. Read `robot_state` for what becomes of
//! what the robot says, `journey` for how goals become missions, `gate` for what reaches the base, and `service` for
//! how these are joined.

mod action_kind;
mod action_publishers;
mod calls;
pub mod config;
mod costmap;
mod diagnosis;
mod drawing;
mod driver_client;
mod fault;
mod frames;
mod further_sensing;
mod further_sensors;
mod gate;
mod gateway;
mod given_path;
mod goals;
mod graph;
mod journey;
mod masks;
mod nav2_pose;
mod node;
mod order;
mod parameters;
mod path_planner;
mod pausing;
mod people;
pub mod problem;
mod publishers;
mod ramp;
mod robot_clock;
mod robot_state;
mod sensing;
mod sensor_config;
mod sensor_intake;
mod service;
mod subscriptions;
mod surroundings;
mod sweep;
pub mod topics;
mod tour;

pub use service::{check, run};
