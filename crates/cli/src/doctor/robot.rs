//! One robot: its mission, the map of it, and its streams.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use curionav_planning::occupancy::StaticMap;
use curionav_pool::context::PlanContext;
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_runtime::map_store;
use curionav_runtime::probe::{Heard, Listener, ask_all};
use curionav_runtime::query::AskError;
use curionav_runtime::topic::TopicError;
use curionav_schemas::{
    self as wire, Belief, Decision, MapId, Message, MissionState, Odometry, People, Scan, keys,
};
use zenoh::Session;

use super::finding::Finding;
use crate::connect::ConnectOptions;
use crate::mission::standing;

const TIMEOUT: Duration = Duration::from_secs(1);
/// A large map over a slow link.
const MAP_TIMEOUT: Duration = Duration::from_secs(20);

pub(super) struct Mission {
    robot: String,
    /// Whether its key is answered: that is the driver.
    driver: bool,
    mission: Option<wire::Mission>,
    /// Bytes of its map, and how long they took, ms.
    map: Option<Result<(usize, f64), String>>,
    context: Option<Result<PlanContext, String>>,
}

impl Mission {
    pub(super) async fn ask(session: &Session, robot: &str) -> anyhow::Result<Self> {
        let key = keys::robot(robot, "mission")?;
        let (replies, _) = ask_all(session, &key, None, TIMEOUT).await?;
        let mission: Option<wire::Mission> = replies.iter().find_map(|r| r.decode()?.ok());
        let mut found =
            Self { robot: robot.to_owned(), driver: !replies.is_empty(), mission, map: None, context: None };
        let Some(mission) = found.mission.clone() else { return Ok(found) };
        found.map = Some(match fetch_map(session, mission.order.map).await {
            Ok((served, map)) => {
                let fields = Fields::of_maps([map]);
                let preparing = tokio::task::spawn_blocking(move || {
                    PlanContext::new(mission, &fields, false).map_err(|e| e.to_string())
                });
                found.context = Some(preparing.await?);
                Ok(served)
            }
            Err(reason) => Err(reason),
        });
        Ok(found)
    }

    fn context(&self) -> Option<&PlanContext> {
        self.context.as_ref()?.as_ref().ok()
    }

    /// What a pool is to be asked about, if the mission asks `role` for work.
    pub(super) fn asking(&self, role: &str) -> Option<&PlanContext> {
        self.context().filter(|_| self.pool_roles().iter().any(|asked| asked == role))
    }

    pub(super) fn pool_roles(&self) -> Vec<String> {
        let Some(context) = self.context() else { return Vec::new() };
        context.pool_roles().map(str::to_owned).collect()
    }

    /// The robot, if its mission requires a tracker of people.
    pub(super) fn tracked(&self) -> Option<String> {
        let mission = self.mission.as_ref().filter(|mission| !mission.is_over())?;
        mission.order.requires(keys::TRACKER).then(|| self.robot.clone())
    }

    fn is_running(&self) -> bool {
        self.mission.as_ref().is_some_and(|m| m.state == MissionState::Running)
    }

    /// `gateways` are the robots that take goals of ROS.
    pub(super) fn findings(&self, at: &ConnectOptions, gateways: &BTreeSet<&str>) -> Vec<Finding> {
        let link = format!("mission of {}", self.robot);
        let Some(mission) = &self.mission else {
            // A driver that is missing has been named.
            let fix = if gateways.contains(self.robot.as_str()) {
                "give it a goal, for example in rviz with 2D Goal Pose".to_owned()
            } else {
                let at = at.arguments();
                let robot = &self.robot;
                format!("give it one, for example: curionav run SCENARIO.toml {at} --robot {robot}")
            };
            let has_none = Finding::note(link, "none yet: the robot stands", fix);
            return self.driver.then_some(has_none).into_iter().collect();
        };
        // A mission that is over needs no map any more, and it need not be served.
        let fault: fn(String, String, String) -> Finding =
            if mission.is_over() { Finding::note } else { Finding::missing };
        let mut findings = vec![state_of(link, mission)];
        let link = format!("map of {}", self.robot);
        match &self.map {
            Some(Ok((bytes, took_ms))) => {
                let detail = format!("{:.0} kB in {took_ms:.1} ms, hash as in the mission", *bytes as f64 / 1e3);
                let bytes = Some(*bytes as u64);
                let round_trip_ms = Some(*took_ms);
                findings.push(Finding { bytes, round_trip_ms, ..Finding::proven(link, detail) });
            }
            Some(Err(reason)) => findings.push(fault(
                link,
                reason.clone(),
                format!(
                    "serve it on {}: the program that set the mission has to; a simulator serves that of its last run",
                    keys::map(&mission.order.map)
                ),
            )),
            None => {}
        }
        if let Some(Err(reason)) = &self.context {
            findings.push(fault(
                format!("mission of {}: plan", self.robot),
                format!("cannot be planned: {reason}"),
                "set a mission with another goal or profile".into(),
            ));
        }
        findings
    }
}

