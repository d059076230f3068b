//! Listens to a deployment and writes what it hears.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::Context;
use curionav_runtime::convert;
use curionav_runtime::map_store;
use curionav_runtime::probe::ask_all;
use curionav_runtime::shutdown::{Shutdown, ShutdownTrigger, shutdown};
use curionav_schemas::{MapId, Message, Mission, MissionState, OccupancyGrid, ServiceStatus, keys};
use tokio::sync::mpsc;
use tokio::task::{JoinHandle, JoinSet};
use zenoh::pubsub::Subscriber;
use zenoh::{Session, Wait};

use super::timeline::Timeline;
use super::visible::Visible;
use super::writer::RecordingWriter;

const STREAMS: [&str; 10] =
    ["scan", "odom", "people", "belief", "particles", "mission", "decision", "cmd", "report", "memory"];
/// Bytes that may wait to be written: beyond it a slow disk costs messages, not the deployment's memory.
const QUEUE_BYTES: usize = 256 << 20;
/// A large map over a slow link, and the status of every service.
const FETCH_TIMEOUT: Duration = Duration::from_secs(20);
const STATUS_TIMEOUT: Duration = Duration::from_secs(1);
/// How long what was asked for may still take when the recording ends: longer than a status takes, shorter than what a
/// process has to end in.
const LAST_ANSWERS: Duration = Duration::from_millis(1100);
/// How often an idle recorder looks whether something waits to be put on disk.
const IDLE: Duration = Duration::from_millis(500);

/// What is recorded.
#[derive(Debug, Clone, Default)]
pub struct Scope {
    /// Only these robots; all of them if there are none.
    pub robots: Vec<String>,
    /// Which simulated worlds.
    pub worlds: Worlds,
}

/// The simulated worlds whose runs are recorded.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Worlds {
    /// All.
    #[default]
    All,
    /// One.
    Only(String),
    /// None: for who may see some robots alone.
    None,
}

impl Scope {
    fn of_robots(&self, stream: &str) -> Result<Vec<String>, keys::KeyError> {
        if self.robots.is_empty() {
            return Ok(vec![keys::every_robot(stream)?]);
        }
        self.robots.iter().map(|robot| keys::robot(robot, stream)).collect()
    }

    fn keys(&self) -> Result<Vec<String>, keys::KeyError> {
        let mut all = Vec::new();
        for stream in STREAMS {
            all.extend(self.of_robots(stream)?);
        }
        if self.robots.is_empty() {
            all.push(keys::every_further_scan());
        }
        for robot in &self.robots {
            all.push(keys::further_scans(robot)?);
        }
        match &self.worlds {
            Worlds::All => all.push(keys::every_world("run")?),
            Worlds::Only(world) => all.push(keys::world(world, "run")?),
            Worlds::None => {}
        }
        Ok(all)
    }
}

/// What has become of the messages.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tally {
    /// In the file, pictures included.
    pub written: u64,
    /// Cycle reports among them.
    pub cycles: u64,
    /// Given up because the disk was too slow.
    pub lost: u64,
    /// Not understood: of another version, or not ours.
    pub refused: u64,
}

struct Arrival {
    key: String,
    encoding: String,
    payload: Vec<u8>,
}

impl Arrival {
    /// Bytes that it takes while it waits, about.
    fn size(&self) -> usize {
        size_of::<Self>() + self.key.len() + self.encoding.len() + self.payload.len()
    }
}

/// The way from Zenoh's threads, which must not wait, to the one that writes.
#[derive(Clone)]
struct Queue {
    sender: mpsc::UnboundedSender<Arrival>,
    waiting: Arc<AtomicUsize>,
    lost: Arc<AtomicU64>,
}

