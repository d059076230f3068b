//! How a service robot moves through a crowd while it is not sure where it is: the planner of K. Cai et al. as a
//! library without I/O. From a map, a belief and the people around, a cycle grows candidate trajectories, computes
//! what each would cost, and decides which one the robot is to drive.
//!
//! Please cite K. Cai, W. Chen, C. Wang, H. Zhang and M. Q.-H. Meng, "Curiosity-based Robot Navigation under
//! Uncertainty in Crowded Environments", IEEE Robotics and Automation Letters, 2023.
//!
//! # One planning cycle
//!
//! ```
//! use std::sync::Arc;
//! use curionav_planning::geometry::{Point2, Pose2, Twist};
//! use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
//! use curionav_planning::scene::{Belief, People};
//! use curionav_planning::{Planner, arbitration::Action, motion::RobotModel, nalgebra::Matrix3, profile::Profile};
//!
//! // An empty hall of 12 m by 12 m; the robot is in its middle and is to go 4 m to the right.
//! let map = Arc::new(StaticMap::new(OccupancyGrid::new(120, 120, 0.1, Pose2::default(), vec![0; 14_400])?));
//! let mut planner = Planner::new(map, Profile::default(), RobotModel::default())?;
//! planner.set_goal(Point2::new(10.0, 6.0))?;
//!
//! let covariance = Matrix3::from_diagonal_element(0.01);
//! let belief = Belief { pose: Pose2::new(6.0, 6.0, 0.0), covariance, twist: Twist { v: 0.5, omega: 0.0 } };
//! let verdict = planner.cycle(belief, &People::default(), 0.0)?;
//! assert_eq!(verdict.decision.action, Action::Follow);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Five examples go further: `one_cycle`, `own_term`, `own_generator`, `map_fields` and `cpc_near_walls`.
//!
//! # What is deliberately absent
//!
//! There is no I/O, no clock, no global randomness, no thread and no network: time, seeds and parameters are
//! arguments, so every result can be replayed bit for bit, on any machine. Poses are in the map frame unless a name
//! says otherwise; units are SI and radians.
//!
//! # Modules
//!
//! | to learn | read |
//! |---|---|
//! | the planner as one object | [`planner`] |
//! | where walls are, and what is derived from them | [`occupancy`] |
//! | what is known at one moment | [`scene`], [`forecast`], [`sensor`], [`sight`] |
//! | what could be driven | [`states`], [`candidates`], [`trajectory`] |
//! | how candidates come to be (Alg. 1) | [`generation`] |
//! | what each of them costs (eqs. 7 to 18) | [`evaluation`], [`terms`] |
//! | which of them is taken (Alg. 2, eqs. 4 to 6) | [`arbitration`] |
//! | how it is driven | [`tracking`], [`motion`], [`speed_zones`] |
//! | what is in its way | [`collision`], [`collision_risk`], [`footprint`] |
//! | every parameter, its range and the reason for it | [`profile`], [`parameters`](mod@parameters) |
//! | how long work is shared by threads of the caller | [`workers`] |
//! | geometry, and mathematics and random numbers that agree everywhere | [`geometry`], [`numerics`], [`random`] |

pub mod arbitration;
pub mod beam;
pub mod candidates;
pub mod collision;
pub mod collision_risk;
mod convex_hull;
pub mod crowd_cluster;
pub mod evaluation;
pub mod footprint;
pub mod forecast;
pub mod generation;
pub mod geometry;
pub mod hrvo;
mod lanes;
pub mod motion;
pub mod numerics;
pub mod occupancy;
pub mod parameters;
pub mod planner;
pub mod profile;
pub mod random;
pub mod scene;
pub mod sensor;
pub mod sight;
pub mod speed_zones;
pub mod states;
pub mod terms;
pub mod text;
pub mod time_to_collision;
pub mod tracking;
pub mod trajectory;
pub mod workers;

pub use planner::Planner;

// Covariances are matrices of this version.
pub use nalgebra;