fn state_of(link: String, mission: &wire::Mission) -> Finding {
    let is = standing(mission);
    if let Some(end) = &mission.end {
        return Finding::proven(link, format!("{is} ({})", wire::words::say("end", end)));
    }
    let required = mission.order.require.iter();
    let waited_for: Vec<&str> = required.filter(|r| !mission.ready.contains(r)).map(String::as_str).collect();
    if mission.state != MissionState::Preparing || waited_for.is_empty() {
        return Finding::proven(link, is);
    }
    Finding::missing(
        link,
        format!("{is}; not ready: {}", waited_for.join(", ")),
        "wait a few seconds; then look at the logs of the roles that are not ready",
    )
}

async fn fetch_map(session: &Session, id: MapId) -> Result<((usize, f64), StaticMap), String> {
    let started = Instant::now();
    match map_store::fetch(session, id, MAP_TIMEOUT).await {
        Ok(grid) => {
            let took_ms = started.elapsed().as_secs_f64() * 1e3;
            Ok(((convert::occupancy_grid_to_wire(&grid).encode().len(), took_ms), StaticMap::new(grid)))
        }
        Err(AskError::NoReply) => Err(format!("map {id} is not served")),
        Err(error) => Err(error.to_string()),
    }
}

type Listen = fn(&Session, &str) -> Result<Listener, TopicError>;

/// A stream: its name, how it is listened to, and what publishes it.
const STREAMS: [(&str, Listen, &str); 6] = [
    ("scan", Listener::new::<Scan>, "the base (or the simulator) has to publish it; is its scanner on?"),
    ("odom", Listener::new::<Odometry>, "the base (or the simulator) has to publish it"),
    (
        "people",
        Listener::new::<People>,
        "the tracker (or the simulator, if the mission requires no tracker) must publish it, also when nobody is near: \
         read its log",
    ),
    ("belief", Listener::new::<Belief>, "the localizer answers odometry with it: look at its log"),
    ("decision", Listener::new::<Decision>, "the arbiter answers beliefs with it: look at its log"),
    ("cmd", Listener::new::<wire::Twist>, "the driver answers odometry with it: look at its log"),
];

pub(super) async fn streams(
    session: &Session,
    missions: &[Mission],
    time: Duration,
) -> anyhow::Result<Vec<Finding>> {
    let mut listeners = Vec::new();
    for mission in missions {
        for (stream, listen, fix) in STREAMS {
            let listener = listen(session, &keys::robot(&mission.robot, stream)?)?;
            listeners.push((&mission.robot, stream, fix, listener));
        }
    }
    tokio::time::sleep(time).await;
    let mut findings = Vec::new();
    for mission in missions {
        let mut silent = Vec::new();
        for (_, stream, fix, listener) in listeners.iter().filter(|l| *l.0 == mission.robot) {
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
    let Heard { messages, bytes, malformed, .. } = *heard;
    let finding = if messages == 0 {
        Finding::missing(link, format!("silent for {:.1} s", time.as_secs_f64()), fix)
    } else if malformed > 0 {
        Finding::missing(
            link,
            format!("{malformed} of {messages} messages cannot be understood"),
            "its publisher speaks another contract: compare versions, and bytes with schemas/golden",
        )
    } else {
        let rate = heard.rate_hz().map_or(String::new(), |hz| format!(", {hz:.1} Hz"));
        Finding::proven(link, format!("{messages} messages{rate}, {:.1} kB", bytes as f64 / 1e3))
    };
    Finding { bytes: Some(bytes), ..finding }
}
