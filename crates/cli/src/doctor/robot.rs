//! One robot: its mission, the map of it, and its streams.

use std::time::Duration;

use curionav_arbiter::context::PlanContext;
use curionav_planning::occupancy::StaticMap;
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_runtime::generator;
use curionav_runtime::probe::{Heard, Listener, ask_everybody};
use curionav_schemas::{
    self as wire, Belief, Decision, MapId, MissionState, OccupancyGrid, Odometry, People, Scan, keys,
};
use zenoh::Session;

use super::finding::Finding;
use crate::arguments::ConnectOptions;

const TIMEOUT: Duration = Duration::from_secs(1);
/// A large map over a slow link.
const MAP_TIMEOUT: Duration = Duration::from_secs(20);

/// What a robot is to do, and whether it can be planned.
pub(super) struct Mission {
    robot: String,
    /// Whether anybody answers on its key: that is the driver.
    driver: bool,
    mission: Option<wire::Mission>,
    map: Option<Result<ServedMap, String>>,
    context: Option<Result<PlanContext, String>>,
}

struct ServedMap {
    bytes: usize,
    took_ms: f64,
}

impl Mission {
    pub(super) async fn ask(session: &Session, robot: &str) -> anyhow::Result<Self> {
        let key = keys::robot(robot, "mission")?;
        let (replies, _) = ask_everybody(session, &key, None, TIMEOUT).await?;
        let mission: Option<wire::Mission> = replies.iter().find_map(|r| r.decode()?.ok());
        let mut found =
            Self { robot: robot.to_owned(), driver: !replies.is_empty(), mission, map: None, context: None };
        let Some(mission) = found.mission.clone() else { return Ok(found) };
        match fetch_map(session, mission.map).await? {
            Ok((served, map)) => {
                found.map = Some(Ok(served));
                let fields = Fields::of_maps([map]);
                let preparing = move || PlanContext::new(mission, &fields, false).map_err(|e| e.to_string());
                found.context = Some(tokio::task::spawn_blocking(preparing).await?);
            }
            Err(reason) => found.map = Some(Err(reason)),
        }
        Ok(found)
    }

    /// What pools are to be asked about.
    pub(super) fn context(&self) -> Option<&PlanContext> {
        self.context.as_ref()?.as_ref().ok()
    }

    /// The roles its mission asks pools for; none without a mission.
    pub(super) fn pool_roles(&self) -> Vec<String> {
        let Some(context) = self.context() else { return Vec::new() };
        std::iter::once(generator::ROLE).chain(context.pool_metrics()).map(str::to_owned).collect()
    }

    fn is_running(&self) -> bool {
        self.mission.as_ref().is_some_and(|m| m.state == MissionState::Running)
    }

    pub(super) fn findings(&self, at: &ConnectOptions) -> Vec<Finding> {
        let link = format!("mission of {}", self.robot);
        let Some(mission) = &self.mission else {
            // A driver that is missing has been named.
            let fix = format!(
                "give it one, for example: curionav run SCENARIO.toml --connect {} --robot {}",
                at.connect, self.robot
            );
            let has_none = Finding::note(link, "none yet: the robot stands", fix);
            return if self.driver { vec![has_none] } else { Vec::new() };
        };
        let mut findings = vec![state_of(link, mission)];
        let link = format!("map of {}", self.robot);
        match &self.map {
            Some(Ok(map)) => {
                let mut finding = Finding::proven(
                    link,
                    format!(
                        "{:.0} kB in {:.1} ms, hash as in the mission",
                        map.bytes as f64 / 1e3,
                        map.took_ms
                    ),
                );
                (finding.bytes, finding.round_trip_ms) = (Some(map.bytes as u64), Some(map.took_ms));
                findings.push(finding);
            }
            Some(Err(reason)) => findings.push(Finding::missing(
                link,
                reason.clone(),
                format!(
                    "serve it on {}: who set the mission has to; a simulator serves that of its last run",
                    keys::map(&mission.map)
                ),
            )),
            None => {}
        }
        if let Some(Err(reason)) = &self.context {
            findings.push(Finding::missing(
                format!("mission of {}: plan", self.robot),
                format!("cannot be planned: {reason}"),
                "set a mission with another goal or profile",
            ));
        }
        findings
    }
}

