//! How work is split over replicas, both halves.
//!
//! The side that asks: [`context`] makes the [`question`]s of a mission, and [`dispatch`] splits a batch evenly over
//! the [`replicas`] that are ready, within a [`budget`]. [`pool`] asks again elsewhere when a replica fails or is late.
//! [`peers`] is the way to them, over Zenoh or in a test.
//!
//! The side that answers: [`generator`] and `evaluation_service`, which serves one of the [`evaluators`], are each a
//! `pool_service` and compute from the fields of a map that their process keeps. Both sides use the same code, so that
//! the one that asks can compute in process what is not answered.

pub mod budget;
pub mod context;
pub mod dispatch;
pub mod evaluation_service;
pub mod evaluators;
pub mod generator;
pub mod own_planner_service;
pub mod peers;
pub mod pool;
mod pool_service;
mod preparation;
pub mod question;
pub mod replicas;
