//! Which picture goes with which message.

use ::foxglove::messages::log::Level;
use curionav_schemas::{
    Belief, CycleReport, Decision, Memory, Message, Mission, OccupancyGrid, Odometry, Particles, People,
    Reject, RunStatus, Scan, ServiceStatus, Twist, words,
};

use super::writer::RecordingWriter;
use super::{foxglove_messages as drawn, scene_update};

/// What is drawn of a message that is recorded, or what else is needed of it.
#[expect(clippy::large_enum_variant, reason = "each is written before the next one is read")]
pub(super) enum Visible {
    Scan(Scan),
    Belief(Belief),
    Particles(Particles),
    Mission(Mission),
    Decision(Decision),
    Report(CycleReport),
    Map(OccupancyGrid),
    /// Of a message that is not drawn: when it was made, seconds of the robot's clock, if it says so.
    Nothing(Option<f64>),
}

impl Visible {
    /// Reads the message of a stream; "map" and "status" stand for what has no stream.
    pub(super) fn decode(stream: &str, bytes: &[u8], encoding: &str) -> Result<Self, Reject> {
        let encoding = Some(encoding);
        Ok(match stream {
            "scan" => Self::Scan(Scan::decode(bytes, encoding)?),
            "odom" => Self::Nothing(Some(Odometry::decode(bytes, encoding)?.stamp)),
            "people" => Self::Nothing(Some(People::decode(bytes, encoding)?.stamp)),
            "belief" => Self::Belief(Belief::decode(bytes, encoding)?),
            "particles" => Self::Particles(Particles::decode(bytes, encoding)?),
            "mission" => Self::Mission(Mission::decode(bytes, encoding)?),
            "decision" => Self::Decision(Decision::decode(bytes, encoding)?),
            "cmd" => Self::Nothing(Some(Twist::decode(bytes, encoding)?.stamp)),
            "report" => Self::Report(CycleReport::decode(bytes, encoding)?),
            "memory" => Memory::decode(bytes, encoding).map(|_| Self::Nothing(None))?,
            "run" => RunStatus::decode(bytes, encoding).map(|_| Self::Nothing(None))?,
            "map" => Self::Map(OccupancyGrid::decode(bytes, encoding)?),
            _ if stream.starts_with("scan/") => Self::Scan(Scan::decode(bytes, encoding)?),
            _ => ServiceStatus::decode(bytes, encoding).map(|_| Self::Nothing(None))?,
        })
    }

    /// When the message was made, seconds of the robot's clock; absent if it does not say.
    pub(super) fn stamp(&self) -> Option<f64> {
        match self {
            Self::Scan(scan) => Some(scan.stamp),
            Self::Belief(belief) => Some(belief.stamp),
            Self::Particles(particles) => Some(particles.stamp),
            Self::Decision(decision) => Some(decision.stamp),
            Self::Report(report) => Some(report.scene.stamp),
            Self::Mission(_) | Self::Map(_) => None,
            Self::Nothing(stamp) => *stamp,
        }
    }

    /// Writes what can be drawn of a message on a stream of `owner`, which is the robot's or world's name.
    pub(super) fn show(
        &self,
        owner: &str,
        stream: &str,
        time: u64,
        file: &mut RecordingWriter,
    ) -> anyhow::Result<()> {
        let topic = |name: &str| format!("/{owner}/{name}");
        match self {
            Self::Scan(scan) => file.picture(&topic(stream), &drawn::scan(owner, scan, time), time),
            Self::Belief(belief) => {
                file.picture("/tf", &drawn::transform(owner, belief, time), time)?;
                file.picture(&topic("belief"), &drawn::believed(belief, time), time)?;
                file.picture(&topic("belief/ellipse"), &scene_update::ellipse(belief, time), time)
            }
            Self::Particles(particles) => {
                file.picture(&topic("particles"), &drawn::particles(particles, time), time)
            }
            Self::Mission(mission) => {
                file.picture(&topic("goal"), &scene_update::goal(mission, time), time)?;
                let end = mission.end.as_ref().map(|end| format!(": {}", words::say("end", end)));
                let text = format!(
                    "mission {} is {}{}; goal ({:.2}, {:.2})",
                    mission.revision,
                    mission.state.name(),
                    end.unwrap_or_default(),
                    mission.order.goal_x,
                    mission.order.goal_y
                );
                file.picture(&topic("log"), &drawn::line(owner, Level::Info, text, time), time)
            }
            Self::Decision(decision) => {
                file.picture(&topic("path"), &drawn::path(decision, time), time)?;
                file.picture(&topic("log"), &drawn::decided(owner, decision, time), time)
            }
            Self::Report(report) => {
                // The scene's people are in the map's frame whatever frame the tracker speaks of.
                file.picture(&topic("people"), &scene_update::people(&report.scene.people, time), time)?;
                file.picture(&topic("candidates"), &scene_update::candidates(report, time), time)
            }
            Self::Map(map) => file.picture("/map", &drawn::grid(map, time), time),
            Self::Nothing(_) => Ok(()),
        }
    }
}
