//! The trajectory generator: grows a robot's tree and offers its branches as candidates (Alg. 1).
//!
//! Stateless: the tree comes with the request and goes with the reply, so any replica can take over.

pub use curionav_pool::generator::run;