impl Queue {
    /// Whether so many bytes more may wait; if not, what has them is counted as lost, before it is copied.
    fn has_room(&self, bytes: usize) -> bool {
        let room = self.waiting.load(Ordering::Relaxed).saturating_add(bytes) <= QUEUE_BYTES;
        if !room {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
        room
    }

    fn push(&self, key: &str, encoding: String, payload: Vec<u8>) {
        let arrival = Arrival { key: key.to_owned(), encoding, payload };
        if self.waiting.fetch_add(arrival.size(), Ordering::Relaxed) > QUEUE_BYTES {
            self.waiting.fetch_sub(arrival.size(), Ordering::Relaxed);
            self.lost.fetch_add(1, Ordering::Relaxed);
            return;
        }
        // Once the recording has ended, nothing receives any more.
        let _ = self.sender.send(arrival);
    }
}

/// A recording under way.
pub struct Recorder {
    task: JoinHandle<anyhow::Result<Tally>>,
    trigger: ShutdownTrigger,
    subscribers: Vec<Subscriber<()>>,
}

impl Recorder {
    /// Records everything in `scope` from now on, and the missions under way.
    pub fn start(session: &Session, path: &Path, scope: &Scope) -> anyhow::Result<Self> {
        let file = RecordingWriter::create(path)?;
        let (sender, arrivals) = mpsc::unbounded_channel();
        let queue = Queue { sender, waiting: Arc::default(), lost: Arc::default() };
        let mut subscribers = Vec::new();
        for key in scope.keys()? {
            let queue = queue.clone();
            let subscriber = session
                .declare_subscriber(key)
                .callback(move |sample| {
                    if queue.has_room(sample.payload().len()) {
                        let payload = sample.payload().to_bytes().into_owned();
                        queue.push(sample.key_expr().as_str(), sample.encoding().to_string(), payload);
                    }
                })
                .wait();
            subscribers.push(subscriber.map_err(|e| anyhow::anyhow!("cannot listen: {e}"))?);
        }
        let mut writing = Writing {
            session: session.clone(),
            path: path.to_owned(),
            file,
            queue,
            timelines: BTreeMap::new(),
            missions: BTreeMap::new(),
            maps: BTreeSet::new(),
            lacking: BTreeSet::new(),
            runs: BTreeSet::new(),
            errands: JoinSet::new(),
            tally: Tally::default(),
        };
        scope.of_robots("mission")?.into_iter().for_each(|key| writing.ask(key));
        let (trigger, token) = shutdown();
        let task = tokio::spawn(writing.run(arrivals, token));
        Ok(Self { task, trigger, subscribers })
    }

    /// Completes when the recording cannot go on.
    pub async fn failure(&mut self) -> anyhow::Error {
        match (&mut self.task).await {
            Ok(Err(error)) => error,
            Ok(Ok(_)) => anyhow::anyhow!("the recording has ended by itself"),
            Err(error) => anyhow::anyhow!("the recording failed: {error}"),
        }
    }

    /// Writes what has arrived and completes the file.
    pub async fn finish(self) -> anyhow::Result<Tally> {
        drop(self.subscribers);
        self.trigger.fire();
        self.task.await.context("the recording failed")?
    }
}

struct Writing {
    session: Session,
    path: PathBuf,
    file: RecordingWriter,
    queue: Queue,
    /// By robot or world.
    timelines: BTreeMap<String, Timeline>,
    /// The newest message about each robot's mission.
    missions: BTreeMap<String, Vec<u8>>,
    /// Maps that are here or asked for.
    maps: BTreeSet<MapId>,
    /// Maps that were not served when they were asked for.
    lacking: BTreeSet<MapId>,
    /// (robot, run) whose services have been asked for their versions.
    runs: BTreeSet<(String, u64)>,
    /// What is asked for; a map that did not come is given back.
    errands: JoinSet<Option<MapId>>,
    tally: Tally,
}

impl Writing {
    async fn run(
        mut self,
        mut arrivals: mpsc::UnboundedReceiver<Arrival>,
        mut end: Shutdown,
    ) -> anyhow::Result<Tally> {
        let written = format!("cannot write {}", self.path.display());
        loop {
            tokio::select! {
                biased;
                () = end.requested() => break,
                arrival = arrivals.recv() => match arrival {
                    Some(arrival) => self.take(&arrival).context(written.clone())?,
                    None => break,
                },
                Some(done) = self.errands.join_next(), if !self.errands.is_empty() => self.note(done.ok().flatten()),
                () = tokio::time::sleep(IDLE) => {}
            }
            self.file.flush_if_due().context(written.clone())?;
        }
        let errands = async {
            while let Some(done) = self.errands.join_next().await {
                self.note(done.ok().flatten());
            }
        };
        // Without an answer the recording lacks a map or a version and says so when it is read.
        let _ = tokio::time::timeout(LAST_ANSWERS, errands).await;
        while let Ok(arrival) = arrivals.try_recv() {
            self.take(&arrival).context(written.clone())?;
        }
        self.tally.lost = self.queue.lost.load(Ordering::Relaxed);
        self.tally.written = self.file.messages;
        self.file.finish().with_context(|| format!("cannot complete {}", self.path.display()))?;
        Ok(self.tally)
    }

