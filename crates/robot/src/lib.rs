//! What the services of a robot compute, without a network: no session, no clock, no thread.
//!
//! Each service takes messages from its streams, lets this crate make the answer, and publishes it.
//! `crates/in-process` hands the same messages from one role to the next instead, tick by tick.
//!
//! | role | read first |
//! |---|---|
//! | arbiter | [`arbiter::cycle`] |
//! | driver | [`driver::drive`] |
//! | localizer | [`localizer`] |
//! | people tracker | [`tracker`] |

pub mod arbiter;
pub mod driver;
pub mod localizer;
pub mod tracker;
