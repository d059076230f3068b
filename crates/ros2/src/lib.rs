//! What nodes of ROS 2 say over Zenoh, without a network: the encoding of their messages, the names and hashes of their
//! types, and the keys, liveliness tokens and attachments around them.
//!
//! No I/O and no clock. Bytes are read within [`limits`], and no bytes make it panic. What is sent passes through
//! [`dialect::outgoing`] alone, so that a listener of ROS, which ends its process on malformed bytes, hears none.
//!
//! ```
//! use curionav_ros2::dialect::{Dialect, RmwZenoh};
//! use curionav_ros2::interface::Distribution;
//! use curionav_ros2::message::Message;
//! use curionav_ros2::messages::{Twist, Vector3};
//!
//! let twist = Twist { linear: Vector3 { x: 0.5, ..Vector3::default() }, ..Twist::default() };
//! let payload = twist.encode()?;
//! assert_eq!(Twist::decode(&payload)?, twist);
//!
//! let dialect = RmwZenoh { domain: 0, distribution: Distribution::Kilted };
//! let key = dialect.key("/r1/cmd_vel", &Twist::INTERFACE);
//! assert!(key.starts_with("0/r1/cmd_vel/geometry_msgs::msg::dds_::Twist_/RIHS01_9c45bf16"));
//! # Ok::<(), curionav_ros2::cdr::CdrError>(())
//! ```
//!
//! [`cdr`] reads and writes; [`messages`] has the types; [`dialect`] says where and with what they are sent; [`token`]
//! and [`qos`] say how nodes find each other.

#[macro_use]
mod declare;

pub mod attachment;
pub mod cdr;
pub mod dialect;
pub mod interface;
pub mod limits;
pub mod message;
pub mod messages;
pub mod qos;
pub mod random;
pub mod testing;
pub mod token;