    fn take(&mut self, arrival: &Arrival) -> anyhow::Result<()> {
        let Arrival { key, encoding, payload } = arrival;
        self.queue.waiting.fetch_sub(arrival.size(), Ordering::Relaxed);
        let (owner, stream) = names(key);
        let message = match Visible::decode(stream, payload, encoding) {
            Ok(message) => message,
            Err(error) => {
                self.tally.refused += 1;
                tracing::warn!(key, %error, "not recorded");
                return Ok(());
            }
        };
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos() as u64;
        let mut is_drawn = true;
        match &message {
            Visible::Report(_) => self.tally.cycles += 1,
            Visible::Mission(mission) => {
                self.timelines.entry(owner.to_owned()).or_default().follow(mission, now);
                // The driver says it again every second: that changes no picture.
                let last = self.missions.insert(owner.to_owned(), payload.clone());
                is_drawn = last.is_none_or(|last| last != *payload);
                self.look_into(mission);
            }
            _ => {}
        }
        // What has no stamp and no clock of its own goes with the newest of the others.
        let others = self.timelines.values().map(|timeline| timeline.latest).max().unwrap_or_default();
        let now = if message.stamp().is_none() && others > 0 { others } else { now };
        let time = self.timelines.entry(owner.to_owned()).or_default().time(message.stamp(), now);
        self.file.contract(key, encoding, payload, time)?;
        if is_drawn { message.show(owner, stream, time, &mut self.file) } else { Ok(()) }
    }

    /// Gets the map of a mission and the versions of the services that carry it out.
    fn look_into(&mut self, mission: &Mission) {
        if self.maps.insert(mission.order.map) {
            let session = self.session.clone();
            let queue = self.queue.clone();
            let id = mission.order.map;
            self.errands.spawn(async move {
                let served = map_store::fetch(&session, id, FETCH_TIMEOUT).await;
                let Ok(map) = served else { return Some(id) };
                let map = convert::occupancy_grid_to_wire(&map);
                queue.push(&keys::map(&id), OccupancyGrid::ENCODING.into(), map.encode());
                None
            });
        }
        // By then every service that has a part in it is there.
        let prepared = mission.state != MissionState::Preparing;
        if prepared && self.runs.insert((mission.order.robot.clone(), mission.run)) {
            self.ask(keys::every_status());
        }
    }

    /// Takes note of a map that did not come. It is asked for again when the mission is said again.
    fn note(&mut self, absent: Option<MapId>) {
        let Some(map) = absent else { return };
        self.maps.remove(&map);
        if self.lacking.insert(map) {
            tracing::warn!(%map, "the recording lacks a map, which is not served");
        }
    }

