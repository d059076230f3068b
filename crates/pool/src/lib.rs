//! How work is split over replicas, both halves.
//!
//! The side that asks: [`context`] makes the questions of a mission, [`dispatch`] splits a batch over the slots that
//! `slot_selection` picks, within a [`budget`]; [`pool`] asks again elsewhere when a replica fails or is late
//! (`lateness`), and [`replicas`] is what is known of each. [`peers`] is the way to them, over Zenoh or in a test.
//!
//! The side that answers: `evaluation_service` and [`generation_service`] serve what [`evaluators`] and [`generator`]
//! compute from the [`fields`] of a map. Both sides use the same code, so that the one that asks can compute in process
//! what is not answered.

pub mod budget;
pub mod context;
pub mod dispatch;
pub mod evaluation_service;
pub mod evaluators;
pub mod fields;
pub mod generation_service;
pub mod generator;
mod lateness;
pub mod peers;
pub mod pool;
pub mod replicas;
mod slot_selection;
