//! A client that tells the driver of a real base what no planner would.

use std::time::Duration;

use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::motion::step;
use curionav_planning::random::{Rng, rng, uniform};
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::process::Service;
use curionav_runtime::query::AskError;
use curionav_runtime::robot_limits::RobotLimits;
use curionav_runtime::topic::{Flow, Inbox, Topic};
use curionav_schemas::{
    self as wire, Action, Belief, Clock, CommandReason, Decision, Footprint, MissionCommand, MissionOrder,
    Odometry, Scan,
};
use curionav_testing::golden;

use super::base::next;
use super::test_bench::TestBench;

const SEED: u64 = 15;
/// Decisions that no planner would make.
const HOSTILE: u64 = 160;
const DRIVER: Service = curionav_driver::run;
/// Of the base under test.
const TICK: f64 = 0.1;
const V_MAX: f64 = 0.8;
const A_MAX: f64 = 0.5;
const OMEGA_MAX: f64 = 0.9;
const ALPHA_MAX: f64 = 1.0;

fn own() -> ServiceConfig {
    let limits = RobotLimits {
        v_max: V_MAX,
        a_max: A_MAX,
        omega_max: OMEGA_MAX,
        alpha_max: ALPHA_MAX,
        v_reverse: 0.0,
        radius: 0.3,
        tick_s: TICK,
        latency_s: None,
        belief_age_max: 0.5,
        scan_age_max: 0.5,
        decision_age_max: 1.2,
    };
    ServiceConfig { limits: Some(limits), ..ServiceConfig::default() }
}

fn honest() -> MissionOrder {
    let mut order = TestBench::order(Clock::Realtime, &["driver"]);
    let model = &mut order.robot_model;
    (model.v_max, model.a_max, model.omega_max, model.alpha_max) = (V_MAX, A_MAX, OMEGA_MAX, ALPHA_MAX);
    order
}

/// A base that does what it is told, and says so.
struct ObedientBase {
    odometry: Topic<Odometry>,
    beliefs: Topic<Belief>,
    scans: Topic<Scan>,
    decisions: Topic<Decision>,
    commands: Inbox<wire::Twist>,
    /// Its clock goes as the wall's does: the driver compares both.
    started: tokio::time::Instant,
    tick: u64,
    pose: Pose2,
    twist: Twist,
}

/// What is said at a tick besides odometry.
struct Said {
    belief: bool,
    /// What the laser measures all around, m.
    room: f32,
    /// What becomes of the scan before it is sent.
    spoils: fn(&mut Scan),
    decision: Option<Decision>,
}

impl ObedientBase {
    fn of(bench: &TestBench) -> Self {
        Self {
            odometry: bench.topic("odom", Flow::Sensor),
            beliefs: bench.topic("belief", Flow::Sensor),
            scans: bench.topic("scan", Flow::Sensor),
            decisions: bench.topic("decision", Flow::Control),
            commands: bench.inbox("cmd"),
            started: tokio::time::Instant::now(),
            tick: 0,
            pose: Pose2::default(),
            twist: Twist::default(),
        }
    }

    fn stamp(&self) -> f64 {
        self.tick as f64 * TICK
    }

    fn belief(&self) -> Belief {
        let Pose2 { x, y, heading } = self.pose;
        let Twist { v, omega } = self.twist;
        Belief { tick: self.tick, stamp: self.stamp(), x, y, heading, v, omega, ..golden::belief() }
    }

    /// One tick; the base then carries out the command, which must be one that it can.
    async fn tick(&mut self, said: Said) -> wire::Twist {
        let due = self.started + Duration::from_secs_f64(TICK * (self.tick + 1) as f64);
        tokio::time::sleep_until(due).await;
        // A machine that is late passes over ticks.
        let before = self.tick;
        self.tick = ((self.started.elapsed().as_secs_f64() / TICK) as u64).max(before + 1);
        let passed = TICK * (self.tick - before) as f64;
        while self.commands.try_next().is_some() {}
        let (tick, stamp, belief) = (self.tick, self.stamp(), self.belief());
        if said.belief {
            self.beliefs.publish(&belief, Clock::Realtime);
        }
        if let Some(decision) = said.decision {
            self.decisions.publish(&decision, Clock::Realtime);
        }
        let mut scan = Scan { tick, stamp, ..golden::dense_scan(f64::from(said.room).min(5.0)) };
        (said.spoils)(&mut scan);
        self.scans.publish(&scan, Clock::Realtime);
        let Pose2 { x, y, heading } = self.pose;
        let Twist { v, omega } = self.twist;
        self.odometry.publish(&Odometry { tick, stamp, x, y, heading, v, omega }, Clock::Realtime);
        let command = next(&self.commands, |c| c.tick == tick && c.reason != CommandReason::NoOdometry).await;
        assert!((0.0..=V_MAX).contains(&command.v), "{command:?}");
        assert!((-OMEGA_MAX..=OMEGA_MAX).contains(&command.omega), "{command:?}");
        // One step of a tick that is on its way, and one of this command.
        assert!((command.v - v).abs() <= 2.0 * A_MAX * TICK + 1e-9, "from {v} m/s: {command:?}");
        assert!((command.omega - omega).abs() <= 2.0 * ALPHA_MAX * TICK + 1e-9, "{omega} rad/s: {command:?}");
        self.twist = Twist { v: command.v, omega: command.omega };
        self.pose = step(self.pose, self.twist, passed);
        command
    }