    fn ask(&mut self, key: String) {
        let session = self.session.clone();
        let queue = self.queue.clone();
        self.errands.spawn(async move {
            let (replies, _) = ask_all(&session, &key, None, STATUS_TIMEOUT).await.unwrap_or_default();
            for reply in replies {
                let Ok((payload, encoding)) = reply.answer else { continue };
                match own_key(&reply.key, &payload) {
                    Some(key) => queue.push(&key, encoding, payload),
                    None => tracing::warn!(key = reply.key, "an answer that says not whose it is"),
                }
            }
            None
        });
    }
}

/// The key of an answer to a question that was put to all: it may come under the question's.
fn own_key(key: &str, payload: &[u8]) -> Option<String> {
    if !key.contains('*') {
        return Some(key.to_owned());
    }
    match names(key).1 {
        "mission" => keys::robot(&Mission::decode(payload, None).ok()?.order.robot, "mission").ok(),
        "status" => {
            let status = ServiceStatus::decode(payload, None).ok()?;
            keys::status(&status.role, &status.instance).ok()
        }
        _ => None,
    }
}

/// (robot or world, stream) of a key; for maps and statuses, which have neither, the family. The stream of a further
/// sensor has two chunks, such as `scan/camera`.
pub(super) fn names(key: &str) -> (&str, &str) {
    let rest = key.strip_prefix(keys::ROOT).unwrap_or(key).trim_start_matches('/');
    let mut chunks = rest.splitn(3, '/');
    match (chunks.next(), chunks.next(), chunks.next()) {
        (Some("robot" | "world"), Some(owner), Some(stream)) => (owner, stream),
        (Some(family), ..) => (family, family),
        _ => ("", ""),
    }
}

#[cfg(test)]
mod tests {
    use curionav_runtime::{convert, session};
    use curionav_schemas::Scan;
    use curionav_testing::golden;

    use super::*;
    use crate::{Item, Reader};

