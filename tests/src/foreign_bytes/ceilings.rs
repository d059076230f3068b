//! A client with every right that sends the largest messages there are, as fast as it can: how much memory that takes.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::query::fetch;
use curionav_runtime::session;
use curionav_schemas::{F64Array, MESSAGES, Message, Mission, People, Scan, keys, limits};
use curionav_testing::golden;
use zenoh::bytes::ZBytes;
use zenoh::qos::CongestionControl;
use zenoh::query::QueryTarget;
use zenoh::{Session, Wait};

use super::target::{Target, all};
use crate::end_to_end::program::{Deployment, LIMIT, is_alive, root, run, soak_time, turn, two_workers};
use crate::soak::process::usage;

const QUICK: &str = "scenarios/quickstart.toml";
/// Between two looks at the memory.
const LOOK: Duration = Duration::from_millis(100);

/// The ceiling of each role, MiB, as the document for operators states it.
pub(crate) fn ceilings() -> BTreeMap<String, f64> {
    let text = std::fs::read_to_string(root().join("docs/tuning.md")).unwrap();
    let table = text.split("| role | ceiling |").nth(1).expect("docs/tuning.md has the table of ceilings");
    let row = |line: &str| {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let mib = cells.get(2)?.strip_suffix(" MiB")?.parse().ok()?;
        Some(
            cells[1]
                .split(", ")
                .map(move |role| (role.trim_matches('`').to_owned(), mib))
                .collect::<Vec<_>>(),
        )
    };
    table.lines().skip(1).take_while(|line| line.starts_with('|')).filter_map(row).flatten().collect()
}

/// What a process has in memory, MiB.
fn resident(pid: u32) -> f64 {
    usage(pid).map_or(0.0, |usage| usage.resident)
}

/// The memory of processes, looked at until [`judge`](Self::judge).
pub(crate) struct Memory {
    /// Role and id of each.
    processes: Vec<(String, u32)>,
    before: BTreeMap<String, f64>,
    ceilings: BTreeMap<String, f64>,
    looking: Arc<AtomicBool>,
    thread: JoinHandle<BTreeMap<String, f64>>,
}

impl Memory {
    /// Of processes by name, which begins with the role.
    pub(crate) fn watch<'a>(processes: impl Iterator<Item = (&'a str, u32)>) -> Self {
        let ceilings = ceilings();
        let role = |name: &str| {
            let of_name = ceilings.keys().filter(|role| name.starts_with(role.as_str()));
            of_name.max_by_key(|role| role.len()).unwrap_or_else(|| panic!("{name} has no ceiling")).clone()
        };
        let processes: Vec<_> = processes.map(|(name, pid)| (role(name), pid)).collect();
        let before = processes.iter().map(|(role, pid)| (role.clone(), resident(*pid))).collect();
        let looking = Arc::new(AtomicBool::new(true));
        let (on, of) = (Arc::clone(&looking), processes.clone());
        let thread = std::thread::spawn(move || {
            let mut most: BTreeMap<String, f64> = BTreeMap::new();
            while on.load(Ordering::Relaxed) {
                for (role, pid) in &of {
                    let entry = most.entry(role.clone()).or_default();
                    *entry = entry.max(resident(*pid));
                }
                std::thread::sleep(LOOK);
            }
            most
        });
        Self { processes, before, ceilings, looking, thread }
    }

    /// Fails if a process has died, or one was above the ceiling of its role.
    pub(crate) fn judge(self) {
        let Self { processes, before, ceilings, looking, thread } = self;
        looking.store(false, Ordering::Relaxed);
        let most = thread.join().unwrap();
        println!("role        before   most  ceiling, MiB");
        for (role, most) in &most {
            println!("{role:10} {:7.0} {most:6.0} {:8.0}", before[role], ceilings[role]);
        }
        assert!(processes.iter().all(|(_, pid)| is_alive(*pid)), "a process has died");
        for (role, most) in &most {
            assert!(*most <= ceilings[role], "{role}: {most:.0} MiB");
        }
    }
}

/// One item of CBOR of so many bytes that is no message: it has to be read to find out.
fn well_formed(bytes: usize) -> Vec<u8> {
    let content = bytes.saturating_sub(5);
    let mut item = vec![0x5a];
    item.extend((content as u32).to_be_bytes());
    item.resize(content + 5, 0);
    item
}

