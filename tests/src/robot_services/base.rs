//! What a base and those around it say, a tick at a time.

use curionav_planning::geometry::Pose2;
use curionav_runtime::topic::{Flow, Inbox, Topic};
use curionav_schemas::{Action, Belief, Clock, CommandReason, Decision, Odometry, People, Scan, Twist};
use curionav_testing::golden;

use super::test_bench::TestBench;
use crate::end_to_end::program::LIMIT;
use crate::faults::corridor_map::START;

/// Seconds between two ticks.
const TICK: f64 = 0.1;

pub(super) struct Base {
    odometry: Topic<Odometry>,
    scans: Topic<Scan>,
    people: Topic<People>,
    beliefs: Topic<Belief>,
    believed: Inbox<Belief>,
    decisions: Topic<Decision>,
    decided: Inbox<Decision>,
    commands: Inbox<Twist>,
}

impl Base {
    pub(super) fn of(bench: &TestBench) -> Self {
        Self {
            odometry: bench.topic("odom", Flow::Sensor),
            scans: bench.topic("scan", Flow::Sensor),
            people: bench.topic("people", Flow::Sensor),
            beliefs: bench.topic("belief", Flow::Sensor),
            believed: bench.inbox("belief"),
            decisions: bench.topic("decision", Flow::Control),
            decided: bench.inbox("decision"),
            commands: bench.inbox("cmd"),
        }
    }

    fn belief(tick: u64) -> Belief {
        let (x, y, stamp) = (START.x, START.y, tick as f64 * TICK);
        Belief { tick, stamp, x, y, heading: 0.0, ..golden::belief() }
    }

    pub(super) fn say_odometry(&self, tick: u64, at: Pose2) {
        let Pose2 { x, y, heading } = at;
        let stamp = tick as f64 * TICK;
        self.odometry.publish(&Odometry { tick, stamp, x, y, heading, v: 0.5, omega: 0.0 }, Clock::Realtime);
    }

    /// There are no people.
    pub(super) fn say_people(&self, tick: u64) {
        let none = || Vec::<f64>::new().into();
        let people = People {
            tick,
            stamp: tick as f64 * TICK,
            id: Vec::<u32>::new().into(),
            x: none(),
            y: none(),
            vx: none(),
            vy: none(),
            ..golden::people()
        };
        self.people.publish(&people, Clock::Realtime);
    }

    /// What the driver commands when it hears all it needs, and a decision to go straight on under `id`, if any.
    pub(super) async fn command(&self, tick: u64, id: Option<(u64, u64)>) -> Twist {
        while self.commands.try_next().is_some() {}
        let belief = Self::belief(tick);
        if let Some((epoch, seq)) = id {
            self.decisions.publish(&straight_on(epoch, seq, &belief), Clock::Realtime);
        }
        self.beliefs.publish(&belief, Clock::Realtime);
        let scan = Scan { tick, stamp: belief.stamp, ..golden::dense_scan(5.0) };
        self.scans.publish(&scan, Clock::Realtime);
        self.say_odometry(tick, Pose2::default());
        // A driver that has waited for a while also says that it heard nothing.
        next(&self.commands, |c| c.tick == tick && c.reason != CommandReason::NoOdometry).await
    }

    /// What the arbiter decides when it hears of a belief.
    pub(super) async fn decision(&self, tick: u64) -> Decision {
        self.beliefs.publish(&Self::belief(tick), Clock::Realtime);
        next(&self.decided, |d| d.tick == tick).await
    }

    /// What the localizer believes when it hears of odometry.
    pub(super) async fn belief_at(&self, tick: u64, odometry: Pose2) -> Belief {
        self.say_odometry(tick, odometry);
        next(&self.believed, |b| b.tick == tick).await
    }

    /// The next belief of this tick or a later one.
    pub(super) async fn belief_since(&self, tick: u64) -> Belief {
        next(&self.believed, |b| b.tick >= tick).await
    }
}

pub(super) async fn next<M: curionav_schemas::Message>(inbox: &Inbox<M>, is: impl Fn(&M) -> bool) -> M {
    let wait = async {
        loop {
            let said = inbox.next().await.unwrap();
            if is(&said) {
                return said;
            }
        }
    };
    tokio::time::timeout(LIMIT, wait).await.expect("it is answered")
}

fn straight_on(epoch: u64, seq: u64, from: &Belief) -> Decision {
    let steps = 13;
    Decision {
        epoch,
        seq,
        tick: from.tick,
        stamp: from.stamp,
        action: Action::Follow,
        x: (1..=steps).map(|k| from.x + 0.15 * f64::from(k)).collect(),
        y: vec![from.y; steps as usize].into(),
        heading: vec![from.heading; steps as usize].into(),
        v: vec![0.5; steps as usize].into(),
        omega: vec![0.0; steps as usize].into(),
        ..golden::decision()
    }
}
