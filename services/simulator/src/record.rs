//! What a run leaves behind: metrics, the decisions' digest, and the trace for pictures and files.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use curionav_crowdsim::metrics::social::Task;
use curionav_crowdsim::metrics::{Metrics, MetricsParams, Recorder};
use curionav_crowdsim::outcome::Outcome;
use curionav_crowdsim::{SocialMetrics, SocialParams, Track, Truth, World};
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::GeodesicField;
use curionav_runtime::convert;
use curionav_runtime::latency::Latency;
use curionav_schemas::limits::MAX_MAGNITUDE;
use curionav_schemas::{self as wire, Belief, Cycles, Decision, PeopleTrace, RunResult, Trace, Value};
use sha2::{Digest, Sha256};

/// Columns of the trace, one row a tick.
const COLUMNS: [&str; 17] = [
    "time_s",
    "true_x",
    "true_y",
    "true_heading",
    "belief_x",
    "belief_y",
    "belief_heading",
    "cov_xx",
    "cov_xy",
    "cov_yy",
    "cov_hh",
    "v",
    "omega",
    "person_distance",
    "person_clearance",
    "wall_clearance",
    "outside_weight",
];
/// Stands for "nobody there" in the trace, metres: numbers on the wire are finite.
const NOBODY: f64 = 1e3;

/// Collects one run.
pub(crate) struct Record {
    recorder: Recorder,
    track: Track,
    digest: Sha256,
    cycles: u64,
    degraded: u64,
    latency: Latency,
    longest: Duration,
    rows: Vec<[f64; COLUMNS.len()]>,
    people: Vec<Vec<(u32, f32, f32)>>,
    started: Instant,
}

impl Record {
    pub(crate) fn new() -> Self {
        Self {
            recorder: Recorder::new(MetricsParams::default()),
            track: Track::default(),
            digest: Sha256::new(),
            cycles: 0,
            degraded: 0,
            latency: Latency::default(),
            longest: Duration::ZERO,
            rows: Vec::new(),
            people: Vec::new(),
            started: Instant::now(),
        }
    }

    /// One decision: its scene's stamp and what was chosen go into the digest, wall times and epochs do not.
    pub(crate) fn decision(&mut self, decision: &Decision) {
        self.digest.update(decision.stamp.to_le_bytes());
        self.digest.update([decision.action as u8]);
        for array in [&decision.x, &decision.y, &decision.heading, &decision.v, &decision.omega] {
            for number in array.iter() {
                self.digest.update(number.to_le_bytes());
            }
        }
        self.cycles += 1;
        self.degraded += u64::from(!decision.degraded.is_empty());
        let elapsed = Duration::from_micros(decision.elapsed_us);
        self.latency.record(elapsed);
        self.longest = self.longest.max(elapsed);
    }

    /// One tick.
    pub(crate) fn tick(&mut self, truth: &Truth, belief: &Belief, world: &World) {
        let people = world.people();
        self.track.record(truth, people, world.scenario().robot.model.radius());
        let estimate = Pose2::new(belief.x, belief.y, belief.heading);
        let c = &belief.covariance;
        self.recorder.record(truth, estimate, c[0] + c[4] + c[8]);
        self.rows.push([
            truth.time,
            truth.pose.x,
            truth.pose.y,
            truth.pose.heading,
            estimate.x,
            estimate.y,
            estimate.heading,
            c[0],
            c[1],
            c[4],
            c[8],
            truth.twist.v,
            truth.twist.omega,
            truth.person_distance.min(NOBODY),
            truth.person_clearance.min(NOBODY),
            truth.wall_clearance.min(NOBODY),
            belief.health.outside_weight,
        ]);
        self.people.push(
            (0..people.len()).map(|i| (people.id[i], people.x[i] as f32, people.y[i] as f32)).collect(),
        );
    }