    /// Until it drives as fast as it can.
    async fn drive(&mut self) {
        for _ in 0..24 {
            let ahead = straight_on(self);
            self.tick(free(Some(ahead))).await;
        }
        assert_eq!(self.twist.v, V_MAX);
    }

    /// Ticks until it stands; each command must be for one of `reasons`.
    async fn ticks_to_stand(&mut self, reasons: &[CommandReason], said: impl Fn(&Self) -> Said) -> u32 {
        let mut ticks = 0;
        // Rounding may leave a trace of speed.
        while self.twist.v > 1e-6 {
            let said = said(self);
            let command = self.tick(said).await;
            assert!(reasons.contains(&command.reason), "tick {ticks}: {command:?}");
            ticks += 1;
            assert!(ticks < 200, "it does not stop: {command:?}");
        }
        ticks
    }
}

/// A decision of the next tick, made from its belief, that is valid for ever.
fn decision(base: &ObedientBase, seq: u64, states: usize, dt: f64, state: impl Fn() -> [f64; 5]) -> Decision {
    let states: Vec<[f64; 5]> = (0..states).map(|_| state()).collect();
    let column = |k: usize| states.iter().map(|s| s[k]).collect();
    Decision {
        epoch: 1,
        seq,
        tick: base.tick + 1,
        stamp: (base.tick + 1) as f64 * TICK,
        valid_for_s: 1e12,
        action: Action::Follow,
        dt,
        x: column(0),
        y: column(1),
        heading: column(2),
        v: column(3),
        omega: column(4),
        ..golden::decision()
    }
}

fn hostile(base: &ObedientBase, seq: u64, random: &std::cell::RefCell<Rng>) -> Decision {
    let u = || uniform(&mut random.borrow_mut());
    let any = || {
        let sign = if u() < 0.5 { -1.0 } else { 1.0 };
        match (u() * 8.0) as usize {
            0 => 0.0,
            1 => sign * 1e12,
            2 => sign * 1e-12,
            3 if u() < 0.1 => f64::NAN,
            _ => sign * 10f64.powf(6.0 * u() - 3.0),
        }
    };
    let (states, dt) = (1 + (u() * 30.0) as usize, 10f64.powf(4.0 * u() - 2.0));
    decision(base, seq, states, dt, || [any(), any(), any(), any().abs(), any()])
}

/// Far straight ahead, as fast as can be.
fn straight_on(base: &ObedientBase) -> Decision {
    let Pose2 { x, y, heading } = base.pose;
    decision(base, 1000 + base.tick, 50, 0.3, || {
        [x + 1e3 * heading.cos(), y + 1e3 * heading.sin(), heading, 1e9, 0.0]
    })
}

