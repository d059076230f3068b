//! Someone with the certificate of a viewer who does all that it allows, and some of what it does not, as fast as can
//! be.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::query::fetch;
use curionav_runtime::session;
use curionav_schemas::keys::{self, ROOT};
use curionav_schemas::{MapId, Mission};
use curionav_security::name::Name;
use curionav_security::table::{Space, Verb};
use zenoh::handlers::FifoChannel;
use zenoh::pubsub::Subscriber;
use zenoh::qos::CongestionControl;
use zenoh::query::{ConsolidationMode, QueryTarget};
use zenoh::{Session, Wait};

use super::ceilings::Memory;
use crate::end_to_end::program::{
    Deployment, LIMIT, RunJson, in_real_time, run, soak_time, turn, two_workers,
};

const QUICK: &str = "scenarios/quickstart.toml";
/// Threads that ask for each key.
const ASKERS: usize = 4;
/// Cycles that may be skipped, as a share: the flood has its threads on the robot's machine, which it would not have
/// elsewhere. None may be late.
const SKIPPED: f64 = 0.2;

/// A flood that goes on until it is ended.
pub(crate) struct Flood {
    session: Session,
    end: Arc<AtomicBool>,
    done: Arc<AtomicU64>,
    threads: Vec<std::thread::JoinHandle<()>>,
    _heard: Vec<Subscriber<()>>,
}

impl Flood {
    /// Begins one over this link of a viewer.
    pub(crate) fn begin(session: &Session, robot: &str, map: &MapId) -> Self {
        let (end, done) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let viewer: Name = "viewer".parse().unwrap();
        // What passes between programs of the deployment; what a router's key holds is asked for below.
        let of = |verb: Verb| {
            let rights =
                viewer.rights().filter(move |right| right.verb == verb && right.space == Space::Deployment);
            rights.flat_map(|right| right.keys).map(|key| format!("{ROOT}/{key}"))
        };
        let heard =
            of(Verb::Subscribe).map(|key| session.declare_subscriber(key).callback(drop).wait().unwrap());
        let mut flood =
            Self { session: session.clone(), end, done, threads: Vec::new(), _heard: heard.collect() };
        let asked = of(Verb::Ask).chain([keys::map(map), format!("{ROOT}/status/router/*")]);
        for key in asked.flat_map(|key| std::iter::repeat_n(key, ASKERS)) {
            flood.keep_doing(move |session| {
                let get = session.get(&key).target(QueryTarget::All).consolidation(ConsolidationMode::None);
                let get = get.congestion_control(CongestionControl::Block).timeout(Duration::from_secs(1));
                let replies = get.with(FifoChannel::new(64)).wait().unwrap();
                while replies.recv().is_ok() {}
            });
        }
        for key in of(Verb::Watch) {
            flood.keep_doing(move |session| {
                let tokens = session.liveliness().get(&key).timeout(Duration::from_secs(1)).wait().unwrap();
                while tokens.recv().is_ok() {}
            });
        }
        // What it may not, in the largest pieces that a command and a scan can have.
        for stream in ["cmd", "scan", "decision"] {
            let key = keys::robot(robot, stream).unwrap();
            flood.keep_doing(move |session| {
                let put = session.put(&key, vec![0; 64 << 10]).congestion_control(CongestionControl::Block);
                put.wait().unwrap();
            });
        }
        flood
    }

    fn keep_doing(&mut self, deed: impl Fn(&Session) + Send + 'static) {
        let (session, end, done) = (self.session.clone(), Arc::clone(&self.end), Arc::clone(&self.done));
        self.threads.push(std::thread::spawn(move || {
            while !end.load(Ordering::Relaxed) {
                deed(&session);
                done.fetch_add(1, Ordering::Relaxed);
            }
        }));
    }

    /// Ends it; gives how much was done.
    pub(crate) fn end(self) -> u64 {
        self.end.store(true, Ordering::Relaxed);
        self.threads.into_iter().for_each(|thread| thread.join().unwrap());
        self.done.load(Ordering::Relaxed)
    }
}

#[test]
fn a_viewer_at_full_speed_delays_no_decision_and_takes_no_role_above_its_ceiling() {
    let _turn = turn();
    let lasts = soak_time(10).min(Duration::from_secs(60));
    let place = tempfile::tempdir().unwrap();
    let pki = place.path().join("pki");
    let secure = ["--secure", pki.to_str().unwrap()];
    let deployment = Deployment::start_with(1, &secure);
    let at = [&["--connect", deployment.endpoint()], &secure[..]].concat();
    assert_eq!(run(QUICK, &at).1, 0);
    let runtime = two_workers();
    let config = ServiceConfig {
        connect: vec![deployment.endpoint().to_owned()],
        secure: Some(pki.clone()),
        certificates: vec!["viewer".parse().unwrap()],
        ..ServiceConfig::default()
    };
    let session = runtime.block_on(session::client(&config)).unwrap();
    let mission: Mission =
        runtime.block_on(fetch(&session, &keys::robot("robot", "mission").unwrap(), LIMIT)).unwrap();
    let memory = Memory::watch(deployment.processes());
    in_real_time(|speed| {
        // The flood is on the same machine as the robot.
        let speed = (0.5 * speed).to_string();
        let flood = Flood::begin(&session, "robot", &mission.order.map);
        let begun = Instant::now();
        let is_in_time = |json: &RunJson| {
            let cycles = &json.cycles;
            json.outcome == "reached"
                && cycles.late == 0
                && (cycles.skipped as f64) < SKIPPED * (cycles.count + cycles.skipped) as f64
        };
        let driven = loop {
            let (json, _) = run(QUICK, &[&at[..], &["--speed", &speed]].concat());
            println!(
                "{} after {} cycles, {} skipped, {} late, {} degraded by {:?}",
                json.outcome,
                json.cycles.count,
                json.cycles.skipped,
                json.cycles.late,
                json.cycles.degraded,
                json.cycles.degraded_by
            );
            let holds = is_in_time(&json);
            if !holds || begun.elapsed() > lasts {
                break (json, holds);
            }
        };
        println!("{} deeds of the viewer in {:.0} s", flood.end(), begun.elapsed().as_secs_f64());
        driven
    });
    memory.judge();
    session::close(&session);
    runtime.shutdown_timeout(Duration::from_secs(2));
    assert_eq!(run(QUICK, &at).1, 0, "the robot does not arrive afterwards");
}
