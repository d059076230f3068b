//! What a run leaves behind: measures, the decisions' digest, and the trace for pictures and files.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use curionav_crowdsim::measures::social::{Task, social_measures};
use curionav_crowdsim::measures::{Measures, Row};
use curionav_crowdsim::outcome::Outcome;
use curionav_crowdsim::{Truth, World};
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::GeodesicField;
use curionav_runtime::latency::Latency;
use curionav_schemas::limits::MAX_MAGNITUDE;
use curionav_schemas::{self as wire, Belief, Cycles, Decision, PeopleTrace, RunResult, Trace};
use sha2::{Digest, Sha256};

/// Columns of the trace, one row per tick.
const COLUMNS: usize = 17;
/// Stands for an infinite distance in trace and measures, metres: numbers on the wire are finite.
const FAR_AWAY: f64 = 1e3;

/// Collects one run.
pub(crate) struct Record {
    measured: Vec<Row>,
    digest: Sha256,
    cycles: u64,
    degraded: u64,
    latency: Latency,
    longest: Duration,
    columns: [&'static str; COLUMNS],
    rows: Vec<[f64; COLUMNS]>,
    people: Vec<Vec<(u32, f32, f32)>>,
    started: Instant,
}

impl Record {
    pub(crate) fn new() -> Self {
        Self {
            measured: Vec::new(),
            digest: Sha256::new(),
            cycles: 0,
            degraded: 0,
            latency: Latency::default(),
            longest: Duration::ZERO,
            columns: [""; COLUMNS],
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
    pub(crate) fn tick(&mut self, truth: Truth, belief: &Belief, world: &World) {
        let (people, c) = (world.people(), &belief.covariance);
        let row = [
            ("time_s", truth.time),
            ("true_x", truth.pose.x),
            ("true_y", truth.pose.y),
            ("true_heading", truth.pose.heading),
            ("belief_x", belief.x),
            ("belief_y", belief.y),
            ("belief_heading", belief.heading),
            ("cov_xx", c[0]),
            ("cov_xy", c[1]),
            ("cov_yy", c[4]),
            ("cov_hh", c[8]),
            ("v", truth.twist.v),
            ("omega", truth.twist.omega),
            ("person_distance", truth.person_distance.min(FAR_AWAY)),
            ("person_clearance", truth.person_clearance.min(FAR_AWAY)),
            ("wall_clearance", truth.wall_clearance.min(FAR_AWAY)),
            ("outside_weight", belief.health.outside_weight),
        ];
        self.columns = row.map(|(column, _)| column);
        self.rows.push(row.map(|(_, value)| value));
        let estimate = Pose2::new(belief.x, belief.y, belief.heading);
        self.measured.push(Row { truth, estimate, trace: c[0] + c[4] + c[8] });
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
            measures: measures(&Measures::of(&self.measured)),
            social: social(&self.measured, world, outcome, goal),
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
                columns: self.columns.map(String::from).to_vec(),
                values: self.rows.concat().into(),
                people: people_trace(&self.people),
            },
        }
    }
}

fn measures(m: &Measures) -> wire::Measures {
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
        clearance_min_m: m.clearance_min_m.min(FAR_AWAY),
    }
}

/// Spacing of the shortest way whose length is measured, metres.
const WAY_SPACING: f64 = 0.1;

/// The measures of social navigation by name.
fn social(rows: &[Row], world: &World, outcome: Outcome, goal: Point2) -> BTreeMap<String, f64> {
    let (map, radius) = (world.map(), world.scenario().robot.model.radius());
    let field = GeodesicField::new(map, goal, radius);
    let start = rows.first().map_or(goal, |row| row.truth.pose.position());
    let way = field.descend(start, WAY_SPACING);
    let driven: f64 = way.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let rest = way.last().map_or(0.0, |end| end.distance(goal));
    let task = Task { outcome, shortest_m: driven + rest, to_go: &|p| field.at(p), robot_radius: radius };
    let truth: Vec<&Truth> = rows.iter().map(|row| &row.truth).collect();
    let measures = social_measures(&truth, &task).into_iter();
    let sendable = measures.filter(|(_, value)| value.abs() < MAX_MAGNITUDE);
    sendable.map(|(name, value)| (name.to_owned(), value)).collect()
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
