//! How work is split over replicas, both halves.
//!
//! The side that asks: [`context`] makes the [`question`]s of a mission, [`dispatch`] splits a batch over the slots that
//! `slot_selection` picks, into [`parts`], within a [`budget`], and [`ahead`] lets the generator ask instead. [`pool`] asks
//! again elsewhere when a replica fails or is late (`lateness`), and [`replicas`] is what is known of each. [`peers`] is the
//! way to them, over Zenoh or in a test; `scores_inbox` is where the answers to a generator's questions come.
//!
//! The side that answers: [`generator`] and `evaluation_service`, which serves one of the [`evaluators`], are each a
//! `pool_service` and compute from the fields of a map that their process keeps. Both sides use the same code, so that
//! the one that asks can compute in process what is not answered.

pub mod ahead;
pub mod budget;
pub mod context;
pub mod dispatch;
pub mod evaluation_service;
pub mod evaluators;
pub mod generator;
mod lateness;
pub mod parts;
pub mod peers;
pub mod pool;
mod pool_service;
mod preparation;
pub mod question;
pub mod replicas;
mod scores_inbox;
mod slot_selection;