    /// The result, at the end of a run to `goal`.
    pub(crate) fn finish(
        self,
        world: &World,
        planner: &str,
        seed: u64,
        outcome: Outcome,
        goal: Point2,
    ) -> RunResult {
        let wall = self.started.elapsed().as_secs_f64();
        let hex = self.digest.finalize().iter().map(|b| format!("{b:02x}")).collect();
        RunResult {
            scenario: world.scenario().name.clone(),
            planner: planner.to_owned(),
            seed,
            outcome: match outcome {
                Outcome::Reached => wire::Outcome::Reached,
                Outcome::Timeout => wire::Outcome::Timeout,
                Outcome::Lost => wire::Outcome::Lost,
            },
            measures: measures(&self.recorder.metrics()),
            social: social(&self.track, world, outcome, goal),
            cycles: Cycles {
                count: self.cycles,
                degraded: self.degraded,
                p50_ms: self.latency.percentile_ms(0.50),
                p99_ms: self.latency.percentile_ms(0.99),
                max_ms: self.longest.as_secs_f64() * 1e3,
            },
            real_time_factor: world.time() / wall.max(1e-9),
            decisions_sha256: hex,
            trace: Trace {
                rows: self.rows.len() as u32,
                columns: COLUMNS.map(String::from).to_vec(),
                values: self.rows.concat().into(),
                people: people_trace(&self.people),
            },
        }
    }
}

fn measures(m: &Metrics) -> wire::Measures {
    wire::Measures {
        rmse_m: m.rmse_m,
        tcm: m.tcm,
        nm: m.nm,
        td: m.td,
        md_m: m.md_m,
        nt: m.nt,
        vel_mps: m.vel_mps,
        length_m: m.length_m,
        time_s: m.time_s,
        collisions: m.collisions,
        clearance_min_m: m.clearance_min_m.min(NOBODY),
    }
}

/// Spacing of the shortest way whose length is measured, metres.
const WAY_SPACING: f64 = 0.1;

/// The measures of social navigation by name; yes is 1, no is 0, and none is left out.
fn social(track: &Track, world: &World, outcome: Outcome, goal: Point2) -> BTreeMap<String, f64> {
    let (map, radius) = (world.map(), world.scenario().robot.model.radius());
    let field = GeodesicField::new(map, goal, radius);
    let start = track.rows().first().map_or(goal, |row| row.pose.position());
    let way = field.descend(start, WAY_SPACING);
    let driven: f64 = way.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let rest = way.last().map_or(0.0, |end| end.distance(goal));
    let task = Task { outcome, shortest_m: driven + rest, to_go: &|p| field.at(p), robot_radius: radius };
    let measures = SocialMetrics::of(track, &task, &SocialParams::default());
    let named = convert::to_value(&measures).ok().and_then(|value| value.into_map().ok()).unwrap_or_default();
    named
        .into_iter()
        .filter_map(|(name, value)| {
            let number = match value {
                Value::Bool(yes) => f64::from(u8::from(yes)),
                Value::Integer(count) => i128::from(count) as f64,
                Value::Float(number) => number,
                _ => return None,
            };
            Some((name.into_text().ok()?, number)).filter(|(_, number)| number.abs() < MAX_MAGNITUDE)
        })
        .collect()
}

/// Rows of (id, x, y) as a rectangle with a presence mask.
fn people_trace(rows: &[Vec<(u32, f32, f32)>]) -> PeopleTrace {
    let ids: BTreeMap<u32, usize> = {
        let mut ids: Vec<u32> = rows.iter().flatten().map(|p| p.0).collect();
        ids.sort_unstable();
        ids.dedup();
        ids.into_iter().enumerate().map(|(i, id)| (id, i)).collect()
    };
    let mut xy = vec![0.0_f32; rows.len() * ids.len() * 2];
    let mut present = vec![0_u8; rows.len() * ids.len()];
    for (row, people) in rows.iter().enumerate() {
        for (id, x, y) in people {
            let at = row * ids.len() + ids[id];
            present[at] = 1;
            xy[2 * at] = *x;
            xy[2 * at + 1] = *y;
        }
    }
    PeopleTrace {
        rows: rows.len() as u32,
        id: ids.into_keys().collect(),
        xy: xy.into(),
        present: present.into(),
    }
}