/// The largest message of that kind that a reader takes, where one is easily made.
fn largest(message: &str) -> Option<Vec<u8>> {
    match message {
        "scan" => {
            let mut scan: Scan = golden::scan();
            scan.ranges.0 = vec![scan.range_max as f32; limits::MAX_BEAMS];
            scan.angle_increment = std::f64::consts::TAU / limits::MAX_BEAMS as f64;
            Some(scan.encode())
        }
        "people" => {
            let many = || F64Array::from(vec![1.0; limits::MAX_PEOPLE]);
            let id = (0..limits::MAX_PEOPLE as u32).collect();
            Some(People { id, x: many(), y: many(), vx: many(), vy: many(), ..golden::people() }.encode())
        }
        _ => None,
    }
}

/// What is sent to a key in turn: as long as can be, longer than can be, and what is a message.
fn loads(target: &Target) -> Vec<Load> {
    let load = |bytes: Vec<u8>, encoding| Load { payload: bytes.into(), encoding, attachment: None };
    let Some(message) = target.message.and_then(|name| MESSAGES.iter().find(|m| m.name == name)) else {
        // Nothing belongs there.
        return vec![load(vec![0; 1 << 20], "zenoh/bytes")];
    };
    let (most, encoding) = (message.max_bytes, message.encoding);
    let invalid = [well_formed(most), vec![0; most + 1]];
    invalid.into_iter().chain(largest(message.name)).map(|bytes| load(bytes, encoding)).collect()
}

/// One thing that is sent: its bytes, how they are encoded, and what is attached.
pub(crate) struct Load {
    pub(crate) payload: ZBytes,
    pub(crate) encoding: &'static str,
    pub(crate) attachment: Option<Vec<u8>>,
}

/// Sends all of `loads` to one key until the end, without a pause; gives the bytes sent.
pub(crate) fn flood(session: &Session, key: &str, is_asked: bool, loads: &[Load], end: Instant) -> u64 {
    let mut sent = 0;
    while Instant::now() < end {
        for Load { payload, encoding, attachment } in loads {
            sent += payload.len() as u64;
            let (payload, attachment) = (payload.clone(), attachment.clone());
            if is_asked {
                let get = session.get(key).payload(payload).encoding(*encoding).attachment(attachment);
                let get = get.target(QueryTarget::All);
                let get = get.congestion_control(CongestionControl::Block).timeout(Duration::from_secs(1));
                let replies = get.wait().unwrap();
                while replies.recv().is_ok() {}
            } else {
                let put = session.put(key, payload).encoding(*encoding).attachment(attachment);
                put.congestion_control(CongestionControl::Block).wait().unwrap();
            }
        }
    }
    sent
}

#[test]
fn the_largest_messages_at_full_speed_take_no_role_above_its_ceiling() {
    let _turn = turn();
    let lasts = soak_time(10).min(Duration::from_secs(60));
    let deployment = Deployment::start(1);
    let at = ["--connect", deployment.endpoint()];
    assert_eq!(run(QUICK, &at).1, 0);
    let config =
        ServiceConfig { connect: vec![deployment.endpoint().to_owned()], ..ServiceConfig::default() };
    let runtime = two_workers();
    let session = runtime.block_on(session::client(&config)).unwrap();
    let mission: Mission =
        runtime.block_on(fetch(&session, &keys::robot("robot", "mission").unwrap(), LIMIT)).unwrap();

    let memory = Memory::watch(deployment.processes());
    let end = Instant::now() + lasts;
    let sent: u64 = std::thread::scope(|scope| {
        let targets = all(&mission.order.map);
        let flooding: Vec<_> = (targets.into_iter())
            .map(|target| {
                let session = &session;
                scope.spawn(move || flood(session, &target.key, target.asked, &loads(&target), end))
            })
            .collect();
        flooding.into_iter().map(|thread| thread.join().unwrap()).sum()
    });
    println!("{} s, {} MB sent", lasts.as_secs(), sent / 1_000_000);
    memory.judge();
    session::close(&session);
    runtime.shutdown_timeout(Duration::from_secs(2));
    assert_eq!(run(QUICK, &at).1, 0, "the robot does not arrive afterwards");
}