    #[tokio::test(flavor = "multi_thread")]
    async fn a_map_is_asked_for_until_it_comes_and_a_mission_said_again_is_drawn_once() {
        let path = std::env::temp_dir().join(format!("curionav-recorder-{}.mcap", std::process::id()));
        let session = session::embedded().await.unwrap();
        let recorder = Recorder::start(&session, &path, &Scope::default()).unwrap();
        // Under the map's name another one, then nothing, then the map itself.
        let map = convert::occupancy_grid(golden::occupancy_grid()).unwrap();
        let map = convert::occupancy_grid_to_wire(&map);
        let mut mission = golden::mission();
        mission.order.map = map.map;
        let other = OccupancyGrid { resolution: 2.0 * map.resolution, ..map.clone() };
        let (asked, own) = (Arc::new(AtomicUsize::new(0)), map.clone());
        let count = Arc::clone(&asked);
        let answers = move |query: zenoh::query::Query| {
            let answer = match count.fetch_add(1, Ordering::Relaxed) {
                0 => &other,
                1 => return,
                _ => &own,
            };
            let key = query.key_expr().clone();
            query.reply(key, answer.encode()).encoding(OccupancyGrid::ENCODING).wait().unwrap();
        };
        let _hosted = session.declare_queryable(keys::map(&map.map)).callback(answers).wait().unwrap();
        let said = keys::robot(&mission.order.robot, "mission").unwrap();
        let deadline = std::time::Instant::now() + Duration::from_secs(30);
        while asked.load(Ordering::Relaxed) < 3 && std::time::Instant::now() < deadline {
            session.put(&said, mission.encode()).encoding(Mission::ENCODING).wait().unwrap();
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        let tally = recorder.finish().await;
        session::close(&session);
        let mut maps = Vec::new();
        let mut reader = Reader::open(&path).unwrap();
        while let Some(item) = reader.next_message().unwrap() {
            if let Item::Map(map) = item {
                maps.push(map);
            }
        }
        let bytes = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert!(maps == [map] && tally.unwrap().refused == 0);
        let topics = mcap::MessageStream::new(&bytes).unwrap().map(|m| m.unwrap().channel.topic.clone());
        let (mut words, mut goals) = (0, 0);
        for topic in topics {
            words += u32::from(topic == said);
            goals += u32::from(topic.ends_with("/goal"));
        }
        // Each time one holder is asked, and then all.
        assert!(words >= 2 && goals == 1, "{words} words, {goals} goals");
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_camera_is_recorded_and_drawn_beside_the_scanner_and_is_not_read_as_it() {
        let path = std::env::temp_dir().join(format!("curionav-cameras-{}.mcap", std::process::id()));
        let session = session::embedded().await.unwrap();
        let scope = Scope { robots: vec!["r1".into()], ..Scope::default() };
        let recorder = Recorder::start(&session, &path, &scope).unwrap();
        let scanned = golden::scan();
        let camera = golden::spotty_scan();
        let of_scanner = keys::robot("r1", "scan").unwrap();
        let of_camera = keys::further_scan("r1", "camera").unwrap();
        let of_another = keys::further_scan("r2", "camera").unwrap();
        for (key, scan) in [(&of_scanner, &scanned), (&of_camera, &camera), (&of_another, &camera)] {
            session.put(key, scan.encode()).encoding(Scan::ENCODING).wait().unwrap();
        }
        let tally = recorder.finish().await.unwrap();
        session::close(&session);
        let mut reader = Reader::open(&path).unwrap();
        let read = [reader.next_message().unwrap(), reader.next_message().unwrap()];
        let bytes = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!((tally.written, tally.refused), (4, 0));
        let [Some(Item::Scan(_, scan)), None] = read else { panic!("{read:?}") };
        assert_eq!(*scan, scanned);
        let of_topic: BTreeMap<String, (String, Vec<u8>)> = mcap::MessageStream::new(&bytes)
            .unwrap()
            .map(|message| message.unwrap())
            .map(|m| {
                (m.channel.topic.clone(), (m.channel.schema.clone().unwrap().name.clone(), m.data.to_vec()))
            })
            .collect();
        assert_eq!(of_topic["/r1/scan/camera"].0, "foxglove.LaserScan");
        assert_eq!(of_topic[&of_camera], (Scan::SCHEMA.to_owned(), camera.encode()));
        assert!(of_topic.len() == 4 && of_topic.contains_key("/r1/scan"), "{:?}", of_topic.keys());
    }

    #[test]
    fn messages_without_content_fill_the_queue_too() {
        let (sender, _arrivals) = mpsc::unbounded_channel();
        let waiting = Arc::new(AtomicUsize::new(QUEUE_BYTES));
        let queue = Queue { sender, waiting, lost: Arc::default() };
        (0..3).for_each(|_| queue.push("k", String::new(), Vec::new()));
        assert_eq!(queue.lost.load(Ordering::Relaxed), 2);
    }

    #[test]
    fn an_answer_is_recorded_as_what_it_is_whatever_was_asked() {
        let all = keys::every_robot("mission").unwrap();
        let (mission, status) = (golden::mission(), golden::service_status());
        assert_eq!(own_key(&all, &mission.encode()), keys::robot(&mission.order.robot, "mission").ok());
        let own = keys::status(&status.role, &status.instance).ok();
        assert_eq!(own_key(&keys::every_status(), &status.encode()), own);
        assert_eq!(own_key(&own.clone().unwrap(), &[]), own);
        assert_eq!(own_key(&all, &[]), None);
    }

    #[test]
    fn every_recorded_key_is_known_by_its_stream() {
        let scope = Scope { robots: vec!["r1".into()], worlds: Worlds::Only("hall".into()) };
        let keys = scope.keys().unwrap();
        assert_eq!(keys.len(), STREAMS.len() + 2);
        for (key, stream) in keys.iter().zip(STREAMS) {
            assert_eq!(names(key), ("r1", stream));
        }
        assert_eq!(names(&keys[STREAMS.len()]), ("r1", "scan/*"));
        assert_eq!(names(&keys[STREAMS.len() + 1]), ("hall", "run"));
        assert!(Scope::default().keys().unwrap().contains(&keys::every_further_scan()));
        assert_eq!(names(&keys::status("cpc", "a").unwrap()), ("status", "status"));
        assert_eq!(names(&keys::map(&MapId([3; 32]))), ("map", "map"));
    }
}
