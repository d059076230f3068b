//! The driver: owns the mission, tracks decisions, and stops on anything missing, old or too close.

pub mod control;
pub mod decision_fence;
pub mod drive;
pub mod guard;
pub mod lookout;
pub mod mission_state;
pub mod seen_way;
pub mod sight;
pub mod told;