fn state_of(link: String, mission: &wire::Mission) -> Finding {
    let is = format!(
        "revision {}, {}, goal ({:.2}, {:.2})",
        mission.revision, mission.state, mission.goal_x, mission.goal_y
    );
    let waited_for: Vec<&str> =
        mission.require.iter().filter(|r| !mission.ready.contains(r)).map(String::as_str).collect();
    match mission.state {
        MissionState::Preparing if !waited_for.is_empty() => Finding::missing(
            link,
            format!("{is}; not ready: {}", waited_for.join(", ")),
            "wait a few seconds; then look at the log of who is not ready",
        ),
        MissionState::Finished | MissionState::Cancelled if !mission.note.is_empty() => {
            Finding::proven(link, format!("{is} ({})", mission.note))
        }
        _ => Finding::proven(link, is),
    }
}

async fn fetch_map(session: &Session, id: MapId) -> anyhow::Result<Result<(ServedMap, StaticMap), String>> {
    let (replies, took) = ask_everybody(session, &keys::map(&id), None, MAP_TIMEOUT).await?;
    let Some(reply) = replies.first() else { return Ok(Err(format!("nobody serves map {id}"))) };
    let read = || {
        let grid: OccupancyGrid = reply.decode().ok_or("refused")?.map_err(|e| e.to_string())?;
        let grid = convert::occupancy_grid(grid).map_err(|e| e.to_string())?;
        if grid.hash().0 != id.0 {
            return Err(format!("what is served as map {id} is another map"));
        }
        Ok((ServedMap { bytes: reply.bytes(), took_ms: took.as_secs_f64() * 1e3 }, StaticMap::new(grid)))
    };
    Ok(read())
}

/// A stream: its name, who publishes it.
const STREAMS: [(&str, &str); 6] = [
    ("scan", "the base (or the simulator) has to publish it; is its scanner on?"),
    ("odom", "the base (or the simulator) has to publish it"),
    ("people", "whoever tracks people (or the simulator) has to publish it, also when there are none"),
    ("belief", "the localizer answers odometry with it: look at its log"),
    ("decision", "the arbiter answers beliefs with it: look at its log"),
    ("cmd", "the driver answers odometry with it: look at its log"),
];

/// Listens to every stream of every robot at the same time.
pub(super) async fn streams(
    session: &Session,
    missions: &[Mission],
    time: Duration,
) -> anyhow::Result<Vec<Finding>> {
    let mut listeners = Vec::new();
    for mission in missions {
        for (stream, fix) in STREAMS {
            let key = keys::robot(&mission.robot, stream)?;
            let listener = match stream {
                "scan" => Listener::new::<Scan>(session, &key),
                "odom" => Listener::new::<Odometry>(session, &key),
                "people" => Listener::new::<People>(session, &key),
                "belief" => Listener::new::<Belief>(session, &key),
                "decision" => Listener::new::<Decision>(session, &key),
                _ => Listener::new::<wire::Twist>(session, &key),
            }?;
            listeners.push((mission, stream, fix, listener));
        }
    }
    tokio::time::sleep(time).await;
    let mut findings = Vec::new();
    for mission in missions {
        let mut silent = Vec::new();
        for (_, stream, fix, listener) in listeners.iter().filter(|l| l.0.robot == mission.robot) {
            let heard = listener.heard();
            if heard.messages == 0 && !mission.is_running() {
                silent.push(*stream);
            } else {
                findings.push(stream_of(&mission.robot, stream, fix, &heard, time));
            }
        }
        if !silent.is_empty() {
            findings.push(Finding::note(
                format!("streams of {}", mission.robot),
                format!("silent for {:.1} s: {}", time.as_secs_f64(), silent.join(", ")),
                "nothing while no mission is running; run the doctor again while one is",
            ));
        }
    }
    Ok(findings)
}

fn stream_of(robot: &str, stream: &str, fix: &str, heard: &Heard, time: Duration) -> Finding {
    let link = format!("{stream} of {robot}");
    let mut finding = if heard.messages == 0 {
        Finding::missing(link, format!("silent for {:.1} s", time.as_secs_f64()), fix)
    } else if heard.malformed > 0 {
        Finding::missing(
            link,
            format!("{} of {} messages cannot be understood", heard.malformed, heard.messages),
            "its publisher speaks another contract: compare versions, and bytes with schemas/golden",
        )
    } else {
        let rate = heard.rate_hz().map_or(String::new(), |hz| format!(", {hz:.1} Hz"));
        Finding::proven(
            link,
            format!("{} messages{rate}, {:.1} kB", heard.messages, heard.bytes as f64 / 1e3),
        )
    };
    finding.bytes = Some(heard.bytes);
    finding
}
