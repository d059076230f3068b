//! Many robots more than the pool can serve, for a few seconds.

use std::future::Future;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use curionav_pool::context::PlanContext;
use curionav_pool::peers::{Call, Peers, ZenohPeers};
use curionav_runtime::convert;
use curionav_runtime::query::AskError;
use curionav_schemas::{Clock, CycleReport, keys};
use tokio::task::JoinSet;

use super::figures::Figures;
use super::pace::{Kept, measured, play};
use super::site::{Layout, NOMINAL_LIMIT, POOL, Site, is_over_tls};
use crate::faults::corridor_map::change_profile;

/// Cycles of the robot that the burst lasts: 2.5 s at 10 Hz.
const BURST_CYCLES: usize = 25;
/// Robots that ask each replica, all at the same time.
const ROBOTS: usize = 40;
/// Between two questions of such a robot to a replica, at 10 Hz.
const ASKED_EVERY: Duration = Duration::from_millis(50);
/// How long it waits for an answer: like a robot that plans twice a second, so that one question keeps a replica busy
/// for longer than the robot of the site waits.
const PATIENCE: Duration = Duration::from_millis(250);
/// A tree so large that a generator has to end by its budget, however fast the machine is.
const ITERATIONS: u32 = 10_000;
const NODES: u32 = 8000;
/// From the end of the burst until every cycle is as it should be.
const RECOVERY_MAX: Duration = Duration::from_secs(1);
/// Of the burst's cycles this share is degraded at least: else it was none.
const DEGRADED_MIN: f64 = 0.3;

#[test]
fn after_a_burst_of_load_the_robot_is_nominal_within_a_second() {
    if is_over_tls() {
        curionav_testing::skip("no certificate asks in the names of forty robots");
        return;
    }
    play(&Layout::default(), |site| {
        let soon = site.pace.scaled(RECOVERY_MAX);
        let is_met = move |f: &Figures| f.recovered.is_some_and(|time| time <= soon);
        measured("40 robots at once for 2.5 s", site, is_met, burst)
    });
}

fn burst(site: &mut Site) -> Kept<Figures> {
    let recorder = site.recorder();
    recorder.await_nominal("nominal before the burst", NOMINAL_LIMIT)?;
    let mut mission = recorder.mission();
    change_profile(&mut mission, |profile| {
        (profile.generation.tree.iterations, profile.generation.tree.max_nodes) = (ITERATIONS, NODES);
    });
    let context = Arc::new(recorder.context(mission));
    let moment = recorder.record().reports.last().unwrap().1.clone();
    let from = Instant::now();
    let crowd = Crowd::begin(site, &context, &Arc::new(moment));
    let cycles = recorder.await_cycles(BURST_CYCLES);
    let told = crowd.end();
    cycles?;
    let over = Instant::now();
    println!("network | {told}");
    let during = recorder.figures_since(from);
    let enough = (DEGRADED_MIN * BURST_CYCLES as f64) as usize;
    assert!(during.degraded >= enough, "{} cycles were degraded: no burst, {told}", during.degraded);
    recorder.await_nominal("nominal after the burst", NOMINAL_LIMIT)?;
    let record = recorder.record();
    let after = record.decisions.iter().filter(|(at, _)| *at >= over);
    let last = after.filter(|(_, d)| !d.degraded.is_empty()).map(|(at, _)| *at - over).next_back();
    drop(record);
    Ok(Figures { recovered: Some(last.unwrap_or_default()), ..recorder.figures_since(from) })
}

/// Robots that ask every replica what the robot of the site has asked, over and over.
struct Crowd {
    asking: JoinSet<()>,
    counts: Arc<Counts>,
}

#[derive(Default)]
struct Counts {
    answered: AtomicU64,
    refused: AtomicU64,
    silent: AtomicU64,
}

impl Crowd {
    fn begin(site: &Site, context: &Arc<PlanContext>, moment: &Arc<CycleReport>) -> Self {
        let recorder = site.recorder();
        let _inside = recorder.runtime.enter();
        let peers = ZenohPeers::new(&recorder.session, false).unwrap();
        let (mut asking, counts) = (JoinSet::new(), Arc::new(Counts::default()));
        for role in [keys::GENERATOR, "cpc", "cnc"] {
            for (index, robot) in (0..POOL.len()).flat_map(|i| (0..ROBOTS).map(move |r| (i, r))) {
                let asker = Asker {
                    peers: Arc::clone(&peers),
                    context: Arc::clone(context),
                    moment: Arc::clone(moment),
                    instance: format!("{role}-{index}"),
                    robot: format!("other-{robot}"),
                    every: site.pace.scaled(ASKED_EVERY),
                    phase: robot as f64 / ROBOTS as f64,
                    timeout: site.pace.scaled(PATIENCE),
                };
                asking.spawn(asker.ask_on(role, Arc::clone(&counts)));
            }
        }
        Self { asking, counts }
    }

    /// Ends it, and says what came of the questions.
    fn end(mut self) -> String {
        self.asking.abort_all();
        let of = |count: &AtomicU64| count.load(Ordering::Relaxed);
        let Counts { answered, refused, silent } = &*self.counts;
        format!("the crowd: {} answered, {} refused, {} silent", of(answered), of(refused), of(silent))
    }
}

/// One of the other robots, as far as one replica is concerned.
struct Asker {
    peers: Arc<ZenohPeers>,
    context: Arc<PlanContext>,
    moment: Arc<CycleReport>,
    instance: String,
    robot: String,
    every: Duration,
    /// When in this time it asks, as a share: robots that do not know each other ask at different times.
    phase: f64,
    timeout: Duration,
}

impl Asker {
    async fn ask_on(self, role: &'static str, counts: Arc<Counts>) {
        let Self { peers, context, moment, instance, robot, every, phase, timeout } = self;
        let call = || Call { instance: &instance, robot: &robot, timeout, clock: Clock::Realtime };
        let candidates = convert::candidates(moment.candidates.clone()).unwrap();
        let questions = context.evaluate_questions((1, 1), &moment.scene, &candidates);
        let scores = questions.shard(role, 0, 0..candidates.len());
        let growth = context.generate_question((1, 1), &moment.scene, 0, None, &[]);
        let mut beat = tokio::time::interval_at(tokio::time::Instant::now() + every.mul_f64(phase), every);
        beat.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            beat.tick().await;
            match role {
                keys::GENERATOR => counts.count(peers.generate(call(), &growth)).await,
                term => counts.count(peers.evaluate(term, call(), &scores)).await,
            }
        }
    }
}

impl Counts {
    async fn count<T>(&self, answer: impl Future<Output = Result<T, AskError>>) {
        let count = match answer.await {
            Ok(_) => &self.answered,
            Err(AskError::Rejected(_)) => &self.refused,
            Err(_) => &self.silent,
        };
        count.fetch_add(1, Ordering::Relaxed);
    }
}
