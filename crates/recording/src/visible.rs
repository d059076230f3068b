//! Which picture goes with which message.

use ::foxglove::messages::log::Level;
use curionav_schemas::{
    Belief, CycleReport, Decision, Memory, Message, Mission, OccupancyGrid, Odometry, Particles, People,
    RunStatus, Scan, ServiceStatus, Twist, words,
};

use super::writer::RecordingWriter;
use super::{foxglove_messages as drawn, scene_update};

/// A message that is recorded.
pub(super) trait Visible: Message {
    /// When it was made, seconds of the robot's clock; absent if it does not say.
    fn stamp(&self) -> Option<f64>;

    /// Writes what can be drawn of it. `owner` is the robot's or world's name.
    fn show(&self, _owner: &str, _time: u64, _file: &mut RecordingWriter) -> anyhow::Result<()> {
        Ok(())
    }
}

impl Visible for Scan {
    fn stamp(&self) -> Option<f64> {
        Some(self.stamp)
    }

    fn show(&self, owner: &str, time: u64, file: &mut RecordingWriter) -> anyhow::Result<()> {
        file.picture(&format!("/{owner}/scan"), &drawn::scan(owner, self, time), time)
    }
}

impl Visible for Odometry {
    fn stamp(&self) -> Option<f64> {
        Some(self.stamp)
    }
}

impl Visible for People {
    fn stamp(&self) -> Option<f64> {
        Some(self.stamp)
    }
}

impl Visible for Twist {
    fn stamp(&self) -> Option<f64> {
        Some(self.stamp)
    }
}

impl Visible for Belief {
    fn stamp(&self) -> Option<f64> {
        Some(self.stamp)
    }

    fn show(&self, owner: &str, time: u64, file: &mut RecordingWriter) -> anyhow::Result<()> {
        file.picture("/tf", &drawn::transform(owner, self, time), time)?;
        file.picture(&format!("/{owner}/belief"), &drawn::believed(self, time), time)?;
        file.picture(&format!("/{owner}/belief/ellipse"), &scene_update::ellipse(self, time), time)
    }
}

impl Visible for Particles {
    fn stamp(&self) -> Option<f64> {
        Some(self.stamp)
    }

    fn show(&self, owner: &str, time: u64, file: &mut RecordingWriter) -> anyhow::Result<()> {
        file.picture(&format!("/{owner}/particles"), &drawn::particles(self, time), time)
    }
}

impl Visible for Mission {
    fn stamp(&self) -> Option<f64> {
        None
    }

    fn show(&self, owner: &str, time: u64, file: &mut RecordingWriter) -> anyhow::Result<()> {
        file.picture(&format!("/{owner}/goal"), &scene_update::goal(self, time), time)?;
        let end = self.end.as_ref().map(|end| format!(": {}", words::say("end", end))).unwrap_or_default();
        let text = format!(
            "mission {} is {}{end}; goal ({:.2}, {:.2})",
            self.revision,
            self.state.name(),
            self.order.goal_x,
            self.order.goal_y
        );
        file.picture(&format!("/{owner}/log"), &drawn::line(owner, Level::Info, text, time), time)
    }
}

impl Visible for Decision {
    fn stamp(&self) -> Option<f64> {
        Some(self.stamp)
    }

    fn show(&self, owner: &str, time: u64, file: &mut RecordingWriter) -> anyhow::Result<()> {
        file.picture(&format!("/{owner}/path"), &drawn::path(self, time), time)?;
        file.picture(&format!("/{owner}/log"), &drawn::decided(owner, self, time), time)
    }
}

impl Visible for CycleReport {
    fn stamp(&self) -> Option<f64> {
        Some(self.scene.stamp)
    }

    fn show(&self, owner: &str, time: u64, file: &mut RecordingWriter) -> anyhow::Result<()> {
        // The scene's people are in the map's frame whatever frame the tracker speaks of.
        file.picture(&format!("/{owner}/people"), &scene_update::people(&self.scene.people, time), time)?;
        file.picture(&format!("/{owner}/candidates"), &scene_update::candidates(self, time), time)
    }
}

impl Visible for Memory {
    fn stamp(&self) -> Option<f64> {
        None
    }
}

impl Visible for RunStatus {
    fn stamp(&self) -> Option<f64> {
        None
    }
}

impl Visible for ServiceStatus {
    fn stamp(&self) -> Option<f64> {
        None
    }
}

impl Visible for OccupancyGrid {
    fn stamp(&self) -> Option<f64> {
        None
    }

    fn show(&self, _owner: &str, time: u64, file: &mut RecordingWriter) -> anyhow::Result<()> {
        file.picture("/map", &drawn::grid(self, time), time)
    }
}
