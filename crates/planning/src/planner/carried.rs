//! What one cycle hands to the next.

use crate::arbitration::{Decision, Observer, Previous};
use crate::generation::Tree;
use crate::geometry::Pose2;

/// What a planner remembers between two cycles. A new one is that of a robot which has just been given its goal.
#[derive(Debug, Clone, Default)]
pub struct Carried {
    /// What forms the scene.
    pub observer: Observer,
    /// The search trees, by index; `None` until one has been grown.
    pub trees: Vec<Option<Tree>>,
    /// The last decision, if it moved the robot.
    pub previous: Option<Previous>,
}

impl Carried {
    /// What is left of the trajectory decided last at `stamp`, state by state; empty if the robot was stopped.
    pub fn ahead(&self, stamp: f64) -> Vec<Pose2> {
        let Some(previous) = &self.previous else { return Vec::new() };
        let elapsed = stamp - previous.stamp;
        let tail = previous.trajectory.tail(elapsed, previous.trajectory.at(elapsed));
        (0..tail.len()).map(|k| tail.states().at(k).0).collect()
    }

    /// Makes `decision`, of the scene at `stamp`, the previous one, and gives back the one before.
    pub fn remember(&mut self, decision: &Decision, stamp: f64) -> Option<Previous> {
        std::mem::replace(&mut self.previous, Previous::of(decision, stamp))
    }
}