fn free(decision: Option<Decision>) -> Said {
    Said { belief: true, room: f32::MAX, spoils: |_| {}, decision }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_mission_widens_the_limits_of_a_real_base() {
    let bench = TestBench::configured(&[DRIVER], own()).await;
    type Asks = fn(&mut MissionOrder);
    let hostile: [(Asks, &str); 10] = [
        (|o| o.robot_model.v_max = 1e9, "robot_model.v_max"),
        (|o| o.robot_model.v_max = 0.81, "robot_model.v_max"),
        (|o| o.robot_model.v_max = f64::NAN, "robot_model.v_max"),
        (|o| o.robot_model.a_max = 5.0, "robot_model.a_max"),
        (|o| o.robot_model.omega_max = 2.0, "robot_model.omega_max"),
        (|o| o.robot_model.footprint = Footprint::Disc { radius: 1e-6 }, "robot_model.footprint"),
        (|o| o.robot_model.footprint = Footprint::Disc { radius: 0.29 }, "robot_model.footprint"),
        (|o| o.tick_s = 10.0, "tick_s"),
        (|o| o.time_scale = 0.01, "time_scale"),
        (|o| o.clock = Clock::Lockstep, "clock"),
    ];
    for (asks, field) in hostile {
        let mut order = honest();
        asks(&mut order);
        match bench.try_request(&MissionCommand::Set { order: Box::new(order) }).await {
            Err(AskError::Rejected(reject)) => {
                assert!(reject.field.as_ref().is_some_and(|f| f.contains(field)), "{field}: {reject}");
            }
            other => panic!("{field}: {other:?}"),
        }
    }
    let given = bench.request(MissionCommand::Set { order: Box::new(honest()) }).await;
    assert_eq!(given.revision, 1, "none of the others was taken");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_decision_drives_a_real_base_beyond_its_limits_or_keeps_it_from_stopping() {
    println!("seed {SEED}");
    let bench = TestBench::configured(&[DRIVER], own()).await;
    let mut base = ObedientBase::of(&bench);
    bench.request(MissionCommand::Set { order: Box::new(honest()) }).await;
    bench.runs().await;
    let random = std::cell::RefCell::new(rng(SEED, 0));
    let (mut fastest, mut tracked) = (0.0_f64, 0);
    for seq in 1..=HOSTILE {
        let decision = hostile(&base, seq, &random);
        let command = base.tick(free(Some(decision))).await;
        fastest = fastest.max(command.v);
        tracked += u64::from(command.reason == CommandReason::Tracking);
    }
    println!("{tracked} of {HOSTILE} hostile decisions tracked, at up to {fastest:.2} m/s");
    assert!(
        tracked > HOSTILE / 4 && fastest > 0.3,
        "hardly any decision was followed: the test shows nothing"
    );

    // At 0.5 m/s2 it takes 16 ticks from 0.8 m/s.
    let from_full_speed = 15..=17;
    base.drive().await;
    let wall = |base: &ObedientBase| Said { room: 0.25, ..free(Some(straight_on(base))) };
    let ticks = base.ticks_to_stand(&[CommandReason::TooClose], wall).await;
    assert!(from_full_speed.contains(&ticks), "{ticks} ticks to stop before a wall");

    base.drive().await;
    // The last decision says that it is valid for ever.
    for _ in 0..11 {
        assert_eq!(base.tick(free(None)).await.reason, CommandReason::Tracking);
    }
    // At 1.2 s rounding may go either way.
    base.tick(free(None)).await;
    let ticks = base.ticks_to_stand(&[CommandReason::DecisionExpired], |_| free(None)).await;
    assert!(from_full_speed.contains(&ticks), "{ticks} ticks to stop when the decision is old");

    base.drive().await;
    // No belief for half a second.
    let blind = || Said { belief: false, ..free(None) };
    for _ in 0..4 {
        assert_eq!(base.tick(blind()).await.reason, CommandReason::Tracking);
    }
    base.tick(blind()).await;
    let ticks = base
        .ticks_to_stand(&[CommandReason::BeliefTooOld, CommandReason::DecisionExpired], |_| blind())
        .await;
    assert!(from_full_speed.contains(&ticks), "{ticks} ticks to stop without a belief");

    // A mission may plan to brake gently; a base that has to stop brakes with all it has.
    base.drive().await;
    let mut gentle = honest();
    (gentle.robot_model.a_max, gentle.robot_model.alpha_max) = (0.01, 0.01);
    gentle.require = vec!["arbiter".into()];
    let set = MissionCommand::Set { order: Box::new(gentle) };
    bench.request(set.clone()).await;
    let ticks = base.ticks_to_stand(&[CommandReason::MissionNotRunning], |_| free(None)).await;
    assert!(from_full_speed.contains(&ticks), "{ticks} ticks to stop in a mission that brakes gently");

    // Whatever it measures just as a mission begins is answered.
    for _ in 0..100 {
        bench.request(set.clone()).await;
        assert_eq!(base.tick(free(None)).await.reason, CommandReason::MissionNotRunning);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_real_base_whose_scans_show_nothing_stands_and_drives_on_when_they_show_something() {
    let bench = TestBench::configured(&[DRIVER], own()).await;
    let mut base = ObedientBase::of(&bench);
    bench.request(MissionCommand::Set { order: Box::new(honest()) }).await;
    bench.runs().await;
    let refused = CommandReason::BlindRefused;
    type Spoils = fn(&mut Scan);
    let blind: [(Spoils, CommandReason); 8] = [
        // Refused as they come: the last good one is followed until it is too old.
        (|s| s.laser.x = 1e6, refused),
        (|s| s.angle_increment = 0.0, refused),
        (|s| s.angle_increment = 1.0, refused),
        (|s| s.range_min = Some(6.0), refused),
        // Not by the contract, but by what the robot's file declares.
        (|s| (s.angle_min, s.ranges) = (std::f64::consts::PI, vec![3.0].into()), CommandReason::BlindNarrow),
        (|s| s.range_max = 0.4, CommandReason::BlindShort),
        (|s| s.ranges.0.fill(0.0), CommandReason::BlindSilent),
        (|s| s.ranges.0.fill(f32::NAN), CommandReason::BlindSilent),
    ];
    for (spoils, reason) in blind {
        base.drive().await;
        let said = |base: &ObedientBase| Said { spoils, ..free(Some(straight_on(base))) };
        if reason == refused {
            // For half a second: six ticks, or fewer where the machine passes over some.
            let mut followed = 0;
            loop {
                let next = said(&base);
                match base.tick(next).await.reason {
                    CommandReason::Tracking => followed += 1,
                    other => break assert_eq!(other, refused),
                }
            }
            assert!((2..=6).contains(&followed), "{followed} ticks");
        }
        let ticks = base.ticks_to_stand(&[reason], said).await;
        // At 0.5 m/s2 it takes 16 ticks from 0.8 m/s.
        assert!((14..=17).contains(&ticks), "{reason:?}: {ticks} ticks");
    }
    base.drive().await;
}
